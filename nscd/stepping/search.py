"""Neighbours of a step: all pairs and walls within a margin."""

from typing import NamedTuple

from nscd import _core
from nscd.arrays import Floats, Index32
from nscd.bodies import Walls
from nscd.contacts import NO_WALLS, connected


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


def segments_of(walls: Walls | None) -> _core.Walls:
    """Give walls as the core takes them."""
    return connected(walls or NO_WALLS)


def neighbours(
    position: Floats, radius: Floats, segments: _core.Walls, margin: float
) -> Neighbours:
    """Find every pair and every wall whose gap is at most `margin` (m).

    position (n,2) m, radius (n,) m. A disk has one contact for each nearest point of connected
    walls: one at a corner that points at it, two in a corner that it sits in."""
    return Neighbours(*_core.neighbours(position, radius, segments, margin))
