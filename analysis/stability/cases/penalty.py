"""What penalty engines fail at."""

import dataclasses
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from analysis.engines.penalty import damping_ratio_for, penalty_of, restitution_of
from analysis.percussions.dense_reference import dense_percussions
from analysis.scene.scene import ContactModel, Run, Scene, Wall
from analysis.stability.case import By, Cell, Outcome, case
from analysis.stability.crowds import (
    FRAMES,
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    RELAXATION_S,
    STIFFNESS_N_PER_M,
    WALKING_M_PER_S,
    contacts_of,
    corner_walls,
    critical_time_step,
    disks,
    end_walls,
    kicked,
    line,
    pressed_line,
    pressed_rhombus,
    rhombus,
    rhombus_walls,
    scene_of,
    walking_drive,
)
from analysis.stability.trial import (
    ENGINES,
    GAIN,
    SOLVER_QUANTITIES,
    SOLVERS,
    Edit,
    Frames,
    engine_cell,
    refused_cell,
    rigid_cell,
    run_frames,
    solver_cell,
    undriven_cell,
)
from nscd import Snapshot, find_contacts, solve
from nscd.arrays import Floats

# Kinetic over elastic energy at the start: dashpots that only push limit what grows, long after
# this.
KICK = 1e-12
SWUNG_STEPS = 600
# Displacements so many times v√(m/k) of the kick are made by the time step: leapfrog's own swings
# just below the critical step are smaller. Energy shows less, since dashpots that only push keep
# what grows small.
GROWN = 100.0


@dataclass(frozen=True, slots=True)
class Packed:
    """A row: disks in a line or along each side of a rhombus, and the engine that runs them."""

    disks: int
    rhombus: bool
    engine: str

    def __str__(self) -> str:
        row = "1 disk" if self.disks == 1 else f"line of {self.disks}"
        return f"{f'{self.disks} × {self.disks}' if self.rhombus else row}, {self.engine}"

    def scene(self, restitution: float) -> Scene:
        """Make the packing, pressed by walls and at rest."""
        return (pressed_rhombus if self.rhombus else pressed_line)(self.disks, restitution)


def packed(engine: str, *packings: tuple[int, bool]) -> tuple[Packed, ...]:
    """Make rows of one engine."""
    return tuple(Packed(*packing, engine) for packing in packings)


def time_step_theory(row: Packed) -> float:
    """Compute 2/ω_max of the row's packing, in √(m/k)."""
    return critical_time_step(row.scene(1.0)) / PERIOD_S


@case(
    columns=(
        "time step / √(m/k)",
        (0.2, 0.4, 0.6, 0.75, 0.9, 1.1, 1.3, 1.6),
        (0.5, 0.75, 1.1, 1.6),
    ),
    # YADE computes the same numbers and takes longer to start: two packings show it
    rows=(
        "packing, engine",
        packed("lammps", (1, False), (10, False), (4, True), (12, True))
        + packed("yade", (1, False), (4, True)),
        packed("lammps", (1, False), (4, True)) + packed("yade", (4, True)),
    ),
    fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
    theory=time_step_theory,
    values={"steps": SWUNG_STEPS, "lattice": 2 / np.sqrt(6)},
)
def time_step(step: float, row: Packed, folder: Path) -> Cell:
    """Run the packing at a time step (in √(m/k)) and see whether its energy grows."""
    return swing(row.scene(1.0), row.engine, step, SWUNG_STEPS, folder)


def swing(scene: Scene, engine: str, step: float, steps: int, folder: Path) -> Cell:
    """Kick a packing that rests and see whether the time step (in √(m/k)) makes it swing."""
    dt = step * PERIOD_S
    scene = kicked(scene, KICK).with_run(time_step_s=dt, duration_s=steps * dt, frames=FRAMES)
    frames = run_frames(scene, engine, folder)
    # an unstable mode alternates from step to step: at a frame its velocity may be 0, its
    # displacement is not
    kick = PERIOD_S * float(np.sqrt((scene.snapshot.velocity**2).mean()))
    away = np.sqrt(((frames.position - scene.snapshot.position) ** 2).mean((1, 2)))
    grown = float(away.max()) / kick if len(frames.time) else float("nan")
    outcome = Outcome.ENERGY_GAIN if grown > GROWN else Outcome.STABLE
    reason = f"swings {grown:.3g} times the kick, {frames.gain:.4g} times the energy of the start"
    return engine_cell(frames, outcome, reason)


DAMPED_ACROSS = 4
# With dashpots what is just unstable grows slowly.
DAMPED_STEPS = 5000


def damping_theory(restitution: float) -> float:
    """Compute where leapfrog with dashpots becomes unstable on the packing, in √(m/k)."""
    return critical_time_step(pressed_rhombus(DAMPED_ACROSS, restitution)) / PERIOD_S


@case(
    columns=(
        "time step / √(m/k)",
        (0.025, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9),
        (0.05, 0.2, 0.5, 1.0),
    ),
    rows=("asked restitution (LAMMPS)", (1.0, 0.5, 0.2, 0.1, 0.01), (1.0, 0.1)),
    fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
    theory=damping_theory,
    values={"across": DAMPED_ACROSS, "steps": DAMPED_STEPS},
)
def damping(step: float, restitution: float, folder: Path) -> Cell:
    """Run a rhombus of that restitution at a time step (in √(m/k)) with LAMMPS."""
    return swing(pressed_rhombus(DAMPED_ACROSS, restitution), "lammps", step, DAMPED_STEPS, folder)


LINE, SHARE = 5, 0.01
RESTITUTION = 0.5
# How much more energy than the loaded contacts have at rest, Σ(jF)²/(2k), after eight times τ.
HOT = 0.01
FORCE_N = MASS_KG * WALKING_M_PER_S / RELAXATION_S


def stiffness_theory(step: float) -> float:
    """Compute k r/F at which the time step (s) is the critical one of the pressed line."""
    pressed = pressed_line(LINE, RESTITUTION)
    held = pressed.model_copy(update={"walls": pressed.walls[1:]})
    k = MASS_KG * (critical_time_step(held) / PERIOD_S / step) ** 2
    return float(k * RADIUS_M / FORCE_N)


@case(
    columns=(
        "stiffness ratio k·r / F",
        tuple(10.0**p for p in range(1, 9)),
        tuple(10.0**p for p in range(2, 7)),
    ),
    rows=("time step (s), LAMMPS", (0.001, 0.003, 0.01), (0.003,)),
    fails_as=(Outcome.ENERGY_GAIN, Outcome.LOST),
    theory=stiffness_theory,
    values={"line": LINE, "restitution": RESTITUTION, "force_n": FORCE_N, "share": SHARE}
    | {"softest": LINE / SHARE},
)
def stiffness(ratio: float, step: float, folder: Path) -> Cell:
    """Drive LINE disks against a wall, k r = ratio times the drive of one, with a time step (s):
    the wall must carry the drive of all, with an overlap below SHARE of r."""
    k = ratio * FORCE_N / RADIUS_M
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
        contact=ContactModel(stiffness_N_per_m=k, restitution=RESTITUTION),
        walls=end_walls(-4.0, far)[1:],
        drive=walking_drive(((far, -1e-3), (far, 1e-3))),
    )
    frames = run_frames(scene, "lammps", folder)
    static = 0.5 * FORCE_N**2 / k * sum(j * j for j in range(1, LINE + 1))
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


BY_LAMMPS = (Collision("lammps", 1.0), Collision("lammps", 0.5), Collision("lammps", 1.0, True))


def mass_ratio_theory(row: Collision) -> float:
    """Compute the mass ratio R at which the dashpot of the heaviest pair makes the restitution OFF
    too small: ζ√((1+R)/2)."""
    if row.restitution == 1 or row.heavy_step:
        return float("nan")
    damping = damping_ratio_for(row.restitution)

    def missed(ratio: float) -> float:
        return restitution_of(damping * np.sqrt((1 + ratio) / 2)) - (row.restitution - OFF)

    return float(brentq(missed, 1.0, 1e6, xtol=1e-12))


@case(
    columns=(
        "heavy mass / light mass",
        (1.0, 2.0, 5.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6),
        (1.0, 1.5, 1e2, 1e6),
    ),
    rows=(
        "engine, asked restitution",
        (*BY_LAMMPS, Collision("yade", 1.0), Collision("yade", 0.5)),
        BY_LAMMPS,
    ),
    fails_as=(Outcome.INACCURATE,),
    theory=mass_ratio_theory,
    values={"off": OFF},
)
def mass_ratio_engines(ratio: float, row: Collision, folder: Path) -> Cell:
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


PRODUCT, PERCUSSIONS = "percussions run", "percussions solve"
GIVEN = (By("lammps", "k", 1e6), By("yade", "k", 1e6), PRODUCT, PERCUSSIONS)
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


def overlap_theory(row: By | str) -> float:
    """Compute the overlap over r whose ½kδ² is the kinetic energy of two who walk."""
    if not isinstance(row, By):
        return float("nan")
    return float(WALKING_M_PER_S * (2 * MASS_KG / row.value) ** 0.5 / RADIUS_M)


@case(
    columns=(
        "overlap / r",
        (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 1.9, 2.0),
        (1e-3, 3e-2, 0.1, 2.0),
    ),
    rows=("who is given it", (By("lammps", "k", 1e4), By("lammps", "k", 1e5), *GIVEN), GIVEN),
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=overlap_theory,
)
def initial_overlap(overlap: float, row: By | str, folder: Path) -> Cell:
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
    elif share > SLIGHT_RELEASE:
        outcome = Outcome.INACCURATE
        reason = f"{released:.3g} J from rest, {share:.2g} of that of walking"
    elif overlap >= 2 and share < SLIGHT_RELEASE:
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


SPEED_M_PER_S = 1.0
STEP_S, SKIN_FRAMES = 0.1 * PERIOD_S, 100
RENEWAL = "neigh_modify every 1 delay 0 check yes binsize 1.0"


@dataclass(frozen=True, slots=True)
class Renewal:
    """A row: the engine, and every how many steps its list is renewed unchecked; None: as its own
    deck or script has it, which checks each step."""

    engine: str
    every: int | None = None

    def __str__(self) -> str:
        checked = "checks each step" if self.engine == "lammps" else "verletDist"
        return f"{self.engine}, {f'every {self.every}' if self.every else checked}"

    def edits(self, skin_m: float) -> list[Edit]:
        """Give the engine's input another skin (m), and its renewal."""
        if self.engine == "yade":
            return [Edit(file="crowd.py", old="SKIN_M = 0.04", new=f"SKIN_M = {skin_m!r}")]
        old = "variable skin index "
        edits = [Edit(file="crowd.in", old=f"{old}0.1", new=f"{old}{skin_m!r}")]
        if self.every:
            unchecked = f"neigh_modify every {self.every} delay 0 check no binsize 1.0"
            edits.append(Edit(file="crowd.in", old=RENEWAL, new=unchecked))
        return edits


def renewals(*every: int) -> tuple[Renewal, ...]:
    """Make the rows of both engines' own decks and of LAMMPS' with unchecked renewals between."""
    return Renewal("lammps"), *(Renewal("lammps", steps) for steps in every), Renewal("yade")


def skin_theory(row: Renewal) -> float:
    """Compute the skin below which a contact is noticed so late, with the overlap
    δ = 2vNΔt − skin, that it adds GAIN to the energy.

    ½μu² + ½k x(t)x(t+Δ), with u the velocity between t and t + Δ and x the overlap, is what
    leapfrog keeps for a spring: with the last step before the contact, of 2vΔt, it adds ½kδ(δ −
    2vΔt)."""
    if row.every is None:
        return float("nan")
    path = 2 * SPEED_M_PER_S * STEP_S
    added = 2 * GAIN * MASS_KG * SPEED_M_PER_S**2 / STIFFNESS_N_PER_M
    late = path / 2 + np.sqrt(path**2 / 4 + added)
    return float(row.every * path - late)


@case(
    columns=(
        "skin of the neighbour list (m)",
        (0.001, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.9),
        (0.01, 0.03, 0.1),
    ),
    rows=("engine, renewal of its list", renewals(10, 30, 100, 400), renewals(30)),
    fails_as=(Outcome.ENERGY_GAIN,),
    theory=skin_theory,
)
def skin(skin_m: float, row: Renewal, folder: Path) -> Cell:
    """Let two disks meet, each at SPEED_M_PER_S, that start just outside the skin (m) of the row's
    neighbour list."""
    gap = skin_m * (1 + 1e-6)
    between = np.ceil((gap + 4 * RADIUS_M) / SPEED_M_PER_S / (SKIN_FRAMES * STEP_S)) * STEP_S
    scene = scene_of(
        disks(line(2, 2 * RADIUS_M + gap), [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]]),
        Run(duration_s=SKIN_FRAMES * between, frames=SKIN_FRAMES, time_step_s=STEP_S),
    )
    frames = run_frames(scene, row.engine, folder, row.edits(skin_m))
    passed = len(frames.position) and frames.position[-1, 1, 0] < frames.position[-1, 0, 0]
    if passed and not frames.gain > 1 + GAIN:
        return engine_cell(frames, Outcome.INACCURATE, "the disks passed through each other")
    return undriven_cell(frames)


def tunnelling_theory(row: By) -> float:
    """Compute the speed, over r√(k/m), at which the centre reaches the wall in leapfrog:
    x_n = vΔ sin(nθ)/sin θ, cos θ = 1 − Δ²/2 with Δ the step over √(m/k); 1 for short steps
    (½mv² = ½kr²)."""
    angle = float(np.arccos(1 - row.value**2 / 2))
    n = np.arange(1, int(np.pi / angle) + 2)
    return float(np.sin(angle) / (row.value * np.sin(n * angle).max()))


@case(
    columns=("speed / (r √(k/m))", (0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 1.1, 1.3, 2.0), (0.5, 0.9, 1.3)),
    rows=(
        "engine, time step (√(m/k))",
        (*By.each("lammps", "Δt", 0.01, 0.1, 0.5, 1.0, 1.5), By("yade", "Δt", 0.1)),
        By.each("lammps", "Δt", 0.1, 1.0),
    ),
    fails_as=(Outcome.LOST,),
    theory=tunnelling_theory,
)
def tunnelling(speed: float, row: By, folder: Path) -> Cell:
    """Let a disk run into a wall, with speed·r√(k/m) and the row's engine and time step (in
    √(m/k))."""
    velocity = speed * RADIUS_M / PERIOD_S
    steps, dt = int(np.ceil(8 / row.value)), row.value * PERIOD_S
    scene = scene_of(
        disks([[0.0, 0.0]], [[velocity, 0.0]]),
        Run(duration_s=steps * dt, frames=min(steps, 40), time_step_s=dt),
        walls=end_walls(-RADIUS_M - 20 * velocity * PERIOD_S, RADIUS_M)[1:],
    )
    frames = run_frames(scene, row.engine, folder)
    if len(frames.position) and float(frames.position[:, 0, 0].max()) > RADIUS_M:
        return engine_cell(frames, Outcome.LOST, "the disk is behind the wall")
    # in mid-contact a long step's energy swings by Δ²/4 without growing: the end counts
    left = float(frames.energy[-1] / frames.energy[0]) if len(frames.time) else float("nan")
    outcome = Outcome.ENERGY_GAIN if left > 1 + GAIN else Outcome.STABLE
    return engine_cell(frames, outcome, f"bounces with {left:.4g} times its energy")


DRIFT_STEPS = 100_000
SLIGHT_DRIFT = 0.01
GAS_ACROSS, SPACING_M, MARGIN_M = 3, 3.0 * RADIUS_M, 1.5 * RADIUS_M


@case(
    columns=(
        "time step / √(m/k)",
        (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2),
        (0.02, 0.1, 0.5),
    ),
    rows=("engine", ENGINES),
    fails_as=(Outcome.ENERGY_GAIN,),
    values={"steps": DRIFT_STEPS},
)
def drift(step: float, engine: str, folder: Path) -> Cell:
    """Run an elastic gas of disks in a closed rhombus for STEPS steps (in √(m/k))."""
    velocity = np.random.default_rng(2).normal(size=(GAS_ACROSS**2, 2))
    dt = step * PERIOD_S
    scene = scene_of(
        disks(rhombus(GAS_ACROSS, SPACING_M), velocity),
        Run(duration_s=DRIFT_STEPS * dt, frames=50, time_step_s=dt),
        walls=rhombus_walls(GAS_ACROSS, SPACING_M, MARGIN_M),
    )
    frames = run_frames(scene, engine, folder)
    change = float(frames.energy[-1] / frames.energy[0] - 1) if len(frames.time) else float("nan")
    corner = scene.walls[0].start_m
    outside = _outside(corner, frames.position[-1]) if len(frames.time) else 0
    outcome, reason = Outcome.STABLE, f"energy {change:+.2g} of the start after {DRIFT_STEPS} steps"
    if outside:
        outcome, reason = Outcome.LOST, f"{outside} disks are outside the walls"
    elif not abs(change) <= SLIGHT_DRIFT:
        outcome = Outcome.ENERGY_GAIN if change > GAIN else Outcome.INACCURATE
        reason = f"energy {change:+.3g} of the start after {DRIFT_STEPS} steps"
    return engine_cell(frames, outcome, reason)


def _outside(corner: tuple[float, float], position: Floats) -> int:
    """Count the centres outside the rhombus that the walls bound."""
    side = SPACING_M * (GAS_ACROSS - 1) + 2 * MARGIN_M / np.sqrt(0.75)
    basis = np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]])
    shares = np.linalg.solve(basis, (position - np.array(corner)).T) / side
    return int(((shares < 0) | (shares > 1)).any(0).sum())


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


def door_theory(row: By | str) -> float:
    """Compute the width over 2r below which two posts hold a disk that is pushed by F: the largest
    axial force of two springs at the posts is 2kr(1 − (a/r)^⅔)^(3/2) with a half the width, so
    a/r = (1 − (F/(2kr))^⅔)^(3/2)."""
    if not isinstance(row, By):
        return float("nan")
    return float((1 - (row.value / 2) ** (2 / 3)) ** 1.5)


@case(
    columns=(
        "width of the door / diameter",
        (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 1.1),
        (0.5, 0.8, 0.97, 1.1),
    ),
    rows=(
        "engine, drive over k·r",
        (
            *By.each("lammps", "F/(k·r)", 0.5, 0.2, 0.1, 0.03, 0.01, 0.001),
            *By.each("yade", "F/(k·r)", 0.2, 0.01),
            PERCUSSIONS,
        ),
        (*By.each("lammps", "F/(k·r)", 0.1, 0.001), PERCUSSIONS),
    ),
    fails_as=(Outcome.LOST,),
    theory=door_theory,
    values={"longest_periods": LONGEST_PERIODS, "longest_s": LONGEST_S},
)
def narrow_door(width: float, row: By | str, folder: Path) -> Cell:
    """Put a disk before a door of width·2r, with the row's engine and drive (over k·r), or as a
    rigid one."""
    if not isinstance(row, By):
        return _rigid_door(width)
    scene = door_scene(width, row.value)
    frames = run_frames(scene, row.engine, folder)
    through = bool(len(frames.position)) and float(frames.position[-1, 0, 0]) > RADIUS_M
    if through and width < 1:
        return engine_cell(frames, Outcome.LOST, "squeezed through a door narrower than itself")
    return engine_cell(frames, Outcome.STABLE, "walks through" if through else "is held")


def _rigid_door(width: float) -> Cell:
    scene = door_scene(width, 1e-3)
    snapshot = scene.snapshot
    near = find_contacts(snapshot, scene.wall_segments(), tolerance=2 * APART * RADIUS_M)
    assert scene.drive is not None
    desired = scene.drive.desired_velocity(snapshot.position, snapshot.ids)
    answer = solve(snapshot, near, left_velocity=desired)
    through = float(answer.right_velocity[0, 0]) > 1e-6
    outcome = Outcome.LOST if through and width < 1 else Outcome.STABLE
    return rigid_cell(outcome, "walks through" if through else "is held", str(answer.status))


# How far the velocities of two elastic disks after their impact may be off, over the speed. Above
# the boundary that this gives, rounded steps still make errors of up to 5.9 %, here and there.
SLOW_OFF = 0.1
SLOW_ACROSS = 4


def small_speeds_theory(row: By | str) -> float:
    """Compute for an engine the speed (ulp/Δt)(1 − √(2q/(1+q)))/(1 − q) below which the struck disk
    leaves too fast by q = OFF.

    The struck disk, at x = 2 r, stays where it is until its path in a step is half a unit in the
    last place of x, and then moves by a whole one, g(u) = ulp/Δt · round(uΔt/ulp). Momentum is
    exchanged rightly, the overlap changes by v − u − g(u) a second, and the contact ends at the u
    with ∫₀ᵘ (v − s − g(s)) ds = 0. NaN for solvers."""
    if not isinstance(row, By):
        return float("nan")
    unit = np.spacing(2 * RADIUS_M) / (row.value * PERIOD_S)
    return float(unit * (1 - np.sqrt(2 * SLOW_OFF / (1 + SLOW_OFF))) / (1 - SLOW_OFF))


@case(
    columns=(
        "speed (m/s)",
        (1.0, 1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-15, 1e-50, 1e-100, 1e-160, 1e-310, 0.0),
        (1.0, 1e-8, 1e-11, 1e-13, 1e-100, 0.0),
    ),
    rows=(
        "solver; engine, time step (√(m/k))",
        (*SOLVERS, *By.each("lammps", "Δt", 0.001, 0.01, 0.1), By("yade", "Δt", 0.01)),
        (*SOLVERS, By("lammps", "Δt", 0.01)),
    ),
    quantities=SOLVER_QUANTITIES,
    fails_as=(Outcome.INACCURATE,),
    theory=small_speeds_theory,
)
def small_speeds(speed: float, row: By | str, folder: Path) -> Cell:
    """Give velocities of the size `speed` (m/s) to a solver, or to an engine with a time step (in
    √(m/k)). The law of impact has no scale, so the answer must be that of 1 m/s times speed; in an
    engine two elastic disks must still exchange their velocities to OFF."""
    return _slow_engine(speed, row, folder) if isinstance(row, By) else _slow_solver(speed, row)


def _slow_engine(speed: float, row: By, folder: Path) -> Cell:
    run = Run(duration_s=8 * PERIOD_S, frames=FRAMES, time_step_s=row.value * PERIOD_S)
    scene = scene_of(disks(line(2), [[speed, 0.0], [0.0, 0.0]]), run)
    frames = run_frames(scene, row.engine, folder)
    after = frames.velocity[-1, :, 0] if len(frames.velocity) else np.full(2, np.nan)
    error = float(np.abs(after - [0.0, speed]).max()) / (speed or 1.0)
    good = error <= SLOW_OFF
    outcome = Outcome.STABLE if good else Outcome.INACCURATE
    word = "right" if good else "wrong"
    reason = f"velocities after the impact are {word} by {error:.2g} of the speed"
    cell = engine_cell(frames, outcome, reason)
    return dataclasses.replace(cell, numbers=(error, np.nan, np.nan))


def _slow_solver(speed: float, solver: str) -> Cell:
    unit = np.random.default_rng(1).normal(size=(SLOW_ACROSS**2, 2))
    snapshot = disks(rhombus(SLOW_ACROSS), unit)
    contacts = contacts_of(snapshot, corner_walls(SLOW_ACROSS))
    _, reference = dense_percussions(snapshot, contacts, unit)
    try:
        answer = solve(snapshot, contacts, left_velocity=speed * unit, solver=solver)
    except ArithmeticError as error:
        name, nothing = type(error).__name__, (float("nan"),) * len(SOLVER_QUANTITIES)
        reason = f"ends with {name}: {error}"
        return Cell(outcome=Outcome.NOT_CONVERGED, reason=reason, said=name, numbers=nothing)
    return solver_cell(answer, speed * reference, speed * float(np.abs(unit).max()))


RESTART_ACROSS, HALF_S, RESTART_STEPS = 3, 0.2, 1000
# In r: a dashpot that sees the velocity of half a step before changes by this much at most when it
# starts afresh.
SAME = 1e-5


@case(
    columns=("friction", (0.0, 0.01, 0.1, 0.3, 0.5, 1.0), (0.0, 0.5)),
    rows=("engine", ENGINES),
    quantities=("difference of positions / r",),
    fails_as=(Outcome.INACCURATE,),
    values={"same": SAME},
)
def restart(friction: float, engine: str, folder: Path) -> Cell:
    """Stir up a packing for 2 · HALF_S: in one run, and in two of which the second starts from what
    the dump of the first ends with."""
    velocity = np.random.default_rng(3).normal(size=(RESTART_ACROSS**2, 2))
    first = scene_of(
        disks(rhombus(RESTART_ACROSS), velocity),
        Run(duration_s=HALF_S, frames=5, time_step_s=HALF_S / RESTART_STEPS),
        contact=ContactModel(
            stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=0.5, friction=friction
        ),
        walls=rhombus_walls(RESTART_ACROSS),
    )
    whole = first.with_run(duration_s=2 * HALF_S, frames=10)
    in_one = run_frames(whole, engine, folder / "whole")
    half = run_frames(first, engine, folder / "first")
    second = first.model_copy(update={"snapshot": _last(half, first.snapshot)})
    in_two = run_frames(second, engine, folder / "second")
    apart = _apart(in_one, in_two)
    outcome = Outcome.STABLE if apart <= SAME else Outcome.INACCURATE
    cell = engine_cell(in_two, outcome, f"positions differ by {apart:.2g} r")
    return dataclasses.replace(cell, numbers=(apart,))


def _last(frames: Frames, start: Snapshot) -> Snapshot:
    """The disks of the last frame, spins included."""
    last = {name: getattr(frames, name)[-1] for name in ("position", "velocity", "spin")}
    return dataclasses.replace(start, **last)


def _apart(one: Frames, two: Frames) -> float:
    if one.trouble or two.trouble:
        return float("nan")
    return float(np.abs(one.position[-1] - two.position[-1]).max() / RADIUS_M)
