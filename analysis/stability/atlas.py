"""The atlas: all cases, tried in parallel."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

from analysis.engines.record import EngineError
from analysis.stability.case import Boundary, Case, Cell, Cells, Map, Outcome, Row
from analysis.stability.cases import penalty, percussions, stepping
from analysis.support.parallel import Progress, Task, do_all, workers

CASES = (
    penalty.time_step,
    penalty.damping,
    penalty.stiffness,
    penalty.mass_ratio_engines,
    percussions.mass_ratio_solvers,
    percussions.long_chains,
    percussions.redundant,
    percussions.contact_order,
    penalty.initial_overlap,
    penalty.skin,
    penalty.tunnelling,
    percussions.restitution,
    percussions.opening_contacts,
    penalty.drift,
    penalty.narrow_door,
    penalty.small_speeds,
    penalty.restart,
    stepping.long_step,
    stepping.missed_contacts,
    stepping.left_overlap,
    stepping.unsolved_step,
    stepping.several_answers,
)
# How many attempts a quick and a full atlas spend on halving the bracket of a boundary.
QUICK_HALVINGS, HALVINGS = 3, 7


def choose(names: Sequence[str] | None, quick: bool) -> list[Case]:
    """Make the cases of these names, or all, in the atlas' order. Raises ValueError for an unknown
    name."""
    every = [declared.case(quick) for declared in CASES]
    known = [case.name for case in every]
    for name in names or ():
        if name not in known:
            raise ValueError(f"case: unknown {name!r}; there are: {', '.join(known)}")
    return [case for case in every if not names or case.name in names]


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
    places = [(case, column, row) for case, row in rows for column in case.columns.values]
    halvings = QUICK_HALVINGS if quick else HALVINGS
    with workers(processes, scheduler) as pool:
        tasks = [Task(call=attempt, arguments=(*place, base), work=1.0) for place in places]
        tried = do_all(tasks, pool, "cells of the atlas", progress)
        cells: dict[str, Cells] = {case.name: {} for case in cases}
        for (case, column, row), cell in zip(places, tried, strict=True):
            cells[case.name][column, row] = cell
        edges = [
            Task(call=boundary, arguments=(case, row, cells[case.name], base, halvings), work=1.0)
            for case, row in rows
        ]
        found = iter(do_all(edges, pool, "boundaries of the atlas", progress))
    return [
        Map(
            case=case,
            cells=cells[case.name],
            boundaries=tuple(edge for _ in case.rows.values if (edge := next(found)) is not None),
        )
        for case in cases
    ]


def attempt(case: Case, column: float | str, row: Row, base: Path) -> Cell:
    """Make one cell; where its engine is missing, one that says so."""
    try:
        return case.attempt(column, row, _folder(base, case, column, row))
    except EngineError as error:
        nothing = (math.nan,) * len(case.quantities)
        return Cell(outcome=Outcome.REFUSED, reason=str(error), said="missing", numbers=nothing)


def boundary(case: Case, row: Row, cells: Cells, base: Path, halvings: int) -> Boundary | None:
    """Find where the outcome of a row changes: the first two neighbouring columns between which it
    becomes, or stops being, one of `fails_as`, halved down where there is a theory to compare with.

    None where the columns are words or the outcome does not change."""
    along = [column for column in case.columns.values if not isinstance(column, str)]
    for low, high in itertools.pairwise(along):
        failing = [cells[column, row].outcome in case.fails_as for column in (low, high)]
        if failing[0] == failing[1]:
            continue
        theory = case.theory(row) if case.theory else math.nan
        ends = float(low), float(high)
        if math.isfinite(theory) and min(ends) > 0:
            ends = _narrowed(case, row, ends, failing[1], base, halvings)
        return Boundary(row=row, low=min(ends), high=max(ends), theory=theory)
    return None


def _narrowed(
    case: Case, row: Row, ends: tuple[float, float], failing_high: bool, base: Path, halvings: int
) -> tuple[float, float]:
    """The bracket after attempts at the geometric middle of what is left of it."""
    low, high = ends
    for _ in range(halvings):
        middle = (low * high) ** 0.5
        if case.columns.whole:
            middle = float(round(middle))
            if middle in (low, high):
                break
        if case.fails_at(middle, row, _folder(base, case, middle, row)) == failing_high:
            high = middle
        else:
            low = middle
    return low, high


def _folder(base: Path, case: Case, column: float | str, row: Row) -> Path:
    """Where an attempt keeps its runs."""
    place = column if isinstance(column, str) else f"{column:.9g}"
    words = "".join(c if c.isalnum() or c in ".-+=" else "_" for c in str(row))
    return base / case.name / words / place
