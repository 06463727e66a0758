"""The active set: from a guess of the closed contacts to the exact ones, one factorisation a
round."""

from __future__ import annotations

from typing import Any

import numpy as np

from nscd.arrays import Flags, Floats
from nscd.compiling import inner, kernel
from nscd.solvers.cholesky.factor import factorise
from nscd.solvers.closing import CLOSED, EXACT, PENALTY, close_contacts
from nscd.solvers.projected_gradient import descend_task
from nscd.solvers.system import System, approach, even, stiffness
from nscd.solvers.task import UNKNOWN, Answer, Held, Task
from nscd.solvers.thresholds import AT

ROUNDS = 12
# Multiplier steps at most; the first shows which contacts pull, the others are for a set that is
# nearly right.
STEPS = 50
# So many contacts, and this share of all, may change without getting fewer from round to round.
HANDFUL, SHARE = 4, 1e-5
# Reactions below the rounding of PENALTY · C u have no sign.
ROUNDING = 4.0 * PENALTY * float(np.finfo(float).eps)


def active_set(task: Task) -> Answer:
    """Find the closed contacts by descent and close them, however many there are."""
    system = task.system
    reaction, velocity, sweeps, _ = descend_task(
        task, task.tolerance, AT.sweeps, _steady(system), np.inf
    )
    return close_set(task, pressing(system, reaction, velocity), sweeps)[0]


def correct_guess(task: Task) -> Answer:
    """Close the contacts whose reactions were more than nothing in the guess (k,) N·s.

    A set of another crowd may settle without contacts that are nearly closed, which would change the
    reactions of least energy: gaps have to be known as well as they are looked at."""
    assert task.guess is not None
    pressed = AT.pressed * task.guess.max(initial=0.0)
    found, error = close_set(task, task.guess[task.factor.contact] > pressed, 0)
    return found._replace(least=found.least and error <= EXACT)


def descend_and_close(task: Task) -> Answer:
    """Find the closed contacts of even masses by descent and close them, where that is worth it.

    Unsettled where the packing is marginal, so that the descent does not tell them, or where the
    set would not settle."""
    system = task.system
    n = len(system.mass)
    most = AT.sweeps if n >= AT.large else AT.few_sweeps
    reaction, velocity, sweeps, _ = descend_task(
        task, task.tolerance, most, _steady(system), AT.isostatic
    )
    closed = pressing(system, reaction, velocity)
    share = int(closed.sum()) / (2 * n)
    marginal = AT.isostatic < share < AT.redundant
    if not marginal:
        found, error = close_set(task, closed, sweeps)
        if error <= task.tolerance and found.least:
            return found._replace(settled=True)
        sweeps = found.iterations
    return task.answer(reaction, velocity, sweeps)._replace(settled=False)


def _steady(system: System) -> int:
    return AT.steady + int(AT.steady_share * len(system.first))


def pressing(system: System, reaction: Floats, velocity: Floats) -> Flags:
    """Tell which contacts (k,) press more than they open."""
    closed: Flags = system.inverse_mass * reaction > gap(system, velocity)
    return closed


def gap(system: System, velocity: Floats) -> Floats:
    """Compute b − C u (k,) m/s: how fast the contacts open."""
    v = np.empty(len(system.first))
    approach(system, velocity, v)
    opening: Floats = system.offset - v
    return opening


def close_set(
    task: Task, closed: Flags, before: int, thorough: bool = False
) -> tuple[Answer, float]:
    """Find percussions from a set of contacts that is nearly the set of closed ones.

    closed: (k,) the set, in elimination order
    before: iterations that were made already
    thorough: go to the stiff limit in every round

    Returns the answer, and the error max|min(wλ, b − Cu)| / ‖u⁻‖∞ with the pulls that had to be
    cut.

    A round closes the set from rest: λ is then the least-norm reaction on it (the first step is
    the penalty model of stiffness PENALTY, the others its stiff limit), and Σ θ(Cu − b) on the
    open ones says whether they would be pressed in that limit. Contacts that pull open, those
    that would be pressed close: the primal–dual active set method on the penalty model, one
    factorisation a round. Once it settles, the reactions are those of least energy if the
    stiffness is the same for all contacts (see `stiffness`). It ends unsettled after ROUNDS, or
    when more contacts change than before."""
    system = task.system
    theta = PENALTY * stiffness(system.inverse_mass)
    closed = closed.copy()
    reaction, velocity, done, error, settled = _rounds(
        system, task.factor, closed, theta, ROUNDS, thorough, CLOSED
    )
    task.workspace.held = Held(np.where(closed, theta, 0.0), closed) if settled else UNKNOWN
    least = bool(settled) and even(system.inverse_mass)
    return task.answer(reaction, velocity, before + int(done), least=least), float(error)


@kernel(apart=True, nogil=True)
def _rounds(
    system: Any, factor: Any, closed: Any, theta: Any, most: Any, thorough: Any, enough: Any
) -> Any:
    k = len(closed)
    w, b, scale = system.inverse_mass, system.offset, system.scale
    weight, reaction, v, pressed = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    u, best_u, best, best_error = system.free.copy(), system.free.copy(), np.zeros(k), np.inf
    wrong = np.empty(k, np.bool_)
    few = HANDFUL + int(SHARE * k)
    before, sparing = k, False
    done = 0
    while done < most:
        done += 1
        for c in range(k):
            weight[c] = theta[c] if closed[c] else 0.0
        if not factorise(system, factor, weight):
            break
        u[:] = system.free
        reaction[:] = 0.0
        approach(system, u, v)
        close_contacts(system, factor, closed, theta, reaction, u, v, np.int64(1), enough)
        changed = _find_wrong(w, b, scale, closed, reaction, v, wrong)
        if thorough or changed <= few or done == most:
            close_contacts(system, factor, closed, theta, reaction, u, v, np.int64(STEPS), enough)
            changed = _find_wrong(w, b, scale, closed, reaction, v, wrong)
            error = 0.0
            for c in range(k):
                pressed[c] = max(reaction[c], 0.0) if closed[c] else 0.0
                error = max(error, abs(min(w[c] * pressed[c], b[c] - v[c])))
                if closed[c]:
                    error = max(error, -w[c] * reaction[c])
            if changed == 0:
                return pressed, u, done, error / scale, True
            if error / scale < best_error:
                best_error = error / scale
                best[:], best_u[:] = pressed, u
        if changed >= before and changed > few:
            break
        # a handful that does not shrink is a cycle between neighbours: one of them at a time breaks
        # it
        sparing = sparing or changed >= before
        before = changed
        _change(system.first, system.second, len(u), closed, wrong, sparing)
    return best, best_u, done, best_error, False


@inner
def _find_wrong(
    w: Any, offset: Any, scale: float, closed: Any, reaction: Any, v: Any, wrong: Any
) -> int:
    """Mark the closed contacts that pull, and the open ones without a gap that would be pressed, by
    more than rounding."""
    count = 0
    for c in range(len(closed)):
        least = ROUNDING * scale / w[c]
        if closed[c]:
            wrong[c] = reaction[c] <= -least
        else:
            wrong[c] = reaction[c] > least and offset[c] - v[c] <= EXACT * scale
        count += wrong[c]
    return count


@inner
def _change(first: Any, second: Any, disks: int, closed: Any, wrong: Any, sparing: bool) -> None:
    """Wrong contacts change sides; of those that share a disk only the first one where
    `sparing`."""
    taken = np.zeros(disks, np.bool_)
    for c in range(len(closed)):
        if wrong[c]:
            i, j = first[c], second[c]
            if sparing and (taken[i] or (j >= 0 and taken[j])):
                continue
            taken[i] = True
            if j >= 0:
                taken[j] = True
            closed[c] = not closed[c]
