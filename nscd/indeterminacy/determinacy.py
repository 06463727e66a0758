"""Which contact forces the mechanics determines: by balance alone, and by balance of forces that
only push."""

from dataclasses import dataclass

import numpy as np

from nscd.arrays import Floats, Mask
from nscd.bodies import Snapshot
from nscd.contacts import Contacts, of_bodies
from nscd.indeterminacy.equilibrium import Equilibrium, edges
from nscd.indeterminacy.orthogonal import ZERO_ROW, factorise, self_stresses, undetermined_rows
from nscd.percussions import Percussions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Determinacy:
    """Hold what is known of percussions.

    rank: of the balance on the unknowns: of C, without friction
    redundant: unknowns − rank, the dimension of the set of percussions that agree with the balance
    normal, tangential: (k,) whether λ, and τ, of a contact are the same in all of them"""

    rank: int
    redundant: int
    normal: Mask
    tangential: Mask

    @property
    def determined(self) -> Mask:
        """Tell (k,) whether a contact's whole percussion is the same in all of them."""
        return self.normal & self.tangential

    def __repr__(self) -> str:
        return (
            f"<Determinacy: {int(self.determined.sum())} of {len(self.determined)} contacts "
            f"determined, rank {self.rank}, redundant {self.redundant}>"
        )


def determinacy(contacts: Contacts, n: int, snapshot: Snapshot | None = None) -> Determinacy:
    """Tell what the balance of n disks alone, Cᵀλ given, says of the reactions λ, whatever their
    sign.

    λ is known up to a self-stress: a vector of the null space of Cᵀ. A contact is determined if it
    is zero in all of them. Reads only the normals, so it holds for forces of any frictionless model
    on these contacts, and of a snapshot the bodies that disks are joined to. Raises ValueError for
    contacts that name disks beyond n."""
    contacts.check_disks(n)
    if snapshot is not None and (compound := snapshot.compound) is not None:
        rows = edges(snapshot, contacts, np.zeros(len(contacts)))
        factor = factorise(of_bodies(compound, contacts), len(compound), rows)
    else:
        factor = factorise(contacts, n)
    return Determinacy(
        rank=factor.rank,
        redundant=len(contacts) - factor.rank,
        normal=~undetermined_rows(factor),
        tangential=np.ones(len(contacts), dtype=bool),
    )


def admissible_determinacy(contacts: Contacts, solution: Percussions) -> Determinacy:
    """Tell what balance and λ ≥ 0 together say of the reactions of an answer without friction: see
    `determinacy_of`. Raises ValueError as `Equilibrium.of` does."""
    return determinacy_of(Equilibrium.of(contacts, solution))


def determinacy_of(equilibrium: Equilibrium) -> Determinacy:
    """Tell what the balance of an answer says of its percussions.

    `normal` (k,) is whether the contact's interval [λ_min, λ_max] is a point. This is more than
    `determinacy` finds: contacts that open carry nothing, and some self-stresses would make a
    contact pull that carries nothing in any admissible percussion. `redundant` is the dimension
    of the set, `rank` the number of unknowns that can carry something, less that dimension.
    Raises ProgramError if a linear program has no usable answer."""
    chosen = equilibrium.carrying()
    contact = equilibrium.contact[chosen]
    factor = equilibrium.factor_of(chosen)
    loose = self_stresses(factor)

    def determined_by(stress: Floats) -> Mask:
        sums = np.zeros((len(equilibrium.contacts), stress.shape[1]))
        np.add.at(sums, contact, stress)
        return np.asarray(np.abs(sums).max(1) <= ZERO_ROW)

    return Determinacy(
        rank=factor.rank,
        redundant=len(chosen) - factor.rank,
        normal=determined_by(loose),
        tangential=determined_by(equilibrium.along[chosen, None] * loose),
    )
