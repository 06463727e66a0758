"""What a run says about forces and flow, window by window."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window, joined
from analysis.exposure.exposure import exposure_values
from analysis.motion.arches import LEAST_N, Arch, arches_of, share_of
from analysis.scene.scene import Scene, read_scene
from nscd import Snapshot
from nscd.arrays import Floats

# The shortest window (s) that is worth comparing: below it a quantile of forces depends on the
# step.
SHORTEST_S = 0.1
# Near the door (m).
NEAR_M = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """Name a headline quantity: its title and its unit."""

    title: str
    unit: str


MEASURES: Mapping[str, Measure] = {
    "contact_largest": Measure(title="largest contact force", unit="N"),
    "contact_95": Measure(title="95 % quantile of contact forces", unit="N"),
    "contact_mean": Measure(title="mean contact force", unit="N"),
    "person_largest": Measure(title="load of the most loaded person", unit="N"),
    "walls": Measure(title="load on all walls", unit="N"),
    "pressure_door": Measure(title="pressure on people within 2 m of the door", unit="N/m"),
    "speed_door": Measure(title="speed within 2 m of the door", unit="m/s"),
    "density_door": Measure(title="density within 2 m of the door", unit="1/m²"),
    "flow": Measure(title="people through the door per second", unit="1/s"),
    "arch_share": Measure(title="share of time with an arch before the door", unit="–"),
    "arch_lifetime": Measure(title="mean lifetime of an arch", unit="s"),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """Hold what a run says, one number per window.

    time: (w,) s, the ends of the windows
    window_s: s, over which forces are means: impulse over time
    values: (w,) per measure in its unit, and what `exposure_values` gives
    evacuated: (w,) people beyond the line of the door
    forces: for each window the contact forces (N) above 10 N
    arches: before the door, in order of time
    final: the last window
    """

    time: Floats
    window_s: float
    values: Mapping[str, Floats]
    evacuated: Floats
    forces: tuple[Floats, ...]
    arches: tuple[Arch, ...] = ()
    final: Window | None = None

    def last(self, duration_s: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Choose the windows (w,) that begin in the last `duration_s` of the run."""
        kept: np.ndarray[tuple[int], np.dtype[np.bool_]] = (
            self.time - self.window_s >= self.time[-1] - duration_s - 1e-9
        )
        return kept

    def lifetimes(self, duration_s: float) -> list[float]:
        """List the lifetimes (s) of the arches that stood in the last `duration_s` of the run."""
        begins = float(self.time[-1]) - duration_s + 1e-9
        return [arch.lifetime for arch in self.arches if arch.end > begins]


def read_series(folder: Path, time_step_s: float, limits: tuple[Path, ...] = ()) -> Series:
    """Read the windows of a run of a driven crowd. A window is as many frames as make 0.1 s or
    more; limits: files of further ones.

    Raises DumpError for a run without impulses."""
    scene = read_scene(folder / "scene.toml")
    run = RunWindows(folder, time_step_s)
    frames = list(run.between_frames())
    together = max(1, math.ceil(SHORTEST_S / frames[0].duration - 1e-9))
    windows = [joined(frames[n - together : n]) for n in range(together, len(run.times), together)]
    if not windows:
        raise DumpError(f"{folder}: {run.times[-1]:g} s; a window of {SHORTEST_S:g} s is the least")
    people = [passed(scene, window.now) for window in windows]
    gone = np.diff([passed(scene, scene.snapshot), *people])
    arches = arches_of(scene, frames)
    rows = [
        values_of(scene, window)
        | exposure_values(scene, window, limits)
        | {"flow": out / window.duration, "arch_share": share_of(window, arches)}
        for window, out in zip(windows, gone, strict=True)
    ]
    return Series(
        time=np.array([window.end for window in windows]),
        window_s=windows[0].duration,
        values={key: np.array([row[key] for row in rows]) for key in rows[0]},
        evacuated=np.array(people),
        forces=tuple(pressing(window) for window in windows),
        arches=arches,
        final=windows[-1],
    )


def pressing(window: Window) -> Floats:
    """Give the contact forces of a window above 10 N."""
    return window.force[window.force > LEAST_N]


def passed(scene: Scene, now: Snapshot) -> float:
    """Count who is beyond the line of the door."""
    return float(_gone(scene, now).sum())


def values_of(scene: Scene, window: Window) -> dict[str, float]:
    """Measure a window: the loads, and of a driven crowd pressure, speed and density at the
    door."""
    now, force, pressed = window.now, window.force, pressing(window)
    load = window.at_people(force)
    values = {
        "contact_largest": float(force.max(initial=0.0)),
        "contact_95": float(np.quantile(pressed, 0.95)) if len(pressed) else 0.0,
        "contact_mean": float(pressed.mean()) if len(pressed) else 0.0,
        "person_largest": float(load.max(initial=0.0)),
        "walls": float(force[window.is_wall].sum()),
    }
    if scene.drive is None:
        return values
    near = near_door(scene, now)
    walking = np.hypot(*now.velocity[near].T)
    outline = 2 * np.pi * now.radius
    return values | {
        "pressure_door": float((load[near] / outline[near]).mean()) if near.any() else 0.0,
        "speed_door": float(walking.mean()) if near.any() else 0.0,
        "density_door": float(near.sum()) / (0.5 * np.pi * NEAR_M**2),
    }


def near_door(scene: Scene, now: Snapshot) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell who (n,) is within 2 m of the own door and has not passed it."""
    return ~_gone(scene, now) & (_from_door(scene, now) <= NEAR_M)


def _gone(scene: Scene, snapshot: Snapshot) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Who has passed the line of the own door."""
    drive = scene.drive
    assert drive is not None
    return drive.gone(snapshot.position, snapshot.ids)


def _from_door(scene: Scene, snapshot: Snapshot) -> Floats:
    """Distance (n,) m from the middle of the own door."""
    assert scene.drive is not None
    distance = np.empty(len(snapshot))
    for exit_, mine in scene.drive.exits(snapshot.ids):
        middle = np.mean(exit_.door, axis=0)
        distance[mine] = np.hypot(*(snapshot.position[mine] - middle).T)
    return distance
