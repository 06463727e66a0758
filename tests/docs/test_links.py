"""The docs: every link and every file that they name is there, lines are no longer than 100. What
the code reads beside itself goes into the wheel."""

import pkgutil
import re
from fnmatch import fnmatch
from itertools import pairwise
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

import pytest
from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]
IGNORED = (ROOT / ".gitignore").read_text(encoding="utf-8").split()


def own(folder):
    """The files of the project: all but what .gitignore names (git itself may be missing)."""
    for path in sorted(folder.iterdir()):
        names = [f"{'/' if folder == ROOT else ''}{path.name}/", path.name, f"{path.name}/"]
        if path.name == ".git" or any(fnmatch(n, i) for n in names for i in IGNORED):
            continue
        yield from own(path) if path.is_dir() else [path]


FILES = list(own(ROOT))
PAGES = [path for path in FILES if path.suffix == ".md" and ROOT / "analysis" not in path.parents]
TEXTS = [path for path in FILES if path.suffix in (".md", ".py", ".in", ".toml", ".html")]
# what a run writes, what a text names as an example, what a how-to page adds
MADE = re.compile(r"^(paper|report|out|stability|chart|mine)/|[A-Z]{4}|^nscd/core/jacobi")


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    tokens = MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8"))
    titles = [b.content for a, b in pairwise(tokens) if a.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def links(page):
    """The targets of a page's links and pictures."""
    found = []
    for token in MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8")):
        for child in token.children or ():
            found += [child.attrs[name] for name in ("href", "src") if name in child.attrs]
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for link in links(page):
        target, _, anchor = unquote(link).partition("#")
        if re.match(r"https?:|mailto:", target):
            continue
        position = (page.parent / target).resolve() if target else page
        assert position.exists(), f"{link} of {page.name}"
        if anchor and position.suffix == ".md":
            assert anchor in anchors(position), f"{link} of {page.name}"


def test_docs_named_in_texts_exist():
    for path in TEXTS:
        for name in re.findall(r"(?<![\w/])docs/[a-z_/]+\.md", path.read_text(encoding="utf-8")):
            assert (ROOT / name).exists(), f"{path.relative_to(ROOT)}: {name}"


def test_every_doc_is_reached_from_the_index():
    visited, todo = set(), [ROOT / "docs/index.md"]
    while todo:
        page = todo.pop()
        if page in visited:
            continue
        visited.add(page)
        for link in links(page):
            position = (page.parent / link.partition("#")[0]).resolve()
            if position.suffix == ".md" and position.exists():
                todo.append(position)
    docs = {page for page in PAGES if (ROOT / "docs") in page.parents}
    assert docs - visited == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_lines_are_no_longer_than_100(page):
    code = False
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        code ^= line.startswith("```")
        # tables, output of programs, and what cannot be broken
        if code or line.startswith("|") or " " not in line.strip() or "](" in line:
            continue
        assert len(line.rstrip()) <= 100, f"{page.name}, line {number}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_a_page_names_exist(page):
    """A path in back-quotes with a folder in it is a file of the project, from its root or here."""
    named = r"`([\w.]+/[\w./]+\.(?:py|md|toml|data|in|json|txt))`"
    for name in re.findall(named, page.read_text()):
        if not MADE.search(name):
            assert (ROOT / name).exists() or (page.parent / name).exists(), f"{page.name}: {name}"


def test_names_of_the_code_exist():
    """A dotted name of ours in back-quotes can be imported."""
    for text in (*PAGES, *(path for path in TEXTS if path.suffix == ".py")):
        for name in re.findall(r"`((?:nscd|analysis)(?:\.\w+)+)", text.read_text(encoding="utf-8")):
            try:
                pkgutil.resolve_name(name)
            except (ImportError, AttributeError):
                raise AssertionError(f"{text.relative_to(ROOT)}: {name}") from None


BUILD = (ROOT / "CMakeLists.txt").read_text()
PATTERNS = re.findall(r'"([\w/*]+\.\w+)"', BUILD[BUILD.index("foreach(files") :])


def test_everything_shipped_is_in_the_wheel():
    """What is in the packages themselves is there without being named."""
    read = {
        PurePosixPath(name)
        for path in (ROOT / "analysis").rglob("*.py")
        for name in re.findall(r'shipped\("([^"]+)"\)', path.read_text())
    }
    assert PurePosixPath("docs/errata.md") in read
    files = {path for pattern in PATTERNS for path in ROOT.glob(pattern)}
    for name in read:
        assert ROOT / name in files | {path.parent for path in files}, name
