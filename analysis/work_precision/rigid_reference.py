"""The rigid model solved without any solver of this product: the reference of everything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from nscd import Contacts, Snapshot
from nscd.arrays import Floats

# Rounding, as a share of the kinetic norm.
ROUNDING = 1e-15
# Singular values below this share of the largest are none.
RANK = 1e-10
# Normals this near to one line count as aligned.
ALIGNED = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigidReference:
    """u⁺ (n,2) m/s of the purely inelastic impact, how it was found, and a bound of its error |u⁺ −
    exact|_M, kg^½ m/s."""

    right_velocity: Floats
    origin: str
    bound: float


def rigid_reference(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats
) -> RigidReference:
    """u⁺ of M(u⁺ − u⁻) + Cᵀλ = 0, 0 ≤ λ ⟂ −C u⁺ ≥ 0 (paper eq. (1), corrected, k = 0).

    In closed form for a line of touching disks that is pressed together everywhere (paper eqs. (5),
    (6)); else λ minimises |M^(−½)Cᵀλ − M^½u⁻| over λ ≥ 0, by Lawson and Hanson's active set on
    dense matrices (scipy). The bound: what was found is the exact answer for C u ≤ b, with b = C u⁺
    where λ > 0 and max(C u⁺, 0) elsewhere, tiny. A shift by w with C w = b turns one problem into
    the other, so |u⁺ − exact|_M ≤ 2 |w|_M ≤ 2 |b| / σ_min(C M^(−½)). Where C lacks full row rank:
    |u⁺ − exact|²_M ≤ |λ·v| + Σλ* max(v, 0), from monotonicity, where Σλ stands for Σλ*."""
    closed = _pressed_line(snapshot, contacts, left_velocity)
    if closed is not None:
        norm = float(np.sqrt((snapshot.mass[:, None] * left_velocity**2).sum()))
        return RigidReference(
            right_velocity=closed, origin="closed form of a pressed line", bound=ROUNDING * norm
        )
    n = len(snapshot)
    matrix = contacts.normal_matrix(n).toarray()
    root = np.sqrt(np.repeat(snapshot.mass, 2))
    reaction, _ = nnls(
        matrix.T / root[:, None], root * left_velocity.ravel(), maxiter=30 * (len(contacts) + 1)
    )
    right = left_velocity.ravel() - matrix.T @ reaction / root**2
    closing = matrix @ right
    size = np.linalg.svd(matrix / root, compute_uv=False)
    if len(contacts) <= 2 * n and size[-1] > RANK * size[0]:
        offset = np.where(reaction > 0, closing, np.maximum(closing, 0.0))
        bound = 2.0 * float(np.linalg.norm(offset)) / float(size[-1])
    else:
        most = max(float(closing.max(initial=0.0)), 0.0)
        bound = float(np.sqrt(abs(float(reaction @ closing)) + float(reaction.sum()) * most))
    return RigidReference(
        right_velocity=right.reshape(n, 2),
        origin="dense non-negative least squares (Lawson–Hanson)",
        bound=bound + ROUNDING * float(np.linalg.norm(root * left_velocity.ravel())),
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
