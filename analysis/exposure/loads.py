"""What each person and each wall bears over a window: impulses over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.dumps.windows import Window
from analysis.exposure.limits import QUANTITIES, Limit
from analysis.scene.scene import Scene
from nscd.arrays import Flags, Floats, Indices

# Near the door (m); the stretch of a wall (m) on which a line load is taken.
NEAR_M, STRETCH_M = 2.0, 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loads:
    """Hold what a window says, by the quantities of limits.

    time: s, the end of the window
    duration: s, of the window
    person: (n,) of each quantity of a person, in its unit; those who have passed the door included
    wall: (w,) of each quantity of a wall
    crowd: one number of each quantity of the crowd; none without a door
    """

    time: float
    duration: float
    person: dict[str, Floats]
    wall: dict[str, Floats]
    crowd: dict[str, float]

    def above(self, limit: Limit) -> Flags:
        """Tell which people or walls, or whether the crowd, are above the number of a limit."""
        of = QUANTITIES[limit.quantity].of
        if of == "crowd":
            return np.array([value > limit.number for value in self._crowd(limit)], dtype=bool)
        values = (self.person if of == "person" else self.wall)[limit.quantity]
        flags: Flags = values > limit.number
        return flags

    def _crowd(self, limit: Limit) -> Sequence[float]:
        return [self.crowd[limit.quantity]] if limit.quantity in self.crowd else []


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
