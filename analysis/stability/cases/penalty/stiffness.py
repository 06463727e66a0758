"""Stiffness against load and time step."""

from math import ceil
from pathlib import Path

from analysis.scene.scene import ContactModel, Run
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, engine_cell
from analysis.stability.crowds import (
    FRAMES,
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    RELAXATION_S,
    WALKING_M_PER_S,
    critical_time_step,
    disks,
    end_walls,
    line,
    pressed_line,
    scene_of,
    walking_drive,
)
from analysis.stability.frames import run_frames

LINE, SHARE = 5, 0.01
RESTITUTION = 0.5
# How much more energy than the loaded contacts have at rest, Σ(jF)²/(2k), after eight times τ.
HOT = 0.01
FORCE_N = MASS_KG * WALKING_M_PER_S / RELAXATION_S


def attempt(ratio: float, step: float, folder: Path) -> Cell:
    """Drive LINE disks against a wall, k r = ratio times the drive of one, with a time step (s):
    the wall must carry the drive of all, with an overlap below SHARE of r."""
    stiffness = ratio * FORCE_N / RADIUS_M
    position = line(LINE)
    far = position[-1, 0] + RADIUS_M
    scene = scene_of(
        disks(position),
        Run(
            duration_s=FRAMES * step * ceil(max(4.0 / step, 4000.0) / FRAMES),
            frames=FRAMES,
            time_step_s=step,
            drive_interval_steps=1,
        ),
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=RESTITUTION),
        walls=end_walls(-4.0, far)[1:],
        drive=walking_drive(((far, -1e-3), (far, 1e-3))),
    )
    frames = run_frames(scene, "lammps", folder)
    static = 0.5 * FORCE_N**2 / stiffness * sum(j * j for j in range(1, LINE + 1))
    more = float(frames.energy[-5:].max() / static - 1) if len(frames.time) else float("nan")
    # soft contacts still swing slowly; energy in stiff ones beyond that of rest is made by the time
    # step
    if len(frames.time) and frames.overlap[-1] > SHARE and more < 1:
        outcome, reason = Outcome.INACCURATE, f"overlap {frames.overlap[-1]:.2g} r at rest"
    elif more > HOT:
        outcome, reason = Outcome.ENERGY_GAIN, f"{1 + more:.3g} times the energy of rest under load"
    else:
        outcome, reason = Outcome.STABLE, "at rest"
    return engine_cell(frames, outcome, reason)


def theory(step: float) -> float:
    """Compute k r/F at which the time step (s) is the critical one of the pressed line."""
    pressed = pressed_line(LINE, RESTITUTION)
    held = pressed.model_copy(update={"walls": pressed.walls[1:]})
    stiffness = MASS_KG * (critical_time_step(held) / PERIOD_S / step) ** 2
    return float(stiffness * RADIUS_M / FORCE_N)


def case(quick: bool) -> Case:
    """Make the case."""
    powers = range(2, 7) if quick else range(1, 9)
    return Case(
        name="stiffness",
        columns=Axis("stiffness ratio k·r / F", tuple(10.0**p for p in powers)),
        rows=Axis("time step (s), LAMMPS", (0.003,) if quick else (0.001, 0.003, 0.01)),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=theory,
        values={
            "line": LINE,
            "restitution": RESTITUTION,
            "force_n": FORCE_N,
            "softest": LINE / SHARE,
            "share": SHARE,
        },
    )
