"""The proximal point method, each step of which is made exactly, by a path of pivots.

A step asks for percussions that obey the law while closed contacts yield by εw a newton-second away
from the percussions before. At λ, τ of before, perturbed, that answer is known; a path of pivots
leads from it to the answer without perturbation. It passes the folds at which Newton's method on
the same equations stops. Contacts get firmer where few of them change their state, and softer where
the path closes on itself: with soft contacts the step is short, and its answer is the only one.
Where percussions have no bound or no single value they drift, and firm steps are what takes the
drift to the next change of a state. Rockafellar, SIAM J. Control Optim. 14 (1976) 877."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from nscd.friction.pivots.path import ARRIVED, clean, follow, perturb
from nscd.friction.pivots.rates import LAM, TAU

# Compliance at first and its bounds; it falls by FIRMER after a step of at most FEW pivots and
# grows by SOFTER where there is none.
FIRST, FIRMEST, SOFTEST, FIRMER, SOFTER, FEW = 1e-3, 1e-10, 1.0, 0.3, 10.0, 25
# Pivots allowed for a step; what its factorisations cost, in pivots.
PIVOTS, STEP = 300, 15
# Noise on contacts that are on the brink of another state, of the scale of velocities.
BRINK = 1e-9


class Point(NamedTuple):
    """λ, τ (k,) N·s after a step; whether it was made; pivots, and the cost of it in pivots."""

    reaction: Any
    friction: Any
    made: bool
    pivots: int
    cost: int


def proximal_points(
    problem: Any, factor: Any, path: Any, answer: tuple[Any, Any, Any]
) -> Iterator[Point]:
    """Yield the points of one step after another, from an answer λ, τ, u (n,3), without end. The
    states of a step are left in `path`."""
    lam, tau, u = (one.copy() for one in answer)
    clean(problem, u, lam, tau)
    compliance, most, tries = FIRST, PIVOTS, 0
    while True:
        noise = BRINK * problem.scale * np.random.default_rng(tries).random(len(lam))
        path.compliance[0] = compliance
        perturb(problem, path, lam, tau, noise)
        ended, pivots = follow(problem, factor, path, 1.0, -1.0, most)
        if ended == ARRIVED:
            lam = np.maximum(path.x[LAM], 0.0)
            tau = np.clip(path.x[TAU], -problem.friction * lam, problem.friction * lam)
            if pivots <= FEW:
                compliance = max(FIRMER * compliance, FIRMEST)
        else:
            tries += 1
            if compliance >= SOFTEST:
                most *= 2
            compliance = min(SOFTER * compliance, SOFTEST)
        yield Point(lam, tau, ended == ARRIVED, pivots, STEP + pivots)
