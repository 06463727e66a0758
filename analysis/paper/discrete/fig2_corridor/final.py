"""The corridor some time after the push: where everybody is, as rigid and as soft disks."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.engines.run import EngineRun
from analysis.pages.names import ENGINE_NAMES
from analysis.paper.discrete.engine_runs import end_of
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd.arrays import Flags, Floats
from nscd.stepping import Motion

# s: the push has gone through the corridor several times
TIME_S = 1.0
STEP_S = 1e-3
STIFFNESS, RESTITUTION = 1e6, 0.01  # N/m and –, of the soft disks
# Who is displaced less has not moved.
MOVED_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Final:
    """Positions (n,2) m at the end, and who was at rest before the push (n,)."""

    model: str
    start: Floats
    position: Floats
    resting: Flags

    @property
    def displaced(self) -> Floats:
        """How far each of those who were at rest is displaced (m)."""
        distance: Floats = np.hypot(*(self.position - self.start)[self.resting].T)
        return distance

    @property
    def moved(self) -> int:
        """How many of those who were at rest are displaced."""
        return int((self.displaced > MOVED_M).sum())


def rigid_final(scene: Scene) -> Final:
    """Step the push with rigid, inelastic disks."""
    motion = Motion(scene.snapshot, scene.wall_segments(), step=STEP_S)
    for _ in range(round(TIME_S / STEP_S)):
        motion.advance()
    return _final("rigid disks, k = 0", scene, motion.position)


def final_run(scene: Scene, engine: str, runs: Path) -> EngineRun:
    """Name the run of the push with soft, strongly damped disks."""
    variant = scene.model_copy(update={"name": f"{scene.name}_final"})
    variant = variant.with_contact(stiffness_N_per_m=STIFFNESS, restitution=RESTITUTION)
    variant = variant.with_run(duration_s=TIME_S, frames=1, time_step_s=None)
    return EngineRun.of(variant, engine, runs)


def soft_final(run: EngineRun, progress: Progress | None) -> Final:
    """Read where an engine's run ends. Raises EngineError, DumpError."""
    return _final(ENGINE_NAMES[run.engine], run.scene, end_of(run, progress).position)


def _final(model: str, scene: Scene, position: Floats) -> Final:
    resting = np.hypot(*scene.snapshot.velocity.T) == 0
    return Final(model=model, start=scene.snapshot.position, position=position, resting=resting)
