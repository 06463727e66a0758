"""The atlas: all cases, tried in parallel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Future, as_completed
from pathlib import Path
from typing import TypeVar

from analysis.engines.record import EngineError
from analysis.stability.case import (
    HALVINGS,
    QUICK_HALVINGS,
    Boundary,
    Case,
    Cell,
    Map,
    Outcome,
    Value,
    bracket,
    narrow,
)
from analysis.stability.cases.chains import long_chains
from analysis.stability.cases.contact_search import skin
from analysis.stability.cases.energy import drift, opening_contacts, restitution
from analysis.stability.cases.initial_overlap import initial_overlap
from analysis.stability.cases.limits import restart, small_speeds, stiffness
from analysis.stability.cases.masses import mass_ratio_engines, mass_ratio_solvers
from analysis.stability.cases.packings import contact_order, redundant
from analysis.stability.cases.passing import narrow_door, tunnelling
from analysis.stability.cases.time_steps import damping, time_step
from analysis.support.parallel import workers
from analysis.support.progress import Progress

K = TypeVar("K")
V = TypeVar("V")
CASES = (
    time_step,
    damping,
    stiffness,
    mass_ratio_engines,
    mass_ratio_solvers,
    long_chains,
    redundant,
    contact_order,
    initial_overlap,
    skin,
    tunnelling,
    restitution,
    opening_contacts,
    drift,
    narrow_door,
    small_speeds,
    restart,
)


def choose(names: Sequence[str] | None, quick: bool) -> list[Case]:
    """The cases of these names, or all, in the atlas' order. Raises ValueError for an unknown
    name."""
    every = [make(quick) for make in CASES]
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

    On so many processes, or a Dask cluster; runs are kept under runs/stability and taken again
    where nothing changed. Raises what `workers` does."""
    with workers(processes, scheduler) as pool:
        places = [
            (case, column, row)
            for case in cases
            for row in case.rows.values
            for column in case.columns.values
        ]
        tried = _all(
            {pool.submit(attempt, case, column, row, _folder(runs, case)): (case.name, column, row)
             for case, column, row in places},
            "cells of the atlas",
            progress,
        )  # fmt: skip
        cells = {
            case.name: tuple(
                tried[case.name, column, row]
                for row in case.rows.values
                for column in case.columns.values
            )
            for case in cases
        }
        found = _all(
            {
                pool.submit(boundary, case, row, cells[case.name], _folder(runs, case), quick): (
                    case.name,
                    row,
                )
                for case in cases
                for row in case.rows.values
            },
            "boundaries of the atlas",
            progress,
        )
    return [
        Map(
            case=case,
            cells=cells[case.name],
            boundaries=tuple(
                edge for row in case.rows.values if (edge := found[case.name, row]) is not None
            ),
        )
        for case in cases
    ]


def attempt(case: Case, column: Value, row: Value, folder: Path) -> Cell:
    """One cell; where its engine is missing, one that says so."""
    try:
        return case.attempt(column, row, folder)
    except EngineError as error:
        return Cell(
            column=column,
            row=row,
            outcome=Outcome.REFUSED,
            reason=str(error),
            said="missing",
            numbers=(math.nan,) * len(case.quantities),
        )


def boundary(
    case: Case, row: Value, cells: tuple[Cell, ...], folder: Path, quick: bool
) -> Boundary | None:
    """Where the outcome of a row changes: halved down where there is a theory to compare with; None
    where it does not change."""
    around = bracket(case, row, cells)
    if around is None:
        return None
    theory = case.theory(row) if case.theory else math.nan
    if math.isfinite(theory) and min(around) > 0:
        around = narrow(case, row, around, folder, QUICK_HALVINGS if quick else HALVINGS)
    return Boundary(row=row, low=min(around), high=max(around), theory=theory)


def _folder(runs: Path, case: Case) -> Path:
    return runs.absolute() / "stability" / case.name


def _all(pending: dict[Future[V], K], label: str, progress: Progress | None) -> dict[K, V]:
    done: dict[K, V] = {}
    for future in as_completed(pending):
        done[pending[future]] = future.result()
        if progress:
            progress(label, len(done) / len(pending))
    return done
