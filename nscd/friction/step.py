"""The percussions of one step of a moving crowd: sweeps that begin from those of the step
before."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.friction.ladder import climb
from nscd.friction.measures import measure
from nscd.friction.problem import FrictionProblem
from nscd.friction.sweeps import anderson, gauss_seidel

# Plain pairs of sweeps, then accelerated blocks (number, pairs in each) on a copy: the one goes on
# where the other stalls.
ROUNDS = ((0, 60, 10), (100, 60, 10), (400, 100, 10), (1600, 160, 10), (6400, 320, 10))


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

    Sweeps of Gauss–Seidel, plain and accelerated in turn; the quick part of `climb` where they do
    not reach the tolerance. The best answer met, with its error: the caller judges it. Needs a
    problem without dissipation, for which λ and τ are the whole percussions. position (n,2) m."""
    k = len(problem.first)
    if not k:
        return StepAnswer(np.empty(0), np.empty(0), problem.left.copy(), 0.0, 0, "none")
    lam, tau = (np.zeros(k), np.zeros(k)) if guess is None else (guess[0].copy(), guess[1].copy())
    u, pairs = problem.left.copy(), 0
    best = StepAnswer(lam, tau, u, np.inf, 0, "none")
    for plain, blocks, block in ROUNDS:
        if plain:
            _, made = gauss_seidel(problem, lam, tau, u, plain, 0.5 * tolerance)
            pairs += made
            best = _better(best, problem, (lam, tau, u), pairs)
        if best.error > tolerance:
            fast = lam.copy(), tau.copy(), u.copy()
            _, made = anderson(problem, *fast, blocks, block, 0.5 * tolerance)
            pairs += made
            best = _better(best, problem, fast, pairs)
        if best.error <= tolerance:
            return best
    found = climb(problem, position, tolerance, patient=False)
    answer = found.reaction, found.friction, found.velocity
    return _better(best, problem, answer, pairs + found.pairs, found.solver)


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


def _better(
    best: StepAnswer,
    problem: FrictionProblem,
    answer: tuple[Any, Any, Any],
    pairs: int,
    solver: str = "sweeps",
) -> StepAnswer:
    lam, tau, u = answer
    v, s = np.empty((2, len(lam)))
    error = float(measure(problem, u, lam, tau, v, s).max())
    if error < best.error:
        return StepAnswer(lam.copy(), tau.copy(), u.copy(), error, pairs, solver)
    return best._replace(pairs=pairs)
