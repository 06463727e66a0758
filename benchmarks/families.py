"""Scene families for the benchmarks of the percussions: arrays that `nscd` takes, any size,
reproducible.

heap: disks (0.18–0.25 m) grown round an arch at a 1 m exit, each touching two others or the wall:
nearly isostatic; jammed: the same relaxed as soft disks with the door closed; contacts are
overlaps, redundant and ill-conditioned; hexagonal: equal disks on a lattice, redundant; chain: a
line against a wall; masses: the heap with masses 1:10⁶; gate: one frame of a real crowd before a
gate, the scene `gate`, in its one size. The left velocity is 2 m/s toward the nearest point of the
exit (along the chain; in `gate` the scene's own)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from analysis.scene.packing import pop_site, push_site, touching_site
from analysis.scene.scene import read_scene
from nscd import Contacts, Snapshot, Walls, find_contacts

DOOR = 0.5  # half width, m
REST = 1e-3  # unbalanced force of a jammed disk, of the mean contact force


class Case(NamedTuple):
    """One contact problem."""

    name: str
    snapshot: Snapshot
    walls: Walls
    contacts: Contacts
    left_velocity: Any


def heap(n: int, seed: int = 1) -> Case:
    """A heap of n disks of 75 kg."""
    position, radius = _heap(n, seed)
    return _case("heap", position, radius, np.full(n, 75.0), 1e-9, closed=False)


def masses(n: int, seed: int = 1) -> Case:
    """The heap with masses from 10⁻³ to 10³ times 75 kg."""
    position, radius = _heap(n, seed)
    mass = 75.0 * 10.0 ** np.random.default_rng(seed).uniform(-3, 3, n)
    return _case("masses", position, radius, mass, 1e-9, closed=False)


def jammed(n: int, seed: int = 1) -> Case:
    """The heap pressed to a closed door until its soft disks rest: no force is off balance by more
    than a thousandth of the mean contact force."""
    position, radius = _heap(n, seed)
    # stiffer in a larger crowd, so that overlaps stay below a tenth of a radius
    # stiffness waves cross a larger crowd more slowly, hence the steps
    if not _relax(
        position,
        radius,
        75.0 * 2.0 / 0.5,
        1e6 * np.sqrt(n / 594),
        20_000 + int(400 * np.sqrt(n)),
        REST,
    ):
        raise RuntimeError(f"{n} jammed disks did not come to rest")
    return _case("jammed", position, radius, np.full(n, 75.0), 0.0, closed=True)


def hexagonal(n: int, seed: int = 1) -> Case:
    """The n sites of a touching triangular lattice (0.2 m) that are nearest to the door."""
    del seed
    r = 0.2
    m = int(np.sqrt(n)) + 2
    i, j = (a.ravel() for a in np.meshgrid(np.arange(m), np.arange(-m, m + 1), indexing="ij"))
    position = np.column_stack([-r - i * r * np.sqrt(3), (j + 0.5 * (i % 2)) * 2 * r])
    position = position[np.argsort(np.hypot(*position.T), kind="stable")[:n]]
    return _case("hexagonal", position, np.full(n, r), np.full(n, 75.0), 1e-9, closed=False)


def chain(n: int, seed: int = 1) -> Case:
    """n disks in line against a wall, all at 2 m/s into it."""
    del seed
    position = np.column_stack([0.5 * np.arange(n) - 0.5 * n + 0.25, np.zeros(n)])
    velocity = np.tile([2.0, 0.0], (n, 1))
    snapshot = Snapshot(
        position=position, velocity=velocity, radius=np.full(n, 0.25), mass=np.full(n, 75.0)
    )
    walls = Walls(start=np.array([[0.0, -1.0]]), end=np.array([[0.0, 1.0]]))
    return Case("chain", snapshot, walls, find_contacts(snapshot, walls, tolerance=1e-9), velocity)


def gate(n: int = 0, seed: int = 1) -> Case:
    """The people of the scene `gate`, however many are asked for; contacts are those that touch to
    1e-6 m."""
    del n, seed
    scene = read_scene("gate")
    snapshot, walls = scene.snapshot, scene.wall_segments()
    assert scene.drive is not None
    contacts = find_contacts(snapshot, walls, tolerance=scene.analysis.contact_tolerance_m)
    return Case("gate", snapshot, walls, contacts, scene.drive.desired_velocity(snapshot.position))


FAMILIES: dict[str, Callable[[int], Case]] = {
    "heap": heap,
    "jammed": jammed,
    "hexagonal": hexagonal,
    "chain": chain,
    "masses": masses,
    "gate": gate,
}


def _case(name: str, position: Any, radius: Any, mass: Any, tolerance: float, closed: bool) -> Case:
    y = position[:, 1]
    target = np.column_stack([np.zeros(len(y)), np.clip(y, -DOOR, DOOR)])
    towards = target - position
    velocity = 2.0 * towards / np.hypot(*towards.T)[:, None]
    reach = float(np.abs(position).max()) + 1.0
    ends = [[0.0, -reach], [0.0, DOOR]], [[0.0, -DOOR], [0.0, reach]]
    walls = (
        Walls(start=[[0.0, -reach]], end=[[0.0, reach]])
        if closed
        else Walls(start=ends[0], end=ends[1])
    )  # type: ignore[arg-type]
    snapshot = Snapshot(position=position, velocity=velocity, radius=radius, mass=mass)
    return Case(
        name, snapshot, walls, find_contacts(snapshot, walls, tolerance=tolerance), velocity
    )


def _heap(n: int, seed: int) -> tuple[Any, Any]:
    radius = np.random.default_rng(seed).uniform(0.18, 0.25, n)
    position = np.zeros((n, 2))
    if _grow(position, radius, 0.25) < n:
        raise RuntimeError("the heap stopped growing")
    return position, radius


@njit(cache=True)
def _grow(position: Any, radius: Any, widest: float) -> int:
    n = len(radius)
    cell = 2 * widest
    reach = 2.0 * np.sqrt(n * 0.25) + 6.0
    m = int(2 * reach / cell) + 4
    head = np.full((m, m), -1, np.int32)
    following = np.full(n, -1, np.int32)
    keys, sites = np.empty(60 * n + 1000), np.empty((60 * n + 1000, 3), np.int32)
    size = 0
    count = 0
    y = 0.0
    while count < n:
        r = radius[count]
        if count == 0:  # an arch of touching disks from wall to wall, on a circle round the door
            px, py = -r, 0.75
        elif y > -10.0:
            rho, step = 0.8, radius[count - 1] + r
            angle = np.arctan2(position[count - 1, 1], -position[count - 1, 0]) - 2 * np.arcsin(
                step / (2 * rho)
            )
            px, py = -rho * np.cos(angle), rho * np.sin(angle)
            if px > -r:
                y = -20.0
                continue
        else:
            found = False
            px = py = 0.0
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
        i, j = int((px + reach) / cell), int((py + reach) / cell)
        if px > -3.2 * widest:
            for side in (-1, 1):
                sx, sy, good = touching_site(position, radius, count, -1, side, 0.215)
                if good and abs(sy) > DOOR:
                    size = push_site(
                        keys,
                        sites,
                        size,
                        abs(sy) - DOOR if abs(sy) > DOOR else 0.0,
                        count,
                        -1,
                        side,
                    )
        for p in range(i - 2, i + 3):
            for q in range(j - 2, j + 3):
                c = head[p, q]
                while c >= 0:
                    d = np.hypot(position[c, 0] - px, position[c, 1] - py)
                    if d < radius[c] + r + 0.43:
                        for side in (-1, 1):
                            sx, sy, good = touching_site(position, radius, count, c, side, 0.215)
                            if good and sx < -0.17 and np.hypot(sx, sy) > 0.9:
                                far = np.hypot(sx, max(abs(sy) - DOOR, 0.0))
                                size = push_site(keys, sites, size, far, count, c, side)
                    c = following[c]
        following[count] = head[i, j]
        head[i, j] = count
        count += 1
    return count


@njit(cache=True)
def _relax(
    position: Any, radius: Any, push: float, stiffness: float, most: int, enough: float
) -> bool:
    """FIRE minimisation of the energy of soft disks that are pushed to the door (N) before a closed
    wall x = 0: whether `most` steps were enough."""
    n = len(radius)
    velocity = np.zeros((n, 2))
    force = np.zeros((n, 2))
    pairs = np.empty((12 * n, 2), np.int32)
    listed = position.copy()
    count = -1
    skin = 0.05
    dt, alpha, steps = 0.02, 0.1, 0
    scale = 1.0 / np.sqrt(stiffness)
    for _ in range(most):
        moved = 0.0
        for a in range(n):
            moved = max(
                moved, np.hypot(position[a, 0] - listed[a, 0], position[a, 1] - listed[a, 1])
            )
        if count < 0 or moved > skin / 2:
            listed[:] = position
            count = _pairs(position, radius, skin, pairs)
        worst = pressed = 0.0
        overlaps = 0
        for a in range(n):
            x, y = position[a, 0], position[a, 1]
            ty = min(max(y, -DOOR), DOOR) - y
            d = np.hypot(x, ty)
            force[a, 0], force[a, 1] = -push * x / d, push * ty / d
            if x > -radius[a]:
                force[a, 0] -= stiffness * (x + radius[a])
        for p in range(count):
            a, b = pairs[p, 0], pairs[p, 1]
            dx, dy = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1]
            d2 = dx * dx + dy * dy
            if d2 < (radius[a] + radius[b]) ** 2:
                d = np.sqrt(d2)
                f = stiffness * (radius[a] + radius[b] - d)
                pressed += f
                overlaps += 1
                f /= d
                force[a, 0] -= f * dx
                force[a, 1] -= f * dy
                force[b, 0] += f * dx
                force[b, 1] += f * dy
        power = speed = size = 0.0
        for a in range(n):
            for c in range(2):
                power += force[a, c] * velocity[a, c]
                speed += velocity[a, c] ** 2
                size += force[a, c] ** 2
                worst = max(worst, abs(force[a, c]))
        if worst * overlaps < enough * pressed:
            return True
        if power > 0:
            steps += 1
            mix = alpha * np.sqrt(speed / size)
            if steps > 5:
                dt, alpha = min(dt * 1.1, 0.5), alpha * 0.99
            velocity[:] = (1 - alpha) * velocity + mix * force
        else:
            velocity[:] = 0.0
            dt, alpha, steps = dt * 0.5, 0.1, 0
        velocity += dt * scale * force
        position += dt * scale * velocity
    return False


@njit(cache=True)
def _pairs(position: Any, radius: Any, skin: float, pairs: Any) -> int:
    n = len(radius)
    cell = 2 * radius.max() + skin
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
                    if (position[a, 0] - position[b, 0]) ** 2 + (
                        position[a, 1] - position[b, 1]
                    ) ** 2 < near * near:
                        pairs[count, 0], pairs[count, 1] = b, a
                        count += 1
                    b = following[b]
        following[a] = head[i, j]
        head[i, j] = a
    return count
