"""A contact problem as matrices, in the forms that FCLIB knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from nscd import Snapshot
from nscd.arrays import Floats
from nscd.contacts import Contacts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GlobalProblem:
    """Hold the problem M v = f + H r, u = Hᵀ v + w, of k contacts in the plane.

    mass: M (v,v) kg, kg m²
    transfer: H (v,2k), columns in the order normal, tangent of each contact
    momentum: f (v,) N·s
    offset: w (2k,) m/s
    friction: μ (k,)

    Of each contact u_n opens, r_n presses, and Coulomb's law is 0 ≤ r_n ⟂ u_n ≥ 0, |r_t| ≤ μ r_n,
    r_t u_t = −μ r_n |u_t|.
    """

    mass: csc_array
    transfer: csc_array
    momentum: Floats
    offset: Floats
    friction: Floats

    @classmethod
    def of(
        cls, snapshot: Snapshot, contacts: Contacts, left: Floats, friction: Floats
    ) -> GlobalProblem:
        """State the inelastic impact of disks with left velocity (n,2) m/s and the spins of the
        snapshot, at contacts with μ (k,): v = (x, y, ω) of each disk, H = −(C, T)ᵀ."""
        n, k = len(snapshot), len(contacts)
        diagonal = np.column_stack([snapshot.mass, snapshot.mass, snapshot.inertia]).ravel()
        velocity = np.column_stack([left, snapshot.spin]).ravel()
        return cls(
            mass=csc_array(diags_array(diagonal)),
            transfer=_transfer(snapshot, contacts, n, k),
            momentum=diagonal * velocity,
            offset=np.zeros(2 * k),
            friction=friction,
        )

    def local(self) -> LocalProblem:
        """Eliminate the velocities: W = Hᵀ M⁻¹ H, q = Hᵀ M⁻¹ f + w. Raises ValueError for a mass
        matrix that has no inverse."""
        diagonal = self.mass.diagonal()
        if self.mass.nnz == len(diagonal) and (diagonal != 0).all():
            carried = csc_array(diags_array(1.0 / diagonal) @ self.transfer)
            free = self.momentum / diagonal
        else:
            try:
                factor = splu(csc_array(self.mass))
            except RuntimeError:
                raise ValueError("M: singular; a mass matrix has an inverse") from None
            carried = csc_array(factor.solve(self.transfer.toarray()))
            free = factor.solve(self.momentum)
        return LocalProblem(
            delassus=csc_array(self.transfer.T @ carried),
            free=self.transfer.T @ free + self.offset,
            friction=self.friction,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalProblem:
    """Hold the problem u = W r + q of k contacts in the plane, without its bodies.

    delassus: W (2k,2k) 1/kg; free: q (2k,) m/s; friction: μ (k,)
    """

    delassus: csc_array
    free: Floats
    friction: Floats


def _transfer(snapshot: Snapshot, contacts: Contacts, n: int, k: int) -> csc_array:
    """H (3n,2k): what reactions along the normal and across it give to each disk."""
    rows, columns, values = [], [], []
    (nx, ny), pairs = contacts.normal.T, ~contacts.is_wall
    lever = snapshot.radius
    for sign, disk, there in (
        (-1.0, contacts.first, np.ones(k, dtype=bool)),
        (1.0, np.where(pairs, contacts.second, 0), pairs),
    ):
        on, contact = disk[there], np.flatnonzero(there)
        x, y = nx[there], ny[there]
        for axis, tangent, value in (
            (0, 0, sign * x),
            (1, 0, sign * y),
            (0, 1, -sign * y),
            (1, 1, sign * x),
            # both turn the same way
            (2, 1, -lever[on]),
        ):
            rows.append(3 * on + axis)
            columns.append(2 * contact + tangent)
            values.append(value)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    found = csc_array(coo_array(entries, shape=(3 * n, 2 * k)))
    found.eliminate_zeros()
    found.sort_indices()
    return found
