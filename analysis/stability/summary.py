"""The atlas in a few lines."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.pages.numbers import number, percent
from analysis.stability.case import Map, Outcome


def summary(maps: Sequence[Map]) -> list[str]:
    """One line a case, with its counts, and one a boundary that has a theory."""
    lines = []
    for made in maps:
        failed = [cell for cell in made.cells if cell.outcome is not Outcome.STABLE]
        silent = sum(cell.silent for cell in made.cells)
        lines.append(
            f"{made.case.name:<20}{len(failed):>4} of {len(made.cells)} attempts not stable, "
            f"{silent} of them unnoticed by the method"
        )
        lines += [
            f"{'':<20}{edge.row}: measured {number(edge.low, 4)} to {number(edge.high, 4)}, theory {number(edge.theory, 4)} "
            f"({percent(edge.difference)} ± {percent(edge.half_width)})"
            for edge in made.boundaries
            if edge.theory == edge.theory
        ]
    return lines
