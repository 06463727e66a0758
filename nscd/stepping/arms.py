"""Arms: a soft layer around people, through which they push each other before their bodies touch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscd import _core
from nscd.arrays import Floats, Index32
from nscd.contacts import sum_at_disks


class Neighbours(NamedTuple):
    """Hold candidates for contact.

    first: (k,) disk
    second: (k,) disk; −1 for a wall
    wall: (k,) wall; −1 for a pair
    normal: (k,2) unit vector, first → second
    gap: (k,) m"""

    first: Index32
    second: Index32
    wall: Index32
    normal: Floats
    gap: Floats

    @classmethod
    def of(cls, found: _core.Neighbours) -> Neighbours:
        """Take over what the core has found."""
        return cls(found.first, found.second, found.wall, found.normal, found.gap)


def neighbours(
    position: Floats,
    radius: Floats,
    segments: _core.Walls,
    margin: float,
    body: Index32 | None = None,
) -> Neighbours:
    """Find every pair, but of one body, and every wall whose gap is at most `margin` (m).

    position (n,2) m, radius (n,) m, body (n,), none where each is alone. A disk has one contact for
    each nearest point of connected walls: one at a corner that points at it, two in a corner that it
    sits in."""
    return Neighbours.of(_core.neighbours(position, radius, segments, margin, body))


class Arms(NamedTuple):
    """Push people apart with F = F_a min(1, max(0, (a − g)/a)) at a gap g between bodies.

    The force rises from 0 at a gap of a to F_a where bodies touch. It stays F_a in the overlap, and
    the law of the bodies adds to it. There is no dashpot: arms give back what they take.

    reach: m, a > 0, of a pair or of a person and a wall
    force: N, F_a > 0"""

    reach: float
    force: float

    @property
    def stiffness(self) -> float:
        """Give the slope F_a/a (N/m) of the force."""
        return self.force / self.reach

    def push(self, gap: Floats) -> Floats:
        """Compute F (k,) N at gaps (k,) m; an overlap is a gap below 0."""
        return np.asarray(self.force * np.clip(1 - gap / self.reach, 0.0, 1.0))

    def energy(self, gap: Floats) -> Floats:
        """Compute the work (k,) J that brought people to gaps (k,) m: F_a (d² − max(0, −g)²)/(2 a),
        d = max(0, a − g)."""
        within, beyond = np.maximum(self.reach - gap, 0.0), np.maximum(-gap, 0.0)
        return np.asarray(0.5 * self.stiffness * (within * within - beyond * beyond))

    def reached(
        self, position: Floats, radius: Floats, segments: _core.Walls
    ) -> tuple[Neighbours, Floats]:
        """Find who reaches whom or which wall, k of them, and the push (k,) N along the normal."""
        reachable = neighbours(position, radius, segments, self.reach)
        return reachable, self.push(reachable.gap)

    def forces(self, position: Floats, radius: Floats, segments: _core.Walls) -> Floats:
        """Compute the sum (n,2) N of the pushes on each disk."""
        neighbours, push = self.reached(position, radius, segments)
        forces = push[:, None] * neighbours.normal
        return sum_at_disks(neighbours.first, neighbours.second, -forces, forces, len(radius))
