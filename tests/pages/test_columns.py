"""docs/columns.md names every column that the code writes."""

import ast
import dataclasses
import re
from pathlib import Path

import pytest

from analysis.pages import report
from analysis.percussions.trajectory import CSV_HEADER
from analysis.work_precision.point import Point

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/columns.md").read_text(encoding="utf-8")
NAMED = set(re.findall(r"`(\w+)`", PAGE))


def words_in(path):
    """Every string of a module that is one word, or a row of them."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    texts = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant)]
    return {word for text in texts if isinstance(text, str) for word in text.split(",")}


def test_columns_of_solve_and_chart():
    assert set(CSV_HEADER.split(",")) <= NAMED
    assert {field.name for field in dataclasses.fields(Point)} <= NAMED


@pytest.mark.parametrize("unit", ["N", "Ns"])
def test_columns_of_a_comparison(unit):
    assert set(report.contact_columns(unit)) <= NAMED


def test_no_column_is_named_that_nobody_writes():
    written = set(CSV_HEADER.split(",")) | {field.name for field in dataclasses.fields(Point)}
    written |= set(report.contact_columns("N")) | set(report.contact_columns("Ns"))
    for path in ("analysis/stability/page.py", "analysis/paper/page.py"):
        written |= words_in(path)
    rows = [line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    named = {name for cell in rows for name in re.findall(r"`(\w+)`", cell)}
    assert named - written == set()
