"""Which contact forces the mechanics determines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscd.contacts import Contacts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Determinacy:
    """rank of C (contacts × velocities), redundant = contacts − rank, and determined (k,): whether a contact's force
    follows from the balance of the disks alone (its unit vector is orthogonal to the null space of Cᵀ)."""

    rank: int
    redundant: int
    determined: NDArray[np.bool_]


def determinacy(contacts: Contacts, n: int) -> Determinacy:
    """Rank and determined contacts of n disks, by a singular value decomposition of C (k, 2n)."""
    if not len(contacts):
        return Determinacy(rank=0, redundant=0, determined=np.empty(0, dtype=bool))
    touched = np.unique(np.concatenate([contacts.first, contacts.second[~contacts.is_wall]]))
    columns = np.repeat(2 * touched, 2) + np.tile([0, 1], len(touched))
    matrix = contacts.normal_matrix(n)[:, columns].toarray()
    left, values, _ = np.linalg.svd(matrix, full_matrices=True)
    rank = int((values > 1e-9 * values[0]).sum())
    null = left[:, rank:]
    return Determinacy(rank=rank, redundant=len(contacts) - rank, determined=np.abs(null).max(1, initial=0.0) < 1e-7)
