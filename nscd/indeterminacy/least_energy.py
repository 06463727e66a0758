"""The admissible percussion of least elastic energy: what soft contacts choose when loaded from
rest and stiff."""

import logging
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from nscd.arrays import Floats, read_only
from nscd.contacts import Contacts
from nscd.indeterminacy.admissible import Admissible
from nscd.indeterminacy.orthogonal import factorise
from nscd.percussions import Percussions

MOST_STEPS = 200
# Added to the stiffness of the packing, relative to a contact's, so that what nothing holds does
# not move without bound.
SOFTENING = 1e-10
# After as many steps between which no contact opens or closes only rounding is left.
STEADY_STEPS = 3
ACCURATE = 1e-7
SYMMETRIC: dict[str, Any] = {
    "permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}
}  # fmt: skip
_log = logging.getLogger(__name__)


class LeastEnergyError(RuntimeError):
    """Say that an energy minimum was not reached to the accuracy asked, and how near it came."""


def least_energy(
    contacts: Contacts, answer: Percussions, stiffness: ArrayLike | None = None
) -> Floats:
    """Find λ* (k,) N·s, of the least λᵀK⁻¹λ of all admissible percussions of the answer.

    stiffness: (k,) N/m up to a common factor, K = diag(stiffness); equal where left out: the
        least norm

    It is unique. By duality λ*_c = k_c max(0, (C y)_c), where the displacements y of the disks
    maximise y·Cᵀλ − ½ Σ k_c max(0, (C y)_c)²: the equilibrium of elastic contacts that only
    push. Newton's method with exact line search on y finds who touches; then λ* is the
    least-norm solution of the balance on those contacts, by the orthogonal factor.

    The error satisfies ‖λ − λ*‖² ≤ Σ (λ_c − k_c max(0, (C y)_c))² + 2 k_c λ_c max(0, −(C y)_c)
    (norm weighted by k_max/k_c), a sum without cancellation, computed for the result. Raises
    LeastEnergyError if that bound exceeds 10⁻⁷ of ‖λ‖, ValueError for a stiffness that is not
    positive, and whatever `Admissible.of` does."""
    held = Admissible.of(contacts, answer)
    k = len(contacts)
    every = read_only(np.ones(k) if stiffness is None else stiffness, (k,), "stiffness")
    if not (every > 0).all():
        least = int(np.argmin(every))
        raise ValueError(f"stiffness: {every[least]:g} N/m at contact {least}")
    closed, reaction = held.contact, np.zeros(k)
    if not held.point.any():
        return reaction
    stiff = every[closed] / every[closed].max()
    chosen = held.contacts.select(closed)
    matrix = held.matrix
    impulse = matrix.T @ held.point / held.scale
    displacement, steps = _equilibrium(csc_array(matrix), stiff, impulse)

    touching = np.flatnonzero(matrix @ displacement > 0)
    root = np.sqrt(stiff[touching])
    weighted = csr_array(diags_array(root) @ matrix[touching])
    factor = factorise(chosen.select(touching), held.disks, weighted)
    some = np.zeros(len(closed))
    some[touching] = np.maximum(root * factor.least_norm(impulse), 0.0)
    missing = some[touching] / root - root * (matrix @ displacement)[touching]
    displacement += factor.least_squares(missing)
    overlap = matrix @ displacement
    error = (some - stiff * np.maximum(overlap, 0)) ** 2
    error += 2 * stiff * some * np.maximum(-overlap, 0)
    bound = float(np.sqrt((error / stiff).sum()))
    unbalanced = float(np.abs(matrix.T @ some - impulse).max())
    size = float(np.sqrt((some**2 / stiff).sum()))
    error_share = f"the error may be {bound / size:.1e} of the percussions"
    words = f"after {steps} steps {error_share}, the balance misses {unbalanced:.1e} of the largest"
    _log.debug("least energy: %s", words)
    if max(bound, unbalanced) > ACCURATE * size:
        raise LeastEnergyError(f"least energy: {words}")
    reaction[closed] = some * held.scale
    return reaction


def _equilibrium(matrix: csc_array, stiff: Floats, impulse: Floats) -> tuple[Floats, int]:
    """Displacements y (2n,) that maximise y·b − ½ Σ k max(0, C y)², and the number of Newton
    steps."""
    y = np.zeros(matrix.shape[1])
    overlap = np.zeros(matrix.shape[0])
    active = np.ones(len(overlap), dtype=bool)
    steady = 0
    small = SOFTENING * eye_array(len(y), format="csc")
    for step in range(MOST_STEPS):
        force = impulse - matrix.T @ (stiff * np.maximum(overlap, 0))
        hessian = csc_array(matrix.T @ diags_array(stiff * active) @ matrix + small)
        solver = splu(hessian, **SYMMETRIC)
        direction = solver.solve(force)
        moved = matrix @ direction
        length = _line_maximum(overlap, moved, stiff, float(impulse @ direction))
        y = y + length * direction
        overlap = matrix @ y
        before, active = active, overlap > 0
        steady = steady + 1 if np.array_equal(active, before) else 0
        if steady == STEADY_STEPS:
            return y, step + 1
    return y, MOST_STEPS


def _line_maximum(overlap: Floats, moved: Floats, stiff: Floats, work: float) -> float:
    """The t > 0 where work·t − ½ Σ k max(0, o + t m)² is largest: its slope falls, linear between
    the t = −o/m."""
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(moved != 0, -overlap / moved, np.inf)
    ahead = np.flatnonzero((change > 0) & np.isfinite(change))
    ahead = ahead[np.argsort(change[ahead])]
    now = (overlap > 0) | ((overlap == 0) & (moved > 0))
    slope = work - float((stiff * overlap * moved)[now].sum())  # at t = 0
    fall = float((stiff * moved**2)[now].sum())
    begin = 0.0
    for contact in ahead.tolist():
        end = change[contact]
        if slope - fall * (end - begin) <= 0:
            break
        slope -= fall * (end - begin)
        fall = max(
            fall + float(np.sign(moved[contact])) * float(stiff[contact] * moved[contact] ** 2), 0.0
        )
        begin = end
    return begin + slope / fall if fall > 0 else max(begin, 1.0)
