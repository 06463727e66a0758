"""The start of a scene's window: an impact as it stands, or a crowd that the drive has pressed
together."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import EngineError, installed
from analysis.engines.run import run_engine
from analysis.percussions.setting import law_of
from analysis.scene.real.separate import reconcile
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.support.progress import Progress
from analysis.work_precision.soft_runs import soft_engines
from analysis.work_precision.window import Window, driven_window, impact_window
from nscd.arrays import Floats


def prepare_window(scene: Scene, folder: Path, progress: Progress | None = None) -> Window:
    """Make the window of a scene; what it takes to find its start is kept in the folder.

    An impact and the frame of a real crowd are taken as they stand. Any other driven crowd is first
    run to the scene's instant of analysis by the first engine that there is; then disks that
    overlap are moved apart, as little as possible (see `reconcile`), since a stiffer contact would
    make an explosion of the same overlap. Raises ValueError as `check_chart` and `Window.check` do;
    EngineError where no engine can run it."""
    check_chart(scene)
    if scene.drive is None:
        window = impact_window(scene)
    elif scene.reconciliation is not None:
        window = driven_window(scene, scene.snapshot.position)
    else:
        window = driven_window(scene, _pressed(scene, folder, progress))
    window.check()
    return window


def check_chart(scene: Scene) -> None:
    """Raise ValueError naming the field of a scene that charts are not for: friction, a body force,
    an impact of restitution 1, or one in which nobody presses anybody."""
    if scene.contact.friction:
        raise ValueError(
            f"scene {scene.name}: contact.friction: {scene.contact.friction:g}; "
            "charts are for frictionless contacts"
        )
    if scene.body_force:
        raise ValueError(f"scene {scene.name}: body_force: charts are for scenes without")
    law_of(scene)
    if scene.drive is None:
        impact_window(scene).check()


def pressing(scene: Scene) -> Scene | None:
    """Make the run that presses a crowd together; None of one that is taken as it stands."""
    if scene.drive is None or scene.reconciliation is not None:
        return None
    return scene.with_run(duration_s=scene.analysis.time_s, frames=1, time_step_s=None)


def _pressed(scene: Scene, folder: Path, progress: Progress | None) -> Floats:
    present = next(iter(soft_engines()), None)
    if present is None:
        raise EngineError(
            "no engine: the crowd cannot be pressed together; see: percussions doctor"
        )
    file, key = folder / "start.npz", f"{scene.digest()} {installed(present)}"
    if found := kept(file, key):
        return np.asarray(found["position"])
    start = pressing(scene)
    assert start is not None
    record = run_engine(start, present, folder / "start", progress)
    end = snapshot_of(
        open_bodies(folder / "start" / "bodies.dump", record.time_step_s).trajectory[-1]
    )
    position = reconcile(end.position, end.radius, scene.wall_segments()).position
    keep(file, key, {"position": position})
    return position
