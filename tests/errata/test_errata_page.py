"""Every row of docs/errata.md has a test. Errata of the references, read in the stored text of the
paper."""

import ast
import re
from pathlib import Path

import pytest

from analysis.studies.paper.page import errata

HERE = Path(__file__).resolve().parent


def test_every_row_has_a_test_and_every_test_a_row():
    """Tests: each other's docstring begins with the place of its row."""
    rows = [one.where.split(":")[0] for part in ("Section 2", "Section 3") for one in errata(part)]
    tests = [
        ast.get_docstring(node).split(":")[0]
        for path in sorted(HERE.glob("test_*.py"))
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]
    assert len(rows) == len(set(rows))
    assert {*rows, "Tests"} == set(tests)


PAPER = Path(__file__).resolve().parents[3] / "shared" / "paper" / "jebrane2019.txt"


@pytest.fixture(scope="module")
def text():
    if not PAPER.exists():
        pytest.skip("the paper's text is not here (it is not shipped)")
    return PAPER.read_text()


@pytest.fixture(scope="module")
def references(text):
    """Number → entry, spaces made single."""
    entries = re.findall(r"^- \[(\d+)\] (.*(?:\n(?!- \[).*)*)", text, re.MULTILINE)
    found = {int(number): " ".join(entry.split()) for number, entry in entries}
    assert sorted(found) == list(range(1, 23))
    return found


def data(entry):
    """Issue, year, pages and doi of an entry."""
    issue, year, pages = re.search(r"\((\d+)\) \((\d{4})\) (\d+[–-]\s*\d+)", entry).groups()
    doi = re.search(r"10\.\d{4}/ ?\S+", entry)
    return issue, pages.replace("–", "-"), doi and doi.group().rstrip("."), year


def test_reference_9_carries_the_data_of_8(references):
    """References: [9] has [8]'s issue, pages and doi; Simulating dynamical features of escape panic is Nature
    407, 487–490."""
    assert "escape panic, Nature" in references[9]
    assert data(references[9])[:3] == data(references[8])[:3]
    assert data(references[9])[3] == "2000"
    assert data(references[8])[3] == "2011"
    assert "407" not in references[9]
    assert "487" not in references[9]


def test_references_given_twice(references):
    """References: [3] and [15] are one article (its authors misspelt in [3]), [7] and [18] another."""
    assert references[7] == references[18]
    for entry in (references[3], references[15]):
        assert "crowd motion model of gradient flow type, Mathematical Models and Method" in entry
        assert re.search(r"20 \(10\) \(2010\) 1787– ?1821", entry)
    assert "Santanbrogio" in references[3]
    assert "Santambrogio" in references[15]


def test_continuum_rival_is_reference_12(text, references):
    """3.2.2, Fig. 8, (M1): they cite [10], a microscopic model; crowd turbulence is [12]; M1's source
    is not listed."""
    topic = "crowd turbulence"
    assert topic in references[12]
    assert "Golas" in references[12]
    assert "On the modeling of pedestrian motion" in references[10]
    assert topic not in references[10]
    section = text[text.index("3.2.2.") : text.index("3.2.3.")]
    assert topic in section.split("\n")[0]
    assert "[10]" in section
    assert "[12]" not in section
    assert "proposed in [10] and it is also restrained by the authors in [12]" in text
    # Helbing, Johansson, Al-Abideen, Physical Review E 75 (2007) 046109
    assert not [entry for entry in references.values() if "Helbing" in entry and "2007" in entry]
