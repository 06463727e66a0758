"""The rigid model solved without any solver of this product: the reference of everything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from nscd import ContactLaw, Contacts, Snapshot
from nscd.arrays import Floats

# Rounding, as a share of the kinetic norm.
ROUNDING = 1e-15
# Singular values below this share of the largest are none.
RANK = 1e-10
# Normals this near to one line count as aligned.
ALIGNED = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigidReference:
    """The rigid model, solved.

    right_velocity: (n,2) m/s, u⁺.
    origin: how it was found.
    bound: kg^½ m/s, of its error |u⁺ − exact|_M."""

    right_velocity: Floats
    origin: str
    bound: float


def rigid_reference(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats, law: ContactLaw | None = None
) -> RigidReference:
    """Solve M(u⁺ − u⁻) + Cᵀ(κ + λ) = 0, 0 ≤ λ ⟂ −C u⁺ ≥ 0, κ = k max(C(u⁺ + u⁻), 0) (see
    `ContactLaw`).

    Without dissipation (k = 0) in closed form for a line of touching disks that is pressed together
    everywhere (paper eqs. (5), (6)). Else by Lawson and Hanson's active set on dense matrices
    (scipy): with s = κ/k − C u⁻ the pair (u⁺, s) is the nearest to (u⁻, −C u⁻), in the norm of N =
    diag(M, K), of all with C u ≤ 0 and C u ≤ s; λ and κ minimise the distance of N^(−½)Eᵀ(λ, κ) to
    it, E the rows of these constraints. The bound: what was found is the exact answer for E y ≤ c,
    with c = E y where a percussion is > 0 and max(E y, 0) elsewhere, tiny. A shift by w with E w =
    c turns one problem into the other, so |u⁺ − exact|_M ≤ 2 |w|_N ≤ 2 |c| / σ_min(E N^(−½)). Where
    E lacks full row rank: |u⁺ − exact|²_M ≤ |p·v| + Σp* max(v, 0), from monotonicity, where Σp
    stands for Σp*."""
    n, mass = len(snapshot), np.repeat(snapshot.mass, 2)
    root, left = np.sqrt(mass), left_velocity.ravel()
    norm = float(np.linalg.norm(root * left))
    weight = (law or ContactLaw()).acting(contacts, snapshot.mass, left_velocity)[0]
    if not weight.any():
        closed = _pressed_line(snapshot, contacts, left_velocity)
        if closed is not None:
            return RigidReference(
                right_velocity=closed, origin="closed form of a pressed line", bound=ROUNDING * norm
            )
    matrix = contacts.normal_matrix(n).toarray()
    soft = np.flatnonzero(weight)
    stiff = np.sqrt(weight[soft])
    below = np.zeros((len(soft), len(contacts)))
    columns = np.block(
        [[matrix.T / root[:, None], matrix[soft].T / root[:, None]], [below, -np.diag(1 / stiff)]]
    )
    wanted = np.concatenate([root * left, -stiff * (matrix[soft] @ left)])
    percussion, _ = nnls(columns, wanted, maxiter=30 * (columns.shape[1] + 1))
    found = wanted - columns @ percussion
    right, closing = found[: 2 * n] / root, columns.T @ found
    size = np.linalg.svd(columns, compute_uv=False)
    if columns.shape[1] <= columns.shape[0] and size[-1] > RANK * size[0]:
        offset = np.where(percussion > 0, closing, np.maximum(closing, 0.0))
        bound = 2.0 * float(np.linalg.norm(offset)) / float(size[-1])
    else:
        most = max(float(closing.max(initial=0.0)), 0.0)
        bound = float(np.sqrt(abs(float(percussion @ closing)) + float(percussion.sum()) * most))
    return RigidReference(
        right_velocity=right.reshape(n, 2),
        origin="dense non-negative least squares (Lawson–Hanson)",
        bound=bound + ROUNDING * norm,
    )


def _pressed_line(snapshot: Snapshot, contacts: Contacts, left_velocity: Floats) -> Floats | None:
    """The common velocity (n,2) m/s where all disks are one straight line, free or with one end at
    a wall, that moves along itself and in which every contact presses; else None."""
    n, k = len(snapshot), len(contacts)
    walls = int(contacts.is_wall.sum())
    if walls > 1 or k != n - 1 + walls or n < 2:
        return None
    axis = contacts.normal[0]
    across = np.array([-axis[1], axis[0]])
    if np.abs(contacts.normal @ across).max() > ALIGNED or np.abs(left_velocity @ across).max() > 0:
        return None
    order = np.argsort(snapshot.position @ axis)
    pairs = contacts.select(~contacts.is_wall)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    links = np.sort(np.column_stack([place[pairs.first], place[pairs.second]]), axis=1)
    if not np.array_equal(
        links[np.argsort(links[:, 0])], np.column_stack([np.arange(n - 1), np.arange(1, n)])
    ):
        return None
    mass, speed = snapshot.mass[order], (left_velocity @ axis)[order]
    if walls:
        at = int(place[contacts.first[contacts.is_wall][0]])
        inward = float(contacts.normal[contacts.is_wall][0] @ axis)
        if at not in (0, n - 1) or (inward > 0) != (at == n - 1):
            return None
    common = 0.0 if walls else float(mass @ speed / mass.sum())
    momentum = mass * (speed - common)
    # what each contact passes on, counted from the free end
    passed = (
        np.cumsum(momentum)
        if not walls or place[contacts.first[contacts.is_wall][0]]
        else -np.cumsum(momentum[::-1])
    )
    if (passed < -1e-12 * np.abs(momentum).sum()).any():
        return None
    return np.tile(common * axis, (n, 1))
