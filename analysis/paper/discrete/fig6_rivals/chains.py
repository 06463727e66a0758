"""A chain of people who press each other against a wall, under every force law."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, root

from analysis.paper.answers import unsolved
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from nscd import Contacts, Percussions, Snapshot, Walls, find_contacts
from nscd.arrays import Flags, Floats
from nscd.rivals import (
    FirstOrderAnswer,
    LoehnerForces,
    LoehnerReading,
    SocialForceLaw,
    first_order,
    loehner_force,
    social_force,
)

# A social force below this is none.
LEFT_OUT_N = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainForces:
    """Normal forces at the k contacts of a chain of n, from its free end to the wall, the last.

    mass, drive: (n,) kg and N
    percussion: (k,) N, p/τ
    first_order: (k,) N, λ m̄/τ with the mean mass m̄
    social: (k,) N, one contact of the touching chain
    social_section: (k,) N, all pairs that act across that contact
    social_at_rest, gap_at_rest: (k,) N and m, one contact where the social forces balance the drive
    loehner_printed, loehner_text: (k,) N at touch, the mean of what the two receive
    warnings: answers that were not solved
    """

    mass: Floats
    drive: Floats
    percussion: Floats
    first_order: Floats
    social: Floats
    social_section: Floats
    social_at_rest: Floats
    gap_at_rest: Floats
    loehner_printed: Floats
    loehner_text: Floats
    warnings: Sequence[str]

    @property
    def equal_masses(self) -> bool:
        """Whether everybody has the same mass."""
        return bool(np.ptp(self.mass) == 0)


def chain_forces(scene: Scene, relaxation_time: float) -> ChainForces:
    """Compute the forces of a chain whose left velocities are the desired ones, people being driven
    by m u_d/τ toward the wall."""
    snapshot, walls = scene.snapshot, scene.wall_segments()
    found = percussions_of(scene, snapshot, tolerance=1e-10)
    contacts, model = found.contacts, first_order(snapshot, found.contacts)
    drive = snapshot.mass * snapshot.velocity[:, 0] / relaxation_time
    warnings = unsolved_of(scene.name, found.answer, model)
    law = SocialForceLaw()
    rest, error = _social_rest(snapshot, walls, drive, law)
    if error > 1e-6:
        warnings.append(
            f"{scene.name}, social force at rest: a force of {error:.1e} N is left unbalanced"
        )
    nearest = all_pairs(rest, walls)
    nearest = nearest.select(_next_to(nearest, len(rest)))
    tolerance = scene.analysis.contact_tolerance_m
    loehner = {
        reading: mean_received(
            loehner_force(snapshot, contacts, drive, reading, tolerance=tolerance)
        )
        for reading in LoehnerReading
    }
    return ChainForces(
        mass=snapshot.mass,
        drive=drive,
        percussion=(found.answer.impulse * contacts.normal).sum(1) / relaxation_time,
        first_order=model.multiplier * snapshot.mass.mean() / relaxation_time,
        social=social_force(snapshot, contacts, law).normal,
        social_section=_across_sections(snapshot, all_pairs(snapshot, walls), law),
        social_at_rest=social_force(rest, nearest, law).normal,
        gap_at_rest=nearest.gap,
        loehner_printed=loehner[LoehnerReading.PRINTED],
        loehner_text=loehner[LoehnerReading.TEXT],
        warnings=warnings,
    )


def unsolved_of(name: str, answer: Percussions, model: FirstOrderAnswer) -> list[str]:
    """List which of the two answers for a scene are not solved, and why."""
    return unsolved([(f"{name}, percussions", answer), (f"{name}, first-order model", model)])


def mean_received(found: LoehnerForces) -> Floats:
    """Give what the two of a pair receive on average, and the disk at a wall, (k,) N."""
    both = 0.5 * (found.on_first + found.on_second)
    return np.asarray(np.where(found.pairs.is_wall, found.on_first, both), dtype=np.float64)


def gap_that_carries(force: float, law: SocialForceLaw) -> float:
    """Find the gap (m; negative: an overlap) at which the social force of one pair is `force` N."""
    low, high = -1.0, law.reach(min(LEFT_OUT_N, force))

    def excess(gap: float) -> float:
        return float(law.repulsion(np.array(gap)) + law.body(np.array(gap))) - force

    return float(brentq(excess, low, high))


def _social_rest(
    snapshot: Snapshot, walls: Walls, drive: Floats, law: SocialForceLaw
) -> tuple[Snapshot, float]:
    """The chain where the social forces of all pairs balance the drive, and the largest unbalanced
    force (N)."""
    # each contact carries what is driven behind it, as the start of a search that also counts pairs
    # further apart
    gaps = np.array([gap_that_carries(force, law) for force in np.cumsum(drive)])
    spread = np.cumsum(gaps[::-1])[::-1]

    def at(place: Floats) -> Snapshot:
        position = np.column_stack([place, snapshot.position[:, 1]])
        return replace(snapshot, position=position, velocity=np.zeros_like(position))

    def unbalanced(place: Floats) -> Floats:
        forces = social_force(at(place), all_pairs(at(place), walls), law)
        balance: Floats = forces.resultant()[:, 0] + drive
        return balance

    found = root(unbalanced, snapshot.position[:, 0] - spread, tol=1e-12)
    return at(found.x), float(np.abs(unbalanced(found.x)).max())


def all_pairs(snapshot: Snapshot, walls: Walls) -> Contacts:
    """Find the pairs whose social force is beyond LEFT_OUT_N, walls included."""
    return find_contacts(snapshot, walls, tolerance=SocialForceLaw().reach(LEFT_OUT_N))


def _next_to(pairs: Contacts, n: int) -> Flags:
    """Which pairs are neighbours in the chain, the last disk and the wall among them."""
    follows = pairs.second == pairs.first + 1
    return np.asarray(np.where(pairs.is_wall, pairs.first == n - 1, follows))


def _across_sections(snapshot: Snapshot, pairs: Contacts, law: SocialForceLaw) -> Floats:
    force = social_force(snapshot, pairs, law).normal
    other = np.where(pairs.is_wall, len(snapshot), pairs.second)
    section = np.arange(len(snapshot))[:, None]
    across = (pairs.first <= section) & (section < other)
    total: Floats = (across * force).sum(1)
    return total


def chain_rows(chain: ChainForces) -> list[tuple[float, ...]]:
    """Tabulate the forces of one chain, a row per contact."""
    columns = (
        chain.percussion,
        chain.first_order,
        chain.social,
        chain.social_section,
        chain.social_at_rest,
        1e3 * chain.gap_at_rest,
        chain.loehner_printed,
        chain.loehner_text,
    )
    return [
        (number, float(mass), *map(float, row))
        for number, (mass, *row) in enumerate(zip(chain.mass, *columns, strict=True), start=1)
    ]
