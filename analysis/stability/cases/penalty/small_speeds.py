"""Zero and nearly zero velocities, in the engines and in the solvers of percussions."""

import dataclasses
from pathlib import Path

import numpy as np

from analysis.percussions.dense_reference import dense_percussions
from analysis.scene.scene import Run
from analysis.stability.case import Axis, By, Case, Cell, Outcome
from analysis.stability.cells import SOLVER_QUANTITIES, SOLVERS, engine_cell, solver_cell
from analysis.stability.crowds import (
    FRAMES,
    PERIOD_S,
    RADIUS_M,
    contacts_of,
    corner_walls,
    disks,
    line,
    rhombus,
    scene_of,
)
from analysis.stability.frames import run_frames
from nscd import solve

# How far the velocities of two elastic disks after their impact may be off, over the speed. Above
# the boundary that this gives, rounded steps still make errors of up to 5.9 %, here and there.
OFF = 0.1
ACROSS = 4


def attempt(speed: float, row: By | str, folder: Path) -> Cell:
    """Give velocities of the size `speed` (m/s) to a solver, or to an engine with a time step (in
    √(m/k)). The law of impact has no scale, so the answer must be that of 1 m/s times speed; in an
    engine two elastic disks must still exchange their velocities to OFF."""
    return _engine(speed, row, folder) if isinstance(row, By) else _solver(speed, row)


def _engine(speed: float, row: By, folder: Path) -> Cell:
    run = Run(duration_s=8 * PERIOD_S, frames=FRAMES, time_step_s=row.value * PERIOD_S)
    scene = scene_of(disks(line(2), [[speed, 0.0], [0.0, 0.0]]), run)
    frames = run_frames(scene, row.engine, folder)
    after = frames.velocity[-1, :, 0] if len(frames.velocity) else np.full(2, np.nan)
    error = float(np.abs(after - [0.0, speed]).max()) / (speed or 1.0)
    good = error <= OFF
    outcome = Outcome.STABLE if good else Outcome.INACCURATE
    word = "right" if good else "wrong"
    reason = f"velocities after the impact are {word} by {error:.2g} of the speed"
    cell = engine_cell(frames, outcome, reason)
    return dataclasses.replace(cell, numbers=(error, np.nan, np.nan))


def _solver(speed: float, solver: str) -> Cell:
    unit = np.random.default_rng(1).normal(size=(ACROSS**2, 2))
    snapshot = disks(rhombus(ACROSS), unit)
    contacts = contacts_of(snapshot, corner_walls(ACROSS))
    _, reference = dense_percussions(snapshot, contacts, unit)
    try:
        answer = solve(snapshot, contacts, left_velocity=speed * unit, solver=solver)
    except ArithmeticError as error:
        name = type(error).__name__
        return Cell(
            outcome=Outcome.NOT_CONVERGED,
            reason=f"ends with {name}: {error}",
            said=name,
            numbers=(float("nan"),) * len(SOLVER_QUANTITIES),
        )
    return solver_cell(answer, speed * reference, speed * float(np.abs(unit).max()))


def theory(row: By | str) -> float:
    """Compute for an engine the speed (ulp/Δt)(1 − √(2q/(1+q)))/(1 − q) below which the struck disk
    leaves too fast by q = OFF.

    The struck disk, at x = 2 r, stays where it is until its path in a step is half a unit in the
    last place of x, and then moves by a whole one, g(u) = ulp/Δt · round(uΔt/ulp). Momentum is
    exchanged rightly, the overlap changes by v − u − g(u) a second, and the contact ends at the u
    with ∫₀ᵘ (v − s − g(s)) ds = 0. NaN for solvers."""
    if not isinstance(row, By):
        return float("nan")
    unit = np.spacing(2 * RADIUS_M) / (row.value * PERIOD_S)
    return float(unit * (1 - np.sqrt(2 * OFF / (1 + OFF))) / (1 - OFF))


def case(quick: bool) -> Case:
    """Make the case."""
    full = (1.0, 1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-15, 1e-50, 1e-100, 1e-160, 1e-310, 0.0)
    engines = [By("lammps", "Δt", step) for step in ((0.01,) if quick else (0.001, 0.01, 0.1))]
    if not quick:
        engines.append(By("yade", "Δt", 0.01))
    return Case(
        name="small_speeds",
        columns=Axis("speed (m/s)", (1.0, 1e-8, 1e-11, 1e-13, 1e-100, 0.0) if quick else full),
        rows=Axis("solver; engine, time step (√(m/k))", (*SOLVERS, *engines)),
        quantities=SOLVER_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=theory,
    )
