"""Doors narrower than a disk."""

from pathlib import Path

import numpy as np

from analysis.scene.scene import ContactModel, Run, Scene, Wall
from analysis.stability.case import Axis, By, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, engine_cell, rigid_cell
from analysis.stability.crowds import (
    MASS_KG,
    RADIUS_M,
    RELAXATION_S,
    WALKING_M_PER_S,
    disks,
    scene_of,
    walking_drive,
)
from analysis.stability.frames import run_frames
from nscd import find_contacts, solve

RIGID = "percussions solve"
# How long a disk may take in a door: near the boundary it creeps, for a time that grows without
# bound.
LONGEST_S, LONGEST_PERIODS = 6.0, 250.0
# How far a disk stands from the posts at the start, in r.
APART = 1e-3


def door_scene(width: float, load: float) -> Scene:
    """Make a disk that walks out of a door of width·2r, pressed to its posts: stiffness such that
    the drive is load·k·r."""
    half, far = width * RADIUS_M, 8 * RADIUS_M
    stiffness = MASS_KG * WALKING_M_PER_S / RELAXATION_S / (load * RADIUS_M)
    behind = np.sqrt(max(RADIUS_M**2 - half**2, 0.0))
    period = (MASS_KG / stiffness) ** 0.5
    return scene_of(
        disks([[-behind - APART * RADIUS_M, 0.0]]),
        Run(duration_s=max(LONGEST_S, LONGEST_PERIODS * period), frames=40),
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=0.01),
        walls=[
            Wall(name="lower", start_m=(0.0, -far), end_m=(0.0, -half)),
            Wall(name="upper", start_m=(0.0, half), end_m=(0.0, far)),
        ],
        drive=walking_drive(((0.0, -half), (0.0, half))),
    )


def attempt(width: float, row: By | str, folder: Path) -> Cell:
    """Put a disk before a door of width·2r, with the row's engine and drive (over k·r), or as a
    rigid one."""
    if not isinstance(row, By):
        return _rigid(width)
    scene = door_scene(width, row.value)
    frames = run_frames(scene, row.engine, folder)
    through = bool(len(frames.position)) and float(frames.position[-1, 0, 0]) > RADIUS_M
    if through and width < 1:
        reason = "squeezed through a door narrower than itself"
        return engine_cell(frames, Outcome.LOST, reason)
    return engine_cell(frames, Outcome.STABLE, "walks through" if through else "is held")


def _rigid(width: float) -> Cell:
    scene = door_scene(width, 1e-3)
    snapshot = scene.snapshot
    near = find_contacts(snapshot, scene.wall_segments(), tolerance=2 * APART * RADIUS_M)
    assert scene.drive is not None
    desired = scene.drive.desired_velocity(snapshot.position, snapshot.ids)
    answer = solve(snapshot, near, left_velocity=desired)
    through = float(answer.right_velocity[0, 0]) > 1e-6
    outcome = Outcome.LOST if through and width < 1 else Outcome.STABLE
    return rigid_cell(outcome, "walks through" if through else "is held", str(answer.status))


def theory(row: By | str) -> float:
    """Compute the width over 2r below which two posts hold a disk that is pushed by F: the largest
    axial force of two springs at the posts is 2kr(1 − (a/r)^⅔)^(3/2) with a half the width, so
    a/r = (1 − (F/(2kr))^⅔)^(3/2)."""
    if not isinstance(row, By):
        return float("nan")
    return float((1 - (row.value / 2) ** (2 / 3)) ** 1.5)


def case(quick: bool) -> Case:
    """Make the case."""
    symbol = "F/(k·r)"
    loads = (0.1, 0.001) if quick else (0.5, 0.2, 0.1, 0.03, 0.01, 0.001)
    rows = [By("lammps", symbol, load) for load in loads]
    if not quick:
        rows += [By("yade", symbol, load) for load in (0.2, 0.01)]
    full = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 1.1)
    return Case(
        name="narrow_door",
        columns=Axis("width of the door / diameter", (0.5, 0.8, 0.97, 1.1) if quick else full),
        rows=Axis("engine, drive over k·r", (*rows, RIGID)),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.LOST,),
        theory=theory,
        values={"longest_periods": LONGEST_PERIODS, "longest_s": LONGEST_S},
    )
