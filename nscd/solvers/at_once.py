"""The rungs of the ladder in one compiled call, for small crowds without dissipation."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner
from nscd.solvers.active_set import ROUNDS, _rounds
from nscd.solvers.canonical import accuracy, settle_energy
from nscd.solvers.cholesky.factor import factor_by_rows
from nscd.solvers.closed_form import answer_at_once
from nscd.solvers.closing import CLOSED, EXACT, PENALTY
from nscd.solvers.interior.interior_point import (
    AFTER_ANOTHER,
    AFTER_DESCENT,
    FIRMER,
    SOFTEST,
    Begin,
    solve_by_path,
)
from nscd.solvers.projected_gradient import descend
from nscd.solvers.system import System, approach, evenly
from nscd.solvers.task import Held
from nscd.solvers.thresholds import AT
from nscd.solvers.tree import branches_of, close_branches
from nscd.solvers.velocity_error import _by_factor, _by_tree

SWEEPS, STEADY, STEADY_SHARE = AT.few_sweeps, AT.steady, AT.steady_share
ISOSTATIC, REDUNDANT, PRESSED = AT.isostatic, AT.redundant, AT.pressed
# Contacts are this firm from the beginning where a crowd was nearly the same before: in films of
# marginal packings softer ones lead to wrong closed contacts as often as not.
FIRM = FIRMER * SOFTEST
# To this share of the tolerance contacts are closed where no bound of the error is asked for.
SHARE_OF_TOLERANCE = 1e-3
TINY = float(np.finfo(float).tiny)
# What gave an answer: no solver, or a rung of the ladder.
CLOSED_FORM, TREES, UNEVEN, DESCENT, MARGINAL = range(5)


class Chosen(NamedTuple):
    """Hold what gave an answer.

    rung: of the numbers above
    disks: how many of them were not answered in closed form
    iterations: sweeps, rounds, factorisations
    least: whether λ is known to be the one of least energy
    bound: √kg m/s, of √(Σ m |u − u⁺|²); 0 where none was asked for"""

    rung: int
    disks: int
    iterations: int
    least: bool
    bound: float


class Near(NamedTuple):
    """Hold an answer that is nearly right, as that of the frame before. Empty where there is none.

    reaction: (k,) N·s, λ
    velocity: (n,2) m/s, u⁺"""

    reaction: Any
    velocity: Any


@inner
def nothing_near() -> Near:
    """Say that nothing is known."""
    return Near(np.empty(0), np.empty((0, 2)))


@inner(apart=True)
def answer(whole: Any, near: Any, tolerance: float, least: Any, bounded: Any) -> Any:
    """Solve a system: λ (k,), u⁺ (n,2), and what gave them.

    near: a `Near`, which makes it cheaper and does not change the answer
    least: whether λ is to be the one of least energy where it is not unique
    bounded: whether the error is to be bounded (offsets are then to be 0)"""
    reaction, velocity = np.zeros(len(whole.first)), whole.free.copy()
    bound, rest, forest = answer_at_once(whole, reaction, velocity, bounded)
    chosen = Chosen(CLOSED_FORM, 0, 0, True, bound)
    if len(rest.contact):
        part = _part(whole, rest)
        if forest:
            pushed, u, own = _by_branches(part, bounded)
        else:
            known = nothing_near()
            if len(near.reaction):
                known = Near(near.reaction[rest.contact], near.velocity[rest.disk])
            pushed, u, own = _by_factors(part, known, tolerance, least, bounded)
        for c in range(len(pushed)):
            reaction[rest.contact[c]] = pushed[c]
        for i in range(len(u)):
            for a in range(2):
                velocity[rest.disk[i], a] = u[i, a]
        bound = math.sqrt(bound * bound + own.bound * own.bound)
        chosen = Chosen(own.rung, own.disks, own.iterations, own.least, bound)
    return reaction, velocity, chosen


@inner
def _by_branches(part: Any, bounded: Any) -> Any:
    """The rung `tree`."""
    branches = branches_of(len(part.mass), part.first, part.second)
    reaction, u, done = close_branches(part, branches)
    bound = math.sqrt(_by_tree(part, branches, reaction, u)) if bounded else 0.0
    return reaction, u, Chosen(TREES, len(u), done, True, bound)


@inner
def _by_factors(part: Any, near: Any, tolerance: float, wanted: Any, bounded: Any) -> Any:
    """The rungs that factorise: descent, or what is nearly right, and active set where masses are
    even, else and where that does not settle the interior point."""
    n, k = len(part.mass), len(part.first)
    factor = factor_by_rows(n, part.first, part.second)
    system = _ordered(part, factor)
    rung, least, iterations = UNEVEN, False, 0
    pushed, u, held = np.empty(0), system.free, Held(np.empty(0), np.empty(0, np.bool_))
    away, soft, known, sure = AFTER_DESCENT, SOFTEST, len(near.reaction) > 0, tolerance
    if known:
        pushed, u = near.reaction[factor.contact], near.velocity[factor.order]
        # gaps have to be known as well as they are looked at: nearly closed contacts that are left
        # out change the reactions of least energy
        away, soft, sure = AFTER_ANOTHER, FIRM, min(tolerance, EXACT)
    if evenly(part.inverse_mass):
        rung = MARGINAL
        if known:
            closed = pushed > PRESSED * pushed.max()
        else:
            pushed, u, iterations, closed = _descended(system, tolerance)
        if closed.any():
            # as `stiffness` has it, so that all rungs close contacts alike, to the last bit
            theta = np.full(k, PENALTY * (1.0 / system.inverse_mass.max()))
            # contacts of a step need not be closed to rounding
            enough = CLOSED if bounded else max(CLOSED, SHARE_OF_TOLERANCE * tolerance)
            # numbers of NumPy: a literal would compile the kernel once more
            better, moved, done, error, exact = _rounds(
                system, factor, closed, theta, np.int64(ROUNDS), np.bool_(False), enough
            )
            iterations += done
            if exact and error <= sure:
                rung, least, pushed, u = DESCENT, True, better, moved
                held = Held(np.where(closed, theta, 0.0), closed)
    if rung != DESCENT:
        begin = Begin(pushed, u, away, soft)
        found = solve_by_path(system, factor, begin, tolerance, wanted)
        pushed, u, least = found.reaction, found.velocity, found.least
        iterations += found.iterations
        held = Held(found.theta, found.closed)
    bound = 0.0
    if bounded:
        none = np.empty((0, 2))
        bound = math.sqrt(_by_factor(system, factor, none, pushed, u, held, np.bool_(False)))
    if wanted and not least and accuracy(system, pushed, u) <= tolerance:
        pushed, least = settle_energy(system, factor, pushed, u, tolerance)
    reaction, velocity = np.empty(k), np.empty((n, 2))
    for c in range(k):
        reaction[factor.contact[c]] = pushed[c]
    for i in range(n):
        for a in range(2):
            velocity[factor.order[i], a] = u[i, a]
    return reaction, velocity, Chosen(rung, n, iterations, least, bound)


@inner
def _descended(system: Any, tolerance: float) -> Any:
    """Where the descent ends, its sweeps, and the contacts (k,) to close: none where it does not tell
    them. See `descend_and_close`."""
    k = len(system.first)
    steady = STEADY + int(STEADY_SHARE * k)
    pushed, u, sweeps, _ = descend(system, tolerance, np.int64(SWEEPS), steady, ISOSTATIC)
    closed, v, count = np.empty(k, np.bool_), np.empty(k), 0
    approach(system, u, v)
    for c in range(k):
        closed[c] = system.inverse_mass[c] * pushed[c] > system.offset[c] - v[c]
        count += closed[c]
    share = count / (2 * len(u))
    if ISOSTATIC < share < REDUNDANT:
        closed[:] = False
    return pushed, u, sweeps, closed


@inner
def _part(whole: Any, rest: Any) -> Any:
    """The problem of the contacts that are left, in the order in which they were given."""
    m, n = len(rest.contact), len(rest.disk)
    i, j, w, none = np.empty(m, np.int32), np.empty(m, np.int32), np.empty(m), np.zeros(m)
    offset = whole.offset[rest.contact]
    there, back, heavy, free = (
        np.empty((m, 2)), np.empty((m, 2)), np.empty((n, 2)), np.empty((n, 2)),
    )  # fmt: skip
    for r in range(m):
        c = rest.contact[r]
        i[r], w[r] = rest.number[whole.first[c]], whole.inverse_mass[c]
        j[r] = rest.number[whole.second[c]] if whole.second[c] >= 0 else -1
        for a in range(2):
            there[r, a], back[r, a] = whole.normal_first[c, a], whole.normal_second[c, a]
    speed = TINY
    for b in range(n):
        for a in range(2):
            heavy[b, a], free[b, a] = whole.mass[rest.disk[b], a], whole.free[rest.disk[b], a]
            speed = max(speed, abs(free[b, a]))
    return System(i, j, there, back, there, back, none, none, heavy, free, offset, w, speed)


@inner
def _ordered(part: Any, factor: Any) -> Any:
    """The same problem in elimination order."""
    there, back = part.normal_first[factor.contact], part.normal_second[factor.contact]
    i, j = factor.place[part.first[factor.contact]], part.second[factor.contact]
    for c in range(len(j)):
        if j[c] >= 0:
            j[c] = factor.place[j[c]]
    none = part.normal_weight
    return System(
        i, j, there, back, there, back, none, none, part.mass[factor.order], part.free[factor.order],
        part.offset[factor.contact], part.inverse_mass[factor.contact], part.scale,
    )  # fmt: skip
