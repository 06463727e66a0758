"""Energy that drifts over many steps."""

from pathlib import Path

import numpy as np

from analysis.scene.scene import Run
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, GAIN, engine_cell
from analysis.stability.crowds import PERIOD_S, RADIUS_M, disks, rhombus, rhombus_walls, scene_of
from analysis.stability.frames import run_frames
from analysis.stability.trial import ENGINES
from nscd.arrays import Floats

STEPS = 100_000
SLIGHT = 0.01
ACROSS, SPACING_M, MARGIN_M = 3, 3.0 * RADIUS_M, 1.5 * RADIUS_M


def attempt(step: float, engine: str, folder: Path) -> Cell:
    """Run an elastic gas of disks in a closed rhombus for STEPS steps (in √(m/k))."""
    velocity = np.random.default_rng(2).normal(size=(ACROSS**2, 2))
    dt = step * PERIOD_S
    scene = scene_of(
        disks(rhombus(ACROSS, SPACING_M), velocity),
        Run(duration_s=STEPS * dt, frames=50, time_step_s=dt),
        walls=rhombus_walls(ACROSS, SPACING_M, MARGIN_M),
    )
    frames = run_frames(scene, engine, folder)
    drift = float(frames.energy[-1] / frames.energy[0] - 1) if len(frames.time) else float("nan")
    outside = 0
    if len(frames.time):
        outside = _outside(scene.walls[0].start_m, frames.position[-1])
    outcome, reason = Outcome.STABLE, f"energy {drift:+.2g} of the start after {STEPS} steps"
    if outside:
        outcome, reason = Outcome.LOST, f"{outside} disks are outside the walls"
    elif not abs(drift) <= SLIGHT:
        outcome = Outcome.ENERGY_GAIN if drift > GAIN else Outcome.INACCURATE
        reason = f"energy {drift:+.3g} of the start after {STEPS} steps"
    return engine_cell(frames, outcome, reason)


def _outside(corner: tuple[float, float], position: Floats) -> int:
    """Count the centres outside the rhombus that the walls bound."""
    side = SPACING_M * (ACROSS - 1) + 2 * MARGIN_M / np.sqrt(0.75)
    basis = np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]])
    shares = np.linalg.solve(basis, (position - np.array(corner)).T) / side
    return int(((shares < 0) | (shares > 1)).any(0).sum())


def case(quick: bool) -> Case:
    """Make the case."""
    full = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2)
    return Case(
        name="drift",
        columns=Axis("time step / √(m/k)", (0.02, 0.1, 0.5) if quick else full),
        rows=Axis("engine", ENGINES),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        values={"steps": STEPS},
    )
