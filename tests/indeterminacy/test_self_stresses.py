"""Laws of redundant contacts, on random lattices and against dense linear algebra, vertices and
least distance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog, nnls

from nscd import Walls, find_contacts, solve
from nscd.indeterminacy.admissible import Admissible
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy
from nscd.indeterminacy.intervals import Intervals, IntervalStatus
from nscd.indeterminacy.least_energy import least_energy
from nscd.indeterminacy.orthogonal import factorise
from tests.crowds import disks_at

WALLS = Walls(start=[[-3, -0.6], [3.1, -3]], end=[[6, -0.6], [3.1, 9]])
SEEDS = st.integers(0, 10**6)


def packing(seed, n=25, side=6, walls=WALLS):
    """A touching triangular lattice with vacancies, pressed into a corner, more or less; its
    percussions."""
    rng = np.random.default_rng(seed)
    sites = [
        (0.5 * i + 0.25 * (j % 2), -0.35 + 0.5 * np.sqrt(0.75) * j)
        for j in range(side)
        for i in range(side)
    ]
    velocity = rng.normal(size=(n, 2)) * rng.choice([0.1, 1.0]) + [1.5, -1.0]
    snapshot = disks_at(
        np.array(sites)[rng.permutation(len(sites))[:n]],
        velocity,
        mass=10.0 ** rng.uniform(-1, 1, n),
    )
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    answer = solve(snapshot, contacts, tolerance=1e-10)
    assert answer.status == "solved"
    return contacts, answer


@given(SEEDS, st.integers(5, 150))
def test_rank_and_determined_contacts_are_those_of_dense_algebra(seed, n):
    contacts, answer = packing(seed, n, side=13)
    known = determinacy(contacts, n)
    basis = null_space(contacts.normal_matrix(n).toarray().T)
    assert (known.rank, known.redundant) == (len(contacts) - basis.shape[1], basis.shape[1])
    np.testing.assert_array_equal(known.determined, (np.abs(basis) < 1e-9).all(1))
    sharper = admissible_determinacy(contacts, answer)
    assert sharper.redundant <= known.redundant
    assert sharper.determined[known.determined].all()


@given(SEEDS, st.integers(5, 100))
def test_the_orthogonal_factor_projects_and_solves(seed, n):
    rng = np.random.default_rng(seed)
    contacts, _ = packing(seed, n, side=11)
    weight = 10.0 ** rng.uniform(-1, 1, len(contacts))
    factor = factorise(contacts, n, weight)
    matrix = contacts.normal_matrix(n).toarray() * weight[:, None]
    if not len(contacts):
        return
    free = rng.normal(size=len(contacts))
    projected = factor.self_stress(free)
    basis = null_space(matrix.T)
    np.testing.assert_allclose(projected, basis @ (basis.T @ free), atol=1e-11)
    momentum = matrix.T @ free
    np.testing.assert_allclose(factor.least_norm(momentum), free - projected, atol=1e-10)
    np.testing.assert_allclose(matrix @ factor.least_squares(free), free - projected, atol=1e-10)


@given(SEEDS)
def test_intervals_contain_every_admissible_percussion_and_are_attained(seed):
    """Contained: the solver's, the one of least energy, and a mixture. Attained: the ends are those
    of the other linear program, of self-stresses N α with λ + N α ≥ 0 in a dense basis N."""
    contacts, answer = packing(seed)
    rng = np.random.default_rng(seed)
    admissible = Admissible.of(contacts, answer)
    intervals = Intervals(admissible)
    chosen = least_energy(contacts, answer)
    carrying = admissible.carrying()
    assert not chosen[~carrying].any()
    determined = admissible_determinacy(contacts, answer).determined
    size = admissible.scale
    closed = np.flatnonzero(admissible.closed)
    basis = null_space(contacts.select(closed).normal_matrix(25).toarray().T)
    start = admissible.reaction[closed] / size
    for contact in rng.permutation(len(contacts))[:4].tolist():
        weights = np.eye(len(contacts))[contact]
        found = intervals.of(weights)
        assert found.status is not IntervalStatus.UNPROVEN
        assert found.gap <= 1e-8 * size
        assert found.lower <= found.upper + 1e-12 * size
        for reaction in (answer.reaction, chosen, 0.3 * chosen + 0.7 * answer.reaction):
            assert found.lower - 1e-6 * size <= reaction[contact] <= found.upper + 1e-6 * size
        for end, sign in ((found.lower, 1.0), (found.upper, -1.0)) if basis.shape[1] else ():
            other = linprog(
                sign * (weights[closed] @ basis), A_ub=-basis, b_ub=start, bounds=(None, None)
            )
            if other.status == 0:
                assert end == pytest.approx(
                    size * (sign * other.fun + weights[closed] @ start), abs=1e-6 * size
                )
            else:
                assert other.status == 3
                assert end == np.inf
        assert (found.width < 1e-7 * size) == determined[contact]
        assert carrying[contact] == (found.upper > 1e-7 * size)


@given(SEEDS)
def test_certificates_hold_for_other_loads_too(seed):
    """Any λ' ≥ 0 on the closed contacts: lower + lower_velocity·Δ ≤ Σ w λ' ≤ upper +
    upper_velocity·Δ."""
    contacts, answer = packing(seed, n=15, side=4)
    rng = np.random.default_rng(seed)
    admissible = Admissible.of(contacts, answer)
    weights = rng.normal(size=len(contacts))
    found = Intervals(admissible).of(weights)
    matrix = contacts.normal_matrix(15)
    for size in (1e-3, 1.0):
        other = np.where(admissible.closed, rng.exponential(size, len(contacts)), 0.0)
        change = (matrix.T @ (other - admissible.reaction)).reshape(-1, 2)
        value, slack = weights @ other, 1e-8 * (admissible.scale + size)
        if np.isfinite(found.upper):
            assert value <= found.upper + (found.upper_velocity * change).sum() + slack
        if np.isfinite(found.lower):
            assert value >= found.lower + (found.lower_velocity * change).sum() - slack


@given(SEEDS, st.booleans())
def test_least_energy_is_the_least_distance_of_lawson_and_hanson(seed, soft):
    contacts, answer = packing(seed, n=20, side=5)
    rng = np.random.default_rng(seed)
    stiffness = 10.0 ** rng.uniform(-1, 1, len(contacts)) if soft else None
    chosen = least_energy(contacts, answer, stiffness)
    closed = Admissible.of(contacts, answer).closed
    root = np.ones(closed.sum()) if stiffness is None else np.sqrt(stiffness[closed])
    matrix = contacts.select(closed).normal_matrix(20).toarray().T * root
    start = np.linalg.lstsq(
        matrix, matrix @ (Admissible.of(contacts, answer).reaction[closed] / root), rcond=None
    )[0]
    basis = null_space(matrix)
    # min ‖α‖ subject to N α ≥ −start, by the non-negative least squares of its dual
    size = np.abs(start).max(initial=0.0)
    if not size:
        assert not chosen.any()
        return
    system = np.vstack([basis.T, -start[None, :] / size])
    target = np.append(np.zeros(basis.shape[1]), 1.0)
    dual, _ = nnls(system, target)
    rest = system @ dual - target
    least = start - size * basis @ (rest[:-1] / rest[-1])
    np.testing.assert_allclose(chosen[closed], least * root, atol=1e-9 * (least * root).max())
    assert chosen[~closed].max(initial=0) == 0
