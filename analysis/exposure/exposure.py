"""What people bear over a run, in force and in time, against published limits."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window, joined
from analysis.engines.record import RunRecord
from analysis.pages.numbers import NONE, significant, with_unit
from analysis.scene.scene import Scene, read_scene
from analysis.support.files import write_rows
from analysis.support.reading import UnreadableError, read_text
from nscd.arrays import Flags, Floats, Indices

# No force, time or length of a crowd is beyond.
Number = Annotated[float, Strict(), Field(gt=0, le=1e9, allow_inf_nan=False)]
Words = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f]*[^\x00-\x1f\s][^\x00-\x1f]*$")]


class LimitError(ValueError):
    """A file of limits that cannot be used; the message names the file, the limit and the key."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """Name what a limit is compared with."""

    title: str
    unit: str
    of: Literal["person", "wall", "crowd"]
    column: str  # its name in a CSV file


# No two of different units are ever added, compared or drawn on one axis.
QUANTITIES: Mapping[str, Quantity] = {
    "contact_largest": Quantity(
        title="largest contact force of a person", unit="N", of="person", column="contact_largest_N"
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
    depth_m: Number | None = None  # m, of the crowd before a barrier

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
    shipped = resources.files(__package__).joinpath("limits.toml").read_text(encoding="utf-8")
    every = {one.name: one for one in _read_limits(shipped, "limits.toml")}
    for path in files:
        try:
            text = read_text(path)
        except UnreadableError as error:
            raise LimitError(str(error)) from None
        for one in _read_limits(text, str(path)):
            same = every.setdefault(one.name, one).quantity
            if one.quantity != same:
                raise LimitError(f"{path}: limit {one.name!r} replaces one of the quantity {same}")
            every[one.name] = one
    return list(every.values())


def _read_limits(text: str, origin: str) -> list[Limit]:
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


# Near the door (m); the stretch of a wall (m) on which a line load is taken.
NEAR_M, STRETCH_M = 2.0, 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loads:
    """Hold what a window says, by the quantities of limits.

    person: (n,) of each quantity of a person, in its unit; those who have passed the door included
    """

    time: float  # s, the end of the window
    duration: float  # s, of the window
    person: dict[str, Floats]
    wall: dict[str, Floats]  # (w,) of each quantity of a wall
    crowd: dict[str, float]  # one number of each quantity of the crowd; none without a door

    def above(self, limit: Limit) -> Flags:
        """Tell which people or walls, or whether the crowd, are above the number of a limit."""
        return np.asarray(self.values(limit) > limit.number)

    def values(self, limit: Limit) -> Floats:
        """Give the quantity of a limit, of each person or wall, or of a crowd that has it."""
        if QUANTITIES[limit.quantity].of == "crowd":
            return np.array([value for key, value in self.crowd.items() if key == limit.quantity])
        return (self.person | self.wall)[limit.quantity]


def loads_of(scene: Scene, window: Window) -> Loads:
    """Compute what people, walls and the crowd bear in a window. Forces are the magnitudes of the
    mean force vectors of contacts, |∫f dt|/T."""
    now, force = window.now, window.force
    total = window.at_people(force)
    return Loads(
        time=window.end,
        duration=window.duration,
        person={
            "contact_largest": _largest(window, force),
            "contact_sum": total,
            "resultant": _resultant(window),
            "pressure": total / (2 * np.pi * now.radius),
        },
        wall=_walls(scene, window),
        crowd=_crowd(scene, window),
    )


def _largest(window: Window, force: Floats) -> Floats:
    """The largest contact force of each person, (n,) N."""
    most, (first, second) = np.zeros(len(window.now)), _ranks(window)
    pairs = ~window.is_wall
    np.maximum.at(most, first, force)
    np.maximum.at(most, second[pairs], force[pairs])
    return most


def _resultant(window: Window) -> Floats:
    """The size of the vector sum of the contact forces on each person, (n,) N."""
    sums, (first, second) = np.zeros((len(window.now), 2)), _ranks(window)
    pairs = ~window.is_wall
    np.add.at(sums, first, -window.impulse)
    np.add.at(sums, second[pairs], window.impulse[pairs])
    return np.asarray(np.hypot(*sums.T) / window.duration)


def _ranks(window: Window) -> tuple[Indices, Indices]:
    """Places of the two bodies of each contact in the crowd; of a wall it means nothing."""
    ids = window.now.ids
    return np.searchsorted(ids, window.keys[:, 0]), np.searchsorted(ids, window.keys[:, 1])


def _walls(scene: Scene, window: Window) -> dict[str, Floats]:
    """Load (N) of each wall and largest line load (kN/m): of all stretches of 1 m, or the whole of
    a shorter wall, the one that bears most."""
    load, line = np.zeros(len(scene.walls)), np.zeros(len(scene.walls))
    first, force = np.searchsorted(window.now.ids, window.keys[:, 0]), window.force
    for number, wall in enumerate(scene.walls):
        on = window.is_wall & (window.keys[:, 1] == number + 1)
        if not on.any():
            continue
        load[number] = force[on].sum()
        start = np.array(wall.start_m)
        way = np.array(wall.end_m) - start
        length = float(np.hypot(*way))
        along = np.clip((window.now.position[first[on]] - start) @ way / length, 0.0, length)
        line[number] = 1e-3 * _most_within(along, force[on], min(STRETCH_M, length))
    return {"wall_load": load, "wall_line_load": line}


def _most_within(place: Floats, force: Floats, stretch: float) -> float:
    """The largest sum of forces at places (m) within a stretch (m), over its length."""
    order = np.argsort(place)
    sums = np.concatenate([[0.0], np.cumsum(force[order])])
    ends = np.searchsorted(place[order], place[order] + stretch, side="right")
    return float((sums[ends] - sums[:-1]).max()) / stretch


def _crowd(scene: Scene, window: Window) -> dict[str, float]:
    """Density (1/m²) of the half disk of 2 m before the door (the one with most people before it),
    and density times the variance of the velocities of those in it (1/s²)."""
    if scene.drive is None:
        return {}
    now, drive = window.now, scene.drive
    before = []
    for exit_ in drive.doors:
        close = np.hypot(*(now.position - np.mean(exit_.door, axis=0)).T) <= NEAR_M
        before.append(close & ~exit_.beyond(now.position))
    near = max(before, key=np.count_nonzero)
    density = float(near.sum()) / (0.5 * np.pi * NEAR_M**2)
    spread = float(now.velocity[near].var(0).sum()) if near.any() else 0.0
    return {"density": density, "crowd_pressure": density * spread}


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
    """Name the series of how many people are above a limit."""
    return f"above_{limit.name}"


def exposure_values(scene: Scene, window: Window, files: tuple[Path, ...] = ()) -> dict[str, float]:
    """Count who is above each limit (files: of users' limits), and find the largest load on any
    metre of any wall (kN/m)."""
    loads = loads_of(scene, window)
    counts = {above_key(one): float(loads.above(one).sum()) for one in limits_of_people(files)}
    return counts | {"wall_line_load": float(loads.wall["wall_line_load"].max(initial=0.0))}


# The shortest window (s): below it a quantile of forces depends on the step.
SHORTEST_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exposure:
    """Hold the loads of a run, window by window."""

    scene: Scene  # with the name that the run has
    ids: Indices  # (n,) of its people
    windows: Sequence[Loads]  # in order of time, each follows the one before

    @property
    def window_s(self) -> float:
        """Give the length of a window (s)."""
        return self.windows[0].duration

    def time_above(self, limit: Limit) -> tuple[Floats, Floats]:
        """Sum for each person or wall, or the crowd, the time above a limit (s), and find its
        longest stretch without a break (s)."""
        total = longest = running = np.zeros(len(self.windows[0].above(limit)))
        for loads in self.windows:
            above = loads.above(limit)
            total = total + np.where(above, loads.duration, 0.0)
            running = np.where(above, running + loads.duration, 0.0)
            longest = np.maximum(longest, running)
        return total, longest

    def largest(self, limit: Limit) -> float:
        """Find the largest value of the limit's quantity, in its unit; NaN where there is none."""
        values = np.concatenate([loads.values(limit) for loads in self.windows])
        return float(values.max()) if values.size else math.nan


def read_exposure(folder: Path, window_s: float = SHORTEST_S) -> Exposure:
    """Read the loads of a finished run over windows of at least so many seconds, from the impulses
    of every step.

    Raises EngineError and DumpError for a folder that does not hold one finished run with impulses,
    or one that is shorter than a window."""
    record = RunRecord.read(folder)
    scene = read_scene(folder / "scene.toml").model_copy(update={"name": record.scene})
    record.check_finished(folder, scene)
    run = RunWindows(folder, record.time_step_s)
    frames = list(run.between_frames())
    together = max(1, math.ceil(window_s / frames[0].duration - 1e-9))
    parts = [frames[n - together : n] for n in range(together, len(run.times), together)]
    if not parts:
        raise DumpError(f"{folder}: the run of {run.times[-1]:g} s is shorter than {window_s:g} s")
    windows = [loads_of(scene, joined(part)) for part in parts]
    return Exposure(scene=scene, ids=frames[0].now.ids, windows=windows)


HEAD = ["limit", "value", "quantity", "ever above", "longest time above", "largest", "source"]


def write_exposure(exposure: Exposure, limits: Sequence[Limit], folder: Path) -> list[Path]:
    """Write exposure_people.csv, exposure_walls.csv, exposure_crowd.csv (a row per window and
    person, wall or crowd) and exposure_limits.csv (a row per limit and person, wall or crowd);
    return them.

    Columns: docs/columns.md."""
    written = []
    for of, rows in (
        ("people", _rows(exposure, "person", "id", exposure.ids.tolist())),
        ("walls", _rows(exposure, "wall", "wall", [wall.name for wall in exposure.scene.walls])),
        ("crowd", _crowd_rows(exposure)),
        ("limits", _limits(exposure, limits)),
    ):
        head, *below = rows
        write_rows(folder / f"exposure_{of}.csv", [*map(str, head)], below)
        written.append(folder / f"exposure_{of}.csv")
    return written


def _columns(of: str) -> dict[str, str]:
    return {key: one.column for key, one in QUANTITIES.items() if one.of == of}


def _rows(
    exposure: Exposure, of: Literal["person", "wall"], head: str, names: Sequence[object]
) -> Iterable[list[object]]:
    columns = _columns(of)
    yield ["time_s", "window_s", head, *columns.values()]
    for loads in exposure.windows:
        values = loads.person if of == "person" else loads.wall
        for row in zip(names, *(values[key] for key in columns), strict=True):
            yield [loads.time, loads.duration, *row]


def _crowd_rows(exposure: Exposure) -> Iterable[list[object]]:
    columns = _columns("crowd")
    yield ["time_s", "window_s", *columns.values()]
    for loads in exposure.windows:
        if loads.crowd:
            yield [loads.time, loads.duration, *(loads.crowd[key] for key in columns)]


def _limits(exposure: Exposure, limits: Sequence[Limit]) -> Iterable[list[object]]:
    yield [
        "limit", "number", "unit", "quantity", "of", "id", "time_above_s", "longest_s", "lasting_s",
        "population", "source", "read",
    ]  # fmt: skip
    for limit in limits:
        of = QUANTITIES[limit.quantity].of
        said = [limit.duration_s or "", limit.population, limit.cited, limit.read]
        names = {
            "person": exposure.ids.tolist(),
            "wall": [wall.name for wall in exposure.scene.walls],
            "crowd": [""],
        }
        for name, total, longest in zip(names[of], *exposure.time_above(limit), strict=False):
            head = [limit.name, limit.number, limit.unit, limit.quantity, of, name]
            yield [*head, total, longest, *said]


def exposure_rows(exposure: Exposure, limits: Sequence[Limit]) -> list[list[str]]:
    """Give a row per limit, HEAD above it: who is above it at any time, the longest stretch of
    anybody and, where the limit has a duration, that beside it."""
    rows = []
    for limit in limits:
        quantity = QUANTITIES[limit.quantity]
        total, longest = exposure.time_above(limit)
        above, most = int((total > 0).sum()), float(longest.max(initial=0.0))
        names = {"person": "people", "wall": "walls", "crowd": ""}
        who = f"{above} of {len(total)} {names[quantity.of]}".strip()
        if quantity.of == "crowd":
            who = ("the crowd" if above else "no") if len(total) else NONE
        lasts = f" of {significant(limit.duration_s)} s" if limit.duration_s else " s"
        rows.append(
            [
                limit.name,
                with_unit(significant(limit.number, 4), limit.unit),
                quantity.title,
                who,
                significant(most, 2) + lasts,
                with_unit(significant(exposure.largest(limit), 2), limit.unit),
                limit.cited,
            ]
        )
    return rows
