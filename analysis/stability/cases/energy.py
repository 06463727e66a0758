"""Energy that grows or drifts: restitution toward 1, contacts that open while they dissipate, long
runs."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.stability import solver_cells
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import (
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    line,
    rhombus,
    rhombus_walls,
    scene_of,
)
from analysis.stability.dense_reference import exact_line
from analysis.stability.motion import GAIN, QUANTITIES, common_cell, read_motion
from analysis.stability.trial import try_engine
from nscd import ContactLaw, find_contacts, solve

DISKS = 6
SOLVERS_WITH_DISSIPATION = ("auto", "interior_point", "active_set")


def restitution_attempt(below: float, row: str, folder: Path) -> Cell:
    """The first of DISKS in a line runs into the others with e = 1 − below, by the solver of the
    row, against the answer in exact arithmetic for the same k."""
    speed = [1.0] + [0.0] * (DISKS - 1)
    scene = scene_of(line(DISKS), np.column_stack([speed, np.zeros(DISKS)]), duration=1.0)
    contacts = find_contacts(scene.snapshot, tolerance=1e-6)
    law = ContactLaw(restitution=1 - below)
    k = law.coefficients(contacts.inverse_mass(scene.snapshot.mass))[0]
    exact, _ = exact_line(
        [int(MASS_KG)] * DISKS, [Fraction(v) for v in speed], [Fraction(float(c)) for c in k]
    )
    reference = np.column_stack([[float(u) for u in exact], np.zeros(DISKS)])
    answer = solve(scene.snapshot, contacts, law=law, solver=row)
    return solver_cells.solver_cell(below, row, answer, reference, 1.0)


def restitution(quick: bool) -> Case:
    """Restitution toward 1."""
    return Case(
        name="restitution",
        title="Restitution toward 1 with many contacts",
        fails="percussions: k = m_eff(1+e)/(1−e) grows without bound, and with it what rounding makes of u⁺",
        columns=Axis(
            label="1 − e",
            values=(1e-2, 1e-8, 1e-15)
            if quick
            else (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15),
        ),
        rows=Axis(label="solver", values=SOLVERS_WITH_DISSIPATION),
        quantities=solver_cells.QUANTITIES,
        attempt=restitution_attempt,
        fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
        words=(
            f"{DISKS} touching disks in a line; the first one moves. The reference is the same law in exact (rational) "
            "arithmetic. k D(u⁺+u⁻) is then huge times tiny: each digit that 1 − e gets smaller is one that the answer loses. "
            "The momentum balance of the answer, recomputed from u⁻, says so. e = 1 itself is refused: k would be infinite.",
        ),
    )


def opening_attempt(opening: float, dissipation: float, folder: Path) -> Cell:
    """Three touching disks: the first runs at 1 m/s into the second, at rest, and the third leaves
    it at `opening` m/s; k = dissipation · m at both contacts."""
    scene = scene_of(line(3), [[1.0, 0.0], [0.0, 0.0], [opening, 0.0]], duration=1.0)
    contacts = find_contacts(scene.snapshot, tolerance=1e-6)
    law = ContactLaw(dissipation=dissipation * MASS_KG, tangential_dissipation=0.0)
    answer = solve(scene.snapshot, contacts, law=law)
    exact, change = exact_energy(opening, dissipation)
    reference = np.column_stack([exact, np.zeros(3)])
    cell = solver_cells.solver_cell(opening, dissipation, answer, reference, max(1.0, opening))
    before = 0.5 * MASS_KG * (1 + opening**2)
    outcome, reason = cell.outcome, cell.reason
    if outcome is Outcome.STABLE and answer.energy_change > 1e-9 * before:
        outcome = Outcome.ENERGY_GAIN
        reason = f"energy {answer.energy_change / before:+.3g} of the start; exact {change / before:+.3g}"
    return Cell(
        column=opening,
        row=dissipation,
        outcome=outcome,
        reason=reason,
        said=str(answer.status),
        numbers=(*cell.numbers, answer.energy_change / before, float(len(answer.warnings))),
    )


def exact_energy(opening: float, dissipation: float) -> tuple[list[float], float]:
    """u⁺ (3) m/s and the change of energy (J) of `opening_attempt`, in exact arithmetic."""
    speed = [Fraction(1), Fraction(0), Fraction(opening)]
    after, change = exact_line(
        [int(MASS_KG)] * 3, speed, [Fraction(dissipation) * int(MASS_KG)] * 2
    )
    return [float(u) for u in after], float(change)


def opening_theory(dissipation: float) -> float:
    """The opening speed at which the exact change of energy changes its sign (m/s); NaN where it
    does not below 2."""
    speeds = np.geomspace(0.004, 2.0, 100)
    changes = [exact_energy(float(s), dissipation)[1] for s in speeds]
    for a, b, before, after in zip(speeds, speeds[1:], changes, changes[1:], strict=False):
        if (before > 0) != (after > 0):
            return float(brentq(lambda s: exact_energy(float(s), dissipation)[1], a, b, xtol=1e-12))
    return float("nan")


def opening_contacts(quick: bool) -> Case:
    """Contacts that open while k > 0 acts on them."""
    return Case(
        name="opening_contacts",
        title="k > 0 on contacts that are already opening",
        fails="the paper's law itself: k D(u⁺+u⁻) and λ on a contact that opens can add energy",
        columns=Axis(
            label="speed with which the second contact opens (m/s)",
            values=(0.02, 0.3, 0.7, 1.5)
            if quick
            else (0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5),
        ),
        rows=Axis(
            label="k / m",
            values=(1.0, 10.0, 50.0)
            if quick
            else (0.1, 1.0, 3.0, 6.0, 8.0, 12.0, 20.0, 50.0, 200.0),
        ),
        quantities=(*solver_cells.QUANTITIES, "change of energy / energy", "warnings"),
        attempt=opening_attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=opening_theory,
        edge="sign of the energy's change in exact arithmetic",
        words=(
            "Three equal disks; the first runs at 1 m/s into the second while the third leaves it. The law is solved "
            "rightly (status `solved`), and yet the crowd may have more energy than before: the answer says so in a warning.",
        ),
    )


STEPS = 100_000
SLIGHT = 0.01


def drift_attempt(step: float, row: str, folder: Path) -> Cell:
    """An elastic gas of disks in a closed rhombus for STEPS steps (in √(m/k)) by the engine of the
    row."""
    across, spacing = 3, 3.0 * RADIUS_M
    velocity = np.random.default_rng(2).normal(size=(across**2, 2))
    dt = step * PERIOD_S
    scene = scene_of(
        rhombus(across, spacing),
        velocity,
        walls=rhombus_walls(across, spacing, 1.5 * RADIUS_M),
        duration=STEPS * dt,
        frames=50,
        time_step=dt,
    )
    trial = try_engine(scene, row, folder / row / f"{step:.9g}")
    motion = read_motion(trial, scene)
    drift = float(motion.energy[-1] / motion.energy[0] - 1) if len(motion.time) else float("nan")
    outside = len(motion.time) and _outside(
        scene.walls[0].start_m, across, spacing, motion.position[-1]
    )
    if outside:
        outcome, reason = Outcome.LOST, f"{outside} disks are outside the walls"
    elif drift > GAIN:
        outcome, reason = (
            Outcome.ENERGY_GAIN,
            f"energy {drift:+.3g} of the start after {STEPS} steps",
        )
    elif abs(drift) > SLIGHT:
        outcome, reason = (
            Outcome.INACCURATE,
            f"energy {drift:+.3g} of the start after {STEPS} steps",
        )
    else:
        outcome, reason = Outcome.STABLE, f"energy {drift:+.2g} of the start after {STEPS} steps"
    return common_cell(step, row, trial, motion, outcome, reason)


def _outside(corner: tuple[float, float], across: int, spacing: float, position: np.ndarray) -> int:
    """How many centres are outside the rhombus that the walls bound."""
    side = spacing * (across - 1) + 2 * 1.5 * RADIUS_M / np.sqrt(0.75)
    basis = np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]])
    shares = np.linalg.solve(basis, (position - np.array(corner)).T) / side
    return int(((shares < 0) | (shares > 1)).any(0).sum())


def drift(quick: bool) -> Case:
    """Drift over many steps."""
    return Case(
        name="drift",
        title=f"Drift over {STEPS} steps",
        fails="penalty engines: contacts that begin and end between two steps add a little energy each time",
        columns=Axis(
            label="time step / √(m/k)",
            values=(0.02, 0.1, 0.5) if quick else (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2),
        ),
        rows=Axis(label="engine", values=("lammps", "yade")),
        quantities=QUANTITIES,
        attempt=drift_attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        words=(
            "Nine elastic disks bounce in a closed rhombus. Each collision has its own small error of energy, of either "
            f"sign; after {STEPS} steps they have added up. Stable: within 1 %; energy gain: above 5 %.",
        ),
    )
