"""What penalty engines fail at."""

from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.engines.penalty import damping_ratio_for, penalty_of, restitution_of
from analysis.percussions.dense_reference import dense_percussions
from analysis.scene.scene import ContactModel, Run, Scene, Wall
from analysis.studies.stability import crowds, trial
from analysis.studies.stability.case import Cell, Of, Outcome, case, each
from analysis.studies.stability.crowds import (
    FRAMES,
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    RELAXATION_S,
    STIFFNESS_N_PER_M,
    WALKING_M_PER_S,
    disks,
    line,
    scene_of,
)  # fmt: skip
from analysis.studies.stability.trial import ENGINES, GAIN, SOLVERS, Edit, engine_cell, run_frames
from nscd import find_contacts, solve
from nscd.arrays import Floats

UNSTABLE = (Outcome.ENERGY_GAIN, Outcome.LOST)
NAN = float("nan")
# Kinetic over elastic energy at the start: dashpots that only push limit what grows, long after
# this.
KICK = 1e-12
SWUNG_STEPS = 600
# Displacements so many times v√(m/k) of the kick are made by the time step: leapfrog's own swings
# just below the critical step are smaller. Energy shows less, since dashpots that only push keep
# what grows small.
GROWN = 100.0


def lines(engine: str, *counts: int) -> tuple[Of, ...]:
    """Make the rows of an engine with so many disks in a line."""
    named = [(f"line of {n}" if n > 1 else "1 disk", n) for n in counts]
    return tuple(Of(f"{name}, {engine}", (engine, crowds.pressed_line, n)) for name, n in named)


def rhombi(engine: str, *across: int) -> tuple[Of, ...]:
    """Make the rows of an engine with a rhombus of so many disks along each side."""
    return tuple(Of(f"{n} × {n}, {engine}", (engine, crowds.pressed_rhombus, n)) for n in across)


PACKED = (*lines("lammps", 1, 10), *rhombi("lammps", 4, 12))


def time_step_theory(row: Of) -> float:
    """Compute 2/ω_max of the row's packing, in √(m/k)."""
    _, packing, count = row.values
    return crowds.critical_time_step(packing(count, 1.0)) / PERIOD_S


@case(
    columns=("time step / √(m/k)", 0.2, 0.4, 0.6, 0.75, 0.9, 1.1, 1.3, 1.6),
    few_columns=(0.5, 0.75, 1.1, 1.6),
    # YADE computes the same numbers and takes longer to start: two packings show it
    rows=("packing, engine", *PACKED, *lines("yade", 1), *rhombi("yade", 4)),
    few_rows=(PACKED[0], PACKED[2], *rhombi("yade", 4)),
    fails_as=UNSTABLE,
    theory=time_step_theory,
    values={"steps": SWUNG_STEPS},
)
def time_step(step: float, row: Of, folder: Path) -> Cell:
    """Run the packing at a time step (in √(m/k)) and see whether its energy grows."""
    engine, packing, count = row.values
    return swing(packing(count, 1.0), engine, step, SWUNG_STEPS, folder)


def swing(scene: Scene, engine: str, step: float, steps: int, folder: Path) -> Cell:
    """Kick a packing that rests and see whether the time step (in √(m/k)) makes it swing."""
    dt = step * PERIOD_S
    scene = crowds.kicked(scene, KICK)
    scene = scene.with_run(time_step_s=dt, duration_s=steps * dt, frames=FRAMES)
    frames = run_frames(scene, engine, folder)
    # an unstable mode alternates from step to step: at a frame its velocity may be 0, its
    # displacement is not
    kick = PERIOD_S * float(np.sqrt((scene.snapshot.velocity**2).mean()))
    away = np.sqrt(((frames.position - scene.snapshot.position) ** 2).mean((1, 2)))
    grown = float(away.max()) / kick if len(frames.time) else NAN
    reason = f"swings {grown:.3g} times the kick, {frames.gain:.4g} times the energy of the start"
    return engine_cell(frames, reason, (grown > GROWN, Outcome.ENERGY_GAIN, reason))


DAMPED_ACROSS = 4
# With dashpots what is just unstable grows slowly.
DAMPED_STEPS = 5000


def damping_theory(restitution: float) -> float:
    """Compute where leapfrog with dashpots becomes unstable on the packing, in √(m/k)."""
    packing = crowds.pressed_rhombus(DAMPED_ACROSS, restitution)
    return crowds.critical_time_step(packing) / PERIOD_S


@case(
    columns=("time step / √(m/k)", 0.025, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9),
    few_columns=(0.05, 0.2, 0.5, 1.0),
    rows=("asked restitution (LAMMPS)", 1.0, 0.5, 0.2, 0.1, 0.01),
    few_rows=(1.0, 0.1),
    fails_as=UNSTABLE,
    theory=damping_theory,
    values={"across": DAMPED_ACROSS, "steps": DAMPED_STEPS},
)
def damping(step: float, restitution: float, folder: Path) -> Cell:
    """Run a rhombus of that restitution at a time step (in √(m/k)) with LAMMPS."""
    packing = crowds.pressed_rhombus(DAMPED_ACROSS, restitution)
    return swing(packing, "lammps", step, DAMPED_STEPS, folder)


LINE, SHARE = 5, 0.01
RESTITUTION = 0.5
# How much more energy than the loaded contacts have at rest, Σ(jF)²/(2k), after eight times τ.
HOT = 0.01
FORCE_N = MASS_KG * WALKING_M_PER_S / RELAXATION_S


def stiffness_theory(step: float) -> float:
    """Compute k r/F at which the time step (s) is the critical one of the pressed line."""
    pressed = crowds.pressed_line(LINE, RESTITUTION)
    fixed = pressed.model_copy(update={"walls": pressed.walls[1:]})
    k = MASS_KG * (crowds.critical_time_step(fixed) / PERIOD_S / step) ** 2
    return float(k * RADIUS_M / FORCE_N)


@case(
    columns=("stiffness ratio k·r / F", *(10.0**p for p in range(1, 9))),
    few_columns=tuple(10.0**p for p in range(2, 7)),
    rows=("time step (s), LAMMPS", 0.001, 0.003, 0.01),
    few_rows=(0.003,),
    fails_as=UNSTABLE,
    theory=stiffness_theory,
    values={"line": LINE, "force_n": FORCE_N},
)
def stiffness(ratio: float, step: float, folder: Path) -> Cell:
    """Drive LINE disks against a wall, k r = ratio times the drive of one, with a time step (s):
    the wall must carry the drive of all, with an overlap below SHARE of r."""
    k, position = ratio * FORCE_N / RADIUS_M, line(LINE)
    far = position[-1, 0] + RADIUS_M
    many = ceil(max(4.0 / step, 4000.0) / FRAMES)
    lasts = FRAMES * step * many
    run = Run(duration_s=lasts, frames=FRAMES, time_step_s=step, drive_interval_steps=1)
    scene = scene_of(
        disks(position),
        run,
        contact=ContactModel(stiffness_N_per_m=k, restitution=RESTITUTION),
        walls=crowds.end_walls(-4.0, far)[1:],
        drive=crowds.walking_drive(((far, -1e-3), (far, 1e-3))),
    )
    frames = run_frames(scene, "lammps", folder)
    static = 0.5 * FORCE_N**2 / k * sum(j * j for j in range(1, LINE + 1))
    more = float(frames.energy[-5:].max() / static - 1) if len(frames.time) else NAN
    overlap = float(frames.overlap[-1]) if len(frames.time) else NAN
    # soft contacts still swing slowly; energy in stiff ones beyond that of rest is made by the time
    # step
    return engine_cell(
        frames,
        "at rest",
        (overlap > SHARE and more < 1, Outcome.INACCURATE, f"overlap {overlap:.2g} r at rest"),
        (more > HOT, Outcome.ENERGY_GAIN, f"{1 + more:.3g} times the energy of rest under load"),
    )


# How far the restitution may be from the one asked.
OFF = 0.01
# Of the rule's time step, so that it does not add an error to the restitution.
FRACTION = 0.02
# Of √(m/k) of the heavy disk: the rule's time step for that disk alone.
HEAVY_STEP = 0.1


def collision(engine: str, restitution: float, heavy_step: bool = False) -> Of:
    """Make a row: engine, asked restitution, and whether the time step is that of the heavy
    disk."""
    label = f"{engine}, e = {restitution:g}{' (heavy’s step)' * heavy_step}"
    return Of(label, (engine, restitution, heavy_step))


def mass_ratio_theory(row: Of) -> float:
    """Compute the mass ratio R at which the dashpot of the heaviest pair makes the restitution OFF
    too small: ζ√((1+R)/2)."""
    _, restitution, heavy_step = row.values
    if restitution == 1 or heavy_step:
        return NAN
    damping = damping_ratio_for(restitution)

    def missed(ratio: float) -> float:
        return float(restitution_of(damping * np.sqrt((1 + ratio) / 2)) - (restitution - OFF))

    return float(brentq(missed, 1.0, 1e6, xtol=1e-12))


BY_LAMMPS = (collision("lammps", 1.0), collision("lammps", 0.5), collision("lammps", 1.0, True))
BY_YADE = (collision("yade", 1.0), collision("yade", 0.5))


@case(
    columns=("heavy mass / light mass", 1.0, 2.0, 5.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6),
    few_columns=(1.0, 1.5, 1e2, 1e6),
    rows=("engine, asked restitution", *BY_LAMMPS, *BY_YADE),
    few_rows=BY_LAMMPS,
    fails_as=(Outcome.INACCURATE,),
    theory=mass_ratio_theory,
    values={"off": OFF},
)
def mass_ratio_engines(ratio: float, row: Of, folder: Path) -> Cell:
    """Let a heavy disk hit a light one, `ratio` times lighter: the restitution obtained,
    −(u₂ − u₁)⁺/(u₂ − u₁)⁻, against the one asked."""
    engine, requested, heavy_step = row.values
    mass = np.array([MASS_KG, MASS_KG / ratio])
    lasts = 4 * np.pi * float(np.sqrt(mass.prod() / mass.sum() / STIFFNESS_N_PER_M))
    scene = scene_of(
        disks(line(2), [[1.0, 0.0], [0.0, 0.0]], mass),
        Run(duration_s=lasts, frames=FRAMES),
        contact=ContactModel(stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=requested),
    )
    step = HEAVY_STEP * PERIOD_S if heavy_step else FRACTION * penalty_of(scene).safe_time_step
    scene = scene.with_run(time_step_s=step, duration_s=max(lasts, 20 * step))
    frames = run_frames(scene, engine, folder)
    along = frames.velocity[-1, :, 0]
    obtained, gain = float(along[1] - along[0]), frames.gain
    reason = f"restitution {obtained:.3g}"
    return engine_cell(
        frames,
        reason,
        (gain > 1 + GAIN, Outcome.ENERGY_GAIN, f"{gain:.3g} times the energy of the start"),
        (abs(obtained - requested) > OFF, Outcome.INACCURATE, f"{reason} instead of {requested:g}"),
    )


PRODUCT, PERCUSSIONS = "percussions run", "percussions solve"
GIVEN = (*each("lammps", "k", 1e6), *each("yade", "k", 1e6), PRODUCT, PERCUSSIONS)
# Of the energy of two who walk: less than this is no error.
SLIGHT_RELEASE = 0.01


def overlapping_pair(overlap: float, stiffness: float) -> Scene:
    """Make two disks at rest that overlap by overlap·r, for ten periods."""
    period = (MASS_KG / stiffness) ** 0.5
    return scene_of(
        disks(line(2, (2 - overlap) * RADIUS_M)),
        Run(duration_s=10 * period, frames=FRAMES, time_step_s=0.01 * period),
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=1.0),
    )


def overlap_theory(row: Of | str) -> float:
    """Compute the overlap over r whose ½kδ² is the kinetic energy of two who walk."""
    if isinstance(row, str):
        return NAN
    return float(WALKING_M_PER_S * (2 * MASS_KG / row.values[1]) ** 0.5 / RADIUS_M)


@case(
    columns=("overlap / r", 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 1.9, 2.0),
    few_columns=(1e-3, 3e-2, 0.1, 2.0),
    rows=("who is given it", *each("lammps", "k", 1e4, 1e5), *GIVEN),
    few_rows=GIVEN,
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=overlap_theory,
)
def initial_overlap(overlap: float, row: Of | str, folder: Path) -> Cell:
    """Let go of an overlapping pair by the row's engine and stiffness, or give it to the
    product."""
    engine, k = (row, STIFFNESS_N_PER_M) if isinstance(row, str) else row.values
    scene = overlapping_pair(overlap, k)
    try:
        if isinstance(row, str):
            if row == PRODUCT:
                scene.check("trial")
            solution = solve(scene.snapshot, crowds.contacts_of(scene.snapshot))
            still = "at rest, and the overlap stays, since percussions act on velocities"
            return trial.rigid_cell(str(solution.status), still)
        # LAMMPS' deck needs the energy at the start: not of centres that coincide
        frames = run_frames(scene, engine, folder)
    except ValueError as error:
        return trial.rigid_cell("refused", "", (True, Outcome.REFUSED, str(error)))
    released = float(frames.kinetic.max()) if len(frames.kinetic) else NAN
    fraction = released / (MASS_KG * WALKING_M_PER_S**2)
    slight, joules = fraction > SLIGHT_RELEASE, f"{released:.3g} J from rest"
    inside = "one disk inside the other, and nothing pushes them apart"
    return engine_cell(
        frames,
        f"{released:.2g} J from rest",
        (fraction > 1, Outcome.ENERGY_GAIN, f"{joules}, {fraction:.3g} times that of walking"),
        (slight, Outcome.INACCURATE, f"{joules}, {fraction:.2g} of that of walking"),
        (overlap >= 2 and fraction < SLIGHT_RELEASE, Outcome.INACCURATE, inside),
    )


SPEED_M_PER_S = 1.0
STEP_S, SKIN_FRAMES = 0.1 * PERIOD_S, 100
SKINS_M = (0.001, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.9)
RENEWAL = "neigh_modify every 1 delay 0 check yes binsize 1.0"
# Rows: the engine, and every how many steps its list is renewed unchecked; None: as its own deck or
# script has it, which checks each step.
OWN, YADE = Of("lammps, checks each step", ("lammps", None)), Of("yade, verletDist", ("yade", None))


def unchecked(*every: int) -> tuple[Of, ...]:
    """Make the rows of LAMMPS with unchecked renewals."""
    return tuple(Of(f"lammps, every {steps}", ("lammps", steps)) for steps in every)


def skin_edits(row: Of, skin_m: float) -> list[Edit]:
    """Give the input of the row's engine another skin (m), and its renewal."""
    engine, every = row.values
    if engine == "yade":
        return [("crowd.py", "SKIN_M = 0.04", f"SKIN_M = {skin_m!r}")]
    old = "variable skin index "
    unchecked = f"neigh_modify every {every} delay 0 check no binsize 1.0"
    renewal = [("crowd.in", RENEWAL, unchecked)] if every else []
    return [("crowd.in", f"{old}0.1", f"{old}{skin_m!r}"), *renewal]


def skin_theory(row: Of) -> float:
    """Compute the skin below which a contact is noticed so late, with the overlap
    δ = 2vNΔt − skin, that it adds GAIN to the energy.

    ½μu² + ½k x(t)x(t+Δ), with u the velocity between t and t + Δ and x the overlap, is what
    leapfrog keeps for a spring: with the last step before the contact, of 2vΔt, it adds ½kδ(δ −
    2vΔt)."""
    if (every := row.values[1]) is None:
        return NAN
    path = 2 * SPEED_M_PER_S * STEP_S
    added = 2 * GAIN * MASS_KG * SPEED_M_PER_S**2 / STIFFNESS_N_PER_M
    late = path / 2 + np.sqrt(path**2 / 4 + added)
    return float(every * path - late)


@case(
    columns=("skin of the neighbour list (m)", *SKINS_M),
    few_columns=(0.01, 0.03, 0.1),
    rows=("engine, renewal of its list", OWN, *unchecked(10, 30, 100, 400), YADE),
    few_rows=(OWN, *unchecked(30), YADE),
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=skin_theory,
)
def skin(skin_m: float, row: Of, folder: Path) -> Cell:
    """Let two disks meet, each at SPEED_M_PER_S, that start just outside the skin (m) of the row's
    neighbour list."""
    gap = skin_m * (1 + 1e-6)
    between = np.ceil((gap + 4 * RADIUS_M) / SPEED_M_PER_S / (SKIN_FRAMES * STEP_S)) * STEP_S
    scene = scene_of(
        disks(line(2, 2 * RADIUS_M + gap), [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]]),
        Run(duration_s=SKIN_FRAMES * between, frames=SKIN_FRAMES, time_step_s=STEP_S),
    )
    frames = run_frames(scene, row.values[0], folder, *skin_edits(row, skin_m))
    passed = len(frames.position) and frames.position[-1, 1, 0] < frames.position[-1, 0, 0]
    if passed and not frames.gain > 1 + GAIN:
        through = (True, Outcome.INACCURATE, "the disks passed through each other")
        return engine_cell(frames, "", through)
    return trial.undriven_cell(frames)


def tunnelling_theory(row: Of) -> float:
    """Compute the speed, over r√(k/m), at which the centre reaches the wall in leapfrog:
    x_n = vΔ sin(nθ)/sin θ, cos θ = 1 − Δ²/2 with Δ the step over √(m/k); 1 for short steps
    (½mv² = ½kr²)."""
    step = row.values[1]
    angle = float(np.arccos(1 - step**2 / 2))
    n = np.arange(1, int(np.pi / angle) + 2)
    return float(np.sin(angle) / (step * np.sin(n * angle).max()))


@case(
    columns=("speed / (r √(k/m))", 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 1.1, 1.3, 2.0),
    few_columns=(0.5, 0.9, 1.3),
    rows=(
        "engine, time step (√(m/k))",
        *each("lammps", "Δt", 0.01, 0.1, 0.5, 1.0, 1.5),
        *each("yade", "Δt", 0.1),
    ),
    few_rows=each("lammps", "Δt", 0.1, 1.0),
    fails_as=(Outcome.LOST,),
    theory=tunnelling_theory,
)
def tunnelling(speed: float, row: Of, folder: Path) -> Cell:
    """Let a disk run into a wall, with speed·r√(k/m) and the row's engine and time step (in
    √(m/k))."""
    engine, step = row.values
    velocity = speed * RADIUS_M / PERIOD_S
    steps, dt = int(np.ceil(8 / step)), step * PERIOD_S
    scene = scene_of(
        disks([[0.0, 0.0]], [[velocity, 0.0]]),
        Run(duration_s=steps * dt, frames=min(steps, 40), time_step_s=dt),
        walls=crowds.end_walls(-RADIUS_M - 20 * velocity * PERIOD_S, RADIUS_M)[1:],
    )
    frames = run_frames(scene, engine, folder)
    behind = float(frames.position[:, 0, 0].max(initial=0.0)) > RADIUS_M
    # in mid-contact a long step's energy swings by Δ²/4 without growing: the end counts
    left = float(frames.energy[-1] / frames.energy[0]) if len(frames.time) else NAN
    reason = f"bounces with {left:.4g} times its energy"
    return engine_cell(
        frames,
        reason,
        (behind, Outcome.LOST, "the disk is behind the wall"),
        (left > 1 + GAIN, Outcome.ENERGY_GAIN, reason),
    )


DRIFT_STEPS = 100_000
SLIGHT_DRIFT = 0.01
GAS_ACROSS, SPACING_M, MARGIN_M = 3, 3.0 * RADIUS_M, 1.5 * RADIUS_M


@case(
    columns=("time step / √(m/k)", 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2),
    few_columns=(0.02, 0.1, 0.5),
    rows=("engine", *ENGINES),
    fails_as=(Outcome.ENERGY_GAIN,),
    values={"steps": DRIFT_STEPS},
)
def drift(step: float, engine: str, folder: Path) -> Cell:
    """Run an elastic gas of disks in a closed rhombus for STEPS steps (in √(m/k))."""
    velocity = np.random.default_rng(2).normal(size=(GAS_ACROSS**2, 2))
    dt = step * PERIOD_S
    scene = scene_of(
        disks(crowds.rhombus(GAS_ACROSS, SPACING_M), velocity),
        Run(duration_s=DRIFT_STEPS * dt, frames=50, time_step_s=dt),
        walls=crowds.rhombus_walls(GAS_ACROSS, SPACING_M, MARGIN_M),
    )
    frames = run_frames(scene, engine, folder)
    change = float(frames.energy[-1] / frames.energy[0] - 1) if len(frames.time) else NAN
    outside = _outside(scene.walls[0].start_m, frames.position[-1]) if len(frames.time) else 0
    ended, grows = f"of the start after {DRIFT_STEPS} steps", change > GAIN
    ill = Outcome.ENERGY_GAIN if grows else Outcome.INACCURATE
    return engine_cell(
        frames,
        f"energy {change:+.2g} {ended}",
        (outside > 0, Outcome.LOST, f"{outside} disks are outside the walls"),
        (not abs(change) <= SLIGHT_DRIFT, ill, f"energy {change:+.3g} {ended}"),
    )


def _outside(corner: tuple[float, float], position: Floats) -> int:
    """Count the centres outside the rhombus that the walls bound."""
    side = SPACING_M * (GAS_ACROSS - 1) + 2 * MARGIN_M / np.sqrt(0.75)
    basis = np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]])
    fractions = np.linalg.solve(basis, (position - np.array(corner)).T) / side
    return int(((fractions < 0) | (fractions > 1)).any(0).sum())


# How long a disk may take in a door: near the boundary it creeps, for a time that grows without
# bound.
LONGEST_S, LONGEST_PERIODS = 6.0, 250.0
# How far a disk stands from the posts at the start, in r.
APART = 1e-3


def door_scene(width: float, load: float) -> Scene:
    """Make a disk that walks out of a door of width·2r, pressed to its posts: stiffness such that
    the drive is load·k·r."""
    half, far = width * RADIUS_M, 8 * RADIUS_M
    stiffness = FORCE_N / (load * RADIUS_M)
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
        drive=crowds.walking_drive(((0.0, -half), (0.0, half))),
    )


def door_theory(row: Of | str) -> float:
    """Compute the width over 2r below which two posts hold a disk that is pushed by F: the largest
    axial force of two springs at the posts is 2kr(1 − (a/r)^⅔)^(3/2) with a half the width, so
    a/r = (1 − (F/(2kr))^⅔)^(3/2)."""
    if isinstance(row, str):
        return NAN
    return float((1 - (row.values[1] / 2) ** (2 / 3)) ** 1.5)


@case(
    columns=("width of the door / diameter", 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 1.1),
    few_columns=(0.5, 0.8, 0.97, 1.1),
    rows=(
        "engine, drive over k·r",
        *each("lammps", "F/(k·r)", 0.5, 0.2, 0.1, 0.03, 0.01, 0.001),
        *each("yade", "F/(k·r)", 0.2, 0.01),
        PERCUSSIONS,
    ),
    few_rows=(*each("lammps", "F/(k·r)", 0.1, 0.001), PERCUSSIONS),
    fails_as=(Outcome.LOST,),
    theory=door_theory,
    values={"longest_periods": LONGEST_PERIODS, "longest_s": LONGEST_S},
)
def narrow_door(width: float, row: Of | str, folder: Path) -> Cell:
    """Put a disk before a door of width·2r, with the row's engine and drive (over k·r), or as a
    rigid one."""
    if isinstance(row, str):
        return _rigid_door(width)
    engine, load = row.values
    frames = run_frames(door_scene(width, load), engine, folder)
    through = bool(len(frames.position)) and float(frames.position[-1, 0, 0]) > RADIUS_M
    squeezed = "squeezed through a door narrower than itself"
    return engine_cell(
        frames,
        "walks through" if through else "is held",
        (through and width < 1, Outcome.LOST, squeezed),
    )


def _rigid_door(width: float) -> Cell:
    scene = door_scene(width, 1e-3)
    snapshot = scene.snapshot
    near = find_contacts(snapshot, scene.wall_segments(), tolerance=2 * APART * RADIUS_M)
    assert scene.drive is not None
    desired = scene.drive.desired_velocity(snapshot.position, snapshot.ids)
    solution = solve(snapshot, near, left_velocity=desired)
    through = float(solution.right_velocity[0, 0]) > 1e-6
    reason = "walks through" if through else "is held"
    lost = through and width < 1, Outcome.LOST, reason
    return trial.rigid_cell(str(solution.status), reason, lost)


# How far the velocities of two elastic disks after their impact may be off, over the speed. Above
# the boundary that this gives, rounded steps still make errors of up to 5.9 %, here and there.
SLOW_OFF = 0.1
SLOW_ACROSS = 4
SPEEDS = (1.0, 1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-15, 1e-50, 1e-100, 1e-160, 1e-310, 0.0)
SLOW_ENGINES = (*each("lammps", "Δt", 0.001, 0.01, 0.1), *each("yade", "Δt", 0.01))


def small_speeds_theory(row: Of | str) -> float:
    """Compute for an engine the speed (ulp/Δt)(1 − √(2q/(1+q)))/(1 − q) below which the struck disk
    leaves too fast by q = OFF.

    The struck disk, at x = 2 r, stays where it is until its path in a step is half a unit in the
    last place of x, and then moves by a whole one, g(u) = ulp/Δt · round(uΔt/ulp). Momentum is
    exchanged rightly, the overlap changes by v − u − g(u) a second, and the contact ends at the u
    with ∫₀ᵘ (v − s − g(s)) ds = 0. NaN for solvers."""
    if isinstance(row, str):
        return NAN
    unit = np.spacing(2 * RADIUS_M) / (row.values[1] * PERIOD_S)
    return float(unit * (1 - np.sqrt(2 * SLOW_OFF / (1 + SLOW_OFF))) / (1 - SLOW_OFF))


@case(
    columns=("speed (m/s)", *SPEEDS),
    few_columns=(1.0, 1e-8, 1e-11, 1e-13, 1e-100, 0.0),
    rows=("solver, or engine and time step (√(m/k))", *SOLVERS, *SLOW_ENGINES),
    few_rows=(*SOLVERS, *each("lammps", "Δt", 0.01)),
    quantities=trial.SOLVER_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
    theory=small_speeds_theory,
)
def small_speeds(speed: float, row: Of | str, folder: Path) -> Cell:
    """Give velocities of the size `speed` (m/s) to a solver, or to an engine with a time step (in
    √(m/k)). The law of impact has no scale, so the answer must be that of 1 m/s times speed; in an
    engine two elastic disks must still exchange their velocities to OFF."""
    if isinstance(row, str):
        return _slow_solver(speed, row)
    engine, step = row.values
    run = Run(duration_s=8 * PERIOD_S, frames=FRAMES, time_step_s=step * PERIOD_S)
    scene = scene_of(disks(line(2), [[speed, 0.0], [0.0, 0.0]]), run)
    frames = run_frames(scene, engine, folder)
    after = frames.velocity[-1, :, 0] if len(frames.velocity) else np.full(2, np.nan)
    error = float(np.abs(after - [0.0, speed]).max()) / (speed or 1.0)
    message = "velocities after the impact are {} by " + f"{error:.2g} of the speed"
    wrong = (not error <= SLOW_OFF, Outcome.INACCURATE, message.format("wrong"))
    return engine_cell(frames, message.format("right"), wrong, numbers=(error, np.nan, np.nan))


def _slow_solver(speed: float, solver: str) -> Cell:
    unit = np.random.default_rng(1).normal(size=(SLOW_ACROSS**2, 2))
    snapshot = disks(crowds.rhombus(SLOW_ACROSS), unit)
    contacts = crowds.contacts_of(snapshot, crowds.corner_walls(SLOW_ACROSS))
    _, reference = dense_percussions(snapshot, contacts, unit)
    try:
        solution = solve(snapshot, contacts, left_velocity=speed * unit, solver=solver)
    except ArithmeticError as error:
        name, nothing = type(error).__name__, (NAN,) * len(trial.SOLVER_QUANTITIES)
        reason = f"ends with {name}: {error}"
        return trial.cell(name, nothing, "", (True, Outcome.NOT_CONVERGED, reason))
    return trial.solver_cell(solution, speed * reference, speed * float(np.abs(unit).max()))


RESTART_ACROSS, HALF_S, RESTART_STEPS = 3, 0.2, 1000
# In r: a dashpot that sees the velocity of half a step before changes by this much at most when it
# starts afresh.
SAME = 1e-5


@case(
    columns=("friction", 0.0, 0.01, 0.1, 0.3, 0.5, 1.0),
    few_columns=(0.0, 0.5),
    rows=("engine", *ENGINES),
    quantities=("difference of positions / r",),
    fails_as=(Outcome.INACCURATE,),
    values={"same": SAME},
)
def restart(friction: float, engine: str, folder: Path) -> Cell:
    """Stir up a packing for 2 · HALF_S: in one run, and in two of which the second starts from what
    the dump of the first ends with."""
    velocity = np.random.default_rng(3).normal(size=(RESTART_ACROSS**2, 2))
    frictional = ContactModel(stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=0.5, friction=friction)
    first = scene_of(
        disks(crowds.rhombus(RESTART_ACROSS), velocity),
        Run(duration_s=HALF_S, frames=5, time_step_s=HALF_S / RESTART_STEPS),
        contact=frictional,
        walls=crowds.rhombus_walls(RESTART_ACROSS),
    )
    full = first.with_run(duration_s=2 * HALF_S, frames=10)
    in_one = run_frames(full, engine, folder / "whole")
    half = run_frames(first, engine, folder / "first")
    last = {name: getattr(half, name)[-1] for name in ("position", "velocity", "spin")}
    second = first.model_copy(update={"snapshot": replace(first.snapshot, **last)})
    in_two = run_frames(second, engine, folder / "second")
    separated = NAN
    if not in_one.trouble and not in_two.trouble:
        separated = float(np.abs(in_one.position[-1] - in_two.position[-1]).max() / RADIUS_M)
    reason = f"positions differ by {separated:.2g} r"
    differs = (not separated <= SAME, Outcome.INACCURATE, reason)
    return engine_cell(in_two, reason, differs, numbers=(separated,))
