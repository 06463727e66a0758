"""How exact an answer is: recomputed in one way for every solver, whatever it says of itself."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from families import Case


class Accuracy(NamedTuple):
    """Residual max|min(wλ, −Cu)| / ‖u⁻‖∞ of an answer, the velocity u (2n,) m/s that it holds for,
    and whether that u is the solver's own (else u = u⁻ − M⁻¹Cᵀλ)."""

    residual: float
    velocity: Any
    own: bool


def accuracy(case: Case, reaction: Any, own_velocity: Any | None) -> Accuracy:
    """Accuracy of reactions λ (k,) N·s.

    First with u = u⁻ − M⁻¹Cᵀλ, for which momentum is exact. The solver's own u (2n,) m/s counts
    where it does better, and then the momentum that it misses, max|M(u − u⁻) + Cᵀλ| / (m‖u⁻‖∞ +
    Σ|λ|) over disks, counts as well. An answer that is not finite has an infinite residual."""
    n = len(case.snapshot)
    mass = np.repeat(case.snapshot.mass, 2)
    left = case.left_velocity.ravel()
    scale = float(np.abs(left).max())
    rows = case.contacts.normal_matrix(n)
    weight = case.contacts.inverse_mass(case.snapshot.mass)
    momentum = rows.T @ reaction

    def residual(velocity: Any) -> float:
        found = (
            float(np.abs(np.minimum(weight * reaction, -(rows @ velocity))).max(initial=0.0))
            / scale
        )
        return found if np.isfinite(found) else np.inf

    velocity = left - momentum / mass
    best = Accuracy(residual(velocity), velocity, False)
    if own_velocity is not None:
        missed = np.abs(mass * (own_velocity - left) + momentum)
        received = abs(rows).T @ np.abs(reaction)
        balance = float((missed / (mass * scale + received)).max())
        own = max(residual(own_velocity), balance)
        if own < best.residual:
            best = Accuracy(own, own_velocity, True)
    return best
