"""A contact problem of the benchmarks: as a file; as frames of a run; in scaled variables, as solvers
want it; and how exact an answer to it is.

Scaled, without dissipation. Primal: min ½|y|² − y⁻·y subject to G y ≤ 0, with y = √m u / (√m̄
‖u⁻‖∞), G = C M^(−1/2) with rows divided by √w, and multipliers z = √w λ / (√m̄ ‖u⁻‖∞). Dual: min ½
z·GGᵀz − z·Gy⁻ subject to z ≥ 0."""

import hashlib
import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from analysis.dumps import open_bodies, snapshot_of
from analysis.percussions import Setting
from analysis.scene.scene import read_scene
from benchmarks.problems import families
from benchmarks.problems.families import FAMILIES, Case


def write_case(path: Path, case: Case) -> None:
    """Write a case so that nscd alone can read it."""
    path.write_bytes(pickle.dumps(tuple(case)))


def case_of(family: str, size: int, folder: Path | None, seed: int = 1) -> Case:
    """A case of a family; read from the folder, where there is one, if the same families.py has made
    it before."""
    if folder is None:
        return FAMILIES[family](size, seed)
    made_by = hashlib.sha256(Path(families.__file__).read_bytes()).hexdigest()[:8]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{family}_{size}_{seed}_{made_by}.pickle"
    if not path.exists():
        write_case(path, FAMILIES[family](size, seed))
    return Case(*pickle.loads(path.read_bytes()))


def frames(run: Path, every: int) -> Iterator[Case]:
    """The contact problems of every so many frames of a run, pressed as its scene says; left out are
    those without contacts, or with overlaps that `percussions solve` refuses too."""
    scene = read_scene(run / "scene.toml")
    setting, dump = Setting.of(scene), run / "bodies.dump"
    trajectory = open_bodies(dump).trajectory
    for number in range(every, len(trajectory), every):
        snapshot = snapshot_of(trajectory[number], dump)
        try:
            contacts = setting.contacts(snapshot)
        except ValueError as error:
            print(f"{run}, frame {number}: {error}", file=sys.stderr)
            continue
        if len(contacts):
            name, left = f"{run.parent.name} frame {number}", setting.left(snapshot)[0]
            yield Case(name, snapshot, scene.wall_segments(), contacts, left)


class SolverResult(NamedTuple):
    """Reactions λ (k,) N·s, u (2n,) m/s if the solver has one, its CPU seconds if it had to run in
    another process, and its iterations (0: not said)."""

    reaction: Any
    velocity: Any | None = None
    seconds: float | None = None
    iterations: int = 0


Solver = Callable[[float], SolverResult]


class Scaled(NamedTuple):
    """The problem of a case in scaled variables; `reaction` (k,) and `velocity` (2n,) turn z and y
    into N·s and m/s."""

    case: Case
    left: Any  # y⁻ (2n,)
    rows: Any  # G (k, 2n)
    reaction: Any
    velocity: Any

    def program(self, dual: bool) -> tuple[Any, Any, Any, Any, Any]:
        """P, q, A, low, high: the primal in y, or the dual in z, as min ½ x·Px + q·x subject to low
        ≤ A x ≤ high."""
        k, n = self.rows.shape
        none, infinity = np.zeros(k), np.full(k, np.inf)
        if dual:
            delassus = sparse.csc_matrix(self.rows @ self.rows.T)
            return delassus, -self.rows @ self.left, _identity(k), none, infinity
        return _identity(n), -self.left, self.rows, -infinity, none

    def solution(self, z: Any, y: Any | None = None, seconds: float | None = None) -> SolverResult:
        """The answer that multipliers z (k,), and velocities y (2n,) if there are any, stand for."""
        velocity = None if y is None else np.asarray(y) * self.velocity
        return SolverResult(np.asarray(z) * self.reaction, velocity, seconds)

    def of(self, dual: bool, x: Any, multipliers: Any) -> SolverResult:
        """The answer that a solution of `program` stands for."""
        return self.solution(x) if dual else self.solution(multipliers, x)


def _identity(size: int) -> Any:
    return sparse.identity(size, format="csc")


def scaled(case: Case) -> Scaled:
    """The problem of a case in scaled variables."""
    n = len(case.snapshot)
    mass = np.repeat(case.snapshot.mass, 2)
    weight = np.sqrt(case.contacts.inverse_mass(case.snapshot.mass))
    left = case.left_velocity.ravel()
    size = np.sqrt(mass.mean()) * np.abs(left).max()
    normals, root = case.contacts.normal_matrix(n), np.sqrt(mass)
    rows = sparse.diags_array(1 / weight) @ normals @ sparse.diags_array(1 / root)
    return Scaled(case, left * root / size, sparse.csc_matrix(rows), size / weight, size / root)


class Accuracy(NamedTuple):
    """Residual max|min(wλ, −Cu)| / ‖u⁻‖∞ of an answer, the velocity u (2n,) m/s that it holds for,
    and whether that u is the solver's own (else u = u⁻ − M⁻¹Cᵀλ)."""

    residual: float
    velocity: Any
    own: bool


def accuracy(case: Case, reaction: Any, own_velocity: Any | None = None) -> Accuracy:
    """Accuracy of reactions λ (k,) N·s.

    First with u = u⁻ − M⁻¹Cᵀλ, for which momentum is exact. The solver's own u (2n,) m/s counts
    where it does better, and then the momentum that it misses, max|M(u − u⁻) + Cᵀλ| / (m‖u⁻‖∞ +
    Σ|λ|) over disks, counts as well. An answer that is not finite has an infinite residual."""
    mass = np.repeat(case.snapshot.mass, 2)
    left = case.left_velocity.ravel()
    scale = float(np.abs(left).max())
    rows = case.contacts.normal_matrix(len(case.snapshot))
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
