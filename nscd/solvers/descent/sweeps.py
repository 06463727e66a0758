"""The sweeps of a descent, by as many threads as there are: what each does, and where they meet.

Each sweeps over parts of the crowd of its own; contacts between parts come after those within."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.compiling import inner, kernel
from nscd.compiling.team import THREADS, meet
from nscd.solvers.thresholds import AT

# Sweeps from a look at the closed contacts to the next; in a crowd of FEW contacts, where a
# factorisation costs less than that many sweeps.
CHECK, OFTEN, FEW = 25, 10, 200
# After so many sweeps it is clear that more contacts than unknowns will stay closed: where they are
# REDUNDANT times as many, and where they are just more.
EARLY, LATE, REDUNDANT = 100, 200, AT.redundant / AT.isostatic


class Scaled(NamedTuple):
    """Hold the problem in the variables λ√w, where the Delassus operator has unit diagonal.

    A wall is a disk that never moves: disk n + p for the contacts of part p and beyond.

    first, second: (k,) disks
    x, y: (k,) the normal over √w
    inverse: (n+p,) 1/kg
    pull: (k,) (Cû − b)/√w
    root: (k,) √w"""

    first: Any
    second: Any
    x: Any
    y: Any
    inverse: Any
    pull: Any
    root: Any


class Descent(NamedTuple):
    """Hold where a descent is.

    now, ahead: (k,) √w λ, and where momentum carries it
    v: (k,) C u over √w
    ux, uy: (n+p,) kg m/s, then m/s
    closed: (k,) contacts at the last look
    sums: (4, p, 8) what is added up, by parts"""

    now: Any
    ahead: Any
    v: Any
    ux: Any
    uy: Any
    closed: Any
    sums: Any


@inner(fastmath=True, disjoint=True, forceinline=True)
def gather(
    part: Any, first: Any, second: Any, x: Any, y: Any, reaction: Any, ux: Any, uy: Any
) -> None:
    """u += Cᵀ λ (momentum), of contacts part[0] … part[1]."""
    for c in range(np.uint64(part[0]), np.uint64(part[1])):
        i, j = first[c], second[c]
        px, py = x[c] * reaction[c], y[c] * reaction[c]
        ux[i] += px
        uy[i] += py
        ux[j] -= px
        uy[j] -= py


@inner(fastmath=True, disjoint=True)
def _gather_at(
    low: int, high: int, begin: int, scaled: Any, reaction: Any, ux: Any, uy: Any
) -> None:
    """The same at disks low … high only, of contacts from `begin` on."""
    for c in range(np.uint64(begin), np.uint64(len(reaction))):
        i, j = scaled.first[c], scaled.second[c]
        px, py = scaled.x[c] * reaction[c], scaled.y[c] * reaction[c]
        if low <= i < high:
            ux[i] += px
            uy[i] += py
        if low <= j < high:
            ux[j] -= px
            uy[j] -= py


@inner(fastmath=True, disjoint=True)
def approach_scaled(
    part: Any, first: Any, second: Any, x: Any, y: Any, ux: Any, uy: Any, v: Any
) -> None:
    """v = C u, of contacts part[0] … part[1]."""
    for c in range(np.uint64(part[0]), np.uint64(part[1])):
        i, j = first[c], second[c]
        v[c] = x[c] * (ux[i] - ux[j]) + y[c] * (uy[i] - uy[j])


@inner
def _piece(parts: Any, p: int, between: Any, contacts: int) -> Any:
    """The contacts of a part, or those between parts that are looked at with it."""
    if not between:
        return parts.contact[p], parts.contact[p + 1]
    count = len(parts.disk) - 1
    begin = parts.contact[count]
    return begin + (contacts - begin) * p // count, begin + (contacts - begin) * (p + 1) // count


@inner(fastmath=True, forceinline=True)
def _velocities(parts: Any, mine: Any, scaled: Any, descent: Any) -> None:
    """u of the disks of some parts, from what their contacts do and those between parts."""
    first, second, x, y, inverse, _, _ = scaled
    ahead, ux, uy = descent.ahead, descent.ux, descent.uy
    count = len(parts.disk) - 1
    n, low, high = parts.disk[count], parts.disk[mine[0]], parts.disk[mine[1]]
    for i in range(np.uint64(low), np.uint64(high)):
        ux[i] = uy[i] = 0.0
    for p in range(mine[0], mine[1]):
        gather(_piece(parts, p, False, 0), first, second, x, y, ahead, ux, uy)
        ux[n + p] = uy[n + p] = 0.0
    _gather_at(low, high, parts.contact[count], scaled, ahead, ux, uy)
    for i in range(np.uint64(low), np.uint64(high)):
        ux[i] *= inverse[i]
        uy[i] *= inverse[i]


@inner(fastmath=True, disjoint=True)
def _looked(part: Any, scaled: Any, descent: Any) -> Any:
    """The error of some contacts, how many change sides, and how many press."""
    first, second, x, y, _, pull, root = scaled
    ahead, v, closed = descent.ahead, descent.v, descent.closed
    approach_scaled(part, first, second, x, y, descent.ux, descent.uy, v)
    error, changed, pressed = 0.0, 0, 0
    for c in range(np.uint64(part[0]), np.uint64(part[1])):
        gradient = v[c] - pull[c]
        error = max(error, abs(min(ahead[c], gradient)) * root[c])
        touching = ahead[c] > gradient
        if touching != closed[c]:
            changed += 1
            closed[c] = touching
        pressed += touching
    return error, changed, pressed


@inner(fastmath=True, disjoint=True, forceinline=True)
def _moved(part: Any, scaled: Any, descent: Any, step: float, beta: float) -> float:
    """A step of some contacts; how much it goes uphill."""
    first, second, x, y, _, pull, _ = scaled
    now, ahead, ux, uy = descent.now, descent.ahead, descent.ux, descent.uy
    uphill = 0.0
    for c in range(np.uint64(part[0]), np.uint64(part[1])):
        i, j = first[c], second[c]
        gradient = x[c] * (ux[i] - ux[j]) + y[c] * (uy[i] - uy[j]) - pull[c]
        new = max(ahead[c] - step * gradient, 0.0)
        move = new - now[c]
        uphill += gradient * move
        now[c] = new
        ahead[c] = new + beta * move
    return uphill


@kernel(nogil=True)
def sweep_down(
    control: Any, me: int, parts: Any, scaled: Any, step: float, descent: Any, limits: Any
) -> Any:
    """The descent as thread `me` of a team sees it: sweeps, and whether it ended because it had found
    the closed contacts. Where it ended is in `descent.ahead`."""
    tolerance, most, steady, redundant = limits
    k, count, sums = len(scaled.first), len(parts.disk) - 1, descent.sums
    mine = count * me // control[THREADS], count * (me + 1) // control[THREADS]
    check, met = OFTEN if k < FEW else CHECK, 0
    kinds = 2 if parts.contact[count] < k else 1  # contacts within parts, and those between
    since = 0.0  # sweeps since the last restart
    for sweep in range(most):
        _velocities(parts, mine, scaled, descent)
        met += 1
        meet(control, met)
        if sweep % check == check - 1:
            for p in range(mine[0], mine[1]):
                for q in range(kinds):
                    piece = _piece(parts, p, q == 1, k)
                    sums[0, p, q], sums[1, p, q], sums[2, p, q] = _looked(piece, scaled, descent)
            met += 1
            meet(control, met)
            error, changed, pressed = 0.0, 0.0, 0.0
            for p in range(count):
                for q in range(kinds):
                    error = max(error, sums[0, p, q])
                    changed += sums[1, p, q]
                    pressed += sums[2, p, q]
            if error <= tolerance or changed <= steady:
                return sweep + 1, True
            least = redundant if sweep + 1 >= LATE else REDUNDANT * redundant
            if sweep + 1 >= EARLY and pressed > least:
                return sweep + 1, False
        beta = since / (since + 2.0)
        since += 1.0
        for p in range(mine[0], mine[1]):
            for q in range(kinds):
                sums[3, p, q] = _moved(_piece(parts, p, q == 1, k), scaled, descent, step, beta)
        met += 1
        meet(control, met)
        uphill = 0.0
        for p in range(count):
            for q in range(kinds):
                uphill += sums[3, p, q]
        if uphill > 0.0 or sweep == most - 1:
            since = 0.0
            for p in range(mine[0], mine[1]):
                for q in range(kinds):
                    begin, end = _piece(parts, p, q == 1, k)
                    descent.ahead[begin:end] = descent.now[begin:end]
            met += 1
            meet(control, met)
    return most, False
