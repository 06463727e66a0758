"""What the rigid engine fails at."""

import functools
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from analysis.studies.stability.case import Cell, Of, Outcome, case
from analysis.studies.stability.crowds import MASS_KG, RADIUS_M, disks
from analysis.studies.stability.trial import cell
from nscd import ContactLaw, Contacts, Snapshot, Status, Walls, solve
from nscd.stepping import Motion, Push, StepError
from nscd.stepping.arms import neighbours
from nscd.stepping.motion import segments_of

SPEED_M_PER_S, RELAXATION_S, STEP_S = 2.0, 0.5, 0.005
# By so much of its velocity a disk that touches nobody may differ from free flight.
FREE = 1e-6


@functools.cache
def worst(clearance: float) -> tuple[float, float]:
    """Find the distance along the way (m), and the length of a step (m) from which on it is wrong.

    Two disks pass with a clearance (m). From d before the nearest point the linearised gap allows
    v h d/ρ ≤ ρ − 2r with ρ² = d² + (2r + clearance)²; d is where the least v h reaches that."""
    beside = 2 * RADIUS_M + clearance

    def reach(ahead: float) -> float:
        distance = float(np.hypot(ahead, beside))
        return distance * (distance - 2 * RADIUS_M) / ahead

    found = minimize_scalar(reach, bounds=(1e-3 * RADIUS_M, 20 * RADIUS_M), method="bounded")
    return float(found.x), float(found.fun)


def long_step_theory(clearance: float) -> float:
    """Give the shortest way in a step, over the radius, that is wrong."""
    return worst(clearance)[1] / RADIUS_M


@case(
    columns=("way in a step / radius", 0.01, 0.02, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0),
    few_columns=(0.01, 0.06, 0.25, 1.0),
    rows=("clearance (m)", 0.001, 0.01),
    quantities=("change of velocity / speed", "largest overlap / radius", "residual"),
    fails_as=(Outcome.INACCURATE,),
    theory=long_step_theory,
)
def long_step(way: float, clearance: float, folder: Path) -> Cell:
    """Let a disk pass another in steps of so much of its radius, the first from the worst place."""
    ahead, _ = worst(clearance)
    anchor = [[-ahead, 2 * RADIUS_M + clearance], [0.0, 0.0]]
    snapshot = disks(anchor, [[SPEED_M_PER_S, 0.0], [0.0, 0.0]])
    motion = Motion(snapshot, step=way * RADIUS_M / SPEED_M_PER_S, tolerance=1e-10)
    residual = overlap = 0.0
    while motion.position[0, 0] < ahead:
        residual = max(residual, motion.advance().residual)
        overlap = max(overlap, motion.overlap / RADIUS_M)
        if motion.velocity[0, 0] < 0.1 * SPEED_M_PER_S:
            break
    changed = float(np.hypot(*(motion.velocity[0] - snapshot.velocity[0])) / SPEED_M_PER_S)
    reason = f"it touches nobody and its velocity changes by {changed:.2g} of its speed"
    held_back = (not changed <= FREE, Outcome.INACCURATE, reason)
    return cell("0", (changed, overlap, residual), reason, held_back)


GAPS = 40
# Overlaps (m) that a step with all its contacts does not leave.
NONE_M = 1e-9


def margin_theory(step_s: float) -> float:
    """Give the widest gap tried that closes within a step, over the way of one disk."""
    return 2.0 * GAPS / (GAPS + 1)


@case(
    columns=("margin of the search / way in a step", 0.25, 0.5, 1.0, 1.5, 2.5, 4.0),
    few_columns=(0.5, 1.0, 3.0),
    rows=("step (s)", 0.005, 0.02),
    quantities=("largest overlap / way in a step", "gaps missed", "gaps tried"),
    fails_as=(Outcome.INACCURATE,),
    theory=margin_theory,
    values={"gaps": GAPS},
)
def missed_contacts(margin: float, step_s: float, folder: Path) -> Cell:
    """Let two disks run into each other from many gaps, where a step looks as far as so many ways
    of one disk; what it does not see passes freely."""
    way = SPEED_M_PER_S * step_s
    missed, deepest = 0, 0.0
    for gap in np.linspace(0.0, 2 * way, GAPS + 2)[1:-1]:
        start = disks(
            [[-RADIUS_M - gap / 2, 0.0], [RADIUS_M + gap / 2, 0.0]],
            [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]],
        )
        motion = Motion(start, step=step_s)
        observed = len(neighbours(motion.position, motion.radius, segments_of(None), margin * way).gap)
        if observed:
            motion.advance()
        else:
            motion.position = motion.position + step_s * motion.velocity
        missed += not observed
        deepest = max(deepest, motion.overlap)
    reason = f"{missed} of {GAPS} gaps not seen, overlap {deepest:.2g} m after one step"
    overlaps = (not deepest <= NONE_M, Outcome.INACCURATE, reason)
    return cell("0", (deepest / way, float(missed), float(GAPS)), reason, overlaps)


CORNER_DISKS = 30
# The overlap (m) that a rigid run may have.
ALLOWED_M = 1e-6


def crowd() -> tuple[Snapshot, Walls]:
    """Make people in a row of three who press into a closed corner."""
    random = np.random.default_rng(5)
    radius = RADIUS_M * random.uniform(0.8, 1.0, CORNER_DISKS)
    column, row = np.divmod(np.arange(CORNER_DISKS), 3)
    position = np.column_stack([-(column + 1.0), row + 1.0]) * 2.2 * RADIUS_M
    wall = Walls(
        start=np.array([[0.0, -1.0], [-30.0, 0.0], [-30.0, 7.7 * RADIUS_M]]),
        end=np.array([[0.0, 10.0], [1.0, 0.0], [1.0, 7.7 * RADIUS_M]]),
    )
    return Snapshot(position=position, radius=radius, mass=np.full(CORNER_DISKS, 75.0)), wall


def pushed(snapshot: Snapshot, walls: Walls, tolerance: float) -> Motion:
    """Let all walk along x."""
    wish = np.tile([SPEED_M_PER_S, 0.0], (len(snapshot), 1))
    push = Push(desired=lambda position: wish, relaxation_time=RELAXATION_S)
    return Motion(snapshot, walls, step=STEP_S, push=push, tolerance=tolerance)


@case(
    columns=("tolerance of a step", 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1),
    few_columns=(1e-8, 1e-4, 1e-1),
    rows=("time pressed (s)", 3.0, 12.0),
    few_rows=(3.0,),
    quantities=("largest overlap (m)", "overlap of the last third / of the middle one", "residual"),
    fails_as=(Outcome.INACCURATE, Outcome.NOT_CONVERGED),
    values={"disks": CORNER_DISKS},
)
def left_overlap(tolerance: float, seconds: float, folder: Path) -> Cell:
    """Press them for so many seconds with so tolerant a solver."""
    motion = pushed(*crowd(), tolerance)
    overlaps, residual = [], 0.0
    try:
        for _ in range(round(seconds / STEP_S)):
            residual = max(residual, motion.advance().residual)
            overlaps.append(motion.overlap)
    except StepError as error:
        return cell("3", (float("nan"),) * 3, "", (True, Outcome.NOT_CONVERGED, str(error)))
    third = len(overlaps) // 3
    largest, middle, last = max(overlaps), max(overlaps[third:-third]), max(overlaps[-third:])
    reason = f"overlap of {largest:.2g} m at most, {last:.2g} m in the last third"
    numbers = (largest, last / middle if middle else 0.0, residual)
    return cell("0", numbers, reason, (not largest <= ALLOWED_M, Outcome.INACCURATE, reason))


STEPS = 100
LINE_DISKS = 12
# Rows: how exactly a step is solved; from 1e-6 on by accelerated gradient.
TOLERANCES = (
    Of("0.0001, accelerated gradient", (1e-4,)),
    Of("1e-06, accelerated gradient", (1e-6,)),
    Of("1e-08, exact", (1e-8,)),
)


@case(
    columns=("mass ratio", 1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8),
    few_columns=(1.0, 1e4, 1e8),
    rows=("tolerance", *TOLERANCES),
    quantities=("steps made", "largest residual", "largest overlap / radius"),
    fails_as=(Outcome.NOT_CONVERGED,),
    values={"disks": LINE_DISKS, "steps": STEPS},
)
def unsolved_step(ratio: float, row: Of, folder: Path) -> Cell:
    """Press a line of disks, every other one so many times lighter, against a wall."""
    mass = np.where(np.arange(LINE_DISKS) % 2, MASS_KG / ratio, MASS_KG)
    along = -(2.05 * np.arange(LINE_DISKS) + 1.05) * RADIUS_M
    positions = np.column_stack([along, np.zeros(LINE_DISKS)])
    wall = Walls(start=np.array([[0.0, -1.0]]), end=np.array([[0.0, 1.0]]))
    motion = pushed(disks(positions, mass=mass), wall, *row.values)
    residual, made, why = 0.0, 0, ""
    try:
        while made < STEPS:
            residual = max(residual, motion.advance().residual)
            made += 1
    except StepError as error:
        why = str(error)
    numbers = (float(made), residual, motion.overlap / RADIUS_M)
    reason = f"{STEPS} steps, residual at most {residual:.2g}"
    return cell("3" if why else "0", numbers, reason, (bool(why), Outcome.NOT_CONVERGED, why))


DRAWN, STARTS = 60, 8
# Differences of u⁺ (m/s, of speeds about 1) that the tolerance explains.
SAME = 1e-6


def wedged(apart_deg: float, random: np.random.Generator) -> tuple[Snapshot, Contacts]:
    """Make a disk that moves at random and touches two walls, whose normals are so far apart."""
    angle = np.radians(random.uniform(0.0, 360.0) + np.array([0.0, apart_deg]))
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    snapshot = Snapshot(
        position=np.zeros((1, 2)),
        velocity=random.normal(size=(1, 2)),
        radius=np.ones(1),
        mass=np.full(1, 75.0),
        spin=random.normal(size=1),
    )
    who = {"first": np.zeros(2, dtype=int), "second": np.arange(2)}
    walls, gap = np.ones(2, dtype=bool), np.zeros(2)
    return snapshot, Contacts(**who, is_wall=walls, normal=normal, gap=gap, point=normal)


@case(
    columns=("friction", 0.1, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0),
    few_columns=(0.3, 1.0, 3.0),
    rows=("angle between the normals (°)", 90.0, 120.0, 150.0),
    quantities=("largest spread of u⁺ (m/s)", "disks with several answers", "disks tried"),
    fails_as=(Outcome.INACCURATE,),
    values={"drawn": DRAWN, "starts": STARTS},
)
def several_answers(friction: float, apart_deg: float, folder: Path) -> Cell:
    """Solve for many disks between two walls from several starts, and see how far apart their u⁺
    are."""
    random = np.random.default_rng(7)
    spreads, unsolved = [], 0
    for _ in range(DRAWN):
        snapshot, contacts = wedged(apart_deg, random)
        law = ContactLaw(friction=friction)
        solution = solve(snapshot, contacts, law=law, tolerance=1e-10, starts=STARTS)
        unsolved += solution.status is not Status.SOLVED
        spread = solution.friction.spread if solution.friction else 0.0
        spreads.append(0.0 if np.isnan(spread) else spread)
    several = sum(spread > SAME for spread in spreads)
    reason = f"{several} of {DRAWN} disks have several u⁺, up to {max(spreads):.2g} m/s apart"
    ills = (
        (unsolved > 0, Outcome.NOT_CONVERGED, reason),
        (several > 0, Outcome.INACCURATE, reason),
    )
    return cell("solved", (max(spreads), float(several), float(DRAWN)), reason, *ills)
