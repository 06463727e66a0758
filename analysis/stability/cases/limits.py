"""The ends of the scales: no velocity, a run cut in two, contacts too soft or too stiff for their
load."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from analysis.scene.scene import Drive, Scene
from analysis.stability import solver_cells
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import (
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    critical_time_step,
    end_walls,
    line,
    pressed_line,
    rhombus,
    rhombus_walls,
    scene_of,
)
from analysis.stability.dense_reference import dense_percussions
from analysis.stability.motion import QUANTITIES, Motion, common_cell, read_motion
from analysis.stability.trial import ENGINES, Trial, try_engine
from nscd import Snapshot, find_contacts, solve

# How far the velocities of two elastic disks after their impact may be off, over the speed. Above
# the boundary that this gives, rounded steps still make errors of up to 5.9 %, here and there.
OFF = 0.1


def speed_attempt(speed: float, row: str, folder: Path) -> Cell:
    """Velocities of the size `speed` (m/s): the law of impact has no scale, so the answer must be
    the one of 1 m/s times speed; for an engine with the time step of the row (in √(m/k)), two
    elastic disks must still exchange their velocities to OFF."""
    engine, _, step = row.partition(", Δt = ")
    if engine in ENGINES:
        dt = float(step) * PERIOD_S
        scene = scene_of(line(2), [[speed, 0.0], [0.0, 0.0]], duration=8 * PERIOD_S, time_step=dt)
        trial = try_engine(scene, engine, folder / f"{engine}{step}" / f"{speed:.9g}")
        motion = read_motion(trial, scene)
        after = motion.velocity[-1, :, 0] if len(motion.velocity) else np.full(2, np.nan)
        error = (
            float(np.abs(after - [0.0, speed]).max() / speed)
            if speed
            else float(np.abs(after).max())
        )
        good = error <= OFF
        outcome = Outcome.STABLE if good else Outcome.INACCURATE
        reason = f"velocities after the impact are {'right' if good else 'wrong'} by {error:.2g} of the speed"
        return dataclasses.replace(
            common_cell(speed, row, trial, motion, outcome, reason), numbers=(error, np.nan, np.nan)
        )
    across = 4
    unit = np.random.default_rng(1).normal(size=(across**2, 2))
    walls = [wall for wall in rhombus_walls(across) if wall.name in ("low", "left")]
    scene = scene_of(rhombus(across), unit, walls=walls, duration=1.0)
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)
    _, reference = dense_percussions(scene.snapshot, contacts, unit)
    try:
        answer = solve(scene.snapshot, contacts, left_velocity=speed * unit, solver=row)
    except ArithmeticError as error:
        name = type(error).__name__
        return Cell(
            column=speed,
            row=row,
            outcome=Outcome.NOT_CONVERGED,
            reason=f"ends with {name}: {error}",
            said=name,
            numbers=(float("nan"),) * len(solver_cells.QUANTITIES),
        )
    return solver_cells.solver_cell(
        speed, row, answer, speed * reference, speed * float(np.abs(unit).max()), wrong=1e-5
    )


def speed_theory(row: str) -> float:
    """For an engine: the speed (ulp/Δt)(1 − √(2q/(1+q)))/(1 − q) below which the struck disk leaves
    too fast by q = OFF.

    The struck disk, at x = 2 r, stays where it is until its path in a step is half a unit in the
    last place of x, and then moves by a whole one, g(u) = ulp/Δt · round(uΔt/ulp). Momentum is
    exchanged rightly, the overlap changes by v − u − g(u) a second, and the contact ends at the u
    with ∫₀ᵘ (v − s − g(s)) ds = 0. NaN for solvers."""
    if ", Δt = " not in row:
        return float("nan")
    unit = np.spacing(2 * RADIUS_M) / (float(row.split(" = ")[1]) * PERIOD_S)
    return float(unit * (1 - np.sqrt(2 * OFF / (1 + OFF))) / (1 - OFF))


def small_speeds(quick: bool) -> Case:
    """Zero and nearly zero velocities."""
    speeds: tuple[float, ...] = (1.0, 1e-8, 1e-11, 1e-13, 1e-100, 0.0)
    if not quick:
        speeds = (1.0, 1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-15, 1e-50, 1e-100, 1e-160, 1e-310, 0.0)
    engines = ["lammps, Δt = 0.01"]
    if not quick:
        engines = [f"lammps, Δt = {step}" for step in ("0.001", "0.01", "0.1")] + [
            "yade, Δt = 0.01"
        ]
    return Case(
        name="small_speeds",
        title="Zero and nearly zero velocities",
        fails="engines: steps shorter than the rounding of positions; solvers: squares and scales below the smallest number",
        columns=Axis(label="speed (m/s)", values=speeds),
        rows=Axis(
            label="solver; engine, time step (√(m/k))", values=(*solver_cells.SOLVERS, *engines)
        ),
        quantities=solver_cells.QUANTITIES,
        attempt=speed_attempt,
        fails_as=(Outcome.INACCURATE,),
        theory=speed_theory,
        edge="struck disk 10 % too fast, its steps rounded to units in the last place of its position",
        words=(
            "Percussions: 4 × 4 disks in a corner with random left velocities of this size. Engines: two elastic disks, the "
            "second one at x = 0.5 m. Both answers are proportional to the speed. In an engine a disk whose path in a step is "
            "below half a unit in the last place of its position stands still, so a shorter time step needs a higher speed; "
            "such speeds are far below any that matter.",
        ),
    )


RESTART_S = 0.2
# In r: a dashpot that sees the velocity of half a step before changes by this much at most when it
# starts anew.
SAME = 1e-5


def restart_attempt(friction: float, row: str, folder: Path) -> Cell:
    """A packing that is stirred up, for 2 · RESTART_S: in one run, and in two of which the second
    starts from what the dump of the first ends with."""
    across, steps = 3, 1000
    velocity = np.random.default_rng(3).normal(size=(across**2, 2))
    first = scene_of(
        rhombus(across),
        velocity,
        walls=rhombus_walls(across),
        restitution=0.5,
        friction=friction,
        duration=RESTART_S,
        frames=5,
        time_step=RESTART_S / steps,
    )
    whole = first.with_run(duration_s=2 * RESTART_S, frames=10)
    base = folder / row / f"{friction:g}"
    one = try_engine(whole, row, base / "whole")
    half = try_engine(first, row, base / "first")
    second = first.model_copy(update={"snapshot": last_state(half, first)})
    rest = try_engine(second, row, base / "second")
    in_one, in_two = read_motion(one, whole), read_motion(rest, second)
    apart = _apart(in_one, in_two)
    outcome = Outcome.STABLE if apart <= SAME else Outcome.INACCURATE
    cell = common_cell(friction, row, rest, in_two, outcome, f"positions differ by {apart:.2g} r")
    return dataclasses.replace(cell, numbers=(apart,))


def last_state(trial: Trial, scene: Scene) -> Snapshot:
    """The disks of the last frame of a trial, spins included."""
    motion = read_motion(trial, scene)
    return dataclasses.replace(
        scene.snapshot,
        position=motion.position[-1],
        velocity=motion.velocity[-1],
        spin=motion.spin[-1],
    )


def _apart(one: Motion, two: Motion) -> float:
    if one.trouble or two.trouble:
        return float("nan")
    return float(np.abs(one.position[-1] - two.position[-1]).max() / RADIUS_M)


def restart(quick: bool) -> Case:
    """Runs that are cut in two."""
    return Case(
        name="restart",
        title="A run split in two",
        fails="penalty engines with friction: the tangential springs are in no dump, so the second half starts without them",
        columns=Axis(
            label="friction", values=(0.0, 0.5) if quick else (0.0, 0.01, 0.1, 0.3, 0.5, 1.0)
        ),
        rows=Axis(label="engine", values=ENGINES),
        quantities=("difference of positions / r",),
        attempt=restart_attempt,
        fails_as=(Outcome.INACCURATE,),
        words=(
            "Nine touching disks between four walls, stirred up, for 0.4 s in one run, and in two of 0.2 s, the second from "
            f"the dump of the first (17 digits). Stable: the same places to {SAME:g} r. Without friction the difference is "
            "not 0 either, since the dashpots of both engines act with the velocity of half a step before, which no dump holds.",
        ),
    )


LINE, SHARE = 5, 0.01
# How much more energy than the loaded contacts have at rest, Σ(jF)²/(2k), after eight times τ.
HOT = 0.01
FORCE_N = MASS_KG * 1.0 / 0.5


def stiffness_attempt(ratio: float, row: str, folder: Path) -> Cell:
    """LINE disks driven against a wall, k r = ratio times the drive of one, with the time step of
    the row (s): the wall must carry the drive of all, with an overlap below SHARE of r."""
    step = float(row.split()[-2])
    stiffness = ratio * FORCE_N / RADIUS_M
    position = line(LINE)
    far = position[-1, 0] + RADIUS_M
    scene = scene_of(
        position,
        np.zeros((LINE, 2)),
        walls=end_walls(-4.0, far)[1:],
        drive=Drive(
            speed_m_per_s=1.0,
            relaxation_time_s=0.5,
            door_start_m=(far, -1e-3),
            door_end_m=(far, 1e-3),
            outward=(1.0, 0.0),
        ),
        restitution=0.5,
        stiffness=stiffness,
        duration=max(4.0, 4000 * step),
        time_step=step,
    )
    scene = scene.with_run(drive_interval_steps=1)
    trial = try_engine(scene, "lammps", folder / row.replace(" ", "") / f"{ratio:.9g}")
    motion = read_motion(trial, scene)
    static = 0.5 * FORCE_N**2 / stiffness * sum(j * j for j in range(1, LINE + 1))
    more = float(motion.energy[-5:].max() / static - 1) if len(motion.time) else float("nan")
    # soft contacts still swing slowly; energy in stiff ones beyond that of rest is made by the time
    # step
    if len(motion.time) and motion.overlap[-1] > SHARE and more < 1:
        outcome, reason = Outcome.INACCURATE, f"overlap {motion.overlap[-1]:.2g} r at rest"
    elif more > HOT:
        outcome, reason = Outcome.ENERGY_GAIN, f"{1 + more:.3g} times the energy of rest under load"
    else:
        outcome, reason = Outcome.STABLE, "at rest"
    return common_cell(ratio, row, trial, motion, outcome, reason)


def stiffness_theory(row: str) -> float:
    """k r/F at which the time step of the row is the critical one of the pressed line."""
    pressed = pressed_line(LINE, 0.5)
    held = pressed.model_copy(update={"walls": pressed.walls[1:]})
    critical = critical_time_step(held) / PERIOD_S
    stiffness = MASS_KG * (critical / float(row.split()[-2])) ** 2
    return float(stiffness * RADIUS_M / FORCE_N)


def stiffness(quick: bool) -> Case:
    """Stiffness against load and time step."""
    steps = ("0.003",) if quick else ("0.001", "0.003", "0.01")
    return Case(
        name="stiffness",
        title="Stiffness ratio",
        fails="penalty engines: too soft for the load, or too stiff for the time step",
        columns=Axis(
            label="stiffness ratio k·r / F",
            values=(1e2, 1e3, 1e4, 1e5, 1e6)
            if quick
            else tuple(float(f"1e{p}") for p in range(1, 9)),
        ),
        rows=Axis(label="time step (LAMMPS)", values=tuple(f"Δt = {step} s" for step in steps)),
        quantities=QUANTITIES,
        attempt=stiffness_attempt,
        fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
        theory=stiffness_theory,
        edge="the time step is critical for the line",
        words=(
            f"{LINE} disks of restitution 0.5 are driven against a wall with F = {FORCE_N:g} N each. Softer than k·r/F = "
            f"{LINE / SHARE:g} the overlap at the wall, {LINE} F/k, is above {SHARE:.0%} of r. All contacts of a scene have "
            "one stiffness, so its ratio to the load is the only one there is. Rigid percussions have no such window.",
        ),
    )
