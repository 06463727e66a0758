"""Which contact forces the mechanics determines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from nscd.contacts import Contacts

# A pivot or a row below these, relative to 1, is rounding.
RANK_TOLERANCE = 1e-9
ZERO_ROW = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Determinacy:
    """rank of C (contacts × velocities), redundant = contacts − rank, and determined (k,): whether a contact's force
    follows from the balance of the disks alone (its unit vector is orthogonal to the null space of Cᵀ)."""

    rank: int
    redundant: int
    determined: NDArray[np.bool_]


def determinacy(contacts: Contacts, n: int) -> Determinacy:
    """Rank and determined contacts of n disks, by a pivoted QR factorisation Cᵀ P = Q [R₁ R₂] (dense).

    The null space of Cᵀ is spanned by P [−R₁⁻¹R₂; I]; a contact with a zero row in it is determined.
    """
    if not len(contacts):
        return Determinacy(rank=0, redundant=0, determined=np.empty(0, dtype=bool))
    touched = np.unique(np.concatenate([contacts.first, contacts.second[~contacts.is_wall]]))
    columns = np.repeat(2 * touched, 2) + np.tile([0, 1], len(touched))
    matrix = contacts.normal_matrix(n)[:, columns].toarray().T
    triangle, order = qr(matrix, mode="r", pivoting=True, overwrite_a=True, check_finite=False)
    diagonal = np.abs(np.diagonal(triangle))
    rank = int((diagonal > RANK_TOLERANCE * diagonal[0]).sum())
    dependent = solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:], check_finite=False)
    determined = np.zeros(len(contacts), dtype=bool)
    determined[order[:rank]] = np.abs(dependent).max(1, initial=0.0) < ZERO_ROW
    return Determinacy(rank=rank, redundant=len(contacts) - rank, determined=determined)
