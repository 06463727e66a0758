"""What a run says about forces and flow, window by window."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_dump, open_bodies, snapshot_of
from analysis.dumps.contacts import IMPULSE_COLUMNS
from analysis.scene.scene import Scene, read_scene
from nscd import Snapshot
from nscd.arrays import Floats

# The shortest window (s) that is worth comparing: below it a quantile of forces depends on the step.
SHORTEST_S = 0.1
# Near the door (m), and the force (N) below which two bodies hardly touch.
NEAR_M, LEAST_N = 2.0, 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """Name a headline quantity: its title, its unit, and whether it is a force."""

    title: str
    unit: str
    of_forces: bool = True


MEASURES: Mapping[str, Measure] = {
    "contact_largest": Measure(title="largest contact force", unit="N"),
    "contact_95": Measure(title="95 % quantile of contact forces", unit="N"),
    "contact_mean": Measure(title="mean contact force", unit="N"),
    "person_largest": Measure(title="load of the most loaded person", unit="N"),
    "walls": Measure(title="load on all walls", unit="N"),
    "pressure_door": Measure(title="pressure on people within 2 m of the door", unit="N/m"),
    "speed_door": Measure(title="speed within 2 m of the door", unit="m/s", of_forces=False),
    "density_door": Measure(title="density within 2 m of the door", unit="1/m²", of_forces=False),
    "flow": Measure(title="people through the door per second", unit="1/s", of_forces=False),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """Hold what a run says, one number per window.

    time: (w,) s, the ends of the windows
    window_s: s, over which forces are means: impulse over time
    values: (w,) per measure, in its unit
    evacuated: (w,) people beyond the line of the door
    forces: for each window the contact forces (N) above 10 N
    """

    time: Floats
    window_s: float
    values: Mapping[str, Floats]
    evacuated: Floats
    forces: tuple[Floats, ...]

    def last(self, duration_s: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Choose the windows (w,) that begin in the last `duration_s` of the run."""
        kept: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            self.time - self.window_s >= self.time[-1] - duration_s - 1e-9
        )
        return kept


def read_series(folder: Path, time_step_s: float) -> Series:
    """Read the windows of a run of a driven crowd. A window is as many frames as make 0.1 s or more.

    Raises DumpError for a run without impulses."""
    scene = read_scene(folder / "scene.toml")
    path = folder / "impulses.dump"
    if not path.exists():
        raise DumpError(f"{path}: no such file; run the scene again with [run] impulses = true")
    index = index_dump(path, "ENTRIES")
    if index.columns != IMPULSE_COLUMNS:
        raise DumpError(f"{path}: columns {' '.join(index.columns)}")
    bodies = open_bodies(folder / "bodies.dump", time_step_s).trajectory
    if len(bodies) != len(index.steps):
        raise DumpError(f"{path}: {len(index.steps)} frames where bodies.dump has {len(bodies)}")
    times = np.array(index.steps) * time_step_s
    together = max(1, math.ceil(SHORTEST_S / (times[1] - times[0]) - 1e-9))
    ends = range(together, len(times), together)
    rows: list[dict[str, float]] = []
    evacuated, forces = [float(_gone(scene, scene.snapshot).sum())], []
    for end in ends:
        duration = float(times[end] - times[end - together])
        table = np.concatenate([index.table(n) for n in range(end - together + 1, end + 1)])
        now = snapshot_of(bodies[end])
        values, magnitudes = _window(scene, now, table, duration)
        evacuated.append(float(_gone(scene, now).sum()))
        rows.append(values | {"flow": (evacuated[-1] - evacuated[-2]) / duration})
        forces.append(magnitudes)
    return Series(
        time=times[list(ends)],
        window_s=float(times[together]),
        values={key: np.array([row[key] for row in rows]) for key in MEASURES},
        evacuated=np.array(evacuated[1:]),
        forces=tuple(forces),
    )


def _window(
    scene: Scene, now: Snapshot, table: Floats, duration: float
) -> tuple[dict[str, float], Floats]:
    """The measures of one window, and its contact forces above 10 N. table: rows of its impulses."""
    keys, place = np.unique(table[:, :3].astype(np.int64), axis=0, return_inverse=True)
    impulse = np.zeros((len(keys), 2))
    np.add.at(impulse, place.ravel(), table[:, 3:5])
    force = np.hypot(*impulse.T) / duration
    wall = keys[:, 2] == 1
    load = np.zeros(len(now))
    rank = np.searchsorted(now.ids, keys[:, :2])
    np.add.at(load, rank[:, 0], force)
    np.add.at(load, rank[~wall, 1], force[~wall])
    pressed = force[force > LEAST_N]
    near = ~_gone(scene, now) & (_from_door(scene, now.position) <= NEAR_M)
    walking = np.hypot(*now.velocity[near].T)
    outline = 2 * np.pi * now.radius
    values = {
        "contact_largest": float(force.max(initial=0.0)),
        "contact_95": float(np.quantile(pressed, 0.95)) if len(pressed) else 0.0,
        "contact_mean": float(pressed.mean()) if len(pressed) else 0.0,
        "person_largest": float(load.max(initial=0.0)),
        "walls": float(force[wall].sum()),
        "pressure_door": float((load[near] / outline[near]).mean()) if near.any() else 0.0,
        "speed_door": float(walking.mean()) if near.any() else 0.0,
        "density_door": float(near.sum()) / (0.5 * np.pi * NEAR_M**2),
    }
    return values, pressed


def _gone(scene: Scene, snapshot: Snapshot) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Who has passed the line of the door."""
    drive = scene.drive
    assert drive is not None
    beyond: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
        snapshot.position - np.array(drive.door_start_m)
    ) @ np.array(drive.outward) >= 0
    return beyond


def _from_door(scene: Scene, position: Floats) -> Floats:
    """Distance (n,) m of places (n,2) m from the middle of the door."""
    drive = scene.drive
    assert drive is not None
    middle = 0.5 * (np.array(drive.door_start_m) + np.array(drive.door_end_m))
    return np.asarray(np.hypot(*(position - middle).T))
