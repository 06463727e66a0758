"""The loads of a run: what people, walls and the crowd bear, window by window, and for how long they
are above limits; arches before a door; and who would stop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window, joined
from analysis.engines.record import read_finished
from analysis.pages.numbers import NONE, significant, with_unit
from analysis.scene.drive import Stop
from analysis.scene.rigid_bodies import people_of
from analysis.scene.scene import Scene
from analysis.studies.exposure.limits import (
    QUANTITIES,
    SIGNS,
    Limit,
    LimitError,
    Quantity,
    above_key,
    limits_of_people,
)
from analysis.studies.exposure.walls import OnWalls, beside_doors, loads_on, outlined, outlines_of
from analysis.support.columns import Columns
from analysis.support.files import write_columns, write_rows
from nscd import Snapshot
from nscd.arrays import Floats, Indices, Mask

# The force (N) below which two bodies hardly touch.
LEAST_N = 10.0
# An arch is made of people within half the door's width and so many mean diameters of its middle.
DIAMETERS = 2.0
# Ends of walls this near (m) to an end of the door flank it.
AT_POST_M = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Arch:
    """Name who holds an arch, and when.

    start, end: s, of the first and the last window between two frames in which it was seen"""

    people: frozenset[int]  # ids
    start: float
    end: float

    @property
    def lifetime(self) -> float:
        """Give how long it was seen (s)."""
        return self.end - self.start


def arches_of(scene: Scene, frames: Sequence[Window]) -> tuple[Arch, ...]:
    """Follow the arches before the door of a scene, window by window: one lives as long as the same
    people form it in windows that follow each other. None where the door has no walls beside it."""
    found: list[Arch] = []
    for window in frames:
        people = arch_in(scene, window)
        if not people:
            continue
        last = found[-1] if found else None
        if last and last.people == people and window.start - last.end < 0.5 * window.duration:
            found[-1] = Arch(people=people, start=last.start, end=window.end)
        else:
            found.append(Arch(people=people, start=window.start, end=window.end))
    return tuple(found)


def share_of(window: Window, arches: Sequence[Arch]) -> float:
    """Give the share of a window's time in which an arch stood."""
    stood = (min(window.end, arch.end) - max(window.start, arch.start) for arch in arches)
    return sum(time for time in stood if time > 0) / window.duration


def arch_in(scene: Scene, window: Window) -> frozenset[int]:
    """Find the shortest chain of people who press each other, and whose ends press the walls on
    either side of the door; empty where there is none near the door. Of several doors the own of
    the drive is looked at.

    Its length is that of the line from one end of the door through the centres to the other end."""
    drive = scene.drive
    if drive is None:
        return frozenset()
    posts = np.array(drive.door)
    flanks = [_flanking(scene, post) for post in posts]
    window = window.of_people().summed()
    now, n = window.now, len(window.now)
    reach = 0.5 * np.hypot(*(posts[1] - posts[0])) + DIAMETERS * 2 * now.radius.mean()
    near = np.hypot(*(now.position - posts.mean(0)).T) <= reach
    near &= (now.position - posts[0]) @ np.array(drive.outward) < 0
    presses = window.force > LEAST_N
    first = np.searchsorted(now.ids, window.keys[:, 0])
    second = np.searchsorted(now.ids, np.where(window.is_wall, now.ids[0], window.keys[:, 1]))
    pairs = presses & ~window.is_wall & near[first] & near[second]
    rows, columns = [first[pairs]], [second[pairs]]
    lengths = [_distance(now.position[first[pairs]], now.position[second[pairs]])]
    for side, (post, walls) in enumerate(zip(posts, flanks, strict=True)):
        on = presses & window.is_wall & near[first] & np.isin(window.keys[:, 1], walls)
        who = np.unique(first[on])
        rows.append(who)
        columns.append(np.full(len(who), n + side))
        lengths.append(_distance(now.position[who], post))
    return _shortest(np.concatenate(rows), np.concatenate(columns), np.concatenate(lengths), window)


def _shortest(rows: Indices, columns: Indices, lengths: Floats, window: Window) -> frozenset[int]:
    """Who is on the shortest way between the two ends of the door, which follow the people."""
    n = len(window.now)
    graph = csr_array((lengths, (rows, columns)), shape=(n + 2, n + 2))
    length, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
    if not np.isfinite(length[n + 1]):
        return frozenset()
    chain, at = [], int(before[n + 1])
    while at != n:
        chain.append(int(window.now.ids[at]))
        at = int(before[at])
    return frozenset(chain)


def _flanking(scene: Scene, post: Floats) -> Indices:
    """Numbers, from 1, of the walls that end at an end of the door."""
    walls = scene.wall_segments()
    ends = [_distance(end, post) <= AT_POST_M for end in (walls.start, walls.end)]
    return np.flatnonzero(ends[0] | ends[1]) + 1


def walls_beside(scene: Scene) -> tuple[Indices, Indices]:
    """Number, from 1, the walls that end at the own door of the drive: left and right of it for who
    leaves. None without a door."""
    drive = scene.drive
    if drive is None or not drive.has_door:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    start, end = np.array(drive.door)
    (x, y), (along, up) = drive.outward, end - start
    left, right = (end, start) if x * up - y * along > 0 else (start, end)
    return _flanking(scene, left), _flanking(scene, right)


def _distance(positions: Floats, other: Floats) -> Floats:
    return np.asarray(np.hypot(*(positions - other).T))


# The shortest window (s) that is worth comparing: below it a quantile of forces depends on the
# step.
SHORTEST_S = 0.1
# Near the door (m).
NEAR_M = 2.0
# What a run says in one number per window (`values_of`; flow and arches: `read_exposure`), and the
# mean lifetime of its arches (`RunLoads.lifetimes`).
MEASURES: Mapping[str, Quantity] = {
    "contact_largest": Quantity("largest contact force", "N"),
    "contact_95": Quantity("95 % quantile of contact forces", "N"),
    "contact_mean": Quantity("mean contact force", "N"),
    "person_largest": Quantity("sum on the most loaded person", "N"),
    "walls": Quantity("load on all walls", "N"),
    "wall_left": Quantity("wall left of the door, its first metre", "kN/m"),
    "wall_right": Quantity("wall right of the door, its first metre", "kN/m"),
    "pressure_door": Quantity("force per m round people at door", "N/m"),
    "speed_door": Quantity("speed within 2 m of the door", "m/s"),
    "density_door": Quantity("density within 2 m of the door", "1/m²"),
    "flow": Quantity("people through the door per second", "1/s"),
    "arch_share": Quantity("share of time with an arch before the door", "–"),
    "arch_lifetime": Quantity("mean lifetime of an arch", "s"),
}


def loads_of(scene: Scene, window: Window) -> dict[str, Floats]:
    """Compute QUANTITIES in a window: (n,) of people, those who have passed the door included, (w,)
    of walls, (1,) of the crowd, (0,) where there is no door. Forces are the magnitudes of the mean
    force vectors of contacts, |∫f dt|/T. A body of several disks is one person."""
    window = window.of_people()
    now, force, pairs = window.now, window.force, ~window.is_wall
    # of a wall the second means nothing
    first, second = np.searchsorted(now.ids, window.keys[:, :2]).T
    (largest, total), values = np.zeros((2, len(now))), np.zeros((len(now), 2))
    for who, some, sign in ((first, slice(None), -1.0), (second[pairs], pairs, 1.0)):
        np.maximum.at(largest, who, force[some])
        np.add.at(total, who, force[some])
        np.add.at(values, who, sign * window.impulse[some])
    return {
        "contact_largest": largest,
        "contact_sum": total,
        "resultant": np.hypot(*values.T) / window.duration,
        "pressure": total / (2 * np.pi * now.radius),
        **_walls(scene, outlined(scene, window)),
        **_crowd(scene, window),
    }


def _walls(scene: Scene, on: OnWalls) -> dict[str, Floats]:
    """Load (N) of each wall, and the largest line load (kN/m) of all stretches of 1 m of its outline
    with a contact on it (`Outlines`)."""
    load: Floats = np.bincount(on.wall, weights=on.force, minlength=len(scene.walls)).astype(float)
    line = 1e-3 * outlines_of(scene).line_loads(*on)[0]
    return {"wall_load": load, "wall_line_load": line}


def _crowd(scene: Scene, window: Window) -> dict[str, Floats]:
    """Density (1/m²) of the half disk of 2 m before the door (the one with most people before it),
    and density times the variance of the velocities of those in it (1/s²)."""
    if scene.drive is None or not scene.drive.gates:
        return {"density": np.zeros(0), "crowd_pressure": np.zeros(0)}
    now = window.now
    before = []
    for exit_ in scene.drive.doors:
        if not exit_.has_door:
            continue
        close = np.hypot(*(now.position - np.mean(exit_.door, axis=0)).T) <= NEAR_M
        before.append(close & ~exit_.beyond(now.position))
    near = max(before, key=np.count_nonzero)
    density = float(near.sum()) / (0.5 * np.pi * NEAR_M**2)
    spread = float(now.velocity[near].var(0).sum()) if near.any() else 0.0
    return {"density": np.array([density]), "crowd_pressure": np.array([density * spread])}


def people_above(loads: Mapping[str, Floats], files: tuple[Path, ...] = ()) -> dict[str, float]:
    """Count who is above each limit of people in a window; files: of users' limits."""
    limits = limits_of_people(files)
    return {above_key(one): float((loads[one.quantity] > one.number).sum()) for one in limits}


def pressing(window: Window) -> Floats:
    """Give the contact forces of a window above 10 N."""
    return window.force[window.force > LEAST_N]


def passed(scene: Scene, now: Snapshot) -> float:
    """Count who is beyond the line of the door."""
    assert scene.drive is not None
    people = people_of(now)[0]
    return float(scene.drive.gone(people.position, people.ids).sum())


def values_of(scene: Scene, window: Window, loads: Mapping[str, Floats]) -> dict[str, float]:
    """Measure a window, of which `loads_of` gave the loads; where there is a door pressure, speed and
    density there, too."""
    now, pressed = people_of(window.now)[0], pressing(window)
    values = {
        "contact_largest": float(loads["contact_largest"].max(initial=0.0)),
        "contact_95": float(np.quantile(pressed, 0.95)) if len(pressed) else 0.0,
        "contact_mean": float(pressed.mean()) if len(pressed) else 0.0,
        "person_largest": float(loads["contact_sum"].max(initial=0.0)),
        "walls": float(window.force[window.is_wall].sum()),
    }
    if scene.drive is None or not scene.drive.gates:
        return values
    near = near_door(scene, now)
    return values | {
        "pressure_door": float(loads["pressure"][near].mean()) if near.any() else 0.0,
        "speed_door": float(np.hypot(*now.velocity[near].T).mean()) if near.any() else 0.0,
        "density_door": float(loads["density"][0]),
    }


def near_door(scene: Scene, now: Snapshot) -> Mask:
    """Tell who (n,) is within 2 m of the own door and has not passed it."""
    assert scene.drive is not None
    near = ~scene.drive.gone(now.position, now.ids)
    for exit_, mine in scene.drive.exits(now.ids):
        middle = np.mean(exit_.door, axis=0)
        near[mine] &= np.hypot(*(now.position[mine] - middle).T) <= NEAR_M
    return near


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunLoads:
    """Hold a run as one labelled dataset, window by window.

    duration: (t,) s, of the windows; forces are impulses over it
    loads: by QUANTITIES, (t,n) of people, (t,w) of walls, (t,1) of the crowd or (t,0) without a door
    values: (t,) by MEASURES (but arch_lifetime), `wall_line_load` (kN/m, the largest of all walls)
        and `above_key` (people above each limit)"""

    scene: Scene  # with the name that the run has
    ids: Sequence[int]  # (n,) of its people
    time: Floats  # (t,) s, the ends of the windows
    duration: Floats
    loads: Mapping[str, Floats]
    values: Mapping[str, Floats]
    arches: Sequence[Arch] = ()  # before the door, in order of time
    on_walls: Sequence[OnWalls] = ()  # (t,) the contacts with walls
    # (n,) s, when each got out: infinite for who did not, NaN for who was out at the start
    out: Floats = field(default_factory=lambda: np.zeros(0))

    def last(self, duration_s: float) -> Mask:
        """Choose the windows (t,) that begin in the last `duration_s` of the run."""
        return np.asarray(self.time - self.duration >= self.time[-1] - duration_s - 1e-9)

    def lifetimes(self, duration_s: float) -> list[float]:
        """List the lifetimes (s) of the arches that stood in the last `duration_s` of the run."""
        begins = float(self.time[-1]) - duration_s + 1e-9
        return [arch.lifetime for arch in self.arches if arch.end > begins]

    def time_above(self, limit: Limit) -> tuple[Floats, Floats]:
        """Sum for each person or wall, or the crowd, the time above a limit (s), and find its
        longest stretch without a break (s)."""
        above = self.loads[limit.quantity] > limit.number
        return self.duration @ above, self.running(above).max(axis=0, initial=0.0)

    def running(self, above: Mask) -> Floats:
        """Sum how long (t,n) s somebody has been above without a break at the end of each window."""
        running = np.zeros(above.shape)
        for number, (now, duration) in enumerate(zip(above, self.duration, strict=True)):
            running[number] = np.where(now, running[number - 1] + duration, 0.0)
        return running

    def by_outline(self) -> RunLoads:
        """Give it with line loads of joined walls, (t,o), in place of those of their pieces."""
        of, every = outlines_of(self.scene), self.loads["wall_line_load"]
        joined = [every[:, of.number == n].max(axis=1) for n in range(len(of.length))]
        line = np.stack(joined, axis=1) if joined else every
        return replace(self, loads={**self.loads, "wall_line_load": line})

    def names(self, of: str) -> list[Any]:
        """Name its people or walls, or the crowd, which has no name."""
        every: dict[str, list[Any]] = {
            "person": list(self.ids),
            "wall": [wall.name for wall in self.scene.walls],
            "crowd": [""],
        }
        return every[of]


def read_exposure(
    folder: Path, window_s: float = SHORTEST_S, limits: tuple[Path, ...] = ()
) -> RunLoads:
    """Read the loads of a finished run from the impulses of every step. A window is as many frames
    as make `window_s` or more; limits: files of further ones.

    Raises EngineError and DumpError for a folder that does not hold one finished run with impulses,
    or one that is shorter than a window."""
    scene, record = read_finished(folder)
    run = RunWindows(folder, record.time_step_s)
    frames = list(run.between_frames())
    combined = max(1, math.ceil(window_s / frames[0].duration - 1e-9))
    ends = range(combined, len(run.times), combined)
    windows = [joined(frames[end - combined : end]).of_people() for end in ends]
    if not windows:
        raise DumpError(f"{folder}: the run of {run.times[-1]:g} s is shorter than {window_s:g} s")
    every = [loads_of(scene, window) for window in windows]
    rows = [
        values_of(scene, window, loads)
        | {"wall_line_load": float(loads["wall_line_load"].max(initial=0.0))}
        | people_above(loads, limits)
        for window, loads in zip(windows, every, strict=True)
    ]
    values = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    duration, arches = np.array([window.duration for window in windows]), arches_of(scene, frames)
    if scene.drive is not None:
        gone = [passed(scene, window.now) for window in windows]
        values["flow"] = np.diff([passed(scene, scene.snapshot), *gone]) / duration
        values["arch_share"] = np.array([share_of(window, arches) for window in windows])
    found = _joined(scene, windows, every)
    beside = beside_doors(scene)[:2]  # of the own door
    for one, load in zip(beside, loads_on(scene, found.on_walls, beside).T, strict=True):
        values["wall_left" if one.name.startswith("left") else "wall_right"] = load
    out = times_out(scene, [run.at(0), *(window.now for window in frames)], found.ids)
    return replace(found, duration=duration, values=values, arches=arches, out=out)


def times_out(scene: Scene, frames: Sequence[Snapshot], ids: Sequence[int]) -> Floats:
    """Give when (n,) s each person with these ids passed the own door for good, between two frames in
    a straight line: infinite for who did not, NaN for who was out in the first frame."""
    out = np.full(len(ids), np.inf)
    if scene.drive is None:
        return out
    before: tuple[float, Floats, Mask] | None = None
    for frame in frames:
        people = people_of(frame)[0]
        who = np.searchsorted(ids, people.ids)
        ahead, gone = np.full(len(ids), np.nan), np.zeros(len(ids), dtype=bool)
        for exit_, mine in scene.drive.exits(people.ids):
            way = people.position[mine] - exit_.door_start_m
            ahead[who[mine]] = way @ np.array(exit_.outward)
        gone[who] = scene.drive.gone(people.position, people.ids)
        if before is None:
            out[gone] = np.nan
        else:
            then, was, were = before
            fraction = np.where(
                (was < 0) & (ahead >= 0), was / np.where(was < ahead, was - ahead, -1), 1
            )
            new, inside = gone & ~were, ~np.isnan(out)
            out[new & inside] = (then + fraction * (frame.time - then))[new & inside]
            out[~gone & ~np.isnan(ahead) & inside] = np.inf
        before = frame.time, ahead, gone
    return out


def loads_of_frames(scene: Scene, frames: Sequence[Window]) -> RunLoads:
    """Give the loads at instants, each as a window of one second. A frame stands for the time to the
    next, the last for as long as the one before: two are needed. Loads (t,n) of who is not there
    are NaN."""
    frames = [frame.of_people() for frame in frames]
    found = _joined(scene, frames, [loads_of(scene, frame) for frame in frames])
    intervals = np.diff(found.time)
    out = times_out(scene, [frame.now for frame in frames], found.ids)
    return replace(found, duration=np.append(intervals, intervals[-1]), out=out)


def _joined(
    scene: Scene, frames: Sequence[Window], every: Sequence[Mapping[str, Floats]]
) -> RunLoads:
    """Windows with the loads of each, as one dataset without durations and values."""
    time = np.array([frame.end for frame in frames])
    ids = np.unique(np.concatenate([frame.now.ids for frame in frames]))
    loads: dict[str, Floats] = {}
    for key, quantity in QUANTITIES.items():
        if quantity.of != "person":
            loads[key] = np.stack([one[key] for one in every])
            continue
        loads[key] = np.full((len(time), len(ids)), np.nan)
        for row, frame, one in zip(loads[key], frames, every, strict=True):
            row[np.searchsorted(ids, frame.now.ids)] = one[key]
    nothing = np.zeros(0)
    return RunLoads(
        scene=scene, ids=ids.tolist(), time=time, duration=nothing, loads=loads, values={},
        on_walls=[outlined(scene, frame) for frame in frames],
    )  # fmt: skip


HEAD = ["limit", "value", "ever above", "longest", "largest"]
LOADS = Columns("exposure")
LIMITS_HEAD = Columns("limits")


def write_exposure(run: RunLoads, limits: Sequence[Limit], folder: Path) -> list[Path]:
    """Write exposure_people.csv, exposure_walls.csv, exposure_crowd.csv (a row per window and
    person, wall or crowd) and exposure_limits.csv (a row per limit and person, wall or crowd);
    return them.

    Columns: docs/columns.md."""
    paths = [folder / f"exposure_{one}.csv" for one in ("people", "walls", "crowd", "limits")]
    kinds = {"person": "id", "wall": "wall", "crowd": ""}
    for path, (of, name) in zip(paths, kinds.items(), strict=False):
        mine = {one.column: run.loads[key] for key, one in QUANTITIES.items() if one.of == of}
        windows, count = next(iter(mine.values())).shape
        head = {"time_s": run.time.repeat(count), "window_s": run.duration.repeat(count)}
        named = {name: np.array(run.names(of) * windows)} if name else {}
        columns = head | named | {key: every.ravel() for key, every in mine.items()}
        there = ~np.isnan(columns[next(iter(mine))])
        write_columns(path, {key: every[there] for key, every in columns.items()})
    write_rows(paths[-1], LIMITS_HEAD, _times_above(run, limits))
    return paths


def _times_above(run: RunLoads, limits: Sequence[Limit]) -> Iterator[list[object]]:
    for limit in limits:
        of = QUANTITIES[limit.quantity].of
        sentences = [limit.duration_s or "", limit.population, limit.cited, limit.read]
        for name, total, longest in zip(run.names(of), *run.time_above(limit), strict=False):
            head = [limit.name, limit.number, limit.unit, limit.quantity, of, name]
            yield [*head, float(total), float(longest), *sentences]


def exposure_rows(run: RunLoads, limits: Sequence[Limit]) -> list[list[str]]:
    """Give a row per limit, HEAD above it: who is above it at any time, the longest stretch of
    anybody and, where the limit has a duration, that beside it. It fits 80 columns."""
    rows, run = [], run.by_outline()
    for limit in limits:
        quantity = QUANTITIES[limit.quantity]
        total, longest = run.time_above(limit)
        above, maximum = int((total > 0).sum()), float(longest.max(initial=0.0))
        who = f"{above} of {len(total)}"
        if quantity.of == "crowd":
            who = ("yes" if above else "no") if len(total) else NONE
        lasts = f" of {significant(limit.duration_s)} s" if limit.duration_s else " s"
        values = run.loads[limit.quantity]
        rows.append(
            [
                limit.name,
                with_unit(significant(limit.number, 4), limit.unit),
                who,
                significant(maximum, 2) + lasts,
                significant(np.nanmax(values) if values.size else None, 2),
            ]
        )
    return rows


def sources_of(limits: Sequence[Limit]) -> list[str]:
    """Say below the rows what each limit is compared with, and where it is from."""
    names: dict[tuple[str, str], list[str]] = {}
    for one in limits:
        title = f"{QUANTITIES[one.quantity].title} ({one.unit})"
        names.setdefault((title, one.signed), []).append(one.name)
    return [f"{', '.join(each)}: {title}. {source}" for (title, source), each in names.items()] + [
        SIGNS
    ]


ENDING = "_stops"


def stops_of(run: RunLoads, limit: Limit) -> tuple[Stop, ...]:
    """List who bears a sum of contact forces (N) above the number of a limit for its time without a
    break, and when that time is over, to a window; in the order of time.

    An assumption, no medicine: most limits are of one force, and none is about fainting. Raises
    LimitError for a limit that is not of a force on a person."""
    if QUANTITIES[limit.quantity].of != "person" or limit.unit != "N":
        raise LimitError(f"--stops {limit.name}: a limit of a force (N) on a person is needed")
    above = run.loads["contact_sum"] > limit.number
    over = above & (run.running(above) >= (limit.duration_s or 0.0) - 1e-9)
    first = run.time[over.argmax(axis=0)]
    found = sorted((float(first[n]), run.ids[n]) for n in np.flatnonzero(over.any(axis=0)).tolist())
    people, who = people_of(run.scene.snapshot)
    last = dict(zip(people.ids[who].tolist(), run.scene.snapshot.ids.tolist(), strict=True))
    return tuple(Stop(people=(one, last[one]), time_s=round(time, 9)) for time, one in found)


def write_stops(run: RunLoads, limit: Limit, folder: Path) -> tuple[int, Path]:
    """Write the scene of a run in which those stop (`stops_of`), and no others, into a folder, as
    `<name>_stops`; return how many stop, and its path. Raises LimitError where nobody is driven."""
    if run.scene.drive is None:
        raise LimitError("--stops: nobody is driven")
    name, stops = f"{run.scene.name.removesuffix(ENDING)}{ENDING}", stops_of(run, limit)
    scene = run.scene.with_drive(stops=stops).model_copy(update={"name": name})
    return len(stops), scene.write(folder)
