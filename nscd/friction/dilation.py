"""From the convex programme to the law of Coulomb: contacts that slide open less and less.

In the convex programme a contact that slides opens at μ|T u|: its answer is unique. Here it opens
at ψ μ|T u|, and ψ falls from 1 to 0 in steps, each a path of pivots from the answer before. (ψμ is
a tangent of a dilation angle, as in the plasticity of soils.) Where a path closes on itself the
step is halved."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.friction.pivots.path import ARRIVED, clean, follow, perturb
from nscd.friction.pivots.rates import LAM, TAU

# The shortest step of ψ, and the pivots allowed for one: a number and a share of the contacts.
SHORTEST, PIVOTS, SHARE = 1 / 64, 300, 0.5
# Noise on contacts that are on the brink of another state, of the scale of velocities.
BRINK = 1e-9


class Reached(NamedTuple):
    """How far the dilation fell (0: the law of Coulomb), λ and τ (k,) there, and pivots made."""

    dilation: float
    reaction: Any
    friction: Any
    pivots: int


def lower_dilation(
    problem: Any, factor: Any, path: Any, reaction: Any, friction: Any, u: Any, most: int
) -> Reached:
    """From λ, τ (k,) and u (n,3) of the convex programme toward those of Coulomb's law, with at
    most `most` pivots. The states reached are left in `path`."""
    k = len(reaction)
    lam, tau = reaction.copy(), friction.copy()
    clean(problem, 1.0, u, lam, tau)
    noise = BRINK * problem.scale * np.random.default_rng(k).random(k)
    allowed = PIVOTS + int(SHARE * k)
    psi, step, pivots, failed = 1.0, 1.0, 0, False
    while psi > 0.0 and step >= SHORTEST and pivots < most:
        path.dilation[0] = max(0.0, psi - step)
        perturb(problem, path, lam, tau, noise)
        ended, made = follow(problem, factor, path, 1.0, -1.0, min(allowed, most - pivots))
        pivots += made
        if ended == ARRIVED:
            psi = float(path.dilation[0])
            lam, tau = np.maximum(path.x[LAM], 0.0), path.x[TAU].copy()
            step = step if failed else min(2.0 * step, psi)
            failed = False
        else:
            step *= 0.5
            failed = True
    path.dilation[0] = 0.0
    return Reached(psi, lam, tau, pivots)
