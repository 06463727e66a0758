"""A scene measured for the library: every method over a short grid of time steps and
stiffnesses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path

from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from analysis.work_precision.measure import measure
from analysis.work_precision.point import Point
from analysis.work_precision.soft_runs import (
    LAWS,
    MOST_PARTICLE_STEPS,
    STIFFER,
    SoftSetting,
    scene_of,
)
from analysis.work_precision.window import Window
from analysis.work_precision.window_start import prepare_window

# Shares of the safe time step: finer ones cost more than any asked error is worth, coarser ones
# fail. YADE has the errors of LAMMPS with the same law (tests compare them), so that fewer of its
# runs tell its cost.
SHARES = {"lammps": (0.25, 1.0, 4.0, 8.0), "yade": (1.0, 4.0)}


def grid(window: Window, engines: Sequence[str]) -> Iterator[SoftSetting]:
    """The settings that advice chooses among, short of those that would take too long."""
    for engine in engines:
        for law in LAWS[engine]:
            for stiffer in STIFFER:
                stiffness = stiffer * window.scene.contact.stiffness_N_per_m
                for share in SHARES[engine]:
                    setting = SoftSetting(
                        engine=engine, law=law, stiffness_N_per_m=stiffness, share=share
                    )
                    steps = penalty_of(scene_of(window, setting)).steps
                    if len(window.scene.snapshot) * steps <= MOST_PARTICLE_STEPS:
                        yield setting


def measured_points(
    scene: Scene,
    label: str,
    engines: Sequence[str],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
) -> tuple[Point, ...]:
    """The points of a scene over `grid`, under the name `label`; runs are kept in the folder and
    taken from there the next time. Raises what `prepare_window` raises."""
    folder.mkdir(parents=True, exist_ok=True)
    window = prepare_window(scene, folder)
    return measure(window, label, list(grid(window, engines)), folder, executor, progress).points
