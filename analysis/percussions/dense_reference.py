"""Reference percussions: dense non-negative least squares, no solver of this product."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from nscd import Contacts, Snapshot
from nscd.arrays import Floats

# The share of Σλ² that chooses among the reactions of redundant contacts.
LITTLE = 1e-10


def dense_percussions(
    snapshot: Snapshot,
    contacts: Contacts,
    left_velocity: ArrayLike,
    *,
    restitution: float = 0.0,
    minimum: bool = False,
) -> tuple[Floats, Floats]:
    """Compute λ (k,) N·s and u⁺ (n,2) m/s of Newton's law at all contacts at once, in Moreau's
    form: 0 ≤ λ ⟂ −C(u⁺ + e u⁻) ≥ 0.

    λ minimises |M^(−½) Cᵀλ − (1+e) M^(½) u⁻| over λ ≥ 0, and u⁺ = u⁻ − M⁻¹Cᵀλ (Lawson and Hanson's
    active set, dense). `minimum` adds LITTLE·|λ|², which leads to the reactions of least Σλ² where
    they are not unique."""
    root = np.sqrt(np.repeat(snapshot.mass, 2))
    left = np.asarray(left_velocity, dtype=np.float64).ravel()
    closing = contacts.normal_matrix(len(snapshot)).toarray()
    columns, wanted = closing.T / root[:, None], (1 + restitution) * root * left
    if minimum:
        size = np.sqrt(LITTLE) * np.linalg.norm(columns, 2)
        columns = np.vstack([columns, size * np.eye(len(contacts))])
        wanted = np.concatenate([wanted, np.zeros(len(contacts))])
    reaction, _ = nnls(columns, wanted, maxiter=100 * len(contacts))
    return reaction, (left - closing.T @ reaction / root**2).reshape(-1, 2)
