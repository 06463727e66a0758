"""Crowds that start with disks inside one another."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.scene.scene import Scene
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import MASS_KG, RADIUS_M, STIFFNESS_N_PER_M, line, scene_of
from analysis.stability.motion import QUANTITIES, common_cell, read_motion, refused_cell, rigid_cell
from analysis.stability.trial import try_engine
from nscd import find_contacts, solve

WALKING_M_PER_S = 1.0
PRODUCT, RIGID = "percussions run", "percussions solve"


def overlapping_pair(overlap: float, stiffness: float) -> Scene:
    """Two disks at rest that overlap by overlap·r, for ten periods."""
    places = line(2, (2 - overlap) * RADIUS_M)
    period = (MASS_KG / stiffness) ** 0.5
    return scene_of(
        places, np.zeros((2, 2)), stiffness=stiffness, duration=10 * period, time_step=0.01 * period
    )


def overlap_attempt(overlap: float, row: str, folder: Path) -> Cell:
    """Let go of an overlapping pair by the row's engine and stiffness ("lammps, k = 1e+06"), or
    give it to the product."""
    if row in (PRODUCT, RIGID):
        scene = overlapping_pair(overlap, STIFFNESS_N_PER_M)
        try:
            if row == PRODUCT:
                scene.check("trial")
            contacts = find_contacts(scene.snapshot, tolerance=1e-6)
            answer = solve(scene.snapshot, contacts)
        except ValueError as error:
            return refused_cell(overlap, row, error)
        still = "at rest; the overlap stays, since percussions act on velocities"
        return rigid_cell(overlap, row, Outcome.STABLE, still, str(answer.status))
    engine, stiffness = row.split(", k = ")
    scene = overlapping_pair(overlap, float(stiffness))
    try:
        trial = try_engine(scene, engine, folder / row.replace(" ", "") / f"{overlap:.9g}")
    except ValueError as error:
        # centres that coincide: LAMMPS' deck needs the energy at the start
        return refused_cell(overlap, row, error)
    motion = read_motion(trial, scene)
    released = float(motion.kinetic.max()) if len(motion.kinetic) else float("nan")
    walking = MASS_KG * WALKING_M_PER_S**2
    share = released / walking
    if share > 1:
        outcome, reason = (
            Outcome.ENERGY_GAIN,
            f"{released:.3g} J from rest, {share:.3g} times that of walking",
        )
    elif share > 0.01:
        outcome, reason = (
            Outcome.INACCURATE,
            f"{released:.3g} J from rest, {share:.2g} of that of walking",
        )
    elif overlap >= 2 and share < 0.01:
        outcome, reason = (
            Outcome.INACCURATE,
            "one disk inside the other, and nothing pushes them apart",
        )
    else:
        outcome, reason = Outcome.STABLE, f"{released:.2g} J from rest"
    return common_cell(overlap, row, trial, motion, outcome, reason)


def overlap_theory(row: str) -> float:
    """The overlap over r whose ½kδ² is the kinetic energy of two who walk."""
    if row in (PRODUCT, RIGID):
        return float("nan")
    stiffness = float(row.split(", k = ")[1])
    return float(WALKING_M_PER_S * (2 * MASS_KG / stiffness) ** 0.5 / RADIUS_M)


def initial_overlap(quick: bool) -> Case:
    """Overlaps at the start."""
    rows = ["lammps, k = 1e+06", "yade, k = 1e+06", PRODUCT, RIGID]
    if not quick:
        rows = ["lammps, k = 1e+04", "lammps, k = 1e+05", *rows]
    shares = (1e-3, 3e-2, 0.1, 2.0) if quick else (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 1.9, 2.0)
    return Case(
        name="initial_overlap",
        title="Overlap at the start",
        fails="penalty engines: the overlap is a loaded spring; one disk inside another may never be pushed out",
        columns=Axis(label="overlap / r", values=shares),
        rows=Axis(label="who is given it", values=tuple(rows)),
        quantities=QUANTITIES,
        attempt=overlap_attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=overlap_theory,
        edge="½kδ² = kinetic energy of two who walk at 1 m/s",
        words=(
            "Two disks at rest. An overlap δ sets ½kδ² free: counted as energy gain where that is more than two people "
            "have who walk at 1 m/s, and as inaccurate above a hundredth of it. At 2 r the centres coincide. `percussions "
            "run` refuses overlaps above 10^(-6) of a radius, and `percussions import` reconciles them first; "
            "percussions themselves act on velocities, so an overlap stays as it is.",
        ),
    )
