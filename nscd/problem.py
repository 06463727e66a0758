"""One impact as a convex problem that any solver takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, vstack
from scipy.sparse.linalg import splu

from nscd.bodies import Floats, Snapshot
from nscd.contacts import Contacts
from nscd.laws import ContactLaw


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContactProblem:
    """min ½ (u − û)·Â (u − û) subject to C u ≤ b (or C u = b where `maintained`).

    With the collision law, Â = M + DᵀKD and Â û = (M − DᵀKD) u⁻: physics of eq. (1) with u = u⁺. Degrees of
    freedom: 2 a disk, and the n spins after them only where tangential dissipation needs them. λ is the multiplier:
    Â (u − û) + Cᵀλ = 0. offset b is 0 for an impact, a gap rate (m/s) otherwise.

    inertia Â sparse (d,d); free û (d,); normal C sparse (k,d); offset b (k,) m/s; inverse_mass w (k,) 1/kg;
    deformation D sparse (2k,d) and its coefficients (2k,) kg, None without dissipation; left (d,) u⁻.
    """

    inertia: csc_array
    free: Floats
    normal: csr_array
    offset: Floats
    inverse_mass: Floats
    left: Floats
    deformation: csr_array | None
    coefficients: Floats
    maintained: bool

    @property
    def scale(self) -> float:
        """‖u⁻‖∞ (m/s), the velocity that residuals are measured in; tiny where nothing moves."""
        n = 2 * (len(self.left) // 2 if self.deformation is None else len(self.left) // 3)
        return max(float(np.abs(self.left[:n]).max(initial=0.0)), float(np.finfo(float).tiny))

    def residual(self, reaction: Floats, velocity: Floats) -> float:
        """max |min(wλ, b − Cu)| / ‖u⁻‖∞ (|Cu − b| where maintained): dimensionless, 0 for an exact answer."""
        slack = self.offset - self.normal @ velocity
        error = slack if self.maintained else np.minimum(self.inverse_mass * reaction, slack)
        return float(np.abs(error).max(initial=0.0)) / self.scale

    def balance_error(self, reaction: Floats, velocity: Floats) -> float:
        """max |Â(u − û) + Cᵀλ| / (Âᵢᵢ ‖u⁻‖∞ + |C|ᵀ|λ|): how far the momentum of any disk is from balance, relative to
        what it has and receives; rounding alone leaves about 1e-16."""
        balance = self.inertia @ (velocity - self.free) + self.normal.T @ reaction
        size = self.inertia.diagonal() * self.scale + abs(self.normal).T @ np.abs(reaction)
        return float((np.abs(balance) / size).max(initial=0.0))


def impact_problem(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats, law: ContactLaw, offset: Floats | None = None
) -> ContactProblem:
    """The collision problem of a snapshot with the given left velocity (n,2) m/s and law."""
    n, k = len(snapshot), len(contacts)
    inverse_mass = contacts.inverse_mass(snapshot.mass)
    k_normal, k_tangential = law.coefficients(inverse_mass)
    normal = contacts.normal_matrix(n)
    mass = np.repeat(snapshot.mass, 2)
    left = left_velocity.ravel()
    deformation = None
    coefficients = np.concatenate([k_normal, k_tangential])
    inertia, free = csc_array(diags_array(mass)), left
    if coefficients.any():
        assert snapshot.spin is not None
        left = np.concatenate([left, snapshot.spin])
        normal = csr_array((normal.data, normal.indices, normal.indptr), shape=(k, 3 * n))
        deformation = _deformation(snapshot, contacts, normal)
        dissipative = deformation.T @ diags_array(coefficients) @ deformation
        mass_matrix = diags_array(np.concatenate([mass, snapshot.inertia]))
        inertia = csc_array(mass_matrix + dissipative)
        free = splu(inertia).solve((mass_matrix - dissipative) @ left)
    return ContactProblem(
        inertia=inertia, free=free, normal=normal, offset=np.zeros(k) if offset is None else offset,
        inverse_mass=inverse_mass, left=left, deformation=deformation, coefficients=coefficients,
        maintained=law.maintained,
    )


def _deformation(snapshot: Snapshot, contacts: Contacts, normal: csr_array) -> csr_array:
    """D: normal components first, then tangential ones t·(u_i − u_j) + r_i ω_i + r_j ω_j with t = (−n_y, n_x)."""
    n, k = len(snapshot), len(contacts)
    i, j, pairs = contacts.first, contacts.second, np.flatnonzero(~contacts.is_wall)
    tx, ty = -contacts.normal[:, 1], contacts.normal[:, 0]
    every = np.arange(k)
    rows = np.concatenate([every, every, every, pairs, pairs, pairs])
    columns = np.concatenate([2 * i, 2 * i + 1, 2 * n + i, 2 * j[pairs], 2 * j[pairs] + 1, 2 * n + j[pairs]])
    values = np.concatenate([tx, ty, snapshot.radius[i], -tx[pairs], -ty[pairs], snapshot.radius[j[pairs]]])
    return csr_array(vstack([normal, coo_array((values, (rows, columns)), shape=(k, 3 * n))]))
