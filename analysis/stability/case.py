"""What the atlas is made of: a case, its cells (one attempt each) and its boundaries, measured and
from theory."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

# A word, a number, or a dataclass whose `str` is its label.
Row = Any
# A label with its unit, the values, and those of a quick atlas if they are fewer.
Span = tuple[str, tuple[Row, ...]] | tuple[str, tuple[Row, ...], tuple[Row, ...]]
# The cell of each column and row.
Cells = dict[tuple[float | str, Row], "Cell"]
Attempt = Callable[[Any, Any, Path], "Cell"]
Theory = Callable[[Any], float]
# What is measured of a run of an engine.
ENGINE_QUANTITIES = (
    "largest energy / energy at the start",
    "largest overlap / radius",
    "disks in the last frame",
    "change of momentum / Σm|u|",
)


class Outcome(StrEnum):
    """How an attempt ended, judged from what it left behind and not from what it said of itself."""

    STABLE = "stable"
    INACCURATE = "inaccurate"
    ENERGY_GAIN = "energy gain"
    LOST = "lost disks"
    NOT_CONVERGED = "not converged"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class By:
    """A row that is an engine with one parameter: "lammps, Δt = 0.01"."""

    engine: str
    symbol: str
    value: float

    def __str__(self) -> str:
        return f"{self.engine}, {self.symbol} = {self.value:g}"

    @classmethod
    def each(cls, engine: str, symbol: str, *values: float) -> tuple[By, ...]:
        """Make a row of each value."""
        return tuple(cls(engine, symbol, value) for value in values)


@dataclass(frozen=True, slots=True)
class Axis:
    """One parameter of a map."""

    label: str  # with the unit
    values: tuple[Row, ...]  # in order
    whole: bool = False  # whether they are whole numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One attempt.

    outcome, reason: how it ended, and why.
    numbers: measured, in the order of the case's quantities; NaN where there is none.
    reused: whether a run that was unchanged since an earlier atlas was taken as it was."""

    outcome: Outcome
    reason: str
    said: str  # what the method said of itself, an engine's exit status or a solver's status
    numbers: tuple[float, ...]
    guard: str = ""  # what the product's guard makes of the same run; "" where it was not asked
    reused: bool = False

    @property
    def silent(self) -> bool:
        """Whether the method said that all was well where it was not."""
        return self.outcome is not Outcome.STABLE and self.said in ("0", "solved")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A way to fail, over one or two parameters, with its words in cases/words.md.

    attempt: (column, row, folder) → a cell, its runs kept in the folder, which is its own; a
    function of a module, so that another process can call it."""

    name: str
    columns: Axis
    rows: Axis
    attempt: Attempt
    fails_as: tuple[Outcome, ...]  # the outcomes whose boundary is looked for along the columns
    quantities: tuple[str, ...] = ENGINE_QUANTITIES
    theory: Theory | None = None  # row → where along the columns that boundary is
    values: dict[str, float] = field(default_factory=dict)  # what its words have slots for

    def fails_at(self, column: float, row: Row, folder: Path) -> bool:
        """Try a column of a row: whether it ends as one of `fails_as`."""
        return self.attempt(column, row, folder).outcome in self.fails_as


class Declared:
    """A case as its module declares it; another process finds it by its name."""

    def __init__(
        self, attempt: Attempt, made: Callable[[Declared, bool], Case], theory: Theory | None
    ) -> None:
        self.attempt, self.name, self._made, self.theory = attempt, attempt.__name__, made, theory
        functools.update_wrapper(self, attempt)

    def __call__(self, column: Any, row: Row, folder: Path) -> Cell:
        return self.attempt(column, row, folder)

    def __reduce__(self) -> str:
        return self.name

    def case(self, quick: bool) -> Case:
        """Make the case, of a full atlas or a quick one."""
        return self._made(self, quick)


def case(
    columns: Span, rows: Span, fails_as: tuple[Outcome, ...], *, whole: bool = False, **fields: Any
) -> Callable[[Attempt], Declared]:
    """Decorate the attempt of a case, whose name becomes the case's; the fields as in `Case`.

    whole: whether the columns are whole numbers"""

    def made(attempt: Declared, quick: bool) -> Case:
        (column, *some), (row, *others) = columns, rows
        axis = Axis(column, some[-1 if quick else 0], whole=whole)
        down = Axis(row, others[-1 if quick else 0])
        given: dict[str, Any] = {
            "name": attempt.name,
            "columns": axis,
            "rows": down,
            "fails_as": fails_as,
        }
        return Case(attempt=attempt, **given, **fields)

    return lambda attempt: Declared(attempt, made, fields.get("theory"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Boundary:
    """Where along the columns of a row the outcome changes: between low and high, by theory there
    (NaN without one)."""

    row: Row
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
    """A case with all its cells, row by row, and its boundaries."""

    case: Case
    cells: Cells
    boundaries: tuple[Boundary, ...]
