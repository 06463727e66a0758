"""The penalty law in numbers: damping for an asked restitution, the restitution really obtained, a
time step, and what friction does at the joints of walls."""

import math
from dataclasses import dataclass

import numpy as np

from analysis.engines.guard import speed_most
from analysis.engines.record import Timing, divided
from analysis.scene.scene import Scene
from nscd import Snapshot
from nscd.contacts import connected

# A damping ratio beyond this costs time steps and changes the restitution by less than 0.0024.
LARGEST_DAMPING_RATIO = 10.0
STEP_FRACTION = 0.1
# A disk of the fastest speed asked for moves no more of its radius in a step; the guard allows twice.
CROSSING_FRACTION = 0.05


def restitution_of(damping_ratio: float) -> float:
    """Restitution of two bodies that repel with max(0, kδ + cδ'), at damping ratio ζ = c / (2 √(k
    m_eff)).

    e = exp(−ζφ/s), s = √(1−ζ²), φ = atan2(2ζs, 2ζ²−1) for ζ < 1; e⁻² at ζ = 1; exp(−(ζ/s)
    ln((ζ+s)/(ζ−s))), s = √(ζ²−1), beyond. Schwager & Pöschel, Granular Matter 9 (2007) 465."""
    z = damping_ratio
    if abs(z - 1) < 1e-9:
        return float(np.exp(-2.0))
    s = np.sqrt(abs(1 - z * z))
    angle = np.arctan2(2 * z * s, 2 * z * z - 1) if z < 1 else np.log((z + s) / (z - s))
    return float(np.exp(-z / s * angle))


def damping_ratio_for(restitution: float) -> float:
    """The damping ratio whose restitution is the one asked, at most 10 (restitution 0.0024)."""
    if restitution >= 1:
        return 0.0
    if restitution <= restitution_of(LARGEST_DAMPING_RATIO):
        return LARGEST_DAMPING_RATIO
    low, high = 0.0, LARGEST_DAMPING_RATIO
    while low < (middle := (low + high) / 2) < high:  # bisection; SciPy takes 0.3 s to import
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low


@dataclass(frozen=True, slots=True, kw_only=True)
class Penalty(Timing):
    """Numbers of a scene's penalty law, the same in every engine with springs (SI).

    One stiffness and one dashpot serve all disk contacts, others all wall contacts. The dashpots
    have the asked damping ratio at the heaviest disks; lighter ones are damped more: their
    restitution is between restitution_least and restitution_most, which are what is really
    obtained. Hertz contacts have the tangent stiffness `stiffness` at an overlap of 1 % of the mean
    radius, and all the same damping ratio, so both restitutions are the same; the dashpot constants
    are then those of the linear law of that stiffness. `body` has the restitutions of the linear
    law of its nominal stiffness: harder hits rebound more."""

    stiffness: float  # N/m
    damping: float  # N·s/m, between disks
    wall_stiffness: float  # N/m
    wall_damping: float  # N·s/m
    tangential_stiffness: float  # N/m, between disks; 0 without friction
    wall_tangential_stiffness: float  # N/m
    friction: float


def contact_masses(disks: Snapshot) -> tuple[float, float]:
    """The smallest and largest mass (kg) that a contact without friction can meet: of a body of mass M
    and inertia I, 1/(1/M + l²/I) at the largest lever l, and M."""
    if (of := disks.bodies) is None:
        return float(disks.mass.min()), float(disks.mass.max())
    lever = np.hypot(*(disks.position - of.centre[of.number]).T)
    met = 1 / (1 / of.mass[of.number] + lever**2 / of.inertia[of.number])
    return float(met.min()), float(of.mass.max())


def penalty_of(scene: Scene) -> Penalty:
    """The numbers of the scene's contact law and run. The safe time step is 0.1 √(m/k) / max(1, 2ζ)
    at the lightest disk (`contact_masses`) and the stiffest contact, and at most what takes a disk of the smallest
    radius and the fastest speed asked for 0.05 r on its way."""
    contact, run = scene.contact, scene.run
    k, wall_k = contact.stiffness_N_per_m, contact.at_walls
    tangential = contact.tangential_ratio if contact.friction else 0.0
    # damping on approach only gives the root of what a clipped dashpot gives
    power = 0.5 if contact.kind.dashpot == "apart" else 1.0
    ratio = damping_ratio_for(contact.restitution ** (1 / power))
    lightest, heaviest = contact_masses(scene.snapshot)
    # the dashpot of hertz grows with the masses: every contact has the same damping ratio
    by_mass = np.sqrt(heaviest / lightest) if contact.kind.dashpot != "tangent" else 1.0
    largest_ratio = ratio * by_mass
    stiffest = contact.stiffest(float(scene.snapshot.radius.mean()))
    shortest = float(np.sqrt(lightest / stiffest) / max(1.0, 2 * largest_ratio))
    crossing = float(scene.snapshot.radius.min()) / (speed_most(scene) + 1e-300)
    safe = min(STEP_FRACTION * shortest, CROSSING_FRACTION * crossing)
    wall_damping = 2 * ratio * float(np.sqrt(wall_k * heaviest))
    safe = min(safe, giving_step(scene, stiffest, wall_damping))
    try:
        step, interval = divided(run, run.time_step_s or safe)
    except OverflowError as error:
        raise ValueError(
            f"{scene.name}: run.duration_s: {run.duration_s:g} s are {error}. "
            f"The safe step is {safe:.3g} s at a stiffness of {stiffest:g} N/m"
        ) from None
    return Penalty(
        stiffness=k,
        damping=2 * ratio * float(np.sqrt(k * heaviest / 2)),
        wall_stiffness=wall_k,
        wall_damping=wall_damping,
        damping_ratio=ratio,
        restitution_least=restitution_of(largest_ratio) ** power,
        restitution_most=restitution_of(ratio) ** power,
        tangential_stiffness=tangential * k,
        wall_tangential_stiffness=tangential * wall_k,
        friction=contact.friction,
        time_step=step,
        safe_time_step=safe,
        steps=interval * run.frames,
        frame_interval=interval,
    )


def giving_step(scene: Scene, stiffness: float, damping: float) -> float:
    """Return the safe step (s) of walls that give, each pressed by as many of the smallest disks as have
    room: 0.1 min(√(m/K), m/C) with all springs K and dashpots C on it; infinite where none gives."""
    narrow, longest = 2 * float(scene.snapshot.radius.min()), np.inf
    for wall in scene.giving():
        mass, k, c = wall.oscillator or (np.inf, 0.0, 0.0)
        count = min(len(scene.snapshot), math.dist(wall.start_m, wall.end_m) // narrow + 1)
        springs, dashpots = k + count * stiffness, c + count * damping + 1e-300
        longest = min(longest, STEP_FRACTION * min(math.sqrt(mass / springs), mass / dashpots))
    return float(longest)


# N, of the force for which a length is said.
FORCE = 1000.0


def friction_at_joints(scene: Scene) -> str:
    """Say how far friction is off where disks slide from wall to wall; nothing where none does from
    where it stands at the start.

    Walls that meet hand a disk from one to the next where they are in line, or at a corner that
    points at it. Its tangential spring then begins at zero, and is back after a sliding of μF/k_t."""
    if not scene.contact.friction or not (joints := _passed(scene)):
        return ""
    law = penalty_of(scene)
    length = law.friction * FORCE / law.tangential_stiffness
    return (
        f"friction at {joints} joints of walls: the tangential spring of a disk that slides over "
        f"one begins again at zero. Its friction is too small over the next {length:.2g} m (at {FORCE:g} N, "
        "in proportion to the force)"
    )


def _passed(scene: Scene) -> int:
    """How many joints some disk is not within the corner of."""
    walls = scene.wall_segments()
    if not len(walls):
        return 0
    meeting = connected(walls)
    ends = np.stack([walls.start, walls.end], axis=1)
    passed = 0
    for vertex in np.unique(meeting.vertex):
        wall, side = np.nonzero(meeting.vertex == vertex)
        if len(wall) < 2:
            continue
        arms = ends[wall, 1 - side] - ends[wall, side]
        (a, b), away = arms[:2], scene.snapshot.position - ends[wall[0], side[0]]
        across = a[0] * b[1] - a[1] * b[0]
        # away = α a + β b: within the corner where α, β > 0
        alpha = away[:, 0] * b[1] - away[:, 1] * b[0]
        beta = a[0] * away[:, 1] - a[1] * away[:, 0]
        within = (alpha * across > 0) & (beta * across > 0)
        passed += len(wall) > 2 or not within.all()
    return passed
