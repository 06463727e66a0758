"""A contact problem of the benchmarks: as a file, so that every solver gets the same bits in a
process of its own; in scaled variables, as solvers want it; and how exact an answer to it is.

Scaled, without dissipation. Primal: min ½|y|² − y⁻·y subject to G y ≤ 0, with y = √m u / (√m̄
‖u⁻‖∞), G = C M^(−1/2) with rows divided by √w, and multipliers z = √w λ / (√m̄ ‖u⁻‖∞). Dual: min ½
z·GGᵀz − z·Gy⁻ subject to z ≥ 0."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from benchmarks.problems.families import Case
from nscd import Contacts, Snapshot, Walls

DISKS = ("position", "velocity", "radius", "mass")
WALLS = ("start", "end")
CONTACTS = ("first", "second", "is_wall", "normal", "gap", "point")


def write_case(path: Path, case: Case) -> None:
    """Write a case as .npz."""
    parts = ((case.snapshot, DISKS), (case.walls, WALLS), (case.contacts, CONTACTS))
    arrays = {name: getattr(part, name) for part, names in parts for name in names}
    np.savez(path, name=case.name, left_velocity=case.left_velocity, **arrays)


def read_case(path: Path) -> Case:
    """Read what `write_case` wrote."""
    with np.load(path) as file:
        disks, walls, contacts = (
            {name: file[name] for name in names} for names in (DISKS, WALLS, CONTACTS)
        )
        name, left = str(file["name"]), file["left_velocity"]
    return Case(name, Snapshot(**disks), Walls(**walls), Contacts(**contacts), left)


class Scaled(NamedTuple):
    """The problem in scaled variables; `reaction` (k,) and `velocity` (2n,) turn z and y into N·s
    and m/s."""

    left: Any  # y⁻ (2n,)
    rows: Any  # G (k, 2n)
    reaction: Any
    velocity: Any

    @property
    def identity(self) -> Any:
        return sparse.identity(len(self.left), format="csc")

    @property
    def delassus(self) -> Any:
        """GGᵀ (k, k), with ones on its diagonal."""
        return sparse.csc_matrix(self.rows @ self.rows.T)

    @property
    def approach(self) -> Any:
        """G y⁻ (k,)."""
        return self.rows @ self.left


class Answer(NamedTuple):
    """z (k,), y (2n,) if the solver has one, and its CPU seconds if it had to run in another
    process."""

    multiplier: Any
    velocity: Any | None = None
    seconds: float | None = None


Solver = Callable[[float], Answer]


def scaled(case: Case) -> Scaled:
    """The problem of a case in scaled variables."""
    n = len(case.snapshot)
    mass = np.repeat(case.snapshot.mass, 2)
    weight = np.sqrt(case.contacts.inverse_mass(case.snapshot.mass))
    left = case.left_velocity.ravel()
    size = np.sqrt(mass.mean()) * np.abs(left).max()
    normals, root = case.contacts.normal_matrix(n), np.sqrt(mass)
    rows = sparse.diags_array(1 / weight) @ normals @ sparse.diags_array(1 / root)
    return Scaled(left * root / size, sparse.csc_matrix(rows), size / weight, size / root)


class Accuracy(NamedTuple):
    """Residual max|min(wλ, −Cu)| / ‖u⁻‖∞ of an answer, the velocity u (2n,) m/s that it holds for,
    and whether that u is the solver's own (else u = u⁻ − M⁻¹Cᵀλ)."""

    residual: float
    velocity: Any
    own: bool


def accuracy(case: Case, reaction: Any, own_velocity: Any | None) -> Accuracy:
    """Accuracy of reactions λ (k,) N·s.

    First with u = u⁻ − M⁻¹Cᵀλ, for which momentum is exact. The solver's own u (2n,) m/s counts
    where it does better, and then the momentum that it misses, max|M(u − u⁻) + Cᵀλ| / (m‖u⁻‖∞ +
    Σ|λ|) over disks, counts as well. An answer that is not finite has an infinite residual."""
    n = len(case.snapshot)
    mass = np.repeat(case.snapshot.mass, 2)
    left = case.left_velocity.ravel()
    scale = float(np.abs(left).max())
    rows = case.contacts.normal_matrix(n)
    weight = case.contacts.inverse_mass(case.snapshot.mass)
    momentum = rows.T @ reaction

    def residual(velocity: Any) -> float:
        missed = np.abs(np.minimum(weight * reaction, -(rows @ velocity))).max(initial=0.0)
        return float(missed) / scale if np.isfinite(missed) else np.inf

    velocity = left - momentum / mass
    best = Accuracy(residual(velocity), velocity, False)
    if own_velocity is not None:
        missed = np.abs(mass * (own_velocity - left) + momentum)
        received = abs(rows).T @ np.abs(reaction)
        balance = float((missed / (mass * scale + received)).max())
        own = max(residual(own_velocity), balance)
        if own < best.residual:
            best = Accuracy(own, own_velocity, True)
    return best
