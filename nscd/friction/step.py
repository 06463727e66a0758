"""The percussions of one step of a moving crowd: a search that begins from those of the step
before."""

from typing import Any, NamedTuple

import numpy as np

from nscd.friction.answer import ROUTES
from nscd.friction.problem import FrictionProblem


class StepAnswer(NamedTuple):
    """Hold the percussions of a step.

    reaction, friction: (k,) N·s, λ and τ
    velocity: (n,3) m/s, m/s, rad/s
    error: dimensionless, the larger of natural map and momentum error, recomputed
    pairs: of sweeps
    solver: its name"""

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
    what `nscd.solve` does. So of several answers it gives one near the guess. The best answer met,
    with its error: the caller judges it. Needs a problem without dissipation, for which λ and τ are
    the whole percussions. position (n,2) m."""
    known = np.empty((2, 0)) if guess is None else np.asarray(guess, dtype=float)
    along, across = np.ascontiguousarray(known[0]), np.ascontiguousarray(known[1])
    found, error, pairs, route = problem.in_core(position).step(along, across, tolerance)
    name = ROUTES[route][0] if len(problem.first) else "none"
    return StepAnswer(*found, error, pairs, name)


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
