"""docs/columns.md names every column that the code writes, and no other."""

import ast
import dataclasses
import re

from analysis.exchange.fclib import BARE
from analysis.film import summary as film
from analysis.film.frame import HEADLINES, SHOCK
from analysis.percussions.table import COLUMNS
from analysis.work_precision import whole_runs
from analysis.work_precision.point import Point
from benchmarks.problems import score
from tests.docs.documented import ROOT, columns


def words_in(path):
    """Every word of a string of a module."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    return {word for text in texts if isinstance(text, str) for word in re.split(r"\W+", text)}


def columns_of_film():
    ends = ("", "low", "high")
    forces = {film.column(key, "N", end) for key in HEADLINES for end in ends}
    shocks = {film.column(key, "N·s", end) for key in SHOCK for end in ends}
    return forces | shocks | {f"{key}_jump" for key in HEADLINES} | {*film.HEAD}


def test_columns_of_solve_and_chart():
    assert set(COLUMNS) | set(whole_runs.COLUMNS) | columns_of_film() <= columns()
    assert set(score.COLUMNS) <= columns()
    assert {*BARE, *(field.name for field in dataclasses.fields(Point))} <= columns()


def test_no_column_is_named_that_nobody_writes():
    written = (
        set(COLUMNS) | set(whole_runs.COLUMNS) | {field.name for field in dataclasses.fields(Point)}
    )
    written |= columns_of_film()
    pages = ["stability/page.py", "paper/page.py", "compare/comparison.py", "dumps/contacts.py"]
    pages += ["support/frames.py", "exposure/exposure.py", "motion/pairwise.py"]
    pages += ["push/page.py", "push/hindcast.py"]
    pages += ["exchange/fclib.py", "../benchmarks/problems/score.py"]
    written = written.union(*(words_in(f"analysis/{path}") for path in pages))
    for unit in ("N", "Ns"):
        written |= {f"{model}_{axis}_{unit}" for model in ("penalty", "rigid") for axis in "xy"}
    assert columns() - written == set()
