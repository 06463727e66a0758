"""Where an answer moves with the parameter of a path: the matrix of its states, and how it changes
as contacts change theirs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner
from nscd.friction.elimination import add_to, solve_dense
from nscd.friction.factor import factorise, solve_factorised, solve_two
from nscd.friction.problem import add_impulses, contact_velocities
from nscd.friction.sets import FREE, STICK, slope

# Compliance of closed contacts about their reference, relative to w: keeps redundant ones apart.
# Where a closed contact opens without a new factorisation, its square is lost in digits: so a soft
# one for long paths, a firm one for those that factorise every time.
SOFT, FIRM = 1e-5, 1e-8
# Contacts that may change before the matrix is factorised again, on a soft path.
CHANGES = 24
V, S, LAM, TAU = 0, 1, 2, 3


class Path(NamedTuple):
    """hold, base (k,): states now, and when the matrix was factorised (FREE is open). origin (n,3),
    start (2,k) m/s, held (2,k) N·s: velocities, C u − b and T u, λ and τ where the path begins; at
    these λ and τ contacts do not yield. u (n,3), x (4,k): by how much velocities, C u, T u, λ and τ
    have changed since, so that what firm contacts make of a change is not lost in the digits of the
    whole; the whole where a path has arrived. rate, base_rate (n,3), dx (4,k): their derivatives by
    t, base_rate with the states of then; push (2,k) m/s: a and d. changed, slot: contacts
    whose state is not that of `base`, and where they are in it; columns (2m,n,3): what unit
    percussions along n and t of each do with the matrix of then, gram (2m,2m) at each other,
    known (2m,): `base_rate` at each; count (1,); compliance (1,)."""

    hold: Any
    base: Any
    origin: Any
    start: Any
    held: Any
    u: Any
    rate: Any
    base_rate: Any
    x: Any
    dx: Any
    push: Any
    changed: Any
    slot: Any
    columns: Any
    gram: Any
    known: Any
    count: Any
    compliance: Any


def path_of(n: int, k: int) -> Path:
    """Storage for paths of n disks and k contacts."""
    return Path(
        hold=np.zeros(k, dtype=np.int8),
        base=np.zeros(k, dtype=np.int8),
        origin=np.zeros((n, 3)),
        start=np.zeros((2, k)),
        held=np.zeros((2, k)),
        u=np.zeros((n, 3)),
        rate=np.zeros((n, 3)),
        base_rate=np.zeros((n, 3)),
        x=np.zeros((4, k)),
        dx=np.zeros((4, k)),
        push=np.zeros((2, k)),
        changed=np.zeros(CHANGES, dtype=np.int32),
        slot=np.full(k, -1, dtype=np.int32),
        columns=np.zeros((2 * CHANGES, n, 3)),
        gram=np.zeros((2 * CHANGES, 2 * CHANGES)),
        known=np.zeros(2 * CHANGES),
        count=np.zeros(1, dtype=np.int64),
        compliance=np.full(1, SOFT),
    )


@inner
def weights_of(problem: Any, path: Any, c: int, hold: int) -> Any:
    """α, β, γ, δ of a contact in a state: its part α n nᵀ + β t tᵀ + γ t nᵀ + δ n tᵀ of the
    matrix."""
    if hold == FREE:
        return 0.0, 0.0, 0.0, 0.0
    w, wt = problem.normal_inverse[c], problem.tangent_inverse[c]
    if hold == STICK:
        return 1.0 / (path.compliance[0] * w), 1.0 / (path.compliance[0] * wt), 0.0, 0.0
    alpha = 1.0 / (path.compliance[0] * w)
    return alpha, 0.0, alpha * slope(hold, problem.friction[c]), 0.0


@inner
def _set_forces(problem: Any, path: Any, x: Any, t: float, offset: float) -> None:
    """Changes of λ and τ from those of C u and T u: at t (offset 1.0), or their derivatives by t
    (t = 1, 0.0).

    Where stuck, C u + ta − b = εw(λ − λ°) and T u + td = εw_t(τ − τ°); where sliding, what is
    beyond the latter is the slip σ, and τ = ±μλ."""
    for c in range(len(path.hold)):
        hold = path.hold[c]
        along, across = offset * path.held[0, c], offset * path.held[1, c]
        if hold == FREE:
            x[LAM, c], x[TAU, c] = -along, -across
            continue
        pressed = x[V, c] + t * path.push[0, c] + offset * path.start[0, c]
        x[LAM, c] = pressed / (path.compliance[0] * problem.normal_inverse[c])
        if hold == STICK:
            slid = x[S, c] + t * path.push[1, c] + offset * path.start[1, c]
            x[TAU, c] = slid / (path.compliance[0] * problem.tangent_inverse[c])
        else:
            x[TAU, c] = slope(hold, problem.friction[c]) * (along + x[LAM, c]) - across


@inner(apart=True)
def restart(problem: Any, factor: Any, path: Any, t: float) -> bool:
    """Factorise the matrix of the states now; velocities and forces at t from it, without drift."""
    k, n = len(path.hold), len(path.u)
    weight = np.empty((4, k))
    for c in range(k):
        one = weights_of(problem, path, c, path.hold[c])
        for b in range(4):
            weight[b, c] = one[b]
    for q in range(path.count[0]):
        path.slot[path.changed[q]] = -1
    path.count[0] = 0
    for c in range(k):
        path.base[c] = path.hold[c]
    if not factorise(problem, factor, weight):
        return False
    path.base_rate[:] = 0.0
    path.dx[:] = 0.0
    _set_forces(problem, path, path.dx, 1.0, 0.0)
    add_impulses(problem, path.dx[LAM], path.dx[TAU], -1.0, path.base_rate)
    rest = np.empty((n, 3))
    for repeat in range(3):
        contact_velocities(problem, path.u, path.x[V], path.x[S])
        _set_forces(problem, path, path.x, t, 1.0)
        for i in range(n):
            for b in range(3):
                rest[i, b] = -problem.mass[i, b] * path.u[i, b]
        add_impulses(problem, path.x[LAM], path.x[TAU], -1.0, rest)
        if repeat == 0:
            solve_two(factor, rest, path.base_rate)
        else:
            solve_factorised(factor, rest)
        add_to(path.u, 1.0, rest)
    contact_velocities(problem, path.u, path.x[V], path.x[S])
    _set_forces(problem, path, path.x, t, 1.0)
    return True


@inner(fastmath=True)
def _at_contact(problem: Any, c: int, u: Any) -> Any:
    """n and t components of the velocities u (n,3) at contact c: C u, T u."""
    i, j = problem.first[c], problem.second[c]
    x, y, turn = u[i, 0], u[i, 1], problem.lever[c, 0] * u[i, 2]
    if j >= 0:
        x -= u[j, 0]
        y -= u[j, 1]
        turn += problem.lever[c, 1] * u[j, 2]
    nx, ny = problem.normal[c, 0], problem.normal[c, 1]
    return nx * x + ny * y, nx * y - ny * x + turn


@inner(apart=True)
def take(problem: Any, factor: Any, path: Any, c: int) -> None:
    """Add contact c to those whose state has changed since the factorisation."""
    q = path.count[0]
    path.changed[q], path.slot[c] = c, q
    path.count[0] = q + 1
    i, j = problem.first[c], problem.second[c]
    nx, ny = problem.normal[c, 0], problem.normal[c, 1]
    for b in range(2):
        column = path.columns[2 * q + b]
        column[:] = 0.0
        x, y = (nx, ny) if b == 0 else (-ny, nx)
        column[i, 0], column[i, 1] = x, y
        if b == 1:
            column[i, 2] = problem.lever[c, 0]
        if j >= 0:
            column[j, 0], column[j, 1] = -x, -y
            if b == 1:
                column[j, 2] = problem.lever[c, 1]
    solve_two(factor, path.columns[2 * q], path.columns[2 * q + 1])
    for p in range(q + 1):
        other = path.changed[p]
        for b in range(2):
            one, two = _at_contact(problem, other, path.columns[2 * q + b])
            path.gram[2 * p, 2 * q + b], path.gram[2 * p + 1, 2 * q + b] = one, two
            one, two = _at_contact(problem, c, path.columns[2 * p + b])
            path.gram[2 * q, 2 * p + b], path.gram[2 * q + 1, 2 * p + b] = one, two
    one, two = _at_contact(problem, c, path.base_rate)
    path.known[2 * q], path.known[2 * q + 1] = one, two


@inner(apart=True)
def find_rate(problem: Any, path: Any) -> None:
    """Derivatives by t with the states now: the factorised matrix and the rank-two changes of the
    contacts that have changed (Woodbury)."""
    m = path.count[0]
    path.rate[:] = 0.0
    add_to(path.rate, 1.0, path.base_rate)
    if m > 0:
        size = 2 * m
        matrix, share = np.zeros(size * size), np.empty(size)
        for q in range(m):
            c = path.changed[q]
            one, two = (
                weights_of(problem, path, c, path.hold[c]),
                weights_of(problem, path, c, path.base[c]),
            )
            a = path.push[0, c] + path.known[2 * q]
            d = path.push[1, c] + path.known[2 * q + 1]
            alpha, beta = one[0] - two[0], one[1] - two[1]
            gamma, delta = one[2] - two[2], one[3] - two[3]
            share[2 * q] = -alpha * a - delta * d
            share[2 * q + 1] = -gamma * a - beta * d
            for p in range(size):
                along, across = path.gram[2 * q, p], path.gram[2 * q + 1, p]
                matrix[2 * q * size + p] = alpha * along + delta * across
                matrix[(2 * q + 1) * size + p] = gamma * along + beta * across
        for q in range(size):
            matrix[q * size + q] += 1.0
        solve_dense(matrix, share)
        for q in range(size):
            if share[q] != 0.0:
                add_to(path.rate, share[q], path.columns[q])
    contact_velocities(problem, path.rate, path.dx[V], path.dx[S])
    _set_forces(problem, path, path.dx, 1.0, 0.0)


@inner(fastmath=True)
def move(path: Any, step: float) -> None:
    """Go a step along the path: velocities, C u, T u, λ and τ."""
    add_to(path.u, step, path.rate)
    add_to(path.x, step, path.dx)


@inner
def add_start(path: Any) -> None:
    """Make the changes since the start the whole velocities, λ and τ: where a path has arrived."""
    add_to(path.u, 1.0, path.origin)
    add_to(path.x[LAM], 1.0, path.held[0])
    add_to(path.x[TAU], 1.0, path.held[1])
