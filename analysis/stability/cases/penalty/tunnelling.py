"""Disks too fast for a wall."""

from pathlib import Path

import numpy as np

from analysis.scene.scene import Run
from analysis.stability.case import Axis, By, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, GAIN, engine_cell
from analysis.stability.crowds import PERIOD_S, RADIUS_M, disks, end_walls, scene_of
from analysis.stability.frames import run_frames


def attempt(speed: float, row: By, folder: Path) -> Cell:
    """Let a disk run into a wall, with speed·r√(k/m) and the row's engine and time step (in
    √(m/k))."""
    velocity = speed * RADIUS_M / PERIOD_S
    steps, dt = int(np.ceil(8 / row.value)), row.value * PERIOD_S
    scene = scene_of(
        disks([[0.0, 0.0]], [[velocity, 0.0]]),
        Run(duration_s=steps * dt, frames=min(steps, 40), time_step_s=dt),
        walls=end_walls(-RADIUS_M - 20 * velocity * PERIOD_S, RADIUS_M)[1:],
    )
    frames = run_frames(scene, row.engine, folder)
    if len(frames.position) and float(frames.position[:, 0, 0].max()) > RADIUS_M:
        return engine_cell(frames, Outcome.LOST, "the disk is behind the wall")
    # in mid-contact a long step's energy swings by Δ²/4 without growing: the end counts
    left = float(frames.energy[-1] / frames.energy[0]) if len(frames.time) else float("nan")
    outcome = Outcome.ENERGY_GAIN if left > 1 + GAIN else Outcome.STABLE
    return engine_cell(frames, outcome, f"bounces with {left:.4g} times its energy")


def theory(row: By) -> float:
    """Compute the speed, over r√(k/m), at which the centre reaches the wall in leapfrog:
    x_n = vΔ sin(nθ)/sin θ, cos θ = 1 − Δ²/2 with Δ the step over √(m/k); 1 for short steps
    (½mv² = ½kr²)."""
    angle = float(np.arccos(1 - row.value**2 / 2))
    n = np.arange(1, int(np.pi / angle) + 2)
    return float(np.sin(angle) / (row.value * np.sin(n * angle).max()))


def case(quick: bool) -> Case:
    """Make the case."""
    rows = [
        By("lammps", "Δt", step) for step in ((0.1, 1.0) if quick else (0.01, 0.1, 0.5, 1.0, 1.5))
    ]
    if not quick:
        rows.append(By("yade", "Δt", 0.1))
    full = (0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 1.1, 1.3, 2.0)
    return Case(
        name="tunnelling",
        columns=Axis("speed / (r √(k/m))", (0.5, 0.9, 1.3) if quick else full),
        rows=Axis("engine, time step (√(m/k))", tuple(rows)),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.LOST,),
        theory=theory,
    )
