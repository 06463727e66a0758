"""A dense crowd before a door, grown disk by disk: random, of any size, reproducible, without
overlaps."""

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.compiling import kernel

# of the mean radius, as 0.18 to 0.25 m are of 0.215 m
LEAST, MOST = 0.837, 1.163
# farther apart than this, in mean radii, no disk can touch two others at once
NEIGHBOUR = 2.0
SKIN = 0.25  # of the mean radius: pairs are listed again when a disk has moved half as far
REST = 1e-3  # of the mean contact force: what a disk at rest may be off balance by
MOST_STEPS = 40_000


class Growth(NamedTuple):
    """How a heap grows before the wall x = 0 with its door |y| < half_door; lengths in one unit.

    cell, reach: of the grid in which neighbours are found, and how far it reaches.
    typical: radius of the disk for which sites are looked for.
    near: disks not farther from each other may have one that touches both between them.
    beside: disks not farther from the wall may have one that touches it and them.
    least: distance of a site from the wall, at least.
    hollow: distance of a site from the middle of the door, at least.
    shut: whether a disk may rest on the door."""

    half_door: float
    cell: float
    reach: float
    typical: float
    near: float
    beside: float
    least: float
    hollow: float
    shut: bool


def heap(n: int, seed: int, mean_radius: float, half_door: float) -> tuple[Floats, Floats]:
    """Positions (n,2) m and radii (n,) m of a heap in x < 0 before the wall x = 0, whose door |y| <
    half_door (m) is shut.

    Each disk is put where it touches two earlier ones, or one and the wall or the shut door, at the
    free place nearest to the door: the heap is the set of points within some distance of the door,
    and just rigid (twice as many contacts as disks). Radii are uniform in mean_radius·[0.837,
    1.163]. Raises ValueError for n < 1 or lengths that are not positive."""
    if n < 1:
        raise ValueError(f"n: {n}; a heap has at least one disk")
    for name, length in (("mean_radius", mean_radius), ("half_door", half_door)):
        if not (np.isfinite(length) and length > 0):
            raise ValueError(f"{name}: {length} m; a positive length is needed")
    radius = np.random.default_rng(seed).uniform(LEAST, MOST, n)
    # the first disk rests on the middle of the door
    position = np.zeros((n, 2))
    position[0, 0] = -radius[0]
    door = half_door / mean_radius
    growth = Growth(
        half_door=door,
        cell=2 * MOST,
        reach=2.2 * np.sqrt(n) + door + 20.0,
        typical=1.0,
        near=NEIGHBOUR,
        beside=2 * MOST + 1.0,
        least=LEAST,
        hollow=0.0,
        shut=True,
    )
    if grow(position, radius, 1, growth) < n:
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
        raise ValueError(f"softness: {softness}; a share of a radius in (0, 0.1] is needed")
    mean = float(radius.mean())
    size = radius / mean
    # the crowd's width in radii, and the share of the area that disks cover, give the pressure that
    # a spring must hold
    across = float(np.abs(position).max()) / mean
    place = np.array(position / mean, dtype=np.float64)
    rested = _relax(place, size, half_door / mean, across / np.pi / softness, MOST_STEPS)
    return place * mean, bool(rested)


@kernel
def push_site(keys: Any, sites: Any, size: int, key: float, a: int, b: int, side: int) -> int:
    """Add a site to the binary heap."""
    c = size
    while c > 0 and keys[(c - 1) // 2] > key:
        keys[c] = keys[(c - 1) // 2]
        sites[c] = sites[(c - 1) // 2]
        c = (c - 1) // 2
    keys[c] = key
    sites[c, 0], sites[c, 1], sites[c, 2] = a, b, side
    return size + 1


@kernel
def pop_site(keys: Any, sites: Any, size: int) -> int:
    """Remove the smallest, which is at 0."""
    size -= 1
    key, site = keys[size], sites[size].copy()
    c = 0
    while 2 * c + 1 < size:
        child = 2 * c + 1
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[c] = keys[child]
        sites[c] = sites[child]
        c = child
    keys[c] = key
    sites[c] = site
    return size


@kernel
def touching_site(
    position: Any, radius: Any, a: int, b: int, side: int, r: float
) -> tuple[float, float, bool]:
    """Centre of a disk of radius r that touches a and b (b = −1: the wall), and whether there is
    one."""
    ax, ay, ra = position[a, 0], position[a, 1], radius[a] + r
    if b < 0:
        h = ra * ra - (ax + r) ** 2
        return -r, ay + side * np.sqrt(max(h, 0.0)), h >= 0.0
    dx, dy = position[b, 0] - ax, position[b, 1] - ay
    d = np.sqrt(dx * dx + dy * dy)
    along = (d * d + ra * ra - (radius[b] + r) ** 2) / (2 * d)
    h = ra * ra - along * along
    across = side * np.sqrt(max(h, 0.0))
    return ax + (along * dx - across * dy) / d, ay + (along * dy + across * dx) / d, h >= 0.0


@kernel
def grow(position: Any, radius: Any, placed: int, growth: Growth) -> int:
    """Grow a heap: the first disks are placed already, each other one goes to the free site nearest
    to the door; return the number of disks that found a place."""
    n, cell, reach, half_door = len(radius), growth.cell, growth.reach, growth.half_door
    m = int(2 * reach / cell) + 4
    head = np.full((m, m), -1, np.int32)
    following = np.full(n, -1, np.int32)
    keys, sites = np.empty(60 * n + 1000), np.empty((60 * n + 1000, 3), np.int32)
    size = 0
    for count in range(n):
        r = radius[count]
        px, py, found = position[count, 0], position[count, 1], count < placed
        while size > 0 and not found:
            a, b, side = sites[0, 0], sites[0, 1], sites[0, 2]
            size = pop_site(keys, sites, size)
            px, py, found = touching_site(position, radius, a, b, side, r)
            found = found and px <= -r + 1e-12
            i, j = int((px + reach) / cell), int((py + reach) / cell)
            for p in range(i - 1, i + 2):
                for q in range(j - 1, j + 2):
                    c = head[p, q]
                    while c >= 0 and found:
                        gap = np.hypot(position[c, 0] - px, position[c, 1] - py) - radius[c] - r
                        found = c in (a, b) or gap >= 0.0
                        c = following[c]
        if not found:
            return count
        position[count, 0], position[count, 1] = px, py
        if px > -growth.beside:
            for side in (-1, 1):
                _, sy, good = touching_site(position, radius, count, -1, side, growth.typical)
                if good and (growth.shut or abs(sy) > half_door):
                    far = max(abs(sy) - half_door, 0.0)
                    size = push_site(keys, sites, size, far, count, -1, side)
        i, j = int((px + reach) / cell), int((py + reach) / cell)
        for p in range(i - 2, i + 3):
            for q in range(j - 2, j + 3):
                c = head[p, q]
                while c >= 0:
                    d = np.hypot(position[c, 0] - px, position[c, 1] - py)
                    if d < radius[c] + r + growth.near:
                        for side in (-1, 1):
                            sx, sy, good = touching_site(
                                position, radius, count, c, side, growth.typical
                            )
                            if good and sx < -growth.least and np.hypot(sx, sy) > growth.hollow:
                                far = np.hypot(sx, max(abs(sy) - half_door, 0.0))
                                size = push_site(keys, sites, size, far, count, c, side)
                    c = following[c]
        following[count] = head[i, j]
        head[i, j] = count
    return n


@kernel
def pairs_within(
    position: Any, radius: Any, skin: float, cell: float, first: Any, second: Any
) -> int:
    """List pairs with a gap below the skin, found in a grid of cells; return their number."""
    n = len(radius)
    x0, y0 = position[:, 0].min() - cell, position[:, 1].min() - cell
    nx, ny = (
        int((position[:, 0].max() - x0) / cell) + 3,
        int((position[:, 1].max() - y0) / cell) + 3,
    )
    head = np.full((nx, ny), -1, np.int32)
    following = np.full(n, -1, np.int32)
    count = 0
    for a in range(n):
        i, j = int((position[a, 0] - x0) / cell), int((position[a, 1] - y0) / cell)
        for p in range(i - 1, i + 2):
            for q in range(j - 1, j + 2):
                b = head[p, q]
                while b >= 0:
                    near = radius[a] + radius[b] + skin
                    dx, dy = position[a, 0] - position[b, 0], position[a, 1] - position[b, 1]
                    if dx * dx + dy * dy < near * near:
                        first[count], second[count] = b, a
                        count += 1
                    b = following[b]
        following[a] = head[i, j]
        head[i, j] = a
    return count


@kernel
def _push(
    position: Any, radius: Any, half_door: float, stiffness: float, first: Any, second: Any,
    force: Any,
) -> tuple[float, int]:  # fmt: skip
    """Set the force (n,2) on each disk: its push to the door, the wall, the listed pairs that
    overlap; the sum of the pairs' forces and their number."""
    pressed, touching = 0.0, 0
    for a in range(len(radius)):
        x, y, weight = position[a, 0], position[a, 1], radius[a] * radius[a]
        ty = min(max(y, -half_door), half_door) - y
        d = np.sqrt(x * x + ty * ty)
        force[a, 0], force[a, 1] = -weight * x / d, weight * ty / d
        if x > -radius[a]:
            force[a, 0] -= stiffness * (x + radius[a])
    for p in range(len(first)):
        a, b = first[p], second[p]
        dx, dy = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
        d2, both = dx * dx + dy * dy, radius[a] + radius[b]
        if d2 < both * both:
            d = np.sqrt(d2)
            f = stiffness * (both - d)
            pressed += f
            touching += 1
            force[a, 0] -= f * dx / d
            force[a, 1] -= f * dy / d
            force[b, 0] += f * dx / d
            force[b, 1] += f * dy / d
    return pressed, touching


@kernel
def _relax(position: Any, radius: Any, half_door: float, stiffness: float, most: int) -> bool:
    """FIRE, in units of the mean radius and of the mean push, masses ∝ r²; whether `most` steps
    were enough."""
    n = len(radius)
    velocity, force = np.zeros((n, 2)), np.zeros((n, 2))
    first, second = np.empty(8 * n, np.int32), np.empty(8 * n, np.int32)
    listed = position.copy()
    count, steps, dt, alpha = -1, 0, 0.1 / np.sqrt(stiffness), 0.1
    longest = 0.5 / np.sqrt(stiffness)
    for _ in range(most):
        moved = 0.0
        for a in range(n):
            dx, dy = position[a, 0] - listed[a, 0], position[a, 1] - listed[a, 1]
            moved = max(moved, dx * dx + dy * dy)
        if count < 0 or moved > 0.25 * SKIN * SKIN:
            listed[:] = position
            count = pairs_within(position, radius, SKIN, 2 * MOST + SKIN, first, second)
        pressed, touching = _push(
            position, radius, half_door, stiffness, first[:count], second, force
        )
        power = speed = size = worst = 0.0
        for a in range(n):
            for c in range(2):
                power += force[a, c] * velocity[a, c]
                speed += velocity[a, c] ** 2
                size += force[a, c] ** 2
                worst = max(worst, abs(force[a, c]))
        if worst * touching < REST * pressed:
            return True
        if power > 0:
            steps += 1
            mix = alpha * np.sqrt(speed / size)
            for a in range(n):
                for c in range(2):
                    velocity[a, c] = (1 - alpha) * velocity[a, c] + mix * force[a, c]
            if steps > 5:
                dt, alpha = min(dt * 1.1, longest), alpha * 0.99
        else:
            velocity[:] = 0.0
            dt, alpha, steps = dt * 0.5, 0.1, 0
        for a in range(n):
            for c in range(2):
                velocity[a, c] += dt * force[a, c]
                position[a, c] += dt * velocity[a, c]
    return False
