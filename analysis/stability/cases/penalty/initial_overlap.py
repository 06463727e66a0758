"""Crowds that start with disks inside one another."""

from pathlib import Path

from analysis.scene.scene import ContactModel, Run, Scene
from analysis.stability.case import Axis, By, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, engine_cell, refused_cell, rigid_cell
from analysis.stability.crowds import (
    FRAMES,
    MASS_KG,
    RADIUS_M,
    STIFFNESS_N_PER_M,
    WALKING_M_PER_S,
    contacts_of,
    disks,
    line,
    scene_of,
)
from analysis.stability.frames import run_frames
from nscd import solve

PRODUCT, RIGID = "percussions run", "percussions solve"
# Of the energy of two who walk: less than this is no error.
SLIGHT = 0.01


def overlapping_pair(overlap: float, stiffness: float) -> Scene:
    """Make two disks at rest that overlap by overlap·r, for ten periods."""
    period = (MASS_KG / stiffness) ** 0.5
    return scene_of(
        disks(line(2, (2 - overlap) * RADIUS_M)),
        Run(duration_s=10 * period, frames=FRAMES, time_step_s=0.01 * period),
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=1.0),
    )


def attempt(overlap: float, row: By | str, folder: Path) -> Cell:
    """Let go of an overlapping pair by the row's engine and stiffness, or give it to the
    product."""
    if not isinstance(row, By):
        return _by_the_product(overlap, row)
    scene = overlapping_pair(overlap, row.value)
    try:
        frames = run_frames(scene, row.engine, folder)
    except ValueError as error:
        # centres that coincide: LAMMPS' deck needs the energy at the start
        return refused_cell(error)
    released = float(frames.kinetic.max()) if len(frames.kinetic) else float("nan")
    share = released / (MASS_KG * WALKING_M_PER_S**2)
    outcome, reason = Outcome.STABLE, f"{released:.2g} J from rest"
    if share > 1:
        outcome = Outcome.ENERGY_GAIN
        reason = f"{released:.3g} J from rest, {share:.3g} times that of walking"
    elif share > SLIGHT:
        outcome = Outcome.INACCURATE
        reason = f"{released:.3g} J from rest, {share:.2g} of that of walking"
    elif overlap >= 2 and share < SLIGHT:
        outcome = Outcome.INACCURATE
        reason = "one disk inside the other, and nothing pushes them apart"
    return engine_cell(frames, outcome, reason)


def _by_the_product(overlap: float, row: str) -> Cell:
    scene = overlapping_pair(overlap, STIFFNESS_N_PER_M)
    try:
        if row == PRODUCT:
            scene.check("trial")
        answer = solve(scene.snapshot, contacts_of(scene.snapshot))
    except ValueError as error:
        return refused_cell(error)
    still = "at rest; the overlap stays, since percussions act on velocities"
    return rigid_cell(Outcome.STABLE, still, str(answer.status))


def theory(row: By | str) -> float:
    """Compute the overlap over r whose ½kδ² is the kinetic energy of two who walk."""
    if not isinstance(row, By):
        return float("nan")
    return float(WALKING_M_PER_S * (2 * MASS_KG / row.value) ** 0.5 / RADIUS_M)


def case(quick: bool) -> Case:
    """Make the case."""
    soft = () if quick else (By("lammps", "k", 1e4), By("lammps", "k", 1e5))
    rows = (*soft, By("lammps", "k", 1e6), By("yade", "k", 1e6), PRODUCT, RIGID)
    full = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 1.9, 2.0)
    return Case(
        name="initial_overlap",
        columns=Axis("overlap / r", (1e-3, 3e-2, 0.1, 2.0) if quick else full),
        rows=Axis("who is given it", rows),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=theory,
    )
