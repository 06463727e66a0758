"""The percussions of one step of a moving crowd: a search that begins from those of the step
before."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.friction.ladder import climb, part_of, pressed
from nscd.friction.measures import measure
from nscd.friction.pivots.island import Search
from nscd.friction.problem import FrictionProblem, chosen
from nscd.friction.sweeps import anderson

# Accelerated blocks of sweeps, and pairs in each, before islands are looked at one by one.
BLOCKS, BLOCK = 40, 8
# In the order in which they are tried: the solver of an answer is the last that an island needed.
ROUTES = ("sweeps", "proximal", "path", "none")


class StepAnswer(NamedTuple):
    """Hold the percussions of a step.

    reaction, friction: (k,) N·s, λ and τ
    velocity: (n,3) m/s, m/s, rad/s
    error: dimensionless, the larger of natural map and momentum error, recomputed
    pairs: of sweeps
    solver: its name
    """

    reaction: Any
    friction: Any
    velocity: Any
    error: float
    pairs: int
    solver: str


def solve_step(
    problem: FrictionProblem, position: Any, guess: Any = None, tolerance: float = 1e-6
) -> StepAnswer:
    """Solve the contacts of a step from a guess (2,k) N·s of λ and τ, 0 where left out.

    An island that nothing presses keeps its velocities. The others: accelerated sweeps of
    Gauss–Seidel from the guess, all together; each island that these do not solve by proximal
    steps of Newton's method and paths from where the sweeps ended; at last the quick part of
    `climb`. So of several answers it gives one near the guess. The best answer met, with its error:
    the caller judges it. Needs a problem without dissipation, for which λ and τ are the whole
    percussions. position (n,2) m."""
    k = len(problem.first)
    lam, tau, u = np.zeros(k), np.zeros(k), problem.left.copy()
    disks, contacts = pressed(problem)
    if not len(contacts):
        return StepAnswer(lam, tau, u, 0.0, 0, "none" if not k else "closed_form")
    some, solver = chosen(problem, disks, contacts), "sweeps"
    known = np.zeros((2, len(contacts))) if guess is None else guess[:, contacts]
    along, across, there = known[0].copy(), known[1].copy(), some.left.copy()
    _, pairs = anderson(some, along, across, there, BLOCKS, BLOCK, 0.5 * tolerance)
    errors = _errors(some, along, across, there)
    for island in np.flatnonzero(errors > tolerance):
        here = np.flatnonzero(some.island == island)
        held = np.flatnonzero(some.island[some.first] == island)
        one = part_of(some, position[disks], here, held)
        search = Search(one.problem, one.factor, tolerance)
        start = along[one.contacts], across[one.contacts], there[one.disks]
        search.offer(*start, "sweeps")
        search.by_proximal(*start)
        along[one.contacts], across[one.contacts] = search.reaction, search.friction
        there[one.disks] = search.velocity
        pairs += search.pairs
        solver = max(solver, search.route if search.solved else "none", key=ROUTES.index)
    lam[contacts], tau[contacts], u[disks] = along, across, there
    error = float(_errors(problem, lam, tau, u).max())
    answer = StepAnswer(lam, tau, u, error, pairs, solver)
    if error <= tolerance:
        return answer
    found = climb(problem, position, tolerance, patient=False)
    error = float(_errors(problem, found.reaction, found.friction, found.velocity).max())
    pairs += found.pairs
    if error < answer.error:
        return StepAnswer(
            found.reaction, found.friction, found.velocity, error, pairs, found.solver
        )
    return answer._replace(pairs=pairs)


def carried_over(key: Any, percussions: Any, wanted: Any) -> Any:
    """Give the percussions (2,k) of contacts with distinct keys (k,) to contacts with the wanted
    keys (m,), and 0 to those that are new: (2,m)."""
    guess = np.zeros((2, len(wanted)))
    if len(key):
        order = np.argsort(key)
        place = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
        known = key[place] == wanted
        guess[:, known] = percussions[:, place[known]]
    return guess


def _errors(problem: FrictionProblem, lam: Any, tau: Any, u: Any) -> Any:
    """The errors of the islands."""
    v, s = np.empty((2, len(lam)))
    return measure(problem, u, lam, tau, v, s)
