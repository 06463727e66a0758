"""Many snapshots in one call of the core: contacts, percussions and certificate of each, with the help
of the one before.

What a frame gives does not depend on the others but for rounding. A frame that is not answered here
is left to `find_contacts` and `solve`, which say why."""

from typing import Any, NamedTuple

from nscd import _core
from nscd.bodies import Walls
from nscd.contacts import NO_WALLS, connected


class Disks(NamedTuple):
    """Hold the n disks of f frames, one frame behind the other.

    start: (f+1,) the first of each frame, and the end
    ids: (n,) below 2³¹, rising in each frame
    position, left_velocity: (n,2) m, m/s: u⁻, magnitudes of at most 10¹⁰⁰
    radius, mass: (n,) m, kg, positive"""

    start: Any
    ids: Any
    position: Any
    left_velocity: Any
    radius: Any
    mass: Any


class FrameOptions(NamedTuple):
    """Say what is asked.

    gap: m, up to which disks are in contact, see `find_contacts`
    deepest: share of the smaller radius; a frame with deeper overlaps is not answered
    tolerance: see `solve`
    canonical: see `SolveOptions`"""

    gap: float
    deepest: float
    tolerance: float
    canonical: bool = True


class FrameSolutions(NamedTuple):
    """Hold the k contacts of f frames, one frame behind the other, and what they carry.

    start: (f+1,) the first of each frame, and the end
    answered: (f,) whether a frame is; one that is not has no contacts here
    first, second: (k,) among the disks of all frames; number of a wall where is_wall (k,)
    normal, gap: (k,2), (k,) m
    reaction, impulse: (k,), (k,2) N·s
    residual, velocity_error: (f,), m/s"""

    start: Any
    answered: Any
    first: Any
    second: Any
    is_wall: Any
    normal: Any
    gap: Any
    reaction: Any
    impulse: Any
    residual: Any
    velocity_error: Any


def solve_frames(disks: Disks, walls: Walls | None, options: FrameOptions) -> FrameSolutions:
    """Solve contacts without dissipation, each frame for itself, with their certificate. Other threads
    go on meanwhile."""
    found = _core.film(*disks, connected(walls or NO_WALLS), *options)
    return FrameSolutions(**{name: getattr(found, name) for name in FrameSolutions._fields})
