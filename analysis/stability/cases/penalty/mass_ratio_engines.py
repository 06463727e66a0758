"""Mass ratios in the engines' collision of two disks."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.engines.penalty import damping_ratio_for, penalty_of, restitution_of
from analysis.scene.scene import ContactModel, Run
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, GAIN, engine_cell
from analysis.stability.crowds import (
    FRAMES,
    MASS_KG,
    PERIOD_S,
    STIFFNESS_N_PER_M,
    disks,
    line,
    scene_of,
)
from analysis.stability.frames import run_frames

# How far the restitution may be from the one asked.
OFF = 0.01
# Of the rule's time step, so that it does not add an error to the restitution.
FRACTION = 0.02
# Of √(m/k) of the heavy disk: the rule's time step for that disk alone.
HEAVY_STEP = 0.1


@dataclass(frozen=True, slots=True)
class Collision:
    """A row: engine, asked restitution, and whether the time step is that of the heavy disk."""

    engine: str
    restitution: float
    heavy_step: bool = False

    def __str__(self) -> str:
        return f"{self.engine}, e = {self.restitution:g}{' (heavy’s step)' * self.heavy_step}"


def attempt(ratio: float, row: Collision, folder: Path) -> Cell:
    """Let a heavy disk hit a light one, `ratio` times lighter: the restitution obtained,
    −(u₂ − u₁)⁺/(u₂ − u₁)⁻, against the one asked."""
    mass = np.array([MASS_KG, MASS_KG / ratio])
    lasts = 4 * np.pi * float(np.sqrt(mass.prod() / mass.sum() / STIFFNESS_N_PER_M))
    scene = scene_of(
        disks(line(2), [[1.0, 0.0], [0.0, 0.0]], mass),
        Run(duration_s=lasts, frames=FRAMES),
        contact=ContactModel(stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=row.restitution),
    )
    safe = FRACTION * penalty_of(scene).safe_time_step
    step = HEAVY_STEP * PERIOD_S if row.heavy_step else safe
    scene = scene.with_run(time_step_s=step, duration_s=max(lasts, 20 * step))
    frames = run_frames(scene, row.engine, folder)
    along = frames.velocity[-1, :, 0]
    obtained = float(along[1] - along[0])
    outcome, reason = Outcome.STABLE, f"restitution {obtained:.3g}"
    if frames.gain > 1 + GAIN:
        outcome, reason = Outcome.ENERGY_GAIN, f"{frames.gain:.3g} times the energy of the start"
    elif abs(obtained - row.restitution) > OFF:
        outcome, reason = Outcome.INACCURATE, f"{reason} instead of {row.restitution:g}"
    return engine_cell(frames, outcome, reason)


def theory(row: Collision) -> float:
    """Compute the mass ratio R at which the dashpot of the heaviest pair makes the restitution OFF
    too small: ζ√((1+R)/2)."""
    if row.restitution == 1 or row.heavy_step:
        return float("nan")
    damping = damping_ratio_for(row.restitution)

    def missed(ratio: float) -> float:
        return restitution_of(damping * np.sqrt((1 + ratio) / 2)) - (row.restitution - OFF)

    return float(brentq(missed, 1.0, 1e6, xtol=1e-12))


def case(quick: bool) -> Case:
    """Make the case."""
    rows = [Collision("lammps", 1.0), Collision("lammps", 0.5), Collision("lammps", 1.0, True)]
    if not quick:
        rows += [Collision("yade", 1.0), Collision("yade", 0.5)]
    full = (1.0, 2.0, 5.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6)
    return Case(
        name="mass_ratio_engines",
        columns=Axis("heavy mass / light mass", (1.0, 1.5, 1e2, 1e6) if quick else full),
        rows=Axis("engine, asked restitution", tuple(rows)),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=theory,
        values={"off": OFF},
    )
