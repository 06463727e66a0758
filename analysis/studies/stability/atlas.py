"""The atlas: all cases, tried in parallel."""

import math
from collections.abc import Sequence
from pathlib import Path

from analysis.engines.record import EngineError
from analysis.studies.stability.case import CASES, Boundary, Case, Cell, Cells, Map, Outcome, Row
from analysis.studies.stability.cases import penalty, percussions, stepping
from analysis.support.parallel import Progress, Task, do_all, workers

# The order in which they are shown; the modules that declare them.
ORDER = (
    "time_step", "damping", "stiffness", "mass_ratio_engines", "mass_ratio_solvers", "long_chains",
    "redundant", "contact_order", "initial_overlap", "skin", "tunnelling", "restitution",
    "opening_contacts", "drift", "narrow_door", "small_speeds", "restart", "long_step",
    "missed_contacts", "left_overlap", "unsolved_step", "several_answers",
)  # fmt: skip
DECLARED_IN = (penalty, percussions, stepping)
# How many attempts a quick and a full atlas spend on halving the bracket of a boundary.
QUICK_HALVINGS, HALVINGS = 3, 7


def choose(names: Sequence[str] | None, quick: bool) -> list[Case]:
    """Give the cases of these names, or all, in the atlas' order. Raises ValueError for an unknown
    name."""
    for name in names or ():
        if name not in ORDER:
            raise ValueError(f"case: unknown {name!r}. There are: {', '.join(ORDER)}")
    chosen = [CASES[name] for name in ORDER if not names or name in names]
    return [case.quick() for case in chosen] if quick else chosen


def build(
    cases: Sequence[Case],
    runs: Path,
    quick: bool,
    progress: Progress | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
) -> list[Map]:
    """Try every cell of the cases, then halve the bracket of each boundary that has a theory.

    On so many processes, or a Dask cluster; runs are kept under runs/stability and reused where
    nothing changed. Raises what `workers` does."""
    base = runs.absolute() / "stability"
    rows = [(case, row) for case in cases for row in case.rows.values]
    positions = [(case, column, row) for case, row in rows for column in case.columns.values]
    halvings = QUICK_HALVINGS if quick else HALVINGS
    with workers(processes, scheduler) as pool:
        tasks = [Task(call=attempt, arguments=(*position, base), work=1.0) for position in positions]
        tried = do_all(tasks, pool, "cells of the atlas", progress)
        cells: dict[str, Cells] = {case.name: {} for case in cases}
        for (case, column, row), cell in zip(positions, tried, strict=True):
            cells[case.name][column, row] = cell
        edges = [
            Task(call=boundary, arguments=(case, row, cells[case.name], base, halvings), work=1.0)
            for case, row in rows
        ]
        found = do_all(edges, pool, "boundaries of the atlas", progress)
    finite = [(case, edge) for (case, _), edge in zip(rows, found, strict=True) if edge is not None]
    return [
        Map(
            case=case,
            cells=cells[case.name],
            boundaries=tuple(edge for of, edge in finite if of is case),
        )
        for case in cases
    ]


def attempt(case: Case, column: float, row: Row, base: Path) -> Cell:
    """Make one cell; where its engine is missing, one that says so."""
    words = "".join(c if c.isalnum() or c in ".-+=" else "_" for c in str(row))
    try:
        return case.attempt(column, row, base / case.name / words / f"{column:.9g}")
    except EngineError as error:
        nothing = (math.nan,) * len(case.quantities)
        return Cell(outcome=Outcome.REFUSED, reason=str(error), said="missing", numbers=nothing)


def boundary(case: Case, row: Row, cells: Cells, base: Path, halvings: int) -> Boundary | None:
    """Find where the outcome of a row changes: the first two neighbouring columns between which it
    becomes, or stops being, one of `fails_as`, halved down where there is a theory to compare with.

    None where the outcome does not change."""
    along = case.columns.values
    fails = [cells[column, row].outcome in case.fails_as for column in along]
    changes = (at for at in range(1, len(along)) if fails[at - 1] != fails[at])
    if (at := next(changes, None)) is None:
        return None
    theory = case.theory(row) if case.theory else math.nan
    low, high = map(float, along[at - 1 : at + 1])
    if not math.isfinite(theory) or min(low, high) <= 0:
        halvings = 0
    for _ in range(halvings):
        middle = (low * high) ** 0.5
        if case.columns.whole:
            middle = float(round(middle))
            if middle in (low, high):
                break
        if (attempt(case, middle, row, base).outcome in case.fails_as) == fails[at]:
            high = middle
        else:
            low = middle
    return Boundary(row=row, low=min(low, high), high=max(low, high), theory=theory)
