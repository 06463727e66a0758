"""A push trial: heads of people in a row, read, checked and their speeds."""

import io
import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.integrate import cumulative_trapezoid

from analysis.compare.comparison import first_above
from analysis.scene.anthropometry import MEN, WOMEN, Group
from analysis.scene.real.plausible import STOREYS, TAKE_AS_IS, doubt, heights, plausibility_of
from analysis.scene.real.times import in_seconds
from analysis.support.reading import note, read_text
from nscd.arrays import Floats

# Who moves faster than this along the row has been reached (m/s).
ONSET_M_PER_S = 0.15
# Speeds are over this time (s) at least: over less a head that is measured to a millimetre seems to
# move. Two frames of the trials at hand.
SPEED_OVER_S = 0.08


def speed_of(time: Floats, along: Floats) -> Floats:
    """Compute speeds (f,) or (f, n) m/s at evenly spaced times (f,) by central differences over
    0.08 s or more, and at the ends over the first and the last 0.08 s."""
    last = len(time) - 1
    reach = max(1, round(0.5 * SPEED_OVER_S * last / (time[-1] - time[0])))
    frames = np.arange(last + 1)
    before = np.clip(frames - reach, 0, max(last - 2 * reach, 0))
    after = np.minimum(before + 2 * reach, last)
    span = (time[after] - time[before]).reshape(-1, *[1] * (along.ndim - 1))
    return np.asarray((along[after] - along[before]) / span)


def onset(time: Floats, speed: Floats) -> Floats:
    """Find when speeds (f, …) first exceed 0.15 m/s, between frames by interpolation: s (…),
    infinite for never."""
    return first_above(time, speed, ONSET_M_PER_S)


NEEDED = ("id", "time", "x", "y")


class TrialError(ValueError):
    """A trial that cannot be read; the message names the file and what is wrong in it."""


def read_table(file: Path) -> pd.DataFrame:
    """Read a table of heads: id, time (s), x, y (m) as numbers, other columns as they are, by the
    numbers of their lines; each person once at a time.

    Cells stand between commas, semicolons or tabs; lines that begin with # are comments, unless the
    names of the columns follow it. Raises TrialError naming the file, the line and the column."""
    table = _cells(file)
    missing = [name for name in NEEDED if name not in table.columns]
    if missing:
        raise TrialError(
            f"{file}: no column {', '.join(missing)}. Needed are {', '.join(NEEDED)}, there are "
            f"{', '.join(map(str, table.columns))[:200]}"
        )
    for name in NEEDED:
        numbers = pd.to_numeric(table[name], errors="coerce")
        words = table[name].notna() & numbers.isna()
        if words.any() or (name in ("id", "time") and not np.isfinite(numbers).all()):
            row = int(np.argmax(words | ~np.isfinite(numbers)))
            raise TrialError(
                f"{file}, line {table.index[row]}: {name}: "
                f"{str(table[name].iloc[row])[:40]!r} is not a number"
            )
        table[name] = numbers
    twice = table.duplicated(["id", "time"])
    if twice.any():
        first = table[twice].iloc[0]
        raise TrialError(f"{file}: person {first.id:g} is there twice at {first.time:g} s")
    return table


def _cells(file: Path) -> pd.DataFrame:
    """The table of a file, its rows by the numbers of their lines: cells between commas, semicolons
    or tabs, of which its head has most; lines that begin with # are comments, unless it is the
    head."""
    lines = list(enumerate(read_text(file).splitlines(), start=1))
    named = [one for one in lines if set(NEEDED) <= set(_words(one[1]))]
    selected = [one for one in lines if one[1].strip() and not one[1].lstrip().startswith("#")]
    head = min([*named[:1], *selected[:1]], default=None)
    if head is None:
        raise TrialError(f"{file}: there is no row in it")
    rows = [one for one in selected if one[0] > head[0]]
    mark = max(",;\t", key=head[1].count)
    text = "\n".join(line for _, line in [head, *rows])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # cells that it would drop
            table = pd.read_csv(io.StringIO(text), sep=mark, skipinitialspace=True, index_col=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning) as error:
        raise TrialError(f"{file}: no table: {error}".splitlines()[0]) from None
    names = [name.strip('# "') for name in head[1].split(mark)]
    if twice := next((name for name in NEEDED if names.count(name) > 1), None):
        raise TrialError(f"{file}, line {head[0]}: two columns are called {twice}")
    table.columns = [str(name).strip().lstrip("#").strip() for name in table.columns]
    if len(table) != len(rows):
        raise TrialError(f"{file}: a quotation mark that is not closed")
    table.index = pd.Index([number for number, _ in rows])
    return table


def _words(line: str) -> list[str]:
    """The names in a line that may be the head."""
    return re.split(r"[\s,;#\"]+", line)


# What a file may have besides what it must have; other columns are not read.
MASS, GENDER, NAME, ORDER = "Weight_kg", "Gender", "MoCap_ID", "Order_of_Participants_MoCap_ID"
# Heads that are missing for no longer than this are interpolated (s).
LONGEST_GAP_S = 0.25
# What is compared begins with the push, and ends so much later at the latest; the shortest (s).
WINDOW_S, LEAST_S = 2.0, 0.8
# A row is straight: nobody is farther beside the line through the first and the last (m).
BESIDE_M = 0.5
FASTEST_M_PER_S = 20.0
# Frames farther apart than this (s) are coarser than the onsets that are compared.
COARSE_S = 0.05
# Frames nearer to each other than this (s) are left out: nothing that is compared needs them.
FINEST_S = 0.01
# Evenly spaced, a file would have no more than so many times its frames.
MOST_UNEVEN = 20
# The lightest and the heaviest people (kg).
LEAST_KG, MOST_KG = 5.0, 500.0
GROUPS = {"male": MEN, "m": MEN, "female": WOMEN, "f": WOMEN, "w": WOMEN}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """Hold a row of n people from the push on, the one who is pushed first.

    pushed: (f,) m, the way of the first that models are given: its speeds over 0.08 s summed, since
        the noise of single frames would be blows"""

    name: str  # of the file
    people: tuple[str, ...]  # their names
    notes: tuple[str, ...]  # what was missing in the file and is taken from elsewhere
    time: Floats  # (f,) s, from 0.08 s before the push reaches the first
    start_s: float  # s, when it reaches the first, on that clock
    along: Floats  # (f, n) m, heads along the row, from the first head's start
    pushed: Floats
    depth: Floats  # (n,) m, of the chests
    depth_sd: float  # m, of the mean of two
    mass: Floats  # (n,) kg
    wall: float | None  # m, along the row, None without

    @property
    def speed(self) -> Floats:
        """Give the speeds (f, n) m/s of heads."""
        return speed_of(self.time, self.along)

    @property
    def torso_gap(self) -> Floats:
        """Give the room (n − 1,) m between chests at the start, (n,) with a wall; below 0 where
        heads lean into each other."""
        head = self.along[0]
        gap = np.diff(head) - 0.5 * (self.depth[1:] + self.depth[:-1])
        if self.wall is not None:
            gap = np.append(gap, self.wall - head[-1] - 0.5 * self.depth[-1])
        return np.asarray(gap)


def read_trial(
    file: Path, wall_m: float | None = None, time_unit: str = "s", take_as_is: bool = False
) -> Trial:
    """Read a trial: CSV with id, time (s), x, y (m), one row per head and frame, in any order.

    wall_m: where a wall crosses the row, as its x or y in the file: of whichever the row follows
    take_as_is: take speeds, distances, times and heights that people in a row do not have

    The first of the row is the first in the column of their order; without one, who of the two at
    the ends goes towards the others earlier.
    Chests have the mean depth of their sex (ANSUR II). Heads missing for up to 0.25 s are
    interpolated. Raises TrialError (and UnreadableError) naming the file, the person and the time.
    """
    table = read_table(file)
    _check_people(file, table, time_unit, take_as_is)
    # what the file says first of each person; None where it says nothing
    people = table.groupby("id").first().reindex(columns=[MASS, GENDER, NAME]).astype(object)
    people = people.where(people.notna(), None)
    has_order = {ORDER, NAME} <= set(table) and table[ORDER].notna().any()
    ids = _ordered(file, people, str(table[ORDER].dropna().iloc[0]) if has_order else "")
    notes: list[str] = []
    time, positions = _head_positions(file, table, ids, notes)
    order = _by_place(time, positions)
    if not has_order:
        ids, positions = [ids[position] for position in order], positions[:, order]
    elif ids[order[0]] == ids[-1]:
        notes.append(
            f"the row begins with person {ids[0]:g} by its order, and person {ids[-1]:g} at its "
            "other end is the first who moves towards the others"
        )
    along, axis, origin = _along(file, positions, ids)
    speed = speed_of(time, along[:, 0])
    start = float(onset(time, speed))
    if not np.isfinite(start):
        raise TrialError(
            f"{file}: person {ids[0]}, the first of the row, never goes forward faster than "
            f"{ONSET_M_PER_S:g} m/s: nobody is pushed"
        )
    begin = max(int(np.searchsorted(time, start - SPEED_OVER_S, side="right")) - 1, 0)
    _check_start(file, table, ids, time[0], axis)
    chosen = slice(begin, int(np.searchsorted(time, start + WINDOW_S, side="right")) + 1)
    if time[-1] - start < LEAST_S:
        raise TrialError(
            f"{file}: only {time[-1] - start:.2g} s follow the push. At least {LEAST_S:g} s are "
            "needed"
        )
    moving = [ids[n] for n, v in enumerate(speed_of(time, along)[begin]) if v > ONSET_M_PER_S]
    if not begin and moving:
        named = ", ".join(f"person {one:g}" for one in moving)
        notes.append(f"moving in the first frame already: {named}. The push began before the file")
    people = people.loc[ids]
    groups = _groups(people, notes)
    mass = _masses(file, people, groups, notes)
    shift = along[begin, 0]
    return Trial(
        name=file.name,
        people=tuple(str(name or f"{one:g}").strip() for one, name in people[NAME].items()),
        notes=tuple(notes),
        time=time[chosen] - time[begin],
        start_s=start - time[begin],
        along=along[chosen] - shift,
        pushed=cumulative_trapezoid(speed[chosen], time[chosen], initial=0),
        depth=np.array([np.mean([group.depth[0] for group in each]) for each in groups]),
        depth_sd=0.5 * float(np.hypot(MEN.depth[1], WOMEN.depth[1])),
        mass=mass,
        wall=None if wall_m is None else _wall(file, wall_m, axis, origin, along[begin]) - shift,
    )


def _check_people(file: Path, table: pd.DataFrame, time_unit: str, take_as_is: bool) -> None:
    """Put times in s, and say how the heads look. Raises TrialError for what cannot be people."""
    try:
        table["time"] = in_seconds(table["time"], time_unit == "ms", file)
    except ValueError as error:
        raise TrialError(f"{file}: {error}") from None
    rows = table[[*NEEDED]].assign(frame=table["time"].rank(method="dense"))
    high = pd.to_numeric(table["z"], errors="coerce") if "z" in table else np.nan
    message = heights(rows.assign(z=high))
    why = f"{message}. Give {TAKE_AS_IS}" if message.startswith(STOREYS) else doubt(rows, timed=True)
    if why and not take_as_is:
        raise TrialError(f"{file}: {why}")
    if message:
        note(file, f"z is not used: {message}")
    note(file, plausibility_of(rows).line())


def _check_start(
    file: Path, table: pd.DataFrame, ids: list[float], begins: float, axis: Floats
) -> None:
    """Raise TrialError where the first was pushed before all of the others are seen."""
    first = table[(table.id == ids[0]) & np.isfinite(table.x) & np.isfinite(table.y)]
    first = first.sort_values("time")
    time, positions = first.time.to_numpy(), first[["x", "y"]].to_numpy()
    earlier = int((time < begins).sum())
    if earlier < 2:
        return
    time, along = time[: earlier + 1], positions[: earlier + 1] @ axis
    pushed = float(onset(time, speed_of(time, along)))
    if np.isfinite(pushed):
        present = table[np.isfinite(table.x)].groupby("id").time.min()
        raise TrialError(
            f"{file}: person {present.idxmax():g} is first seen at {begins:g} s, when person "
            f"{ids[0]:g}, the first of the row, is already pushed (at {pushed:.3g} s)"
        )


def _ordered(file: Path, people: pd.DataFrame, order_of_names: str) -> list[float]:
    """The ids from the first of the row to the last; rising where no order is given."""
    ids: list[float] = people.index.tolist()
    if len(ids) < 2:
        raise TrialError(f"{file}: {len(ids)} person. A row has at least two")
    if not order_of_names:
        return ids
    names = {str(name).strip(): one for one, name in people[NAME].items()}
    words = [word.strip() for word in order_of_names.split(",")]
    order = [names[word] for word in words if word in names]
    if sorted(order) != ids:
        raise TrialError(
            f"{file}: {ORDER}: it has {', '.join(words)[:100]}, and {NAME} has "
            f"{', '.join(names)[:100]}"
        )
    return order


def _by_place(time: Floats, positions: Floats) -> list[int]:
    """The order along the row of heads (f, n, 2) m, beginning where the push does."""
    spread = positions[0] - positions[0].mean(0)
    axis = np.linalg.svd(spread)[2][0]
    order = np.argsort(spread @ axis)
    ends = ((order[0], axis), (order[-1], -axis))
    early, late = (float(onset(time, speed_of(time, positions[:, end] @ way))) for end, way in ends)
    return [int(position) for position in (order if early <= late else order[::-1])]


def _head_positions(
    file: Path, table: pd.DataFrame, ids: list[float], notes: list[str]
) -> tuple[Floats, Floats]:
    """Evenly spaced times (f,) s at which everybody is there, and heads (f, n, 2) m; what is
    missing for a short time is interpolated."""
    table = table[np.isfinite(table.x) & np.isfinite(table.y)]
    observed = [table[table.id == one].sort_values("time") for one in ids]
    for one, rows in zip(ids, observed, strict=True):
        if len(rows) < 2:
            raise TrialError(f"{file}: person {one:g} is seen in {len(rows)} frames")
    first = max(rows.time.iloc[0] for rows in observed)
    last = min(rows.time.iloc[-1] for rows in observed)
    frames = np.unique(table.time[(table.time >= first) & (table.time <= last)])
    if len(frames) < 3:
        raise TrialError(f"{file}: {len(frames)} frames have everybody. At least 3 are needed")
    step = float(np.median(np.concatenate([np.diff(rows.time) for rows in observed])))
    if last - first > MOST_UNEVEN * step * len(frames):
        raise TrialError(
            f"{file}: {len(frames)} frames over {last - first:.3g} s, most of them {step:.2g} s "
            "apart: evenly spaced times are needed"
        )
    if step > COARSE_S * (1 + 1e-9):
        notes.append(f"frames are {step:.2g} s apart: onsets are not known better than that")
    between = max(step, FINEST_S)
    time = first + between * np.arange(int((last - first) / between + 1e-6) + 1)
    for one, rows in zip(ids, observed, strict=True):
        there = rows.time.to_numpy()
        intervals = np.diff(there)
        if intervals.max() > LONGEST_GAP_S:
            index = int(intervals.argmax())
            raise TrialError(
                f"{file}: person {one:g} is missing from {there[index]:g} to "
                f"{there[index + 1]:g} s. Up to {LONGEST_GAP_S:g} s are interpolated"
            )
        if missing := int(np.maximum(np.rint(intervals / step) - 1, 0).sum()):
            notes.append(f"person {one:g}: {missing} of {len(time)} frames were interpolated")
    positions = np.stack(
        [
            np.stack([np.interp(time, rows.time, rows[name]) for name in ("x", "y")], axis=1)
            for rows in observed
        ],
        axis=1,
    )
    fastest = np.hypot(*np.gradient(positions, time, axis=0).T).max()
    if fastest > FASTEST_M_PER_S:
        raise TrialError(
            f"{file}: a head moves at {fastest:.3g} m/s. Is x and y in m, and time in s?"
        )
    return time, positions


def _along(file: Path, positions: Floats, ids: list[float]) -> tuple[Floats, Floats, Floats]:
    """Heads (f, n) m along the row of the first frame, its axis (2,) and its origin (2,) m."""
    origin, ends = positions[0, 0], positions[0, -1] - positions[0, 0]
    axis = ends / (np.hypot(*ends) or 1.0)
    along = (positions - origin) @ axis
    beside = np.abs((positions[0] - origin) @ np.array([-axis[1], axis[0]]))
    if (np.diff(along[0]) <= 0).any() or beside.max() > BESIDE_M:
        raise TrialError(
            f"{file}: the heads of {', '.join(f'{one:g}' for one in ids)} are not one behind the "
            "other in the first frame. One straight row is needed, in the order of "
            f"{ORDER} or of ids"
        )
    return along, axis, origin


def _wall(file: Path, wall_m: float, axis: Floats, origin: Floats, positions: Floats) -> float:
    """Where the row meets a wall at a coordinate of the file (m along the row)."""
    way = int(np.argmax(np.abs(axis)))
    position = float((wall_m - origin[way]) / axis[way])
    if not positions[-1] < position < np.inf:
        last = origin[way] + positions[-1] * axis[way]
        side = "above" if axis[way] > 0 else "below"
        raise TrialError(
            f"{file}: a wall at {'xy'[way]} = {wall_m:g} m is not in front of the last head, which "
            f"is at {last:.3g} m. It needs {'xy'[way]} {side} that"
        )
    return position


def _groups(people: pd.DataFrame, notes: list[str]) -> list[tuple[Group, ...]]:
    sentences = [str(word or "").strip().lower() for word in people[GENDER]]
    if not all(word in GROUPS for word in sentences):
        notes.append(f"{GENDER} is not known of everybody: the mean of men and women is taken")
    return [(GROUPS[word],) if word in GROUPS else (MEN, WOMEN) for word in sentences]


def _masses(
    file: Path, people: pd.DataFrame, groups: list[tuple[Group, ...]], notes: list[str]
) -> Floats:
    found = []
    for (one, stated), group in zip(people[MASS].items(), groups, strict=True):
        value = pd.to_numeric(stated, errors="coerce")
        if stated is None:
            value = np.mean([each.mass[0] for each in group])
            notes.append(f"person {one:g}: no {MASS}: {value:.3g} kg, the mean of ANSUR II")
        elif not LEAST_KG <= value <= MOST_KG:
            raise TrialError(
                f"{file}: person {one:g}: {MASS}: {str(stated)[:40]} where {LEAST_KG:g} to {MOST_KG:g} "
                "kg are needed"
            )
        found.append(float(value))
    return np.array(found)
