"""What an answer with friction is worth, recomputed from it: the residuals of the field, and the
state of each contact."""

from __future__ import annotations

import numpy as np

from nscd.arrays import Floats
from nscd.friction.problem import FrictionProblem, contact_velocities
from nscd.percussions import ContactState, FrictionPart

# A contact slides if it does so faster than this share of the scale of velocities.
SLIDING = 1e-9


class Whole:
    """Velocities and whole percussions of an answer at its contacts.

    v, s, v_left, s_left (k,) m/s: C u, T u of u⁺ and u⁻; pn, pt (k,) N·s: p_n, p_t."""

    def __init__(
        self, problem: FrictionProblem, lam: Floats, tau: Floats, velocity: Floats
    ) -> None:
        k = len(lam)
        self.v, self.s, self.v_left, self.s_left = np.empty((4, k))
        contact_velocities(problem, velocity, self.v, self.s)
        contact_velocities(problem, problem.left, self.v_left, self.s_left)
        self.pn = problem.normal_weight * (self.v + self.v_left) + lam
        self.pt = problem.tangent_weight * (self.s + self.s_left) + tau


def certificate(
    problem: FrictionProblem, lam: Floats, tau: Floats, velocity: Floats, start: str
) -> FrictionPart:
    """The residuals of λ, τ (k,) N·s and velocities (n,3), in units of the scale of velocities, and
    of the kinetic energy before for the dissipation; see `FrictionPart`."""
    whole = Whole(problem, lam, tau, velocity)
    w, wt = problem.normal_inverse, problem.tangent_inverse
    most = problem.friction * np.maximum(whole.pn, 0.0)
    signorini = np.abs(np.minimum(w * lam, problem.offset - whole.v))
    natural = wt * np.abs(tau - np.clip(tau + whole.s / wt, -most, most))
    beyond = wt * np.maximum(np.abs(tau) - most, 0.0)
    missing = np.abs(most * np.abs(whole.s) - tau * whole.s)
    energy = 0.5 * float((problem.mass * problem.left**2).sum()) or 1.0
    small = SLIDING * problem.scale
    state = np.full(len(lam), ContactState.OPEN, dtype=np.int8)
    pressed = w * lam > problem.offset - whole.v
    pressed |= problem.normal_weight * (whole.v + whole.v_left) > 0.0
    slides = (np.abs(whole.s) > small) | (most == 0.0)
    way = np.where(whole.s >= 0.0, ContactState.FORWARD, ContactState.BACKWARD)
    state[pressed] = np.where(slides[pressed], way[pressed], ContactState.STICK)
    return FrictionPart(
        coefficient=problem.friction,
        tangential=tau,
        state=state,
        signorini=float(signorini.max(initial=0.0)) / problem.scale,
        cone=float(beyond.max(initial=0.0)) / problem.scale,
        dissipation=float(missing.sum()) / energy,
        natural_map=float(np.maximum(signorini, natural).max(initial=0.0)) / problem.scale,
        start=start,
    )


def momentum_error(problem: FrictionProblem, whole: Whole, velocity: Floats) -> float:
    """The largest |M(u⁺ − u⁻) + Dᵀp| of a disk over m · scale + Σ|p_n| + |p_t|, spins by inertia
    over lever; p: the whole percussions."""
    n = len(problem.mass)
    rest = problem.mass * (velocity - problem.left)
    received = problem.mass[:, 0] * problem.scale
    lever = np.zeros(n)
    tangent = np.column_stack([-problem.normal[:, 1], problem.normal[:, 0]])
    impulse = whole.pn[:, None] * problem.normal + whole.pt[:, None] * tangent
    pair = problem.second >= 0
    ends = (
        (problem.first, 1.0, problem.lever[:, 0], slice(None)),
        (problem.second[pair], -1.0, problem.lever[pair, 1], pair),
    )
    for disk, sign, arm, at in ends:
        for axis in (0, 1):
            rest[:, axis] += sign * np.bincount(disk, impulse[at, axis], n)
        rest[:, 2] += np.bincount(disk, arm * whole.pt[at], n)
        received += np.bincount(disk, np.abs(whole.pn[at]) + np.abs(whole.pt[at]), n)
        np.maximum.at(lever, disk, arm)
    turned = np.divide(np.abs(rest[:, 2]), lever, out=np.zeros(n), where=lever > 0)
    off = np.maximum(np.abs(rest[:, :2]).max(axis=1), turned)
    return float((off / received).max(initial=0.0))
