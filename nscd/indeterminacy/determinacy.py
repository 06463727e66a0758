"""Which contact forces the mechanics determines: by balance alone, and by balance of forces that
only push."""

from dataclasses import dataclass

import numpy as np

from nscd.arrays import Flags
from nscd.contacts import Contacts
from nscd.indeterminacy.admissible import Admissible
from nscd.indeterminacy.orthogonal import factorise, undetermined_rows
from nscd.percussions import Percussions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Determinacy:
    """Hold what is known of reactions.

    rank: of C (contacts × velocities)
    redundant: contacts − rank, the dimension of the set of reactions that agree with the balance
    determined: (k,) whether a contact's reaction is the same in all of them"""

    rank: int
    redundant: int
    determined: Flags

    def __repr__(self) -> str:
        return (
            f"<Determinacy: {int(self.determined.sum())} of {len(self.determined)} contacts "
            f"determined, rank {self.rank}, redundant {self.redundant}>"
        )


def determinacy(contacts: Contacts, n: int) -> Determinacy:
    """Tell what the balance of n disks alone, Cᵀλ given, says of the reactions λ, whatever their
    sign.

    λ is known up to a self-stress: a vector of the null space of Cᵀ. A contact is determined if it
    is zero in all of them. Reads only the normals, so it holds for forces of any frictionless model
    on these contacts. Raises ValueError for contacts that name disks beyond n."""
    contacts.check_disks(n)
    factor = factorise(contacts, n)
    return Determinacy(
        rank=factor.rank,
        redundant=len(contacts) - factor.rank,
        determined=~undetermined_rows(factor),
    )


def admissible_determinacy(contacts: Contacts, answer: Percussions) -> Determinacy:
    """Tell what balance and λ ≥ 0 together say of the reactions of an answer.

    They leave the polytope {λ' ≥ 0, Cᵀλ' = Cᵀλ, λ' = 0 where the contact opens}. `determined`
    (k,) is whether the contact's interval [λ_min, λ_max] is a point. This is more than
    `determinacy` finds: contacts that open carry nothing, and some self-stresses would make a
    contact pull that carries nothing in any admissible percussion. `redundant` is the dimension
    of the polytope, `rank` the number of contacts that can carry something, less that dimension.
    Raises ValueError as `Admissible.of` does."""
    admissible = Admissible.of(contacts, answer)
    carrying = admissible.carrying()
    determined = np.ones(len(contacts), dtype=bool)
    chosen = np.flatnonzero(carrying)
    factor = factorise(contacts.select(chosen), len(answer.right_velocity))
    determined[chosen] = ~undetermined_rows(factor)
    return Determinacy(rank=factor.rank, redundant=len(chosen) - factor.rank, determined=determined)
