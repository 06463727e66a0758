"""A push that soft contacts pass on: when it reaches each disk, how fast, with which impulses."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.compare.comparison import Comparison, compare_run
from analysis.compare.statistics import statistics
from analysis.dumps import open_bodies
from analysis.engines.run import EngineRun
from analysis.paper.discrete.fig2_corridor.columns import first_arrivals
from analysis.paper.discrete.line_of_disks import impact_time
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd import ContactLaw
from nscd.arrays import Floats

# A disk is reached once it is this share of the push as fast.
REACHED = 0.01
# Columns before this one (counted from the pushing one) still feel how the push began.
FRONT_FROM = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Push:
    """One engine's run of a push.

    comparison: its impulses against the percussions
    arrival: (n,) s at each disk; 0 for those that push, NaN where it never arrives
    """

    comparison: Comparison
    arrival: Floats

    @property
    def engine(self) -> str:
        """The engine's name."""
        return self.comparison.record.engine

    @property
    def stiffness(self) -> float:
        """k of its contacts (N/m)."""
        return self.comparison.scene.contact.stiffness_N_per_m

    @property
    def restitution(self) -> float:
        """e asked of its contacts."""
        return self.comparison.scene.contact.restitution

    @property
    def damping(self) -> float:
        """Damping ratio ζ of its contacts."""
        return self.comparison.record.damping_ratio

    @cached_property
    def numbers(self) -> dict[str, float | int]:
        """Its impulses against the percussions, in numbers."""
        return statistics(self.comparison)

    @property
    def difference(self) -> float:
        """rms(∫f dt − p) / rms(∫f dt)."""
        return float(self.numbers["contact_relative_difference"])

    @property
    def first_arrivals(self) -> tuple[Floats, Floats]:
        """Each column's x (m) and the earliest arrival in it (s)."""
        return first_arrivals(self.comparison.snapshot.position[:, 0], self.arrival)

    @property
    def speed(self) -> float:
        """Speed of the front (m/s): slope of distance against the first arrival in each column; NaN
        for fewer than 3."""
        x, first = self.first_arrivals
        known = np.isfinite(first)
        known[:FRONT_FROM] = False
        if known.sum() < 3:
            return float("nan")
        return float(1 / np.polyfit(x[known], first[known], 1)[0])


def push_scene(
    scene: Scene, stiffness: float, restitution: float, periods: float, frames: int
) -> Scene:
    """Make the scene with another stiffness (N/m) and restitution, run for `periods` times
    √(m/k)."""
    variant = scene.model_copy(update={"name": f"{scene.name}_e{restitution:g}"})
    variant = variant.with_contact(stiffness_N_per_m=stiffness, restitution=restitution)
    return variant.with_run(
        duration_s=periods * impact_time(variant), frames=frames, time_step_s=None
    )


def run_push(run: EngineRun, progress: Progress | None = None) -> Push:
    """Read what an engine's run of the push shows. Raises EngineError for an engine that is missing
    or fails."""
    scene, record = run.scene, run.record(progress)
    trajectory = open_bodies(run.folder / "bodies.dump", record.time_step_s).trajectory
    times, speeds = [], []
    for frame in trajectory:
        times.append(float(frame.time))
        speeds.append(np.hypot(frame.data["vx"], frame.data["vy"]))
    pushing = float(np.hypot(*scene.snapshot.velocity.T).max())
    arrival = crossing_times(np.array(times), np.array(speeds), REACHED * pushing)
    # the paper's percussions are inelastic, whatever the soft contacts are
    return Push(comparison=compare_run(run.folder, law=ContactLaw()), arrival=arrival)


def crossing_times(times: Floats, values: Floats, level: float) -> Floats:
    """Find when each column of values (frames, n) first reaches the level (s), linear between
    frames; NaN where never."""
    above = values >= level
    crossing = np.full(values.shape[1], np.nan)
    for column in np.flatnonzero(above.any(0)):
        frame = int(np.argmax(above[:, column]))
        if frame == 0:
            crossing[column] = times[0]
            continue
        before, after = values[frame - 1 : frame + 1, column]
        share = (level - before) / (after - before)
        crossing[column] = times[frame - 1] + share * (times[frame] - times[frame - 1])
    return crossing
