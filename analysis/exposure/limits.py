"""Limits as data: a number with unit, quantity, duration, population, source and how it was
read."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator

from analysis.support.reading import UnreadableError, read_text

# No force, time or length of a crowd is beyond.
Number = Annotated[float, Strict(), Field(gt=0, le=1e9, allow_inf_nan=False)]
Words = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f]*[^\x00-\x1f\s][^\x00-\x1f]*$")]


class LimitError(ValueError):
    """A file of limits that cannot be used; the message names the file, the limit and the key."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """Name what a limit is compared with.

    of: person, wall or crowd
    column: its name in a CSV file
    """

    title: str
    unit: str
    of: Literal["person", "wall", "crowd"]
    column: str


# No two of different units are ever added, compared or drawn on one axis.
QUANTITIES: Mapping[str, Quantity] = {
    "contact_largest": Quantity(
        title="largest contact force of a person",
        unit="N",
        of="person",
        column="contact_largest_N",
    ),
    "contact_sum": Quantity(
        title="sum of a person's contact forces", unit="N", of="person", column="contact_sum_N"
    ),
    "resultant": Quantity(
        title="resultant of a person's contact forces", unit="N", of="person", column="resultant_N"
    ),
    "pressure": Quantity(
        title="sum of a person's contact forces per metre of outline",
        unit="N/m",
        of="person",
        column="pressure_N_per_m",
    ),
    "wall_load": Quantity(title="load on a wall", unit="N", of="wall", column="load_N"),
    "wall_line_load": Quantity(
        title="largest load on any metre of a wall",
        unit="kN/m",
        of="wall",
        column="line_load_kN_per_m",
    ),
    "density": Quantity(
        title="density within 2 m of the door", unit="1/m²", of="crowd", column="density_per_m2"
    ),
    "crowd_pressure": Quantity(
        title="density times the variance of velocity within 2 m of the door",
        unit="1/s²",
        of="crowd",
        column="crowd_pressure_per_s2",
    ),
}


class Limit(BaseModel):
    """One line of a file of limits.

    name: a word of letters, digits and underscores
    number: in `unit`, which must be that of the quantity
    quantity: a key of QUANTITIES
    what: what happens there
    duration_s, duration_most_s: s, how long it must last; at once where left out
    depth_m: m, of the crowd before a barrier
    population: whom it is about
    read: first-hand, excerpt or second-hand; quoted_by names who quotes it in the last case
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
    number: Number
    unit: Words
    quantity: Words
    what: Words
    population: Words
    source: Words
    read: Literal["first-hand", "excerpt", "second-hand"]
    quoted_by: Words | None = None
    duration_s: Number | None = None
    duration_most_s: Number | None = None
    depth_m: Number | None = None

    @model_validator(mode="after")
    def _fits(self) -> Limit:
        if self.quantity not in QUANTITIES:
            raise ValueError(f"quantity {self.quantity!r}; there are: {', '.join(QUANTITIES)}")
        unit = QUANTITIES[self.quantity].unit
        if self.unit != unit:
            raise ValueError(f"unit {self.unit!r}; {self.quantity} is in {unit}")
        if (self.quoted_by is None) == (self.read == "second-hand"):
            raise ValueError("quoted_by is needed where read = 'second-hand', and only there")
        if self.duration_most_s is not None and not self.duration_s:
            raise ValueError("duration_most_s without duration_s")
        if (self.duration_most_s or self.duration_s or 0.0) < (self.duration_s or 0.0):
            raise ValueError("duration_most_s is less than duration_s")
        return self

    @property
    def cited(self) -> str:
        """Give the source with how it was read: `X, quoted by Y`, `X, read in an excerpt`."""
        if self.quoted_by:
            return f"{self.source}, quoted by {self.quoted_by}"
        return self.source + (", read in an excerpt" if self.read == "excerpt" else "")


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    limit: Annotated[tuple[Limit, ...], Field(min_length=1)]


def known_limits(files: Sequence[Path] = ()) -> list[Limit]:
    """List the product's limits and those of further files; of two of one name the later counts.

    Raises LimitError naming the file, the limit and the key."""
    shipped = resources.files(__package__).joinpath("limits.toml").read_text(encoding="utf-8")
    every = {one.name: one for one in _limits(shipped, "limits.toml")}
    for path in files:
        try:
            text = read_text(path)
        except UnreadableError as error:
            raise LimitError(str(error)) from None
        every |= {one.name: one for one in _limits(text, str(path))}
    return list(every.values())


def _limits(text: str, origin: str) -> list[Limit]:
    """The limits of a file, whose names must differ."""
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise LimitError(f"{origin}: {error}") from None
    try:
        found = list(_File.model_validate(content).limit)
    except ValidationError as error:
        raise LimitError(f"{origin}: {_first_problem(error, content)}") from None
    names = [one.name for one in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise LimitError(f"{origin}: two limits are called {twice}")
    return found


def _first_problem(error: ValidationError, content: Mapping[str, object]) -> str:
    """The first thing that is wrong, with the name of the limit where it has one."""
    first = error.errors()[0]
    place = list(first["loc"])
    rows = content.get("limit")
    if len(place) > 1 and isinstance(place[1], int) and isinstance(rows, list):
        row = rows[place[1]]
        name = row.get("name") if isinstance(row, dict) else None
        place[1] = repr(name) if name else f"number {place[1] + 1}"
    said = {"extra_forbidden": "unknown key", "missing": "is missing"}
    words = said.get(first["type"], first["msg"].removeprefix("Value error, "))
    return f"{' '.join(map(str, place))}: {words}" if place else words
