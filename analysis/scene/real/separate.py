"""The smallest displacement that makes overlapping disks a possible crowd."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from nscd import Contacts, Snapshot, Walls, _core, find_contacts
from nscd.arrays import Floats
from nscd.segments import dots, lengths

# Answers are whole multiples of GRID_M, so that every machine gives the same digits; gaps are at
# least SPARE_M before rounding and so never negative after it.
GRID_M = 1e-8
SPARE_M = 3e-8
STEP_M = 1e-9
SOLVER_TOLERANCE = 1e-12
MAXIMUM_ITERATIONS = 500
# Where the normals turn as they do beside bent rows, each step is nearly a fixed share of the one
# before. After so many, once two shares in a row agree, the rest of that series is taken at once.
SLOW, AGREE = 100, 1e-2


class OverlapError(ValueError):
    """No arrangement without overlaps was found; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arrangement:
    """position (n,2) m without overlaps, and the number of linearisations that it took."""

    position: Floats
    linearisations: int


def reconcile(
    position: Floats,
    radius: Floats,
    walls: Walls | None = None,
    door: Walls | None = None,
    outward: Floats | None = None,
    start: Floats | None = None,
) -> Arrangement:
    """Move disks at position (n,2) m with radius (n,) m as little as possible until none overlap.

    start: (n,2) m, where the search begins, such as the answer of an instant before; at `position`
        where left out

    min ½ Σ |q' − q|² subject to |q'_j − q'_i| ≥ r_i + r_j, distance to walls ≥ r, and centres on
    their own side of the door (one segment; `outward` (2,) points out). The constraints are not
    convex. Each iterate solves the convex problem with the normals of the one before, n·(q'_j −
    q'_i) ≥ r_i + r_j, for all pairs with gaps up to a diameter. Its answer satisfies the true
    constraints too, since |x| ≥ n·x, and the one before is admissible for it: the displacement
    falls from step to step, to a point of stationarity (a local minimum; a smaller one may exist).
    A search of more than 100 steps is helped by extrapolation; what ends it is the same.

    Raises OverlapError where there is no room for the disks, or where the iteration does not
    settle; ValueError where two centres (or a centre and a wall) coincide."""
    n = len(position)
    reach = 2.0 * float(radius.max())
    current = np.array(position if start is None else start, dtype=np.float64)
    steps: list[Floats] = []
    for iteration in range(MAXIMUM_ITERATIONS):
        snapshot = Snapshot(position=current, radius=radius, mass=np.ones(n))
        contacts = _with_door(
            find_contacts(snapshot, walls, tolerance=reach), current, door, outward, reach
        )
        overlap = float((SPARE_M - contacts.gap).max(initial=0.0))
        if not len(contacts):
            current = np.array(position, dtype=np.float64)
            break
        if start is None and iteration == 0 and overlap == 0:
            break
        # A projection of the displacement from the current iterate; lengths are measured in radii.
        step, error = _projected(snapshot, contacts, position - current, 0.5 * reach)
        if not error < 1e-6:
            raise OverlapError(f"there is no room for {n} disks of radius up to {radius.max():g} m")
        current = current + step
        if np.abs(step).max() < STEP_M and overlap < STEP_M:
            break
        steps = [*steps[-2:], step]
        if iteration >= SLOW and (rest := _remaining_steps(steps)) is not None:
            current, steps = current + rest, []
    else:
        raise OverlapError(
            f"no end after {MAXIMUM_ITERATIONS} linearisations: the last moved "
            f"{np.abs(step).max():.1e} m"
        )
    return Arrangement(position=np.round(current / GRID_M) * GRID_M, linearisations=iteration)


def _projected(
    snapshot: Snapshot, contacts: Contacts, free: Floats, scale: float
) -> tuple[Floats, float]:
    """Compute x (n,2) m of min ½ Σ |x − free|² subject to C x ≤ gap − SPARE_M, and its recomputed
    error, a share of the scale (m) or more."""
    found = _core.solve_impact(
        contacts.first, contacts.second, contacts.is_wall, contacts.normal, snapshot.position,
        snapshot.radius, snapshot.mass, free, max_approach=contacts.gap - SPARE_M, least_scale=scale,
        tolerance=SOLVER_TOLERANCE, canonical=False, with_error_bound=False,
    )  # fmt: skip
    assert found is not None, "contacts of disks that there are, and finite numbers"
    error = max(found.residual, found.momentum_error)
    return found.right_velocity, error if found.finite else np.inf


def _remaining_steps(steps: list[Floats]) -> Floats | None:
    """What is still to come of three steps (n,2) m that shrink by one factor ρ: ρ/(1 − ρ) times the
    last; None where they do not."""
    if len(steps) < 3:
        return None
    fractions = [float((b * a).sum() / (a * a).sum()) for a, b in pairwise(steps)]
    fraction = fractions[-1]
    bent = lengths(np.ravel(steps[-1] - fraction * steps[-2]))
    straight = bent < AGREE * lengths(np.ravel(steps[-1]))
    if not 0 < fraction < 1 or not straight or abs(fractions[0] - fraction) > AGREE * (1 - fraction):
        return None
    return fraction / (1 - fraction) * steps[-1]


def _with_door(
    contacts: Contacts, position: Floats, door: Walls | None, outward: Floats | None, reach: float
) -> Contacts:
    """The contacts and, for those whose centre is within `reach` of the door, a stop of the centre
    at its line."""
    if door is None or outward is None:
        return contacts
    nearest = door.nearest_point(position, np.zeros(len(position), dtype=np.int64))
    depth = dots(door.start[0] - position, outward)
    near = np.flatnonzero((lengths(nearest - position) <= reach) & (depth >= 0))
    count = len(near)
    return Contacts(
        first=np.concatenate([contacts.first, near]),
        second=np.concatenate([contacts.second, np.zeros(count, dtype=np.int64)]),
        is_wall=np.concatenate([contacts.is_wall, np.ones(count, dtype=bool)]),
        normal=np.concatenate([contacts.normal, np.tile(outward, (count, 1))]),
        gap=np.concatenate([contacts.gap, depth[near]]),
        point=np.concatenate([contacts.point, position[near] + depth[near, None] * outward]),
    )
