"""The evacuation of a room by the social force model (9), as its authors set it up."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from analysis.scene.parts import Drive
from analysis.support.progress import Progress
from nscd import Snapshot, Walls, _core, find_contacts
from nscd.arrays import Floats
from nscd.rivals import SocialForceLaw, SocialForces, social_force

# Helbing, Farkas and Vicsek, Nature 407 (2000) 487: people of 80 kg with diameters of 0.5 to 0.7 m
# in a room of 15 m × 15 m with an exit of 1 m, τ = 0.5 s.
PEOPLE, MASS_KG, RADII_M = 200, 80.0, (0.25, 0.35)
DIAMETER_M = sum(RADII_M)  # on average
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evacuation:
    """A crowd that leaves a room by the social force model.

    speed: m/s, desired
    looks: the social forces at the contacts of two people inside, at each look
    crowd: at the last look
    left: how many have left by then
    """

    speed: float
    seed: int
    looks: list[SocialForces]
    crowd: Snapshot
    left: int

    @property
    def deepest(self) -> Floats:
        """The deepest overlap (m) at each look."""
        return np.array([(-look.pairs.gap).max(initial=0.0) for look in self.looks])

    @property
    def forces(self) -> Floats:
        """The normal forces (N) of all contacts at all looks."""
        return np.concatenate([look.normal for look in self.looks])


def room() -> tuple[Walls, Drive]:
    """Make the walls of the room, which is x < 0, and the drive to the middle of its exit at
    1 m/s."""
    half, side = 0.5 * EXIT_M, 0.5 * SIDE_M
    corners = [(0, half), (0, side), (-SIDE_M, side), (-SIDE_M, -side), (0, -side), (0, -half)]
    walls = Walls(start=np.array(corners[:-1]), end=np.array(corners[1:]))
    drive = Drive(
        speed_m_per_s=1.0,
        relaxation_time_s=TIME_S,
        door_start_m=(0.0, -half),
        door_end_m=(0.0, half),
        outward=(1.0, 0.0),
        aim="centre",
    )
    return walls, drive


def placed(people: int, seed: int) -> Snapshot:
    """Place people at rest in the room at random, without overlaps."""
    random = np.random.default_rng(seed)
    radius = random.uniform(*RADII_M, people)
    position = np.zeros((people, 2))
    low = np.array([-SIDE_M, -0.5 * SIDE_M])
    for number, r in enumerate(radius):
        free = False
        while not free:
            place = random.uniform(low + r, low + SIDE_M - r)
            apart = np.hypot(*(position[:number] - place).T) - radius[:number] - r
            free = bool((apart > 0).all())
        position[number] = place
    still, mass = np.zeros_like(position), np.full(people, MASS_KG)
    return Snapshot(position=position, velocity=still, radius=radius, mass=mass)


def evacuate(speed: float, seed: int, people: int = PEOPLE, until: float = UNTIL_S) -> Evacuation:
    """Let people leave the room at a desired speed (m/s), and look at them from time to time."""
    walls, drive = room()
    drive = drive.model_copy(update={"speed_m_per_s": speed})
    crowd, looks = placed(people, seed), []
    for time in np.arange(EVERY_S, until + 0.5 * EVERY_S, EVERY_S):
        crowd = advance(crowd, walls, drive, round(EVERY_S / STEP_S))
        if time >= FROM_S:
            inside = crowd.position[:, 0] < 0
            pairs = find_contacts(crowd, tolerance=0.0)
            touching = pairs.select(inside[pairs.first] & inside[pairs.second])
            looks.append(social_force(crowd, touching))
    left = int((crowd.position[:, 0] >= 0).sum())
    return Evacuation(speed=speed, seed=seed, looks=looks, crowd=crowd, left=left)


def evacuations(tell: Progress) -> list[Evacuation]:
    """Evacuate the room at each speed with each seed."""
    found = []
    for number, (speed, seed) in enumerate(product(SPEEDS, SEEDS)):
        tell("evacuations", number / (len(SPEEDS) * len(SEEDS)))
        found.append(evacuate(speed, seed))
    tell("evacuations", 1.0)
    return found


def advance(crowd: Snapshot, walls: Walls, drive: Drive, steps: int) -> Snapshot:
    """Move a crowd by so many steps of the semi-implicit Euler method: m du/dt = m (u_d − u)/τ plus
    the social forces of people and walls."""
    law = SocialForceLaw()
    constants = law.strength, law.decay, law.body_stiffness, law.sliding_friction
    position, velocity = crowd.position.copy(), crowd.velocity.copy()
    for done in range(0, steps, RENEWED):
        _core.social_steps(
            position,
            velocity,
            drive.desired_velocity(position),
            crowd.radius,
            crowd.mass,
            walls.start,
            walls.end,
            constants,
            tau=TIME_S,
            reach=REACH_M,
            gone=GONE_M,
            step=STEP_S,
            steps=min(RENEWED, steps - done),
        )
    return replace(crowd, position=position, velocity=velocity)
