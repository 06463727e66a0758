"""Time steps that are too long: against stiffness, packing and damping."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.scene.scene import Scene
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import (
    PERIOD_S,
    critical_time_step,
    kicked,
    pressed_line,
    pressed_rhombus,
)
from analysis.stability.motion import QUANTITIES, common_cell, read_motion
from analysis.stability.trial import try_engine

KICK = 1e-12  # kinetic over elastic energy at the start: dashpots that only push limit what grows, long after this
STEPS = 600
# With dashpots what is just unstable grows slowly.
DAMPED_STEPS = 5000
# Displacements so many times v√(m/k) of the kick are made by the time step: leapfrog's own swings
# just below the critical step are smaller. Energy shows less, since dashpots that only push keep
# what grows small.
GROWN = 100.0
PACKINGS = ("1 disk", "line of 10", "4 × 4", "12 × 12")
LATTICE = 2 / np.sqrt(6)


def packing(name: str, restitution: float) -> Scene:
    """One of the PACKINGS, pressed by walls and at rest."""
    if "×" in name:
        return pressed_rhombus(int(name.split()[0]), restitution)
    return pressed_line(1 if name == "1 disk" else int(name.split()[-1]), restitution)


def undamped_attempt(step: float, row: str, folder: Path) -> Cell:
    """Run the packing of a row ("4 × 4, lammps") at a time step (in √(m/k)) and see whether its
    energy grows."""
    name, engine = row.split(", ")
    return _attempt(packing(name, 1.0), engine, step, row, STEPS, folder)


def damped_attempt(step: float, row: float, folder: Path) -> Cell:
    """The same with LAMMPS for a 4 × 4 packing of the restitution `row`."""
    return _attempt(packing("4 × 4", row), "lammps", step, row, DAMPED_STEPS, folder)


def _attempt(
    scene: Scene, engine: str, step: float, row: float | str, steps: int, folder: Path
) -> Cell:
    dt = step * PERIOD_S
    scene = kicked(scene, KICK).with_run(time_step_s=dt, duration_s=steps * dt, frames=20)
    trial = try_engine(scene, engine, folder / f"{row}" / f"{step:.9g}")
    motion = read_motion(trial, scene)
    # an unstable mode alternates from step to step: at a frame its velocity may be 0, its
    # displacement is not
    kick = PERIOD_S * float(np.sqrt((scene.snapshot.velocity**2).mean()))
    away = motion.position - scene.snapshot.position
    grown = (
        float(np.sqrt((away**2).mean((1, 2))).max()) / kick if len(motion.time) else float("nan")
    )
    outcome = Outcome.ENERGY_GAIN if grown > GROWN else Outcome.STABLE
    reason = f"swings {grown:.3g} times the kick, {motion.gain:.4g} times the energy of the start"
    return common_cell(step, row, trial, motion, outcome, reason)


def undamped_theory(row: str) -> float:
    """2/ω_max of the row's packing, in √(m/k)."""
    return critical_time_step(packing(row.split(", ")[0], 1.0)) / PERIOD_S


def damped_theory(row: float) -> float:
    """Where leapfrog with dashpots becomes unstable on the 4 × 4 packing of that restitution, in
    √(m/k)."""
    return critical_time_step(packing("4 × 4", row)) / PERIOD_S


def time_step(quick: bool) -> Case:
    """Time steps above critical, without damping."""
    names = ("1 disk", "4 × 4") if quick else PACKINGS
    # YADE computes the same numbers and takes longer to start: two packings show it
    by_yade = ("4 × 4",) if quick else ("1 disk", "4 × 4")
    rows = (*(f"{name}, lammps" for name in names), *(f"{name}, yade" for name in by_yade))
    steps = (0.5, 0.75, 1.1, 1.6) if quick else (0.2, 0.4, 0.6, 0.75, 0.9, 1.1, 1.3, 1.6)
    return Case(
        name="time_step",
        title="Time step above critical",
        fails="penalty engines: energy from nothing, with exit status 0",
        columns=Axis(label="time step / √(m/k)", values=steps),
        rows=Axis(label="packing, engine", values=rows),
        quantities=QUANTITIES,
        attempt=undamped_attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=undamped_theory,
        edge="2/ω_max of the stiffness matrix of the packing",
        words=(
            f"Elastic disks, pressed by walls to an overlap of 0.1 % of r and hardly moving, {STEPS} steps. One disk "
            "between two walls becomes unstable at √2 √(m/k); the infinite triangular lattice would at "
            f"{LATTICE:.3f} √(m/k), and the packings approach that from above as they grow.",
        ),
    )


def damping(quick: bool) -> Case:
    """Time steps above critical, with damping."""
    return Case(
        name="damping",
        title="Damping shortens the critical time step",
        fails="penalty engines: a step that is safe for elastic disks heats damped ones",
        columns=Axis(
            label="time step / √(m/k)",
            values=(0.05, 0.2, 0.5, 1.0)
            if quick
            else (0.025, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9),
        ),
        rows=Axis(
            label="asked restitution (LAMMPS)",
            values=(1.0, 0.1) if quick else (1.0, 0.5, 0.2, 0.1, 0.01),
        ),
        quantities=QUANTITIES,
        attempt=damped_attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=damped_theory,
        edge="first Δ with Δ²K + 2ΔC − 4M singular",
        words=(
            f"The 4 × 4 packing with the dashpots of the asked restitution, {DAMPED_STEPS} steps. Dashpots that act with the "
            "velocity of half a step before are an explicit scheme of their own: strong ones need a time step far below "
            "2/ω_max. Just above the boundary damped swings grow slowly, by a share of the distance to it each step, so the "
            "measured boundary comes down to the theory as runs get longer.",
        ),
    )
