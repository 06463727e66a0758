"""Radii and masses of people, from a survey of bodies."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nscd import Snapshot, Walls, _core, find_contacts
from nscd.arrays import Floats
from nscd.stepping import Motion, StepError

# Nobody is farther than so many standard deviations from the mean of the group.
MOST_DEVIATIONS = 2.0
# Steps in which disks grow that would be pushed through a wall at once.
GROWTHS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Describe a group of people, each by mean and standard deviation."""

    breadth: tuple[float, float]  # m, of the shoulders (bideltoid)
    depth: tuple[float, float]  # m, of the chest
    mass: tuple[float, float]  # kg

    def bodies(self, deviation: Floats) -> tuple[Floats, Floats]:
        """Return radius (n,) m and mass (n,) kg of people so many standard deviations (n,) above
        the mean; the disk has the area of the ellipse of breadth and depth: r = ½ √(b d)."""
        breadth, depth, mass = (
            mean + spread * deviation for mean, spread in (self.breadth, self.depth, self.mass)
        )
        return 0.5 * np.sqrt(breadth * depth), mass


# ANSUR II, 4,082 men and 1,986 women of the US Army, 2012.
MEN = Group(breadth=(0.510, 0.033), depth=(0.254, 0.026), mass=(85.5, 14.2))
WOMEN = Group(breadth=(0.450, 0.029), depth=(0.247, 0.027), mass=(67.8, 11.0))
PEOPLE: Mapping[str, tuple[Group, ...]] = {
    "ANSUR II": (MEN, WOMEN),
    "ANSUR II men": (MEN,),
    "ANSUR II women": (WOMEN,),
}


def bodies_of(people: str, count: int, seed: int) -> tuple[Floats, Floats]:
    """Draw radius (n,) m and mass (n,) kg of so many people of a survey, each of its groups as
    likely. Breadth, depth and mass of a person are equally far from their means: who is heavy is
    wide.

    Raises ValueError for an unknown survey."""
    if people not in PEOPLE:
        raise ValueError(f"{people!r}. There are: {', '.join(PEOPLE)}")
    # micrometres and grams are those of every processor, draws up to 3.65 too
    random = np.random.default_rng([seed, 3])
    groups = PEOPLE[people]
    deviation = random.normal(size=count)
    while (far := np.abs(deviation) > MOST_DEVIATIONS).any():
        deviation[far] = random.normal(size=int(far.sum()))
    each = np.array([group.bodies(deviation) for group in groups])
    radius, mass = each[random.integers(0, len(groups), count), :, np.arange(count)].T
    return radius.round(6), mass.round(3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Varied:
    """Say how people differ from each other.

    radius_share: without it, radii are uniform within so large a share above and below the given
        one"""

    people: str | None = None  # a key of PEOPLE; radius and mass are then those of its bodies
    radius_share: float = 0.0
    seed: int = 1  # of the random numbers

    def bodies(self, radius: float, mass: float, count: int) -> tuple[Floats, Floats]:
        """Draw radius (n,) m and mass (n,) kg of so many people; the given ones are means. Raises
        ValueError for an unknown survey and for a share that is not from 0 to below 1."""
        if not 0 <= self.radius_share < 1:
            raise ValueError(f"radius spread: {self.radius_share:g}. From 0 to below 1 is needed")
        if self.people is not None:
            return bodies_of(self.people, count, self.seed)
        fraction = np.random.default_rng([self.seed, 4]).uniform(-1, 1, count)
        return (radius * (1 + self.radius_share * fraction)).round(6), np.full(count, mass)


def separated(snapshot: Snapshot, walls: Walls) -> Snapshot:
    """Push disks that overlap each other or a wall apart, as little as possible; where that would
    push one through a wall, let them grow to their size in GROWTHS.

    Raises StepError where that does not end or one would still go through, ValueError where centres
    coincide, or one is on a wall."""
    find_contacts(snapshot, walls, tolerance=0.0)
    for first in (1.0, 1.0 / GROWTHS):
        now = snapshot
        for fraction in np.arange(first, 1.0 + 0.5 / GROWTHS, 1.0 / GROWTHS):
            grown = dataclasses.replace(now, radius=fraction * snapshot.radius)
            motion = Motion(grown, walls, step=1.0)
            motion.separate()
            now = motion.snapshot()
        end = snapshot.position + walls.shortest(now.position - snapshot.position)
        clear = _core.clear_of(snapshot.position, end, walls.start, walls.end, 1.0)
        if clear.all():
            break
    else:
        through = snapshot.ids[int(np.argmin(clear))]
        raise StepError(f"disk {through} would be pushed through a wall: overlaps are too large")
    moved = dataclasses.replace(snapshot, position=now.position)
    if (of := snapshot.bodies) is None:
        return moved
    return moved.joined(of.ids[of.number], inertia=of.inertia)
