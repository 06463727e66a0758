"""Whether what an engine wrote can be right."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_dump
from analysis.engines.record import EngineError, RunRecord
from analysis.scene import Scene
from nscd.bodies import Floats

# Contacts only dissipate, so kinetic energy stays below the larger of its start and that of everybody at the
# desired speed; the rest is the error of the time step.
ENERGY_MARGIN = 1.1
ADVICE = (
    "If disks were lost or moved too fast, give a smaller time step (run.time_step_s), "
    "or none: then it follows from the stiffness."
)


def check_bodies(path: Path, record: RunRecord, scene: Scene) -> None:
    """Read the whole body dump and raise EngineError naming the time of the first frame that cannot be right:
    disks that are missing, values that are not finite, more kinetic energy than the start and the drive can
    give, missing frames."""
    snapshot = scene.snapshot
    speed = scene.drive.speed_m_per_s if scene.drive else 0.0
    kinetic = 0.5 * float(snapshot.mass @ (snapshot.velocity**2).sum(1))
    most = ENERGY_MARGIN * max(kinetic, 0.5 * speed**2 * float(snapshot.mass.sum()))
    try:
        index = index_dump(path)
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            where = f"{record.engine}, {record.scene}, t = {step * record.time_step_s:.6g} s (step {step})"
            if count != record.disks:
                raise EngineError(
                    f"{where}: {record.disks - count} of {record.disks} disks are lost. {ADVICE}"
                )
            table = index.table(frame)
            if not np.isfinite(table).all():
                raise EngineError(
                    f"{where}: not a finite number in column {_first_bad(index.columns, table)}. {ADVICE}"
                )
            mass, vx, vy = (table[:, index.columns.index(name)] for name in ("mass", "vx", "vy"))
            energy = 0.5 * float(mass @ (vx * vx + vy * vy))
            if energy > most:
                raise EngineError(
                    f"{where}: kinetic energy {energy:.4g} J; the start and the drive can give "
                    f"{most / ENERGY_MARGIN:.4g} J. {ADVICE}"
                )
    except DumpError as error:
        raise EngineError(f"{record.engine}, {record.scene}: {error}. {ADVICE}") from None
    expected = tuple(range(0, record.steps + 1, record.frame_interval))
    if index.steps != expected:
        found, due = len(index.steps), len(expected)
        raise EngineError(f"{record.engine}, {record.scene}: {found} frames where {due} are due. {ADVICE}")


def _first_bad(columns: Sequence[str], table: Floats) -> str:
    return columns[int(np.argmin(np.isfinite(table).all(0)))]
