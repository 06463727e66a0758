"""The numbers of the multifrontal factorisation: assemble fronts, and eliminate.

A front is made where its results belong, as `eliminate` takes it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner
from nscd.compiling.atomics import add_one, look, put
from nscd.compiling.team import FAILED, JOB, NEXT, THREADS, begin_job, end_job
from nscd.compiling.vectors import add, load, store, within
from nscd.friction.cholesky.elimination import chunks, eliminate, height_of, update_size
from nscd.friction.cholesky.tasks import wait_for_those_below

# The kind of this job; the first thread, as a number of NumPy: a literal would compile what it is
# given to once more.
FACTORISE = 1
FIRST: Any = np.int64(0)


class _Front(NamedTuple):
    """Hold where panel and update of a front begin, its pivots and other rows, and rows and chunks
    of its panel."""

    panel: int
    update: int
    pivots: int
    rest: int
    height: int
    wide: int


@inner(fastmath=True, apart=True)
def factorise_fronts(system: Any, fronts: Any, theta: Any) -> bool:
    """Factorise Â + CᵀΘC for theta (k,) kg, d unknowns per disk, with all threads of the team.

    Returns False where rounding left it indefinite."""
    tasks, shared = fronts.tasks, fronts.shared
    control = shared.control
    if control[THREADS] == 1:
        weights = theta, system.normal_weight, system.tangent_weight
        sound = True
        for t in range(len(tasks.end)):
            sound = sound and _factorise_task(system, fronts, weights, t, FIRST)
        return sound
    shared.theta[:] = theta
    shared.along[:] = system.normal_weight
    shared.across[:] = system.tangent_weight
    begin_job(control, FACTORISE)
    factorise_tasks(system, fronts, FIRST)
    end_job(control)
    return bool(look(control, FAILED) == 0)


@inner
def factorise_tasks(system: Any, fronts: Any, me: int) -> None:
    """Do tasks of the job until none is left, with the weights of the job."""
    tasks, shared = fronts.tasks, fronts.shared
    control, weights = shared.control, (shared.theta, shared.along, shared.across)
    job, at = control[JOB], add_one(control, NEXT)
    while at < len(tasks.order):
        t = tasks.order[at]
        wait_for_those_below(tasks, shared, t, job)
        if look(control, FAILED) == 0 and not _factorise_task(system, fronts, weights, t, me):
            put(control, FAILED, 1)
        put(shared.done, t, job)
        at = add_one(control, NEXT)


@inner(fastmath=True, apart=True)
def _factorise_task(system: Any, fronts: Any, weights: Any, t: int, me: int) -> bool:
    d, tasks, F = system.mass.shape[1], fronts.tasks, fronts.store
    theta, along, across = weights
    room = len(fronts.run) // fronts.shared.control[THREADS]
    run, stacks = fronts.run[me * room : (me + 1) * room], me * fronts.stacks
    begin = tasks.end[t - 1] if t > 0 else 0
    # what stays for others is not in the stacks
    root = tasks.end[t] - 1 if len(tasks.end) > 1 else -1
    for s in range(begin, tasks.end[t]):
        pivots = d * (fronts.end[s] - fronts.first[s])
        rest = d * (fronts.border_start[s + 1] - fronts.border_start[s])
        panel, update = fronts.panel_start[s], fronts.update_start[s]
        if s != root:
            update += stacks
        front = _Front(panel, update, pivots, rest, height_of(pivots), chunks(pivots))
        F[panel : fronts.panel_start[s + 1]] = 0.0
        F[update : update + update_size(rest)] = 0.0
        for k in range(fronts.end[s] - fronts.first[s]):
            for a in range(d):
                F[_place(front, k * d + a, k * d + a)] = system.mass[fronts.first[s] + k, a]
        for e in range(fronts.element_start[s], fronts.element_start[s + 1]):
            c = fronts.element[e]
            i, j = fronts.left[e] * d, fronts.right[e] * d
            weight = theta[c] + along[c]
            x, y = system.normal_first[c, 0], system.normal_first[c, 1]
            _add_normal(F, front, i, j, (weight * x * x, weight * x * y, weight * y * y))
            if across[c] != 0.0:
                first, second = system.tangent_first[c], system.tangent_second[c]
                _add_tangent(F, front, i, j, across[c], first, second)
        c = fronts.child[s]
        while c >= 0:
            inner = fronts.inner[fronts.border_start[c] : fronts.border_start[c + 1]]
            given = fronts.update_start[c] + (stacks if c >= begin else 0)
            _add_child(F, front, given, inner, run, d)
            c = fronts.sibling[c]
        if not eliminate(F, panel, update, pivots, rest):
            return False
    return True


@inner
def _place(front: Any, row: int, column: int) -> int:
    """Where the number of a row and a later column is."""
    if row >= front.pivots:
        return _place_in_update(front, row - front.pivots, column - front.pivots)
    if column >= front.pivots:
        column += 8 * front.wide - front.pivots
    place: int = front.panel + ((column >> 3) * front.height + row) * 8 + (column & 7)
    return place


@inner
def _place_in_update(front: Any, row: int, column: int) -> int:
    chunk = column >> 3
    place: int = front.update + 32 * chunk * (chunk + 1) + 8 * row + (column & 7)
    return place


@inner(fastmath=True)
def _add_normal(F: Any, front: Any, i: int, j: int, product: Any) -> None:
    """The upper half of (n, −n)ᵀ(n, −n), product = (xx, xy, yy), at rows i and j (negative: a
    wall)."""
    xx, xy, yy = product
    at, next_to = _place(front, i, i), _place(front, i, i + 1)
    F[at] += xx
    F[next_to] += xy
    F[next_to + 8] += yy
    if j < 0:
        return
    at, next_to = _place(front, j, j), _place(front, j, j + 1)
    F[at] += xx
    F[next_to] += xy
    F[next_to + 8] += yy
    # one of the two disks is eliminated here: the upper row is in the panel
    row, column = min(i, j), max(i, j)
    at, next_to = _place(front, row, column), _place(front, row, column + 1)
    F[at] -= xx
    F[next_to] -= xy
    F[at + 8] -= xy
    F[next_to + 8] -= yy


@inner(fastmath=True)
def _add_tangent(
    F: Any, front: Any, i: int, j: int, weight: float, first: Any, second: Any
) -> None:
    """The upper half of weight · (first, second)ᵀ(first, second) at rows i and j (negative: a
    wall)."""
    d = len(first)
    for a in range(d):
        for b in range(d):
            if b >= a:
                F[_place(front, i + a, i + b)] += weight * first[a] * first[b]
            if b >= a and j >= 0:
                F[_place(front, j + a, j + b)] += weight * second[a] * second[b]
            if j >= 0:
                at = _place(front, i + a, j + b) if i < j else _place(front, j + b, i + a)
                F[at] += weight * first[a] * second[b]


@inner(fastmath=True)
def _add_child(F: Any, front: Any, child: int, inner: Any, to: Any, d: int) -> None:
    """Add a child's Schur complement at the places `inner` of its disks, as many neighbouring
    columns at a time as are in one chunk here and there; `to` is overwritten."""
    count, above = d * len(inner), 0
    # places in the grid of the panel, `above` of them pivots
    beyond = 8 * front.wide - front.pivots
    for i in range(len(inner)):
        for a in range(d):
            place = inner[i] * d + a
            if place < front.pivots:
                above += 1
            else:
                place += beyond
            to[i * d + a] = place
    j = 0
    while j < count:
        lane, end = to[j] & 7, j + 1
        while end < count and to[end] == to[end - 1] + 1 and to[end] & 7 and end & 7:
            end += 1
        chunk = to[j] >> 3
        given = child + 32 * (j >> 3) * ((j >> 3) + 1) + (j & 7) - lane
        panel = front.panel + 8 * chunk * front.height
        above_here = min(above, end)
        _add_rows(F, given, panel, to, (0, above_here), (lane, lane + end - j))
        if above_here < end:
            chunk -= front.wide
            update = front.update + 32 * chunk * (chunk + 1) - 64 * front.wide
            _add_rows(F, given, update, to, (above_here, end), (lane, lane + end - j))
        j = end


@inner(fastmath=True)
def _add_rows(F: Any, given: int, chunk: int, to: Any, rows: Any, lanes: Any) -> None:
    """Add some lanes of the rows that are given at the places `to` of a chunk."""
    low, high = lanes
    for i in range(rows[0], rows[1]):
        at = chunk + 8 * to[i]
        store(F, at, add(load(F, at), within(load(F, given + 8 * i), low, high)))
