"""Time steps above critical, without damping."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.scene.scene import Scene
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, engine_cell
from analysis.stability.crowds import (
    FRAMES,
    PERIOD_S,
    critical_time_step,
    kicked,
    pressed_line,
    pressed_rhombus,
)
from analysis.stability.frames import run_frames

# Kinetic over elastic energy at the start: dashpots that only push limit what grows, long after
# this.
KICK = 1e-12
STEPS = 600
# Displacements so many times v√(m/k) of the kick are made by the time step: leapfrog's own swings
# just below the critical step are smaller. Energy shows less, since dashpots that only push keep
# what grows small.
GROWN = 100.0
LATTICE = 2 / np.sqrt(6)


@dataclass(frozen=True, slots=True)
class Packed:
    """A row: disks in a line or along each side of a rhombus, and the engine that runs them."""

    disks: int
    rhombus: bool
    engine: str

    def __str__(self) -> str:
        row = "1 disk" if self.disks == 1 else f"line of {self.disks}"
        return f"{f'{self.disks} × {self.disks}' if self.rhombus else row}, {self.engine}"

    def scene(self, restitution: float) -> Scene:
        """Make the packing, pressed by walls and at rest."""
        return (pressed_rhombus if self.rhombus else pressed_line)(self.disks, restitution)


def attempt(step: float, row: Packed, folder: Path) -> Cell:
    """Run the packing at a time step (in √(m/k)) and see whether its energy grows."""
    return swing(row.scene(1.0), row.engine, step, STEPS, folder)


def swing(scene: Scene, engine: str, step: float, steps: int, folder: Path) -> Cell:
    """Kick a packing that rests and see whether the time step (in √(m/k)) makes it swing."""
    dt = step * PERIOD_S
    scene = kicked(scene, KICK).with_run(time_step_s=dt, duration_s=steps * dt, frames=FRAMES)
    frames = run_frames(scene, engine, folder)
    # an unstable mode alternates from step to step: at a frame its velocity may be 0, its
    # displacement is not
    kick = PERIOD_S * float(np.sqrt((scene.snapshot.velocity**2).mean()))
    away = np.sqrt(((frames.position - scene.snapshot.position) ** 2).mean((1, 2)))
    grown = float(away.max()) / kick if len(frames.time) else float("nan")
    outcome = Outcome.ENERGY_GAIN if grown > GROWN else Outcome.STABLE
    reason = f"swings {grown:.3g} times the kick, {frames.gain:.4g} times the energy of the start"
    return engine_cell(frames, outcome, reason)


def theory(row: Packed) -> float:
    """Compute 2/ω_max of the row's packing, in √(m/k)."""
    return critical_time_step(row.scene(1.0)) / PERIOD_S


def case(quick: bool) -> Case:
    """Make the case."""
    packings = (
        ((1, False), (4, True)) if quick else ((1, False), (10, False), (4, True), (12, True))
    )
    # YADE computes the same numbers and takes longer to start: two packings show it
    by_yade = ((4, True),) if quick else ((1, False), (4, True))
    rows = [Packed(*packing, "lammps") for packing in packings]
    rows += [Packed(*packing, "yade") for packing in by_yade]
    steps = (0.5, 0.75, 1.1, 1.6) if quick else (0.2, 0.4, 0.6, 0.75, 0.9, 1.1, 1.3, 1.6)
    return Case(
        name="time_step",
        columns=Axis("time step / √(m/k)", steps),
        rows=Axis("packing, engine", tuple(rows)),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=theory,
        values={"steps": STEPS, "lattice": LATTICE},
    )
