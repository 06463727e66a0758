"""A dense crowd before a door, grown disk by disk: random, of any size, reproducible, without
overlaps."""

import numpy as np

from nscd import _core
from nscd.arrays import Floats

# of the mean radius, as 0.18 to 0.25 m are of 0.215 m
LEAST, MOST = 0.837, 1.163
# farther apart than this, in mean radii, no disk can touch two others at once
NEIGHBOUR = 2.0
SKIN = 0.25  # of the mean radius: pairs are listed again when a disk has moved half as far
REST = 1e-3  # of the mean contact force: what a disk at rest may be off balance by
MOST_STEPS = 40_000


def heap(n: int, seed: int, mean_radius: float, half_door: float) -> tuple[Floats, Floats]:
    """Positions (n,2) m and radii (n,) m of a heap in x < 0 before the wall x = 0, whose door |y| <
    half_door (m) is shut.

    Each disk is put where it touches two earlier ones, or one and the wall or the shut door, at the
    free place nearest to the door: the heap is the set of points within some distance of the door,
    and just rigid (twice as many contacts as disks). Radii are uniform in mean_radius·[0.837,
    1.163]. Raises ValueError for n < 1 or lengths that are not positive."""
    if n < 1:
        raise ValueError(f"n: {n}. A heap has at least one disk")
    for name, length in (("mean_radius", mean_radius), ("half_door", half_door)):
        if not (np.isfinite(length) and length > 0):
            raise ValueError(f"{name}: {length} m. A positive length is needed")
    radius = np.random.default_rng(seed).uniform(LEAST, MOST, n)
    # the first disk rests on the middle of the door
    position = np.zeros((n, 2))
    position[0, 0] = -radius[0]
    door = half_door / mean_radius
    placed = _core.grow(
        position,
        radius,
        1,
        half_door=door,
        cell=2 * MOST,
        reach=2.2 * np.sqrt(n) + door + 20.0,
        typical=1.0,
        reach_between=NEIGHBOUR,
        beside=2 * MOST + 1.0,
        wall_distance=LEAST,
        hollow=0.0,
        shut=True,
    )
    if placed < n:
        raise RuntimeError(f"the heap of {n} disks stopped growing (seed {seed})")
    return position * mean_radius, radius * mean_radius


def press(
    position: Floats, radius: Floats, half_door: float, softness: float
) -> tuple[Floats, bool]:
    """Positions (n,2) m at which soft disks, each pushed to the door with a force ∝ r², rest before
    the shut door, and whether they do.

    Contacts are springs of stiffness (total push per area)·(size of the crowd)/softness: overlaps
    are of the order of `softness` of a radius. Energy is minimised by FIRE (Bitzek et al., PRL 97,
    2006, 170201) until no disk's force is off balance by more than a thousandth of the mean contact
    force. A crowd at rest carries its own pressure: it is jammed. Raises ValueError for a softness
    outside (0, 0.1]."""
    if not 0 < softness <= 0.1:
        raise ValueError(f"softness: {softness}. A share of a radius in (0, 0.1] is needed")
    mean = float(radius.mean())
    size = radius / mean
    # the crowd's width in radii, and the share of the area that disks cover, give the pressure that
    # a spring must hold
    across = float(np.abs(position).max()) / mean
    stiffness = across / np.pi / softness
    location = np.array(position / mean, dtype=np.float64)
    rested = _core.press(
        location,
        size,
        size * size,
        half_door=half_door / mean,
        stiffness=stiffness,
        step=0.1 / np.sqrt(stiffness),
        longest=0.5 / np.sqrt(stiffness),
        skin=SKIN,
        cell=2 * MOST + SKIN,
        force_tolerance=REST,
        max_steps=MOST_STEPS,
    )
    return location * mean, rested
