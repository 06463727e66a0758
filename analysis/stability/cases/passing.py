"""Soft disks that pass where rigid ones cannot: through a wall, through a door narrower than
themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.percussions.snapshot import Setting, percussions_of
from analysis.scene.scene import Drive, Scene, Wall
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import MASS_KG, PERIOD_S, RADIUS_M, end_walls, scene_of
from analysis.stability.motion import GAIN, QUANTITIES, common_cell, read_motion, rigid_cell
from analysis.stability.trial import try_engine

WALKING_M_PER_S = 1.0
RELAXATION_S = 0.5
RIGID = "percussions solve"
# How long a disk may take in a door: near the boundary it creeps, for a time that grows without
# bound.
LONGEST_S, LONGEST_PERIODS = 6.0, 250.0


def wall_attempt(speed: float, row: str, folder: Path) -> Cell:
    """A disk that runs into a wall, with speed·r√(k/m) and the row's engine and time step (in
    √(m/k))."""
    engine, step = row.split(", Δt = ")
    dt = float(step) * PERIOD_S
    velocity = speed * RADIUS_M / PERIOD_S
    steps = int(np.ceil(8 / float(step)))
    scene = scene_of(
        [[0.0, 0.0]],
        [[velocity, 0.0]],
        walls=end_walls(-RADIUS_M - 20 * velocity * PERIOD_S, RADIUS_M)[1:],
        duration=steps * dt,
        frames=min(steps, 40),
        time_step=dt,
    )
    trial = try_engine(scene, engine, folder / f"{engine}{step}" / f"{speed:.9g}")
    motion = read_motion(trial, scene)
    if len(motion.position) and float(motion.position[:, 0, 0].max()) > RADIUS_M:
        reason = "the disk is behind the wall"
        return common_cell(speed, row, trial, motion, Outcome.LOST, reason)
    # in mid-contact a long step's energy swings by Δ²/4 without growing: the end counts
    left = float(motion.energy[-1] / motion.energy[0]) if len(motion.time) else float("nan")
    outcome = Outcome.ENERGY_GAIN if left > 1 + GAIN else Outcome.STABLE
    return common_cell(
        speed, row, trial, motion, outcome, f"bounces with {left:.4g} times its energy"
    )


def wall_theory(row: str) -> float:
    """The speed, over r√(k/m), at which the centre reaches the wall in leapfrog: x_n = vΔ
    sin(nθ)/sin θ, cos θ = 1 − Δ²/2 with Δ the step over √(m/k); 1 for short steps (½mv² = ½kr²)."""
    step = float(row.split(", Δt = ")[1])
    angle = float(np.arccos(1 - step**2 / 2))
    n = np.arange(1, int(np.pi / angle) + 2)
    return float(np.sin(angle) / (step * np.sin(n * angle).max()))


def door_scene(width: float, load: float) -> Scene:
    """A disk that walks out of a door of width·2r, pressed to its posts: stiffness such that the
    drive is load·k·r."""
    half = width * RADIUS_M
    force = MASS_KG * WALKING_M_PER_S / RELAXATION_S
    stiffness = force / (load * RADIUS_M)
    behind = np.sqrt(max(RADIUS_M**2 - half**2, 0.0))
    period = (MASS_KG / stiffness) ** 0.5
    far = 8 * RADIUS_M
    return scene_of(
        [[-behind - 1e-3 * RADIUS_M, 0.0]],
        [[0.0, 0.0]],
        walls=[
            Wall(name="lower", start_m=(0.0, -far), end_m=(0.0, -half)),
            Wall(name="upper", start_m=(0.0, half), end_m=(0.0, far)),
        ],
        drive=Drive(
            speed_m_per_s=WALKING_M_PER_S,
            relaxation_time_s=RELAXATION_S,
            door_start_m=(0.0, -half),
            door_end_m=(0.0, half),
            outward=(1.0, 0.0),
        ),
        restitution=0.01,
        stiffness=stiffness,
        duration=max(LONGEST_S, LONGEST_PERIODS * period),
        frames=40,
    )


def door_attempt(width: float, row: str, folder: Path) -> Cell:
    """A disk before a door of width·2r, with the row's engine and drive (over k·r), or as a rigid
    one."""
    if row == RIGID:
        scene = door_scene(width, 1e-3)
        setting = Setting(
            walls=scene.wall_segments(), drive=scene.drive, contact_tolerance=2e-3 * RADIUS_M
        )
        answer = percussions_of(setting, scene.snapshot).answer
        through = float(answer.right_velocity[0, 0]) > 1e-6
        outcome = Outcome.LOST if through and width < 1 else Outcome.STABLE
        return rigid_cell(
            width, row, outcome, "walks through" if through else "is held", str(answer.status)
        )
    engine, load = row.split(", F/(k·r) = ")
    scene = door_scene(width, float(load))
    trial = try_engine(scene, engine, folder / f"{engine}{load}" / f"{width:.9g}")
    motion = read_motion(trial, scene)
    through = bool(len(motion.position)) and float(motion.position[-1, 0, 0]) > RADIUS_M
    if through and width < 1:
        outcome, reason = Outcome.LOST, "squeezed through a door narrower than itself"
    else:
        outcome, reason = Outcome.STABLE, "walks through" if through else "is held"
    return common_cell(width, row, trial, motion, outcome, reason)


def door_theory(row: str) -> float:
    """Width over 2r below which two posts hold a disk that is pushed by F: the largest axial force
    of two springs at the posts is 2kr(1 − (a/r)^⅔)^(3/2) with a half the width, so a/r = (1 −
    (F/(2kr))^⅔)^(3/2)."""
    if row == RIGID:
        return float("nan")
    load = float(row.split(", F/(k·r) = ")[1])
    return float((1 - (load / 2) ** (2 / 3)) ** 1.5)


def tunnelling(quick: bool) -> Case:
    """Disks too fast for a wall."""
    steps = ("0.1", "1.0") if quick else ("0.01", "0.1", "0.5", "1.0", "1.5")
    rows = [f"lammps, Δt = {step}" for step in steps]
    if not quick:
        rows.append("yade, Δt = 0.1")
    return Case(
        name="tunnelling",
        title="Fast disks through a wall",
        fails="penalty engines: a disk whose centre passes the wall is pushed out on the other side, with exit status 0",
        columns=Axis(
            label="speed / (r √(k/m))",
            values=(0.5, 0.9, 1.3) if quick else (0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 1.1, 1.3, 2.0),
        ),
        rows=Axis(
            label="engine, time step (√(m/k))",
            values=tuple(rows),
        ),
        quantities=QUANTITIES,
        attempt=wall_attempt,
        fails_as=(Outcome.LOST,),
        theory=wall_theory,
        edge="the centre reaches the wall: ½mv² = ½kr², leapfrog's own amplitude for long steps",
        words=(
            "One elastic disk against one wall. A linear spring of the length r holds no more than ½kr²; for k = 10^6 N/m, "
            "m = 75 kg and r = 0.25 m that is a speed of 29 m/s, for k = 10^4 N/m it is 2.9 m/s.",
        ),
    )


def narrow_door(quick: bool) -> Case:
    """Doors narrower than a disk."""
    loads = ("0.1", "0.001") if quick else ("0.5", "0.2", "0.1", "0.03", "0.01", "0.001")
    rows = [f"lammps, F/(k·r) = {load}" for load in loads]
    if not quick:
        rows += [f"yade, F/(k·r) = {load}" for load in ("0.2", "0.01")]
    return Case(
        name="narrow_door",
        title="A door narrower than a disk",
        fails="penalty engines: soft disks are squeezed through, with exit status 0",
        columns=Axis(
            label="width of the door / diameter",
            values=(0.5, 0.8, 0.97, 1.1)
            if quick
            else (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 1.1),
        ),
        rows=Axis(label="engine, drive over k·r", values=(*rows, RIGID)),
        quantities=QUANTITIES,
        attempt=door_attempt,
        fails_as=(Outcome.LOST,),
        theory=door_theory,
        edge="a/r = (1 − (F/(2kr))^(2/3))^(3/2), a half the width",
        words=(
            "One disk is driven into a door by F = m u_d/τ. Two posts hold it with at most 2kr(1 − (a/r)^(2/3))^(3/2). Where "
            "they hardly hold it, it creeps through, so that the boundary is measured a little wide: a run lasts "
            f"{LONGEST_PERIODS:g} √(m/k), or {LONGEST_S:g} s if that is more. A run of the product warns of a door narrower "
            "than the widest disk; a rigid disk is held by any.",
        ),
    )
