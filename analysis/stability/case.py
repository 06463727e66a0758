"""What the atlas is made of: a case, its cells (one attempt each) and its boundaries, measured and
from theory."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

Value = float | str
# How many attempts a quick and a full atlas spend on halving the bracket of a boundary.
QUICK_HALVINGS, HALVINGS = 3, 7


class Outcome(StrEnum):
    """How an attempt ended, judged from what it left behind and not from what it said of itself."""

    STABLE = "stable"
    INACCURATE = "inaccurate"
    ENERGY_GAIN = "energy gain"
    LOST = "lost disks"
    NOT_CONVERGED = "not converged"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One parameter of a map: its label with the unit, and its values in order. `whole`: they are
    whole numbers."""

    label: str
    values: tuple[Value, ...]
    whole: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One attempt: where it stands in its map, its outcome and why, what the method said of itself
    (an engine's exit status or a solver's status), the measured numbers in the order of the case's
    quantities (NaN where there is none), and whether a run that was unchanged since an earlier
    atlas was taken as it was."""

    column: Value
    row: Value
    outcome: Outcome
    reason: str
    said: str
    numbers: tuple[float, ...]
    guard: str = ""
    reused: bool = False

    @property
    def silent(self) -> bool:
        """Whether the method said that all was well where it was not."""
        return self.outcome is not Outcome.STABLE and self.said in ("0", "solved")


Attempt = Callable[[Any, Any, Path], Cell]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A way to fail, over one or two parameters.

    `attempt(column, row, folder)` makes one cell and keeps its runs in the folder; it is a function
    of a module, so that another process can call it. `theory(row)` is where along the columns the
    outcome becomes (or stops being) one of `fails_as`; `edge` says in words what that boundary is.
    `words` explain the map."""

    name: str
    title: str
    fails: str
    columns: Axis
    rows: Axis
    quantities: tuple[str, ...]
    attempt: Attempt
    words: tuple[str, ...]
    fails_as: tuple[Outcome, ...]
    theory: Callable[[Any], float] | None = None
    edge: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Boundary:
    """Where along the columns of a row the outcome changes: between low and high, by theory there
    (NaN without one)."""

    row: Value
    low: float
    high: float
    theory: float

    @property
    def measured(self) -> float:
        """The geometric middle of the bracket."""
        return float((self.low * self.high) ** 0.5)

    @property
    def difference(self) -> float:
        """(measured − theory) / theory."""
        return (self.measured - self.theory) / self.theory

    @property
    def half_width(self) -> float:
        """Half the bracket over the theory: no difference below it means anything."""
        return (self.high - self.low) / (2 * self.theory)


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """A case with all its cells (row by row) and boundaries, and the CPU-independent time it took
    (s of the wall)."""

    case: Case
    cells: tuple[Cell, ...]
    boundaries: tuple[Boundary, ...]

    def at(self, column: Value, row: Value) -> Cell:
        """The cell of a column and a row. Raises KeyError where there is none."""
        for cell in self.cells:
            if cell.column == column and cell.row == row:
                return cell
        raise KeyError(f"{self.case.name}: no cell at {column}, {row}")


def bracket(case: Case, row: Value, cells: tuple[Cell, ...]) -> tuple[float, float] | None:
    """The first two neighbouring columns of a row between which the outcome becomes, or stops
    being, one of `fails_as`.

    None where the columns are words or the outcome does not change.
    """
    along = [cell for cell in cells if cell.row == row and not isinstance(cell.column, str)]
    for before, after in itertools.pairwise(along):
        if (before.outcome in case.fails_as) != (after.outcome in case.fails_as):
            return float(before.column), float(after.column)
    return None


def narrow(
    case: Case, row: Value, start: tuple[float, float], folder: Path, halvings: int
) -> tuple[float, float]:
    """The bracket after `halvings` attempts at the geometric middle of what is left of it."""
    low, high = start
    failing_high = _fails(case, high, row, folder)
    for _ in range(halvings):
        middle = (low * high) ** 0.5
        if case.columns.whole:
            middle = float(round(middle))
            if middle in (low, high):
                break
        if _fails(case, middle, row, folder) == failing_high:
            high = middle
        else:
            low = middle
    return low, high


def _fails(case: Case, column: float, row: Value, folder: Path) -> bool:
    return case.attempt(column, row, folder).outcome in case.fails_as
