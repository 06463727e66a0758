"""Forces on people by percussions, the first-order model, the social force and Löhner's law: of a
pair, along a chain, in a crowd, before a blocked exit and in an evacuation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, root

from analysis.compare.comparison import compare_run, correlation, relative_difference
from analysis.pages.names import ENGINE_NAMES
from analysis.percussions.snapshot import percussions_of
from analysis.scene.drive import Drive
from analysis.scene.real.separate import reconcile
from analysis.scene.scene import Scene
from analysis.studies.paper.discrete.pressed_crowd import AT_REST_M_PER_S, Arch, Blocked
from analysis.studies.paper.solutions import unsolved, with_progress
from analysis.support.parallel import Progress
from nscd import Contacts, Percussions, Snapshot, Walls, _core, find_contacts, rivals, solve
from nscd.arrays import Floats

RADIUS_M = 0.25
MASS_KG = 75.0


def pair_forces(gap: Floats, radius: float, limit: float) -> dict[str, Floats]:
    """Compute forces (N) of pairs of equal disks with the given gaps (m), by law."""
    n, cycle = len(gap), 10.0 * np.arange(len(gap))
    left, right = np.column_stack([0 * gap, cycle]), np.column_stack([2 * radius + gap, cycle])
    radii, masses = np.full(2 * n, radius), np.full(2 * n, MASS_KG)
    pairs = Snapshot(position=np.concatenate([left, right]), radius=radii, mass=masses)
    contacts = find_contacts(pairs, tolerance=float(max(gap.max(), 0.0)) + 1e-9)
    social = rivals.social_force(pairs, contacts)
    forces = {"repulsion": social.repulsion, "body": social.body, "social": social.normal}
    for reading in rivals.LoehnerReading:
        found = rivals.loehner_force(pairs, contacts, limit, reading, tolerance=1e-12)
        forces[reading] = found.on_first
    return forces


def ratio_of_sizes(overlap: float, radii: tuple[float, float]) -> float:
    """Divide the social force of a pair of the second radius (m) by that of the first at the same
    overlap (m)."""
    small, large = (pair_forces(np.array([-overlap]), radius, 1.0)["social"][0] for radius in radii)
    return float(large / small)


def pair_rows(limit: float) -> list[list[float]]:
    """Tabulate gap (mm) and forces (N) of one pair at a few gaps, by law."""
    gap = np.array([-0.02, -0.005, 0.0, 0.02, 0.1, 0.3, 0.5])
    columns = [1e3 * gap, *pair_forces(gap, RADIUS_M, limit).values()]
    rows: list[list[float]] = np.column_stack(columns).tolist()
    return rows


# A social force below this is none.
LEFT_OUT_N = 1e-6


Chain = Mapping[str, Floats]
"""Normal forces (k,) N at the contacts of a chain, from its free end to the wall, by `chain_forces`."""


def chain_forces(scene: Scene, relaxation_time: float) -> tuple[Chain, list[str]]:
    """Compute the forces of a chain whose left velocities are the desired ones, people being driven
    by m u_d/τ toward the wall; and what was not solved.

    mass: kg, of the disk before a contact. percussion: p/τ. first_order: λ m̄/τ with the mean mass
    m̄. social: one contact of the touching chain; social_section: all pairs that act across it.
    social_at_rest, gap_at_rest (m): one contact where the social forces balance the drive.
    loehner_printed, loehner_text: at touch, the mean of what the two receive."""
    snapshot, walls = scene.snapshot, scene.wall_segments()
    found = percussions_of(scene, snapshot, tolerance=1e-10)
    contacts, model = found.contacts, rivals.first_order(snapshot, found.contacts)
    drive = snapshot.mass * snapshot.velocity[:, 0] / relaxation_time
    warnings = unsolved_of(scene.name, found.solution, model)
    law = rivals.SocialForceLaw()
    rest, error = _social_rest(snapshot, walls, drive, law)
    if error > 1e-6:
        left = f"a force of {error:.1e} N is left unbalanced"
        warnings.append(f"{scene.name}, social force at rest: {left}")
    nearest = all_pairs(rest, walls)
    follows = nearest.second == nearest.first + 1
    # the last disk and the wall are neighbours too
    nearest = nearest.select(np.where(nearest.is_wall, nearest.first == len(rest) - 1, follows))
    tolerance = scene.analysis.contact_tolerance_m
    chain = {
        "mass": snapshot.mass,
        "percussion": (found.solution.impulse * contacts.normal).sum(1) / relaxation_time,
        "first_order": model.multiplier * snapshot.mass.mean() / relaxation_time,
        "social": rivals.social_force(snapshot, contacts, law).normal,
        "social_section": _across_sections(snapshot, all_pairs(snapshot, walls), law),
        "social_at_rest": rivals.social_force(rest, nearest, law).normal,
        "gap_at_rest": nearest.gap,
    }
    for reading in rivals.LoehnerReading:
        loehner = rivals.loehner_force(snapshot, contacts, drive, reading, tolerance=tolerance)
        chain[f"loehner_{reading}"] = mean_received(loehner)
    return chain, warnings


def unsolved_of(name: str, solution: Percussions, model: rivals.FirstOrderAnswer) -> list[str]:
    """List which of the two answers for a scene are not solved, and why."""
    return unsolved([(f"{name}, percussions", solution), (f"{name}, first-order model", model)])


def mean_received(found: rivals.LoehnerForces) -> Floats:
    """Give what the two of a pair receive on average, and the disk at a wall, (k,) N."""
    both = 0.5 * (found.on_first + found.on_second)
    return np.asarray(np.where(found.pairs.is_wall, found.on_first, both), dtype=np.float64)


def gap_that_carries(force: float, law: rivals.SocialForceLaw) -> float:
    """Find the gap (m; negative: an overlap) at which the social force of one pair is `force` N."""
    low, high = -1.0, law.reach(min(LEFT_OUT_N, force))

    def excess(gap: float) -> float:
        return float(law.repulsion(np.array(gap)) + law.body(np.array(gap))) - force

    return float(brentq(excess, low, high))


def _social_rest(
    snapshot: Snapshot, walls: Walls, drive: Floats, law: rivals.SocialForceLaw
) -> tuple[Snapshot, float]:
    """The chain where the social forces of all pairs balance the drive, and the largest unbalanced
    force (N)."""
    # each contact carries what is driven behind it, as the start of a search that also counts pairs
    # further apart
    gaps = np.array([gap_that_carries(force, law) for force in np.cumsum(drive)])
    spread = np.cumsum(gaps[::-1])[::-1]

    def at(location: Floats) -> Snapshot:
        position = np.column_stack([location, snapshot.position[:, 1]])
        return replace(snapshot, position=position, velocity=np.zeros_like(position))

    def unbalanced(position: Floats) -> Floats:
        forces = rivals.social_force(at(position), all_pairs(at(position), walls), law)
        return np.asarray(forces.resultant()[:, 0] + drive)

    found = root(unbalanced, snapshot.position[:, 0] - spread, tol=1e-12)
    return at(found.x), float(np.abs(unbalanced(found.x)).max())


def all_pairs(snapshot: Snapshot, walls: Walls) -> Contacts:
    """Find the pairs whose social force is beyond LEFT_OUT_N, walls included."""
    return find_contacts(snapshot, walls, tolerance=rivals.SocialForceLaw().reach(LEFT_OUT_N))


def _across_sections(snapshot: Snapshot, pairs: Contacts, law: rivals.SocialForceLaw) -> Floats:
    force = rivals.social_force(snapshot, pairs, law).normal
    other = np.where(pairs.is_wall, len(snapshot), pairs.second)
    section = np.arange(len(snapshot))[:, None]
    across = (pairs.first <= section) & (section < other)
    return np.asarray((across * force).sum(1))


def chain_rows(chain: Chain) -> list[tuple[float, ...]]:
    """Tabulate the forces of one chain, a row per contact, the gap in mm."""
    columns = {**chain, "gap_at_rest": 1e3 * chain["gap_at_rest"]}.values()
    rows = enumerate(zip(*columns, strict=True), start=1)
    return [(number, *map(float, row)) for number, row in rows]


PERCUSSIONS, FIRST_ORDER, SOCIAL = "percussions p/τ", "first-order model λ m̄/τ", "social force"
PRINTED, TEXT = "Löhner as printed", "Löhner, cases exchanged"
READINGS = {PRINTED: rivals.LoehnerReading.PRINTED, TEXT: rivals.LoehnerReading.TEXT}


class Forces(NamedTuple):
    """What one law gives to n disks at k contacts."""

    contact: Floats  # (k,) N normal, what the two sides receive on average
    carried: Floats  # (n,) N, the sum of the magnitudes at each disk
    resultant: Floats  # (n,2) N, the vector sum that each disk receives

    @property
    def spread(self) -> float:
        """Standard deviation over mean of the contacts."""
        return float(self.contact.std() / self.contact.mean())


class ArchForces:
    """Every law on the snapshot of a finished run of a driven scene: n disks, k contacts.

    by_law: in the words of the tables, percussions first
    distance, inside: (k,) m of each contact from the middle of the door, and whether it is in the
        room
    speed_difference: rms of the first-order model's u⁺ minus the percussions', over u_d
    undetermined: contacts whose percussion the mechanics does not fix
    wish: (n,) N, m u_d/τ
    warnings: answers that were not solved

    Raises what `compare_run` does."""

    def __init__(self, scene: Scene, folder: Path) -> None:
        comparison = compare_run(folder)
        snapshot, drive, match = comparison.snapshot, scene.drive, comparison.match
        assert drive is not None
        self.scene, self.snapshot = scene, snapshot
        self.engine = ENGINE_NAMES[comparison.record.engine]
        contacts, n = match.contacts.select(match.in_rigid), len(snapshot)
        penalty, rigid = (part[match.in_rigid] for part in match.normal_parts())
        desired, time = drive.desired_velocity(snapshot.position), drive.relaxation_time_s
        model = rivals.first_order(snapshot, contacts, left_velocity=desired)
        self.wish = snapshot.mass * np.hypot(*desired.T) / time
        social = rivals.social_force(snapshot, contacts)
        self.by_law = {
            PERCUSSIONS: _symmetric(contacts, rigid, n),
            self.engine: _symmetric(contacts, penalty, n),
            FIRST_ORDER: _symmetric(contacts, model.multiplier * snapshot.mass.mean() / time, n),
            SOCIAL: Forces(social.normal, social.magnitude_sum(), social.resultant()),
        }
        tolerance = scene.analysis.contact_tolerance_m
        for name, reading in READINGS.items():
            found = rivals.loehner_force(
                snapshot, contacts, self.wish, reading, tolerance=tolerance
            )
            received = mean_received(found)
            self.by_law[name] = Forces(received, found.magnitude_sum(), found.resultant())
        ends = np.array(drive.door_start_m) + np.array(drive.door_end_m)
        from_door = contacts.point - 0.5 * ends
        self.distance = np.hypot(*from_door.T)
        self.inside = from_door @ np.array(drive.outward) <= 0
        difference = model.right_velocity - comparison.solution.right_velocity
        rms = float(np.sqrt((difference**2).sum(1).mean()))
        self.speed_difference = rms / drive.speed_m_per_s
        self.undetermined = int((~match.determined[match.in_rigid]).sum())
        self.warnings = unsolved_of(scene.name, comparison.solution, model)


def _symmetric(contacts: Contacts, force: Floats, n: int) -> Forces:
    """Forces that both sides of a contact receive alike."""
    resultant = contacts.momentum_change(force[:, None] * contacts.normal, n)
    return Forces(force, contacts.sum_at_disks(np.abs(force), n), resultant)


class WithoutOverlap:
    """The social force on the same crowd moved apart by the least displacement until nobody
    overlaps.

    contact: (k,) N at the pairs that touch; carried: (n,) N, the sum of magnitudes at each disk;
    carried_apart: the sum if all distances were 10 % larger; friction: N, its largest at a contact

    Raises OverlapError."""

    def __init__(self, arch: ArchForces) -> None:
        scene, walls, drive = arch.scene, arch.scene.wall_segments(), arch.scene.drive
        assert drive is not None
        door = Walls(start=np.array([drive.door_start_m]), end=np.array([drive.door_end_m]))
        crowd = arch.snapshot
        found = reconcile(crowd.position, crowd.radius, walls, door, np.array(drive.outward))
        separated = replace(crowd, position=found.position)
        every = rivals.social_force(separated, all_pairs(separated, walls))
        in_contact = every.pairs.gap <= scene.analysis.contact_tolerance_m
        only = rivals.social_force(separated, every.pairs.select(in_contact))
        wider = replace(separated, position=1.1 * found.position)
        room = Walls(start=1.1 * walls.start, end=1.1 * walls.end)
        self.contact, self.carried = only.normal, every.magnitude_sum()
        self.carried_apart = rivals.social_force(wider, all_pairs(wider, room)).magnitude_sum()
        self.friction = float(np.hypot(*only.sliding.T).max())


def loehner_beyond_touch(arch: ArchForces, reach: float) -> Mapping[str, float]:
    """Find the share of the forces' sum that pairs give which do not touch, up to `reach` (m) of
    gap, by each reading of Löhner's law."""
    tolerance = arch.scene.analysis.contact_tolerance_m
    pairs = find_contacts(arch.snapshot, tolerance=reach)
    separated = pairs.gap > tolerance
    out = {}
    for name, reading in READINGS.items():
        found = rivals.loehner_force(arch.snapshot, pairs, arch.wish, reading, tolerance=tolerance)
        both = np.stack([found.on_first, found.on_second])
        out[name] = float(both[:, separated].sum() / both.sum())
    return out


def differences(a: Forces, b: Forces) -> tuple[float, float, float, float]:
    """Compare two laws: relative and largest difference per contact, relative differences of the
    sums of magnitudes and of the resultants."""
    contact, carried, resultant = (
        relative_difference(one.ravel(), other.ravel()) for one, other in zip(a, b, strict=True)
    )
    return contact, float(np.abs(b.contact - a.contact).max()), carried, resultant


def arch_rows(arches: Sequence[ArchForces]) -> list[tuple[str | float, ...]]:
    """Tabulate the laws on each snapshot against its percussions."""
    rows: list[tuple[str | float, ...]] = []
    for arch in arches:
        reference = arch.by_law[PERCUSSIONS]
        for name, forces in arch.by_law.items():
            force = forces.contact
            sizes = float(force.mean()), float(np.median(force)), float(force.max()), forces.spread
            pairs = (reference.contact, force), (reference.carried, forces.carried)
            alike = (of(*pair) for pair in pairs for of in (correlation, relative_difference))
            rows.append((arch.scene.name, name, *sizes, *alike))
    return rows


# kg, as in the paper's Fig. 5 here; how often they are drawn for each crowd
LEAST_KG, MOST_KG, DRAWS = 50.0, 100.0, 5


class Congestion(NamedTuple):
    """Whether a crowd behind a blocked exit stays, by law: the fastest inside.

    first_order, equal: m/s, by the first-order model, and by percussions of equal masses"""

    seed: int
    stiffness: float
    first_order: float
    equal: float
    unequal: tuple[float, ...]  # (draws,) m/s, by percussions of masses from 50 to 100 kg

    @property
    def congests(self) -> bool:
        """Whether the first-order model stops everybody."""
        return self.first_order < AT_REST_M_PER_S

    @property
    def released(self) -> int:
        """In how many draws unequal masses set somebody free."""
        return sum(speed >= AT_REST_M_PER_S for speed in self.unequal)


def congestion_of(crowd: Blocked) -> Congestion:
    """Solve a blocked crowd by both models, and with other masses."""
    arch, n = crowd.arch, len(crowd.arch.snapshot)
    model = rivals.first_order(arch.snapshot, arch.contacts, left_velocity=arch.left_velocity)
    random = np.random.default_rng([crowd.seed, round(crowd.stiffness)])
    unequal = []
    for mass in random.uniform(LEAST_KG, MOST_KG, (DRAWS, n)):
        other = replace(arch.snapshot, mass=mass)
        solution = solve(other, arch.contacts, left_velocity=arch.left_velocity, tolerance=1e-10)
        unequal.append(_fastest(arch, solution.right_velocity))
    first, equal = (_fastest(arch, solved.right_velocity) for solved in (model, arch.solution))
    return Congestion(crowd.seed, crowd.stiffness, first, equal, tuple(unequal))


def _fastest(arch: Arch, velocity: np.ndarray) -> float:
    """The largest speed (m/s) of those inside."""
    return float(np.hypot(*velocity[arch.inside()].T).max())


# Helbing, Farkas and Vicsek, Nature 407 (2000) 487: people of 80 kg with diameters of 0.5 to 0.7 m
# in a room of 15 m × 15 m with an exit of 1 m, τ = 0.5 s.
PEOPLE, EVACUATED_KG, EVACUATED_RADII_M = 200, 80.0, (0.25, 0.35)
DIAMETER_M = sum(EVACUATED_RADII_M)  # on average
SIDE_M, EXIT_M, TIME_S = 15.0, 1.0, 0.5
# s: a hundredth of the period 2π √(m/2ϱ) of two people on their body force
STEP_S = 1e-3
# steps with one desired velocity: it follows the position, slowly
RENEWED = 10
# m: a pair with a larger gap gives less than 0.01 N
REACH_M = 1.0
# Who is so far beyond the exit (m) has left, and pushes nobody.
GONE_M = 1.0
# s: from here on the crowd is looked at, this often, up to there
FROM_S, EVERY_S, UNTIL_S = 10.0, 0.25, 20.0
SPEEDS, SEEDS = (1.0, 2.0, 4.0), (1, 2, 3)
CONSTANTS: dict[str, Any] = {"tau": TIME_S, "reach": REACH_M, "gone": GONE_M, "step": STEP_S}


class Evacuation(NamedTuple):
    """A crowd that leaves a room by the social force model.

    samples: the social forces at the contacts of two people inside, at each look"""

    speed: float  # m/s, desired
    seed: int
    samples: list[rivals.SocialForces]
    crowd: Snapshot  # at the last look
    left: int  # how many have left by then

    @property
    def deepest(self) -> Floats:
        """The deepest overlap (m) at each look."""
        return np.array([(-style.pairs.gap).max(initial=0.0) for style in self.samples])

    @property
    def forces(self) -> Floats:
        """The normal forces (N) of all contacts at all looks."""
        return np.concatenate([style.normal for style in self.samples])


def room() -> tuple[Walls, Drive]:
    """Make the walls of the room, which is x < 0, and the drive to the middle of its exit at
    1 m/s."""
    half, side = 0.5 * EXIT_M, 0.5 * SIDE_M
    corners = [(0, half), (0, side), (-SIDE_M, side), (-SIDE_M, -side), (0, -side), (0, -half)]
    walls = Walls(start=np.array(corners[:-1]), end=np.array(corners[1:]))
    door: Any = {"door_start_m": (0.0, -half), "door_end_m": (0.0, half), "outward": (1.0, 0.0)}
    return walls, Drive(speed_m_per_s=1.0, relaxation_time_s=TIME_S, aim="centre", **door)


def placed(people: int, seed: int) -> Snapshot:
    """Place people at rest in the room at random, without overlaps."""
    random = np.random.default_rng(seed)
    radius = random.uniform(*EVACUATED_RADII_M, people)
    position = np.zeros((people, 2))
    low = np.array([-SIDE_M, -0.5 * SIDE_M])
    for number, r in enumerate(radius):
        free = False
        while not free:
            location = random.uniform(low + r, low + SIDE_M - r)
            distance = np.hypot(*(position[:number] - location).T) - radius[:number] - r
            free = bool((distance > 0).all())
        position[number] = location
    return Snapshot(position=position, radius=radius, mass=np.full(people, EVACUATED_KG))


def evacuate(speed: float, seed: int, people: int = PEOPLE, until: float = UNTIL_S) -> Evacuation:
    """Let people leave the room at a desired speed (m/s), and look at them from time to time."""
    walls, drive = room()
    drive = drive.model_copy(update={"speed_m_per_s": speed})
    crowd, samples = placed(people, seed), []
    for time in np.arange(EVERY_S, until + 0.5 * EVERY_S, EVERY_S):
        crowd = advance(crowd, walls, drive, round(EVERY_S / STEP_S))
        if time >= FROM_S:
            inside = crowd.position[:, 0] < 0
            pairs = find_contacts(crowd, tolerance=0.0)
            in_contact = pairs.select(inside[pairs.first] & inside[pairs.second])
            samples.append(rivals.social_force(crowd, in_contact))
    left = int((crowd.position[:, 0] >= 0).sum())
    return Evacuation(speed=speed, seed=seed, samples=samples, crowd=crowd, left=left)


def evacuations(tell: Progress) -> list[Evacuation]:
    """Evacuate the room at each speed with each seed."""
    wanted = list(product(SPEEDS, SEEDS))
    return [evacuate(*one) for one in with_progress(wanted, "evacuations", tell)]


def advance(crowd: Snapshot, walls: Walls, drive: Drive, steps: int) -> Snapshot:
    """Move a crowd by so many steps of the semi-implicit Euler method: m du/dt = m (u_d − u)/τ plus
    the social forces of people and walls."""
    law = rivals.SocialForceLaw()
    constants = law.strength, law.decay, law.body_stiffness, law.sliding_friction
    position, velocity = crowd.position.copy(), crowd.velocity.copy()
    for done in range(0, steps, RENEWED):
        desired, many = drive.desired_velocity(position), min(RENEWED, steps - done)
        disks = position, velocity, desired, crowd.radius, crowd.mass
        _core.social_steps(*disks, walls.start, walls.end, constants, **CONSTANTS, steps=many)
    return replace(crowd, position=position, velocity=velocity)
