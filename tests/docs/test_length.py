"""The docs stay short: README, each page of results, and all prose together. Long tables are CSV
files beside the pages."""

import re

import pytest

from tests.docs.documented import ROOT

README = ROOT / "README.md"
RESULTS = sorted((ROOT / "docs/results").glob("*.md"))
LARGEST = 750  # words of a page of results, its tables and commands included
LARGEST_README = 600
LARGEST_TEMPLATES = 8_300  # words of the templates of pages, Jinja included
LARGEST_ALL = 13_600  # words of prose


def prose(text):
    """The paragraphs of a page, without code, tables, headings and pictures."""
    blocks = re.split(r"\n\s*\n", re.sub(r"(?sm)```.*?```|^## [^\n]*\n", "\n\n", text))
    return [block for block in blocks if not block.lstrip().startswith(("|", "#", "!", "{", "<"))]


@pytest.mark.parametrize("page", [README, *RESULTS], ids=lambda page: page.stem)
def test_length_of_a_page(page):
    words = len(page.read_text(encoding="utf-8").split())
    assert words <= (LARGEST_README if page == README else LARGEST)


def test_length_of_all():
    for folder, maximum in (("docs", LARGEST_ALL), ("analysis", LARGEST_TEMPLATES)):
        pages = [*ROOT.glob(f"{folder}/**/*.md"), *([README] if folder == "docs" else [])]
        texts = [page.read_text(encoding="utf-8") for page in pages]
        words = sum(len(re.findall(r"\w+", block)) for text in texts for block in prose(text))
        assert 5_000 < words <= maximum, folder


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_a_result_has_its_answer_first_how_sure_and_the_command(page):
    text = page.read_text(encoding="utf-8")
    question, solution = text.split("\n\n")[:2]
    assert question.startswith("# ")
    assert question.endswith("?")
    assert solution.startswith("**Answer**")
    assert re.search("how sure", text, re.IGNORECASE)
    assert re.search(r"(^|`)(nice -n 19 )?(percussions|python)\s", text, re.MULTILINE)
