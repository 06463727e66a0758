"""Published limits of what people, walls and crowds bear, and those of users."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator

from analysis.pages.numbers import significant
from analysis.support.reading import UnreadableError, read_text

# No force, time or length of a crowd is beyond.
Number = Annotated[float, Strict(), Field(gt=0, le=1e9, allow_inf_nan=False)]
Words = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f]*[^\x00-\x1f\s][^\x00-\x1f]*$")]


class LimitError(ValueError):
    """A file of limits or sensors that cannot be used; the message names file, entry and key."""


class Quantity(NamedTuple):
    """Name a quantity that has one number for each person or wall, for the crowd, or for a run."""

    title: str
    unit: str
    of: Literal["person", "wall", "crowd", "run"] = "run"
    column: str = ""  # its name in a CSV file


SIGNS = "* Read in an excerpt. † Quoted by others."
# What a limit is compared with; no two of different units are ever added, compared or drawn on one
# axis.
QUANTITIES: Mapping[str, Quantity] = {
    "contact_largest": Quantity(
        "largest contact force of a person", "N", "person", "contact_largest_N"
    ),
    "contact_sum": Quantity("sum of a person's contact forces", "N", "person", "contact_sum_N"),
    "resultant": Quantity("resultant of a person's contact forces", "N", "person", "resultant_N"),
    "pressure": Quantity(
        "sum of a person's contact forces per metre of outline", "N/m", "person", "pressure_N_per_m"
    ),
    "wall_load": Quantity("load on a wall", "N", "wall", "load_N"),
    "wall_line_load": Quantity(
        "largest load on any metre of walls", "kN/m", "wall", "line_load_kN_per_m"
    ),
    "density": Quantity("density within 2 m of the door", "1/m²", "crowd", "density_per_m2"),
    "crowd_pressure": Quantity(
        "density times the variance of velocity within 2 m of the door",
        "1/s²",
        "crowd",
        "crowd_pressure_per_s2",
    ),
}


class Limit(BaseModel):
    """One line of a file of limits.

    name: a word of letters, digits and underscores
    duration_s, duration_most_s: s, how long it must last; at once where left out
    read: first-hand, excerpt or second-hand; quoted_by names who quotes it in the last case"""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
    number: Number  # in `unit`, which must be that of the quantity
    unit: Words
    quantity: Words  # a key of QUANTITIES
    what: Words  # what happens there
    population: Words  # whom it is about
    source: Words
    read: Literal["first-hand", "excerpt", "second-hand"]
    quoted_by: Words | None = None
    duration_s: Number | None = None
    duration_most_s: Number | None = None

    @model_validator(mode="after")
    def _fits(self) -> Limit:
        if self.quantity not in QUANTITIES:
            raise ValueError(f"quantity {self.quantity!r}. There are: {', '.join(QUANTITIES)}")
        unit = QUANTITIES[self.quantity].unit
        if self.unit != unit:
            raise ValueError(f"unit {self.unit!r}, but {self.quantity} is in {unit}")
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

    @property
    def signed(self) -> str:
        """Give the source with the sign of how it was read, which SIGNS explains."""
        return self.source + {"excerpt": "*", "second-hand": "†"}.get(self.read, "")

    @property
    def lasting(self) -> str:
        """Say for how long it must last: ` in 15 s`, ` in 4–6 minutes`, or nothing."""
        if self.duration_s is None:
            return ""
        if self.duration_most_s is None:
            return f" in {significant(self.duration_s)} s"
        ends = (significant(time / 60) for time in (self.duration_s, self.duration_most_s))
        return f" in {'–'.join(ends)} minutes"


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    limit: Annotated[tuple[Limit, ...], Field(min_length=1)]


def known_limits(files: Sequence[Path] = ()) -> list[Limit]:
    """List the product's limits and those of further files; of two of one name, which have one
    quantity, the later counts.

    Raises LimitError naming the file, the limit and the key."""
    every: dict[str, Limit] = {}
    for path in (Path(__file__).with_name("limits.toml"), *files):
        for one in read_entries(path, _File, "limit").limit:
            same = every.setdefault(one.name, one).quantity
            if one.quantity != same:
                raise LimitError(f"{path}: limit {one.name!r} replaces one of the quantity {same}")
            every[one.name] = one
    return list(every.values())


AnyFile = TypeVar("AnyFile", bound=BaseModel)


def read_entries(path: Path, kind: type[AnyFile], key: str) -> AnyFile:
    """Read a TOML file of entries, a list of tables whose names must differ.

    Raises LimitError naming the file, the entry and the key."""
    content: dict[str, object] = {}
    try:
        content = tomllib.loads(read_text(path))
        found = kind.model_validate(content)
    except UnreadableError as error:
        raise LimitError(str(error)) from None
    except ValidationError as error:
        raise LimitError(f"{path}: {_first_problem(error, content, key)}") from None
    except (ValueError, RecursionError) as error:
        raise LimitError(f"{path}: {error}") from None
    names = [one.name for one in getattr(found, key)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise LimitError(f"{path}: two {key.removesuffix('s')}s are called {twice}")
    return found


def _first_problem(error: ValidationError, content: Mapping[str, object], key: str) -> str:
    """The first thing that is wrong, with the name of the entry where it has one."""
    first = error.errors()[0]
    location = list(first["loc"])
    rows = content.get(key)
    if len(location) > 1 and isinstance(location[1], int) and isinstance(rows, list):
        row = rows[location[1]]
        name = row.get("name") if isinstance(row, dict) else None
        location[1] = repr(name) if name else f"number {location[1] + 1}"
    stated = {"extra_forbidden": "unknown key", "missing": "is missing"}
    words = stated.get(first["type"], first["msg"].removeprefix("Value error, "))
    return f"{' '.join(map(str, location))}: {words}" if location else words


@lru_cache(maxsize=8)
def limits_of_people(files: tuple[Path, ...] = ()) -> tuple[Limit, ...]:
    """List the product's limits of a person and those of further files, the smallest first, those
    of a force before others. Raises LimitError."""
    of_people = [one for one in known_limits(files) if QUANTITIES[one.quantity].of == "person"]
    return tuple(sorted(of_people, key=lambda one: (one.quantity, one.number)))


# Limits of a contact force that no body sets: of a flow; and a second one for the same bar.
NOT_OF_BODIES = ("flow_may_be_unstable", "flow_unstable", "chest_bar_pushing_back")


def limits_of_bodies(files: tuple[Path, ...] = ()) -> list[Limit]:
    """List the limits of a contact force that a body bears, smallest first."""
    return [
        one
        for one in limits_of_people(files)
        if one.quantity == "contact_largest" and one.name not in NOT_OF_BODIES
    ]


def limits_of_walls(files: tuple[Path, ...] = ()) -> list[Limit]:
    """Give the least and the largest limit of the load on a metre of wall."""
    walls = [one for one in known_limits(files) if one.quantity == "wall_line_load"]
    return [end(walls, key=lambda one: one.number) for end in (min, max)]


def above_key(limit: Limit) -> str:
    """Name the number of people above a limit among the values of a run."""
    return f"above_{limit.name}"
