"""What the atlas is made of: a case, its cells (one attempt each) and its boundaries, measured and
from theory."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

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
class Of:
    """A row of several values: its label, and what the attempt takes of it."""

    label: str
    values: tuple[Any, ...]

    def __str__(self) -> str:
        return self.label


Row = float | str | Of
Attempt = Callable[[Any, Any, Path], "Cell"]
Theory = Callable[[Any], float]


def each(engine: str, symbol: str, *values: float) -> tuple[Of, ...]:
    """Make a row of an engine with each value of one parameter: "lammps, Δt = 0.01"."""
    return tuple(Of(f"{engine}, {symbol} = {value:g}", (engine, value)) for value in values)


@dataclass(frozen=True, slots=True)
class Axis:
    """One parameter of a map."""

    label: str  # with the unit
    values: tuple[Any, ...]  # in order
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


# The cell of each column and row.
Cells = dict[tuple[float, Row], Cell]


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
    values: Mapping[str, float] = field(default_factory=dict)  # what its words have slots for
    # columns and rows of a quick atlas, where they are others
    few_columns: tuple[float, ...] = ()
    few_rows: tuple[Row, ...] = ()

    def quick(self) -> "Case":
        """Give the case with the columns and rows of a quick atlas."""
        columns = replace(self.columns, values=self.few_columns or self.columns.values)
        rows = replace(self.rows, values=self.few_rows or self.rows.values)
        return replace(self, columns=columns, rows=rows)


# Every case that was declared, by its name.
CASES: dict[str, Case] = {}


def case(
    columns: tuple[Any, ...],
    rows: tuple[Any, ...],
    fails_as: tuple[Outcome, ...],
    *,
    complete: bool = False,
    **fields: Any,
) -> Callable[[Attempt], Attempt]:
    """Declare the decorated attempt as a case of its name, kept in CASES.

    columns, rows: a label with its unit, then the values; complete: whether the columns are whole
    numbers; the other fields as in `Case`"""

    def declare(attempt: Attempt) -> Attempt:
        name = attempt.__name__
        across, down = Axis(columns[0], columns[1:], whole=complete), Axis(rows[0], rows[1:])
        made = {"columns": across, "rows": down, "fails_as": fails_as, **fields}
        CASES[name] = Case(name=name, attempt=attempt, **made)
        return attempt

    return declare


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
    """A case with all its cells, by column and row, and its boundaries."""

    case: Case
    cells: Cells
    boundaries: tuple[Boundary, ...]
