"""The tests: each is a list of scenes and a judgement of their runs, with its words in cases.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from analysis.scene.anthropometry import Varied
from analysis.scene.named_crowds import WALK
from analysis.scene.new_scene import Crowd, from_geometry
from analysis.scene.scene import Scene
from analysis.scene.waiting import Doorway
from nscd.arrays import Floats, Mask

# m/s, where a test names no other; frames are 0.1 s apart.
SPEED = 1.0
TIME_GAP_S = WALK["time_gap_s"]
# m/s: how far the speed of one who walks alone may be from the desired one.
SPEED_ERROR = 0.05
# m/s: what is less is no difference.
SPEED_NOISE = 0.01
# 1/(m s): IMO MSC/Circ.1238, on which the three standards build.
MOST_FLOW = 1.33
# s, of 40 m: RiMEA.
LEAST_S, MOST_S = 26.0, 34.0
# s: so long do 100 people have to leave by 1 m, and to cross: our limits.
MOST_LEAVING_S, MOST_CROSSING_S = 120.0, 200.0
# People per m².
DENSITIES = (0.5, 1.0, 2.0, 3.0, 4.0)
# How many walk against the 100.
AGAINST = (0, 10, 50, 100)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """Hold where the people of a scene went.

    time: (f,) s; position: (f,n,2) m, in the order of the scene"""

    scene: Scene
    time: Floats
    position: Floats

    @property
    def out(self) -> Mask:
        """Who (f,n) has passed the line of the own door."""
        drive, ids = self.scene.drive, self.scene.snapshot.ids
        assert drive is not None
        passed = np.zeros(self.position.shape[:2], dtype=bool)
        for exit_, mine in drive.exits(ids):
            passed[:, mine] = exit_.beyond(self.position[:, mine])
        return passed

    def first(self, there: Mask) -> Floats:
        """Tell when (s) flags (f,n) first hold for each person; never is infinite."""
        return np.where(there.any(0), self.time[there.argmax(0)], np.inf)

    def within(self, x: tuple[float, float], y: tuple[float, float]) -> Floats:
        """Count people per m² (f,) within a rectangle."""
        low, high = np.transpose([x, y])
        inside = ((self.position >= low) & (self.position <= high)).all(2).sum(1)
        counted: Floats = inside / np.prod(high - low)
        return counted


@dataclass(frozen=True, slots=True)
class Judged:
    """Hold whether a test passed, and the numbers that say so: by name, and where a test has several
    runs by what differs between them."""

    passed: bool
    numbers: dict[str, Any]


def judged_together(every: Sequence[Judged]) -> Judged:
    """Join the judgements of several seeds: all must pass; a number becomes its least and largest."""

    def ends(values: Sequence[Any]) -> Any:
        if isinstance(values[0], dict):
            return {key: ends([one[key] for one in values]) for key in values[0]}
        return min(values), max(values)

    return Judged(all(one.passed for one in every), ends([one.numbers for one in every]))


Judge = Callable[..., Judged]


@dataclass(frozen=True, slots=True)
class Case:
    """Hold a test: the scenes that it runs, made when they are needed, and the judgement of their
    tracks."""

    name: str
    scenes: Callable[[How], Sequence[Scene]]
    judge: Judge


@dataclass(frozen=True, slots=True)
class How:
    """Hold the time gap (s) of the people who wait, and the seed of all that is random."""

    time_gap_s: float = TIME_GAP_S
    seed: int = 1


# Every test that was declared, in the order of the page.
CASES: dict[str, Case] = {}


def case(scenes: Callable[[How], Sequence[Scene]]) -> Callable[[Judge], Judge]:
    """Declare the decorated judgement as a test of its name."""

    def declare(judge: Judge) -> Judge:
        CASES[judge.__name__] = Case(judge.__name__, scenes, judge)
        return judge

    return declare


def _scene(
    how: How, name: str, floor: Any, doors: Sequence[Doorway], people: int, **crowd: Any
) -> Scene:
    duration = crowd.pop("duration")
    varied = Varied(radius_share=0.1, seed=how.seed)
    arguments: dict[str, Any] = {"speed": SPEED, "does": "waiting", "varied": varied}
    made = from_geometry(name, floor, list(doors), Crowd(people=people, **arguments | crowd), duration)
    keeps = made.drive is not None and made.drive.keeps_distance
    return made.with_drive(time_gap_s=how.time_gap_s, seed=how.seed) if keeps else made


def _door(x0: float, y0: float, x1: float, y1: float, start: Any, fraction: float = 1.0) -> Doorway:
    return Doorway(ends=((x0, y0), (x1, y1)), start=start, share=fraction)


def _walk(how: How, name: str, speed: float) -> Scene:
    """One person in a corridor of 60 m, of which 10 to 50 m are measured."""
    door, start = (60.0, 0.0, 60.0, 2.0), shapely.box(0, 0.5, 1, 1.5)
    floor, crowd = shapely.box(0, 0, 60, 2), {"duration": 65.0, "speed": speed}
    return _scene(how, name, floor, [_door(*door, start)], 1, **crowd)


def _from_room(how: How, name: str, people: int, door: float, **crowd: Any) -> Scene:
    room, half = shapely.box(-8, 0, 0, 5), 0.5 * door
    return _scene(how, name, room, [_door(0, 2.5 - half, 0, 2.5 + half, room)], people, **crowd)


def _walked(track: Track) -> float:
    """The time (s) over 40 m."""
    start, end = np.interp([10.0, 50.0], track.position[:, 0, 0], track.time)
    return float(end - start) if track.position[-1, 0, 0] >= 50.0 else np.inf


@case(lambda how: [_walk(how, "corridor", SPEED)])
def corridor(track: Track) -> Judged:
    """Judge the speed of one person."""
    speed = 40.0 / _walked(track)
    return Judged(abs(speed - SPEED) <= SPEED_ERROR, {"speed_m_per_s": speed})


@case(lambda how: [_walk(how, "corridor_fast", 1.33)])
def corridor_fast(track: Track) -> Judged:
    """Judge the time of one person over 40 m."""
    time = _walked(track)
    return Judged(LEAST_S <= time <= MOST_S, {"time_s": time})


def _corner(how: How) -> list[Scene]:
    floor = shapely.Polygon([(0, 0), (12, 0), (12, 12), (10, 12), (10, 2), (0, 2)])
    door = _door(10, 12, 12, 12, shapely.box(0, 0, 6, 2))
    return [_scene(how, "corner", floor, [door], 20, duration=40.0)]


@case(_corner)
def corner(track: Track) -> Judged:
    """Judge that all get out, and that nobody goes through a wall between two frames."""
    walls = track.scene.wall_segments()
    lines = shapely.multilinestrings(shapely.linestrings(np.stack([walls.start, walls.end], 1)))
    steps = np.stack([track.position[:-1], track.position[1:]], axis=2).reshape(-1, 2, 2)
    through = int(shapely.intersects(shapely.linestrings(steps), lines).sum())
    out = int(track.out[-1].sum())
    all_out = out == track.position.shape[1]
    return Judged(all_out and not through, {"out": out, "through_walls": through})


def _towards(how: How) -> list[Scene]:
    parts = shapely.box(0, 0, 10, 10), shapely.box(10, 4, 20, 6), shapely.box(20, 0, 30, 10)
    floor, scenes = shapely.union_all(parts), []
    for against in AGAINST:
        doors = [_door(30, 0, 30, 10, shapely.box(0, 0, 4, 10), fraction=100.0)]
        if against:
            doors.append(_door(0, 0, 0, 10, shapely.box(26, 0, 30, 10), fraction=float(against)))
        name, people = f"counterflow_{against}", 100 + against
        scenes.append(_scene(how, name, floor, doors, people, duration=MOST_CROSSING_S))
    return scenes


@case(_towards)
def counterflow(*tracks: Track) -> Judged:
    """Judge that the 100 take the longer to cross to the other room the more come towards them."""
    crossed = [one.first(one.position[:, :100, 0] >= 20.0) for one in tracks]
    times = {n: float(each.max()) for n, each in zip(AGAINST, crossed, strict=True)}
    counts = {n: int(np.isfinite(each).sum()) for n, each in zip(AGAINST, crossed, strict=True)}
    longer = all(a < b < np.inf for a, b in pairwise(times.values()))
    return Judged(longer, {"last_s": times, "crossed": counts})


def _congested(how: How) -> list[Scene]:
    room = shapely.box(0, 0, 8, 5)
    floor = shapely.union(room, shapely.box(3, 5, 5, 17))
    return [_scene(how, "congestion", floor, [_door(3, 17, 5, 17, room)], 100, duration=50.0)]


@case(_congested)
def congestion(track: Track) -> Judged:
    """Judge that people stand denser where the corridor begins than in it."""
    mouth = float(track.within((3.0, 5.0), (4.5, 5.5)).max())
    middle = float(track.within((3.0, 5.0), (8.0, 10.0)).max())
    return Judged(mouth > middle, {"mouth_per_m2": mouth, "corridor_per_m2": middle})


@case(lambda how: [_from_room(how, "flow", 100, 1.0, duration=MOST_LEAVING_S)])
def flow(track: Track) -> Judged:
    """Judge the flow through a door of 1 m over the time in which people leave."""
    left = np.sort(track.first(track.out))
    left = left[np.isfinite(left)]
    rate = (len(left) - 1) / float(np.ptp(left)) if len(left) > 1 else 0.0
    numbers = {"out": len(left), "flow_per_m_s": rate}
    return Judged(len(left) == track.position.shape[1] and rate <= MOST_FLOW, numbers)


def _dense(how: How) -> list[Scene]:
    """Crowds of each density on 10 m of a corridor of 4 m."""
    start, door = shapely.box(0, 0, 10, 4), (40.0, 0.0, 40.0, 4.0)
    floor = shapely.box(0, 0, 40, 4)
    return [
        _scene(how, f"density_{n:g}", floor, [_door(*door, start)], round(40 * n), duration=8.0)
        for n in DENSITIES
    ]


@case(_dense)
def density(*tracks: Track) -> Judged:
    """Judge that people walk the slower the denser they are: mean speed from 3 to 8 s."""
    speeds = {}
    for n, one in zip(DENSITIES, tracks, strict=True):
        late = one.time >= 3.0
        went = one.position[late][-1, :, 0] - one.position[late][0, :, 0]
        speeds[n] = float(went.mean() / np.ptp(one.time[late]))
    slower = all(a > b + SPEED_NOISE for a, b in pairwise(speeds.values()))
    return Judged(slower, {"speed_m_per_s": speeds})


PUSHING = {"does": "pushing", "relaxation": 0.5, "duration": 20.0}


@case(lambda how: [_from_room(how, "clogging", 60, 0.5, **PUSHING)])
def clogging(track: Track) -> Judged:
    """Judge that an arch holds: people are left, and nobody leaves in the second half of the run."""
    left = track.first(track.out)
    inside = int(np.isinf(left).sum())
    last = float(left[np.isfinite(left)].max(initial=0.0))
    numbers = {"inside": inside, "last_s": last, "end_s": float(track.time[-1])}
    return Judged(bool(inside) and last <= 0.5 * track.time[-1], numbers)
