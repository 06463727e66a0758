"""Single states of an equilibrium: the one nearest to given forces, and the one of least energy, in
Coulomb's cones and with a tolerance on the balance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.sparse import csr_array, diags_array, eye_array, hstack, vstack

from nscd.arrays import Floats, read_only
from nscd.contacts import Contacts
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.linear import ProgramError
from nscd.indeterminacy.quadratic import minimise
from nscd.percussions import Percussions

# A state is `solved` if its program is to this.
ACCURATE = 1e-7
# Stiffness of a contact along its tangent over that along its normal, of the soft models of a scene.
TANGENTIAL = 2 / 7
# A program is without a state if its balances stay open by more than this share of the loads.
FEASIBLE = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceState:
    """Hold forces of k contacts.

    normal, tangential: (k,) N (N·s of percussions), f_n and f_t
    distance: √(mean over the contacts of the squares that were minimised); of the nearest state in σ
    status: `solved`, or `inaccurate` where the program is not solved to 10⁻⁷
    error: of the program, see `quadratic.minimise`"""

    normal: Floats
    tangential: Floats
    distance: float
    status: str
    error: float


def nearest(
    equilibrium: Equilibrium, force: ArrayLike, sigma: ArrayLike, tolerance: ArrayLike
) -> ForceState:
    """Find the state of least Σ ((f_n − F)/σ)² + (f_t/σ)² with |net| ≤ tolerance in each balance.

    force, sigma: F and σ (k,) N
    tolerance: N, see `equilibrium`

    Raises ValueError for shapes, a σ that is not positive, and where no state has so small a net: then
    it names the least tolerance, the same for all bodies that have one."""
    k = len(equilibrium.contacts)
    wanted, spread = read_only(force, (k,), "force"), read_only(sigma, (k,), "sigma")
    if k and not spread.min() > 0:
        raise ValueError(f"sigma: {spread.min():g} N at contact {int(spread.argmin())}")
    return least_of(equilibrium, np.tile(1 / spread**2, 2), np.append(wanted, np.zeros(k)), tolerance)


def least_energy_within(equilibrium: Equilibrium, spread: ArrayLike = 0.0) -> ForceState:
    """Find the state of least Σ f_n² + f_t²/TANGENTIAL, which soft contacts choose that are loaded from rest
    and hold or slide as the unknowns say: with `Equilibrium.of_answer` the canonical percussions of an
    answer with friction.

    spread: N, s: balances may be open, at the price of Σ (net/s)² in units of the mean f_n²
        of the loads (`virial`); 0: they may not

    Raises ValueError as `nearest` does."""
    k, soft = len(equilibrium.contacts), equilibrium.rows(spread, "spread")
    weights = np.append(np.ones(k), np.full(k, 1 / TANGENTIAL))
    if not soft.any():
        return least_of(equilibrium, weights, np.zeros(2 * k), 0.0)
    if not equilibrium.virial > 0:
        raise ValueError(f"load: virial {equilibrium.virial:g} N. Loads that press, all known, are needed")
    with np.errstate(divide="ignore"):
        cost = (equilibrium.virial / soft) ** 2
    return least_of(equilibrium, weights, np.zeros(2 * k), 0.0, cost)


def least_energy(
    contacts: Contacts, solution: Percussions, stiffness: ArrayLike | None = None
) -> Floats:
    """Find λ* (k,) N·s, of the least λᵀK⁻¹λ of all admissible percussions of an answer without
    friction; with friction: `least_energy_within`.

    stiffness: (k,) N/m up to a common factor, K = diag(stiffness); equal where left out: the
        least norm

    It is unique. Raises ValueError for a stiffness that is not positive and for friction, ProgramError
    where the minimum is not reached to 10⁻⁷, and whatever `Equilibrium.of_answer` does."""
    k = len(contacts)
    every = read_only(np.ones(k) if stiffness is None else stiffness, (k,), "stiffness")
    if not (every > 0).all():
        minimum = int(np.argmin(every))
        raise ValueError(f"stiffness: {every[minimum]:g} N/m at contact {minimum}")
    if solution.friction is not None:
        raise ValueError("solution: it has friction. Its state is that of least_energy_within")
    equilibrium = Equilibrium.of_answer(contacts, solution)
    if not len(equilibrium.contact):
        return np.zeros(k)
    found = least_of(equilibrium, np.tile(every.max() / every, 2), np.zeros(2 * k), 0.0)
    if found.status != "solved":
        raise ProgramError(f"least energy: the error may be {found.error:.1e} of the percussions")
    return found.normal


def least_of(
    equilibrium: Equilibrium,
    weights: Floats,
    wanted: Floats,
    tolerance: ArrayLike,
    cost: Floats | None = None,
) -> ForceState:
    """Find the state of least Σ weights (f − wanted)² + Σ price net², (2k,) and (w·n,). Raises as
    `nearest` does."""
    u, k, maximum = len(equilibrium.contact), len(equilibrium.contacts), equilibrium.rows(tolerance, "tolerance")
    sums = equilibrium.sums
    particular = equilibrium.load[:0] if equilibrium.point is None else equilibrium.point
    size = float(np.abs(np.concatenate([equilibrium.load, wanted, particular])).max(initial=0.0)) or 1.0
    balance, load, unit = csr_array(equilibrium.matrix.T), equilibrium.load / size, float(weights.min()) or 1.0
    quadratic = sums.T @ diags_array(weights / unit) @ sums
    linear = -(sums.T @ (weights / unit * wanted)) / size
    if cost is not None:
        soft = np.isfinite(cost)
        priced = np.where(soft, cost, 0.0)
        quadratic = quadratic + balance.T @ diags_array(priced / unit) @ balance
        linear = linear - balance.T @ (priced / unit * load)
        maximum = np.where(soft & (maximum == 0), np.inf, maximum)
    equal, within = np.flatnonzero(maximum == 0), np.flatnonzero((maximum > 0) & np.isfinite(maximum))
    some, near, open_by = balance[within], load[within], maximum[within] / size
    sides = vstack([-eye_array(u), some, -some])
    ends = np.concatenate([np.zeros(u), near + open_by, open_by - near])
    x, error = minimise(quadratic, linear, (balance[equal], load[equal]), (sides, ends))
    if error > ACCURATE and (needed := least_tolerance(equilibrium, maximum)) > 0:
        raise ValueError(f"tolerance: no state is within it. {needed:.3g} N more are needed")
    forces = sums @ np.maximum(x, 0.0) * size
    square = float((weights * (forces - wanted) ** 2).sum()) / max(k, 1)
    status = "solved" if error <= ACCURATE else "inaccurate"
    return ForceState(
        normal=forces[:k], tangential=forces[k:], distance=square**0.5, status=status, error=error
    )


def least_tolerance(equilibrium: Equilibrium, tolerance: ArrayLike = 0.0) -> float:
    """Compute by how much (N) the tolerance must rise, of all bodies that have a finite one, that some
    state be within it; 0 where one is. Raises ProgramError if HiGHS does not solve it."""
    maximum = equilibrium.rows(tolerance, "tolerance")
    rows = np.flatnonzero(np.isfinite(maximum))
    size = float(np.abs(equilibrium.load).max(initial=0.0)) or 1.0
    balance, load = csr_array(equilibrium.matrix.T)[rows], equilibrium.load[rows] / size
    one, open_by = csr_array(-np.ones((len(rows), 1))), maximum[rows] / size
    found = linprog(
        np.append(np.zeros(len(equilibrium.contact)), 1.0),
        A_ub=vstack([hstack([balance, one]), hstack([-balance, one])]),
        b_ub=np.concatenate([load + open_by, open_by - load]),
        method="highs",
    )
    if found.status != 0:
        raise ProgramError(f"least tolerance: {found.message}")
    return float(found.fun * size) if found.fun > FEASIBLE else 0.0
