"""Runs of the engines over time step and stiffness: the motion of the window and its cost, kept for
the next time."""

from __future__ import annotations

import contextlib
import functools
import itertools
import logging
import resource
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.engines import EngineError, engine
from analysis.engines.penalty import penalty_of
from analysis.engines.record import FINISHED
from analysis.engines.run import run_engine
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.support.machine import machine
from analysis.work_precision.point import PointStatus
from analysis.work_precision.points_of import Answer, today
from analysis.work_precision.window import Motion, Window

# Times the scene's stiffness. Those of people stand in analysis/engines/bodies.toml.
STIFFER = (1.0, 1e1, 1e2, 1e3, 1e4)
# Time steps as shares of the safe one, also far beyond where an explicit method is stable.
SHARES = (1 / 64, 1 / 16, 1 / 4, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
# No run is longer than this; finer time steps of large crowds are left out.
MOST_PARTICLE_STEPS, MOST_STEPS = 2.0e7, 2.0e5
LAWS = {"lammps": ("hooke", "hertz"), "yade": ("hooke",)}
# The CPU time of a run is that of the children of this process: one at a time.
_one_at_a_time = threading.Lock()


def soft_engines() -> list[str]:
    """List the engines of soft contacts that are installed."""
    return [name for name in LAWS if engine(name).find()]


@dataclass(frozen=True, slots=True, kw_only=True)
class SoftSetting:
    """An engine with a contact law, a stiffness and a time step as a share of the safe one."""

    engine: str
    law: str
    stiffness_N_per_m: float  # noqa: N815  (the unit is newton)
    share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoftRun:
    """What a run with a setting gave: its motion (None where it failed), and the answer without
    values; its CPU seconds are the engine's, start included."""

    setting: SoftSetting
    motion: Motion | None
    answer: Answer

    def on(self, window: Window) -> Answer:
        """Give the answer on the window."""
        if self.motion is None:
            return self.answer
        values = window.quantities(self.motion, self.setting.stiffness_N_per_m)
        return replace(self.answer, values=values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Settings to try: stiffnesses (times the scene's), shares of the safe time step, and the
    shares of an engine that has others."""

    stiffer: tuple[float, ...] = STIFFER
    shares: tuple[float, ...] = SHARES
    of_engine: dict[str, tuple[float, ...]] = field(default_factory=dict)


FULL = Grid()
QUICK = Grid(stiffer=(1.0, 1e2), shares=(1 / 4, 1.0, 4.0), of_engine={"yade": (1.0,)})


def settings_of(window: Window, engines: Sequence[str], grid: Grid = FULL) -> Iterator[SoftSetting]:
    """Yield all settings of a grid, short of those that would take too long."""
    n = len(window.scene.snapshot)
    own = window.scene.contact.stiffness_N_per_m
    for name in engines:
        shares = grid.of_engine.get(name, grid.shares)
        for law, stiffer, share in itertools.product(LAWS[name], grid.stiffer, shares):
            setting = SoftSetting(
                engine=name, law=law, stiffness_N_per_m=stiffer * own, share=share
            )
            steps = penalty_of(scene_of(window, setting)).steps
            if steps <= MOST_STEPS and n * steps <= MOST_PARTICLE_STEPS:
                yield setting


def scene_of(window: Window, setting: SoftSetting) -> Scene:
    """Make the scene to run: two frames, and a time step at most `share` of the safe one that
    divides the window."""
    variant = window.variant(setting.law, setting.stiffness_N_per_m)
    half = 0.5 * variant.run.duration_s
    steps = ceil(half / (setting.share * penalty_of(variant).safe_time_step) - 1e-9)
    return variant.with_run(time_step_s=half / steps)


def run_folder(folder: Path, setting: SoftSetting) -> Path:
    """Name where a run lives: folder/<engine>_<law>_k<stiffness>_dt<share>."""
    return (
        folder
        / f"{setting.engine}_{setting.law}_k{setting.stiffness_N_per_m:.6g}_dt{setting.share:.6g}"
    )


def run_soft(scene: Scene, setting: SoftSetting, folder: Path) -> SoftRun:
    """Run the scene with the setting's engine, or take what is there: the finished run, or how it
    failed.

    A run that fails is a result: its status and reason say so.
    """
    note = folder.with_name(folder.name + ".json")
    key = f"{scene.digest()} {_version(setting.engine)}"
    known = kept(note, key)
    if known is None or not _is_there(known, folder):
        known = _run(scene, setting, folder)
        keep(note, key, known)
    motion, status, reason = None, PointStatus(known["status"]), known["reason"]
    if status == PointStatus.OK:
        try:
            motion = _motion(scene, folder)
        except (DumpError, EngineError) as error:
            status, reason = PointStatus.FAILED, str(error)
    answer = Answer(
        method=setting.engine,
        law=setting.law,
        time_step_s=penalty_of(scene).time_step,
        time_step_share=setting.share,
        stiffness_N_per_m=setting.stiffness_N_per_m,
        cpu_seconds=known["cpu_seconds"],
        values=None,
        status=status,
        reason=reason,
        machine=known["machine"],
        date=known["date"],
    )
    return SoftRun(setting=setting, motion=motion, answer=answer)


@functools.cache
def _version(name: str) -> str | None:
    """Asked once in a process: asking starts the engine."""
    return engine(name).version()


@contextlib.contextmanager
def _only_errors() -> Iterator[None]:
    """Without warnings of a run: a time step beyond the safe one is meant here."""
    log = logging.getLogger("analysis.engines.run")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


def _run(scene: Scene, setting: SoftSetting, folder: Path) -> dict[str, Any]:
    status, reason = PointStatus.OK, ""
    with _one_at_a_time, _only_errors():
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            record = run_engine(scene, setting.engine, folder)
            seconds = record.cpu_seconds
            if record.exit_state != FINISHED:
                status, reason = PointStatus.FAILED, f"{setting.engine}: {record.exit_state}"
        except (EngineError, DumpError) as error:
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            status, reason = PointStatus.FAILED, str(error).splitlines()[0]
    return {
        "status": str(status),
        "reason": reason,
        "cpu_seconds": seconds,
        "machine": machine(),
        "date": today(),
    }


def _is_there(known: dict[str, Any], folder: Path) -> bool:
    return known.get("status") != PointStatus.OK or (folder / "bodies.dump").exists()


def _motion(scene: Scene, folder: Path) -> Motion:
    """The motion at the last two frames of the run."""
    trajectory = open_bodies(folder / "bodies.dump", penalty_of(scene).time_step).trajectory
    if len(trajectory) != 3:
        raise DumpError(f"{folder}: {len(trajectory)} frames where 3 are due")
    frames = [snapshot_of(trajectory[frame]) for frame in (1, 2)]
    moved = np.stack([frame.position for frame in frames]) - scene.snapshot.position
    return Motion(displacement=moved, velocity=np.stack([frame.velocity for frame in frames]))
