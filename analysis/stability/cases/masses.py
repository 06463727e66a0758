"""Unequal masses: in the engines' collision of two disks, and in the solvers of percussions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.engines.penalty import damping_ratio_for, penalty_of, restitution_of
from analysis.stability import solver_cells
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import (
    MASS_KG,
    PERIOD_S,
    STIFFNESS_N_PER_M,
    line,
    rhombus,
    rhombus_walls,
    scene_of,
)
from analysis.stability.dense_reference import dense_percussions
from analysis.stability.motion import QUANTITIES, common_cell, read_motion
from analysis.stability.trial import try_engine
from nscd import find_contacts, solve

# How far the restitution may be from the one asked.
OFF = 0.01
# Of the rule's time step, so that it does not add an error to the restitution.
FRACTION = 0.02
ACROSS = 5


def pair_attempt(ratio: float, row: str, folder: Path) -> Cell:
    """A heavy disk hits a light one, `ratio` times lighter, with the engine and restitution of the
    row ("lammps, e = 1"): the restitution obtained, −(u₂ − u₁)⁺/(u₂ − u₁)⁻, against the one
    asked."""
    engine, asked = row.split(", e = ")
    restitution = float(asked.split()[0])
    mass = np.array([MASS_KG, MASS_KG / ratio])
    contact = 4 * np.pi * float(np.sqrt(mass.prod() / mass.sum() / STIFFNESS_N_PER_M))
    scene = scene_of(
        line(2),
        [[1.0, 0.0], [0.0, 0.0]],
        mass=mass,
        restitution=restitution,
        duration=contact,
    )
    # the rule's step makes an error of the restitution of its own; the heavy disk's rule is for
    # that disk alone
    step = 0.1 * PERIOD_S if "heavy" in row else FRACTION * penalty_of(scene).safe_time_step
    scene = scene.with_run(time_step_s=step, duration_s=max(contact, 20 * step))
    trial = try_engine(scene, engine, folder / row.replace(" ", "") / f"{ratio:.9g}")
    motion = read_motion(trial, scene)
    along = motion.velocity[-1, :, 0]
    obtained = float(along[1] - along[0])
    if motion.gain > 1.05:
        outcome, reason = Outcome.ENERGY_GAIN, f"{motion.gain:.3g} times the energy of the start"
    elif abs(obtained - restitution) > OFF:
        outcome, reason = (
            Outcome.INACCURATE,
            f"restitution {obtained:.3g} instead of {restitution:g}",
        )
    else:
        outcome, reason = Outcome.STABLE, f"restitution {obtained:.3g}"
    return common_cell(ratio, row, trial, motion, outcome, reason)


def pair_theory(row: str) -> float:
    """The mass ratio at which the dashpot of the heaviest pair makes the restitution OFF too small:
    ζ√((1+R)/2)."""
    asked = float(row.split(", e = ")[1].split()[0])
    if asked == 1 or "heavy" in row:
        return float("nan")
    ratio = damping_ratio_for(asked)
    return float(
        brentq(
            lambda R: restitution_of(ratio * np.sqrt((1 + R) / 2)) - (asked - OFF),
            1.0,
            1e6,
            xtol=1e-12,
        )
    )


def solver_attempt(ratio: float, row: str, folder: Path) -> Cell:
    """Percussions of a rhombus of alternating masses in a corner by the solver of the row, against
    dense NNLS."""
    n = ACROSS**2
    light = (np.arange(n) + np.arange(n) // ACROSS) % 2 == 0
    mass = MASS_KG * np.where(light, 1 / ratio, 1.0)
    left = np.random.default_rng(1).normal(size=(n, 2))
    walls = [wall for wall in rhombus_walls(ACROSS) if wall.name in ("low", "left")]
    scene = scene_of(rhombus(ACROSS), left, mass=mass, walls=walls, duration=1.0)
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)
    _, reference = dense_percussions(scene.snapshot, contacts, left)
    answer = solve(scene.snapshot, contacts, solver=row)
    return solver_cells.solver_cell(ratio, row, answer, reference, float(np.abs(left).max()))


def mass_ratio_engines(quick: bool) -> Case:
    """Mass ratios in the engines."""
    rows = ["lammps, e = 1", "lammps, e = 0.5", "lammps, e = 1 (heavy's step)"]
    if not quick:
        rows += ["yade, e = 1", "yade, e = 0.5"]
    return Case(
        name="mass_ratio_engines",
        title="Mass ratio in the engines",
        fails="penalty engines: the restitution asked for is not obtained; a time step for the heavy disk heats the light one",
        columns=Axis(
            label="heavy mass / light mass",
            values=(1.0, 1.5, 1e2, 1e6)
            if quick
            else (1.0, 2.0, 5.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6),
        ),
        rows=Axis(label="engine, asked restitution", values=tuple(rows)),
        quantities=QUANTITIES,
        attempt=pair_attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=pair_theory,
        edge=f"restitution {OFF:g} too small: ζ√((1+R)/2) instead of ζ",
        words=(
            "A heavy disk hits a light one that is at rest. One dashpot serves all contacts and has the asked restitution "
            "at the heaviest pair; lighter pairs are damped more, which the record of a run states. Elastic contacts have "
            "no dashpot and work at every ratio with the time step of the lightest disk; with that of the heavy one a contact "
            "lasts a few steps or one, and its energy depends on where they fall.",
        ),
    )


def mass_ratio_solvers(quick: bool) -> Case:
    """Mass ratios in the solvers of percussions."""
    ratios = (1.0, 1e3, 1e6) if quick else (1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6)
    return Case(
        name="mass_ratio_solvers",
        title="Mass ratio in the percussions",
        fails="solvers: sweeps grow with the ratio until the limit of sweeps ends them; active sets cycle",
        columns=Axis(label="heavy mass / light mass", values=ratios),
        rows=Axis(label="solver", values=solver_cells.SOLVERS),
        quantities=solver_cells.QUANTITIES,
        attempt=solver_attempt,
        fails_as=(Outcome.NOT_CONVERGED,),
        words=(
            f"{ACROSS} × {ACROSS} disks of alternating masses on the triangular lattice, in a corner of two walls, with "
            "random left velocities; u⁺ against dense non-negative least squares.",
        ),
    )
