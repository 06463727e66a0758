"""Solutions by the factor that fronts hold: forward along the rows of Lᵀ, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.compiling import inner
from nscd.compiling.atomics import add_one, put
from nscd.compiling.team import JOB, NEXT, THREADS, begin_job, end_job, wait_for
from nscd.compiling.vectors import add, less, load, more, spread, spread_from, store, total, within
from nscd.friction.cholesky.elimination import chunks, height_of
from nscd.friction.cholesky.tasks import wait_for_those_below

# The kinds of these jobs; the first task and thread, as a number of NumPy: a literal would compile
# what it is given to once more.
FORWARD, BACK = 2, 3
FIRST: Any = np.int64(0)


@inner(fastmath=True, apart=True)
def solve_fronts(fronts: Any, b: Any) -> None:
    """Solve b ← (L Lᵀ)⁻¹ b in place, (n,d), with all threads of the team."""
    flat, d, count = b.reshape(-1), b.shape[1], len(fronts.tasks.end)
    shared = fronts.shared
    if count == 1:
        _forward_task(fronts, flat, FIRST, d, FIRST)
        _back_task(fronts, flat, FIRST, d, FIRST)
        return
    x, control = shared.solution, shared.control
    x[: len(flat)] = flat
    if control[THREADS] == 1:
        for t in range(count):
            _forward_task(fronts, x, t, d, FIRST)
        for t in range(count - 1, -1, -1):
            _back_task(fronts, x, t, d, FIRST)
    else:
        begin_job(control, FORWARD)
        forward_tasks(fronts, d, FIRST)
        end_job(control)
        begin_job(control, BACK)
        back_tasks(fronts, d, FIRST)
        end_job(control)
    flat[:] = x[: len(flat)]


@inner
def forward_tasks(fronts: Any, d: int, me: int) -> None:
    """Do tasks of the job forward until none is left."""
    tasks, shared = fronts.tasks, fronts.shared
    control = shared.control
    job, at = control[JOB], add_one(control, NEXT)
    while at < len(tasks.order):
        t = tasks.order[at]
        wait_for_those_below(tasks, shared, t, job)
        _forward_task(fronts, shared.solution, t, d, me)
        put(shared.done, t, job)
        at = add_one(control, NEXT)


@inner
def back_tasks(fronts: Any, d: int, me: int) -> None:
    """Do tasks of the job back until none is left."""
    tasks, shared = fronts.tasks, fronts.shared
    control = shared.control
    job, at = control[JOB], add_one(control, NEXT)
    while at < len(tasks.order):
        t = tasks.order[len(tasks.order) - 1 - at]
        if tasks.parent[t] >= 0:
            wait_for(control, shared.done, tasks.parent[t], job)
        _back_task(fronts, shared.solution, t, d, me)
        put(shared.done, t, job)
        at = add_one(control, NEXT)


@inner(fastmath=True, apart=True)
def _forward_task(fronts: Any, flat: Any, t: int, d: int, me: int) -> None:
    """Forward along the nodes of a task. What goes to disks of others is summed up behind the n
    disks, for them to take it."""
    tasks, P = fronts.tasks, fronts.store
    room = len(fronts.work) // fronts.shared.control[THREADS]
    x = fronts.work[me * room : (me + 1) * room]
    begin = tasks.end[t - 1] if t > 0 else 0
    beyond = d * fronts.end[len(fronts.end) - 1]
    flat[beyond + d * tasks.carry[t] : beyond + d * tasks.carry[t + 1]] = 0.0
    for below in range(t):
        if tasks.parent[below] == t:
            for q in range(tasks.carry[below], tasks.carry[below + 1]):
                for a in range(d):
                    flat[d * tasks.onward[q] + a] += flat[beyond + d * q + a]
    for s in range(begin, tasks.end[t]):
        pivots, base = d * (fronts.end[s] - fronts.first[s]), d * fronts.first[s]
        if pivots == 0:
            continue
        target = tasks.target[fronts.border_start[s] : fronts.border_start[s + 1]]
        _read_pivots(flat, base, pivots, x)
        _forward(P, fronts.panel_start[s], x, height_of(pivots), pivots, chunks(d * len(target)))
        for i in range(pivots):
            flat[base + i] = x[i]
        q = 8 * chunks(pivots)
        for i in range(len(target)):
            to = d * target[i]
            flat[to] -= x[q]
            flat[to + 1] -= x[q + 1]
            if d == 3:
                flat[to + 2] -= x[q + 2]
            q += d


@inner(fastmath=True, apart=True)
def _back_task(fronts: Any, flat: Any, t: int, d: int, me: int) -> None:
    tasks, P = fronts.tasks, fronts.store
    room = len(fronts.work) // fronts.shared.control[THREADS]
    x = fronts.work[me * room : (me + 1) * room]
    begin = tasks.end[t - 1] if t > 0 else 0
    for s in range(tasks.end[t] - 1, begin - 1, -1):
        pivots, base = d * (fronts.end[s] - fronts.first[s]), d * fronts.first[s]
        if pivots == 0:
            continue
        border = fronts.border[fronts.border_start[s] : fronts.border_start[s + 1]]
        count = chunks(pivots) + chunks(d * len(border))
        store(x, 8 * count - 8, spread(0.0))
        _read_pivots(flat, base, pivots, x)
        q = 8 * chunks(pivots)
        for i in range(len(border)):
            to = d * border[i]
            x[q] = flat[to]
            x[q + 1] = flat[to + 1]
            if d == 3:
                x[q + 2] = flat[to + 2]
            q += d
        _back(P, fronts.panel_start[s], x, height_of(pivots), count)
        for i in range(pivots):
            flat[base + i] = x[i]


@inner
def _read_pivots(flat: Any, base: int, pivots: int, x: Any) -> None:
    """Copy numbers to the beginning of x, with zeros up to the end of a chunk."""
    store(x, 8 * chunks(pivots) - 8, spread(0.0))
    for i in range(pivots):
        x[i] = flat[base + i]


@inner(fastmath=True)
def _forward(P: Any, at: int, x: Any, height: int, pivots: int, others: int) -> None:
    """x ← L⁻¹ x at the pivots; what they leave to the others, to be subtracted from them."""
    wide = chunks(pivots)
    for c in range(wide):
        chunk = at + 8 * c * height
        if c > 0:
            store(x, 8 * c, less(load(x, 8 * c), spread(1.0), _left(P, chunk, x, 8 * c)))
        for q in range(8 * c, min(8 * c + 8, height), 4):
            row = chunk + 8 * q
            k = row + (q & 7)
            y0 = x[q] * P[k]
            y1 = (x[q + 1] - P[k + 1] * y0) * P[k + 9]
            y2 = (x[q + 2] - P[k + 2] * y0 - P[k + 10] * y1) * P[k + 18]
            y3 = x[q + 3] - P[k + 3] * y0 - P[k + 11] * y1 - P[k + 19] * y2
            y3 *= P[k + 27]
            if not q & 7:
                z = load(x, q)
                z = less(less(z, spread(y0), load(P, row)), spread(y1), load(P, row + 8))
                z = less(less(z, spread(y2), load(P, row + 16)), spread(y3), load(P, row + 24))
                store(x, q, z)
            x[q], x[q + 1], x[q + 2], x[q + 3] = y0, y1, y2, y3
    for c in range(wide, wide + others):
        store(x, 8 * c, _left(P, at + 8 * c * height, x, height))


@inner(fastmath=True)
def _left(P: Any, chunk: int, x: Any, rows: int) -> Any:
    """Σ x · row over the first rows of a chunk, a multiple of four."""
    z0 = z1 = z2 = z3 = spread(0.0)
    for q in range(0, rows, 4):
        row = chunk + 8 * q
        z0 = more(z0, spread_from(x, q), load(P, row))
        z1 = more(z1, spread_from(x, q + 1), load(P, row + 8))
        z2 = more(z2, spread_from(x, q + 2), load(P, row + 16))
        z3 = more(z3, spread_from(x, q + 3), load(P, row + 24))
    return add(add(z0, z1), add(z2, z3))


@inner(fastmath=True)
def _back(P: Any, at: int, x: Any, height: int, count: int) -> None:
    """x ← L⁻ᵀ x at the pivots, given the others."""
    stride = 8 * height
    for q in range(height - 4, -1, -4):
        own = q >> 3
        row = at + own * stride + 8 * q
        z0 = z1 = z2 = z3 = spread(0.0)
        if not q & 7:
            v = within(load(x, q), 4, 8)
            z0, z1 = less(z0, load(P, row), v), less(z1, load(P, row + 8), v)
            z2, z3 = less(z2, load(P, row + 16), v), less(z3, load(P, row + 24), v)
        for c in range(own + 1, count):
            v, to = load(x, 8 * c), at + c * stride + 8 * q
            z0, z1 = less(z0, load(P, to), v), less(z1, load(P, to + 8), v)
            z2, z3 = less(z2, load(P, to + 16), v), less(z3, load(P, to + 24), v)
        k = row + (q & 7)
        y3 = (x[q + 3] + total(z3)) * P[k + 27]
        y2 = (x[q + 2] + total(z2) - P[k + 19] * y3) * P[k + 18]
        y1 = (x[q + 1] + total(z1) - P[k + 10] * y2 - P[k + 11] * y3) * P[k + 9]
        y0 = x[q] + total(z0) - P[k + 1] * y1 - P[k + 2] * y2 - P[k + 3] * y3
        x[q], x[q + 1], x[q + 2], x[q + 3] = y0 * P[k], y1, y2, y3
