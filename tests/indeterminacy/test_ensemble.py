"""States of an equilibrium: their law sampled, against closed forms; the nearest and the least, against
another solver; bounds with a tolerance, by hand."""

import clarabel
import numpy as np
import pytest
from scipy.sparse import csc_matrix, diags_array, vstack
from scipy.spatial import cKDTree
from scipy.stats import beta, truncexpon, truncnorm, uniform

from benchmarks.problems.families import jammed
from nscd import ContactLaw, solve
from nscd.indeterminacy.ensemble import convergence, ensemble
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import IntervalStatus, WithinTolerance
from nscd.indeterminacy.nearest import least_energy_within, least_tolerance, nearest
from tests.refusals import refusals

LOAD, ANGLE, MU = 3.0, 0.7, 0.4


def grooves(loads):
    """Disks each on a floor between two walls that lean by ANGLE: f_floor + 2 g cos ANGLE = load."""
    n = len(loads)
    side = [np.sin(ANGLE), -np.cos(ANGLE)]
    normal = np.tile([[0, -1], side, [-side[0], side[1]]], (n, 1))
    pairs = np.column_stack([np.repeat(np.arange(n), 3), np.full(3 * n, -1)])
    down = np.column_stack([np.zeros(n), -np.asarray(loads), np.zeros(n)])
    index = 10.0 * np.arange(2 * n).reshape(n, 2)
    return Equilibrium.of_disks(index, np.full(n, 0.5), pairs, down, normal=normal)


def flower():
    """Six disks pressed to a seventh by LOAD: spoke + rim = LOAD."""
    angle = np.pi / 3 * np.arange(6)
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    pairs = [[0, i + 1] for i in range(6)] + [[i + 1, (i + 1) % 6 + 1] for i in range(6)]
    position, load = np.vstack([[0, 0], rim]), np.vstack([[0, 0], -LOAD * rim])
    return Equilibrium.of_disks(position, np.full(7, 0.5), pairs, load)


def law_of(values, law, independent):
    """Whether draws have mean, deviation and quantiles of a law, to four standard errors."""
    error = 4 * law.std() / np.sqrt(independent)
    assert values.mean() == pytest.approx(law.mean(), abs=error)
    assert values.std() == pytest.approx(law.std(), abs=1.5 * error)
    fractions = np.array([0.1, 0.5, 0.9])
    found = law.cdf(np.quantile(values, fractions))
    assert found == pytest.approx(fractions, abs=2 / np.sqrt(independent))


def test_one_redundant_contact_has_a_uniform_law_or_a_truncated_exponential():
    """g in [0, w/(2 cos a)] with density exp(−2 g (1 − cos a)/f): the sum of forces grows with g."""
    maximum = LOAD / (2 * np.cos(ANGLE))
    for scale in (np.inf, 0.2):
        rate = 2 * (1 - np.cos(ANGLE)) / scale
        law = truncexpon(b=rate * maximum, scale=1 / rate) if rate else uniform(0, maximum)
        found = ensemble(grooves([LOAD]), scale, draws=500, seed=3)
        assert found.status == "converged"
        assert found.effective.min() > 400
        floor, side = found.draws[:, :, 0], found.draws[:, :, 1]
        law_of(side.ravel(), law, found.effective[1])
        np.testing.assert_allclose(floor + 2 * np.cos(ANGLE) * side, LOAD, rtol=1e-9)


def test_a_ring_about_a_hub_is_uniform_whatever_the_scale():
    """Its one self-stress leaves the sum of forces as it is."""
    found = ensemble(flower(), 0.1 * LOAD, draws=500)
    law_of(found.draws[:, :, 2].ravel() / LOAD, uniform(), found.effective[2])
    assert found.mean()[:6] + found.mean()[6:] == pytest.approx([LOAD] * 6)
    assert (found.quantile(0.0) >= 0).all()


def test_independent_redundancies_are_independent():
    loads = np.arange(1.0, 9.0)
    found = ensemble(grooves(loads), np.inf, draws=500, seed=1)
    walls = found.draws[:, :, 1::3][:, :, :8].reshape(-1, 8)
    law, worth = uniform(0, loads / (2 * np.cos(ANGLE))), np.sqrt(found.effective[1:24:3])
    assert (np.abs(walls.mean(0) - law.mean()) < 4 * law.std() / worth).all()
    assert (np.abs(np.corrcoef(walls.T) - np.eye(8)) < 4 / worth.min() + 1e-9).all()


def shared(spread=(), **how):
    """The states of six contacts that share a load, held against their law."""
    pairs, normal = np.tile([0, -1], (6, 1)), np.tile([0.0, -1.0], (6, 1))
    equilibrium = Equilibrium.of_disks([[0, 0]], [0.5], pairs, [[0, -LOAD, 0]], normal=normal)
    found = ensemble(equilibrium, LOAD / 6, *spread, **how)
    for row in range(6):
        law_of(found.draws[:, :, row].ravel() / LOAD, beta(1, 5), found.effective[row])
    return found


def test_six_contacts_that_share_a_load_have_the_law_of_a_simplex():
    """Even on {f ≥ 0, Σ f = L}: each f/L has a beta law of 1 and 5, any two correlate by −1/5."""
    found = shared(draws=500, seed=2)
    both = np.corrcoef(found.draws[:, :, :6].reshape(-1, 6).T)
    np.testing.assert_allclose(both[~np.eye(6, dtype=bool)], -1 / 5, atol=0.1)


def squeezed(load=LOAD):
    """A disk that friction alone holds between two walls: f_t = load/2, f_n ≥ load/(2 μ)."""
    how = {"normal": [[-1, 0], [1, 0]], "friction": MU}
    return Equilibrium.of_disks([[0, 0]], [0.5], [[0, -1], [0, -1]], [[0, -load, 0]], **how)


def test_what_friction_holds_between_two_walls_has_a_shifted_exponential():
    found = ensemble(squeezed(), 0.5, draws=500)
    law = truncexpon(b=1e3, loc=LOAD / (2 * MU), scale=0.5 / 2)
    law_of(found.draws[:, :, 0].ravel(), law, found.effective[0])
    np.testing.assert_allclose(found.mean(tangential=True), [LOAD / 2, -LOAD / 2], rtol=1e-9)


def test_an_open_balance_has_a_truncated_normal():
    """One disk pressed to a wall, its balance open by s: exp(−x/f − (L − x)²/2s²) on x ≥ 0."""
    f, s = 2.0, 2.5
    equilibrium = Equilibrium.of_disks([[0, 0]], [0.5], [[0, -1]], [[1.0, 0, 0]], normal=[[1, 0]])
    found = ensemble(equilibrium, f, [[s, np.inf, np.inf]], draws=1000)
    middle = 1.0 - s**2 / f
    law = truncnorm(-middle / s, np.inf, loc=middle, scale=s)
    law_of(found.draws[:, :, 0].ravel(), law, found.effective[0])
    again = ensemble(equilibrium, f, [[s, np.inf, np.inf]], draws=1000)
    assert np.array_equal(found.draws, again.draws)


def test_convergence_is_that_of_chains_with_memory():
    """n draws of x' = ρ x + noise are worth n (1 − ρ)/(1 + ρ); chains about other means differ."""
    rng, rho = np.random.default_rng(0), 0.8
    x = np.zeros((4, 4000, 2))
    noise = rng.normal(size=x.shape)
    for i in range(1, 4000):
        x[:, i] = rho * x[:, i - 1] + noise[:, i]
    x[:, :, 1] += 3.0 * np.arange(4)[:, None]
    r_hat, effective = convergence(x, 0.0)
    assert effective[0] == pytest.approx(16000 * (1 - rho) / (1 + rho), rel=0.2)
    assert r_hat[0] < 1.01
    assert r_hat[1] > 2
    assert effective[1] < 20
    assert convergence(np.ones((4, 10, 1)), 1e-9)[0] == [1.0]


def packing(mu, seed=0, n=40):
    """Disks that touch, under random loads at the rim."""
    rng = np.random.default_rng(seed)
    index = np.array([[i + 0.5 * (j % 2), j * np.sqrt(0.75)] for j in range(9) for i in range(9)])
    index = index[rng.permutation(81)[:n]] + rng.normal(scale=0.02, size=(n, 2))
    pairs = cKDTree(index).query_pairs(1.1, output_type="ndarray")
    load = np.column_stack([*(0.4 * rng.normal(size=(2, n))), 0.02 * rng.normal(size=n)])
    equilibrium = Equilibrium.of_disks(index, np.full(n, 0.5), pairs, load, friction=mu)
    return equilibrium, rng.exponential(1.0, len(pairs)), rng.uniform(0.1, 0.5, len(pairs))


def minimum(square, linear, rows, right, equal=0):
    """x of least ½ x·square·x + linear·x, the first rows·x equal to right, the others at most, by Clarabel."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    cones = [clarabel.ZeroConeT(equal), clarabel.NonnegativeConeT(len(right) - equal)]
    values = csc_matrix(square), linear, csc_matrix(rows), right
    return np.array(clarabel.DefaultSolver(*values, cones, settings).solve().x)


def other_solver(constrained, weights, wanted, tolerance):
    """f (2k,) of least Σ weights (f − wanted)² in the cones by Clarabel, with E f from the geometry."""
    c, n, k = constrained.contacts, constrained.bodies, len(constrained.contacts)
    balance = np.zeros((3 * n, 2 * k))
    mu = np.zeros(k)
    np.maximum.at(mu, constrained.contact, constrained.along)
    for row in range(k):
        i, j, (x, y) = c.first[row], c.second[row], c.normal[row]
        for body, sign in ((i, 1.0), (j, -1.0)):
            balance[3 * body : 3 * body + 2, row] = sign * x, sign * y
            balance[3 * body : 3 * body + 2, k + row] = -sign * y, sign * x
            balance[3 * body + 2, k + row] = 1.0
    rub, one = np.diag(mu), np.eye(k)
    cone = np.block([[rub, one], [rub, -one], [one, np.zeros((k, k))]])
    finite = np.isfinite(tolerance)
    rows = np.vstack([balance[finite], -balance[finite], -cone])
    load, maximum = constrained.load[finite], tolerance[finite]
    right = np.concatenate([load + maximum, maximum - load, np.zeros(3 * k)])
    return minimum(diags_array(weights), -weights * wanted, rows, right)


@pytest.mark.parametrize("mu", [0.0, 0.3, 2.0])
def test_the_nearest_state_is_that_of_another_solver(mu):
    constrained, force, sigma = packing(mu)
    k, free = len(force), np.arange(40) < 8
    tolerance = np.where(free, np.inf, least_tolerance(constrained, np.where(free, np.inf, 0.0)) + 0.05)
    found = nearest(constrained, force, sigma, tolerance)
    weights, wanted = np.tile(1 / sigma**2, 2), np.append(force, np.zeros(k))
    other = other_solver(constrained, weights, wanted, np.repeat(tolerance, 3))
    assert found.status == "solved"
    np.testing.assert_allclose(np.append(found.normal, found.tangential), other, atol=3e-5)
    assert found.distance == pytest.approx(np.sqrt((weights * (other - wanted) ** 2).sum() / k))
    net = constrained.net(found.normal, found.tangential)
    assert (np.abs(net) <= tolerance[:, None] * (1 + 1e-6)).all()
    less = np.where(free, np.inf, tolerance - 0.06)
    if np.all(less >= 0):
        with pytest.raises(ValueError, match=r"tolerance: no state is within it. 0\.01 N more"):
            nearest(constrained, force, sigma, less)


def of_jam(people, **law):
    """The contacts of a jam, and their percussions."""
    crowd = jammed(people, 2)
    how = {"left_velocity": crowd.left_velocity, "tolerance": 1e-9}
    return crowd.contacts, solve(crowd.snapshot, crowd.contacts, **how, **law)


def test_canonical_percussions_with_friction_are_those_of_another_solver():
    """Of a jam at μ = 0.3: least λ² + τ²/ratio in the cones, with the impulses of the answer."""
    contacts, solution = of_jam(40, law=ContactLaw(friction=0.3))
    found = least_energy_within(Equilibrium.of_answer(contacts, solution))
    equilibrium = Equilibrium.with_friction(contacts, solution)
    k, u, scale = len(contacts), len(equilibrium.contact), equilibrium.scale
    every = np.zeros((2 * k, u))
    every[equilibrium.contact, np.arange(u)] = 1.0
    every[k + equilibrium.contact, np.arange(u)] = equilibrium.along
    weights = np.append(np.ones(k), np.full(k, 3.5))
    square, rows = every.T @ np.diag(weights) @ every, vstack([equilibrium.matrix.T, -np.eye(u)])
    right = np.append(equilibrium.matrix.T @ equilibrium.point / scale, np.zeros(u))
    expected = every @ minimum(square, np.zeros(u), rows, right, equilibrium.matrix.shape[1]) * scale
    both = np.append(found.normal, found.tangential)
    np.testing.assert_allclose(both, expected, atol=1e-5 * scale)
    values = np.append(solution.reaction, solution.friction.tangential)
    assert weights @ both**2 < 0.99 * (weights @ values**2)


def test_with_a_tolerance_bounds_of_a_chain_widen_by_it_for_each_body():
    """Between loads P at its ends a chain carries P; each body may take t of it: the nearer end
    decides."""
    n, t = 6, 0.1
    load = np.zeros((n, 3))
    load[[0, -1], 0] = LOAD, -LOAD
    pairs = [[i, i + 1] for i in range(n - 1)]
    index = np.column_stack([np.arange(n), np.zeros(n)])
    equilibrium = Equilibrium.of_disks(index, np.full(n, 0.5), pairs, load)
    found = [WithinTolerance(equilibrium, t).of(row) for row in np.eye(n - 1)]
    bodies = np.array([1, 2, 3, 2, 1])
    assert [one.upper - LOAD for one in found] == pytest.approx(bodies * t, abs=1e-9)
    assert [one.lower - LOAD for one in found] == pytest.approx(-bodies * t, abs=1e-9)
    assert {one.status for one in found} == {IntervalStatus.PROVEN}
    # with one end free only the way to the other counts
    free = WithinTolerance(equilibrium, [np.inf, t, t, t, t, t]).of(np.eye(n - 1)[0])
    assert (free.lower, free.upper) == pytest.approx((LOAD - 5 * t, LOAD + 5 * t))
    equilibrium = squeezed()
    span = WithinTolerance(equilibrium, t)
    assert span.of([1, 0]).lower == pytest.approx((LOAD - t) / (2 * MU) - t / 2, abs=1e-8)
    assert span.of([1, 0]).status is IntervalStatus.UNBOUNDED
    assert span.of([1, 0], tangential=True).upper == pytest.approx(LOAD / 2 + t, abs=1e-8)


def test_least_energy_with_open_balances_shares_a_load_by_its_price():
    """One disk pressed to a wall: f²  + (L/s)² (f̄)²… least at f = L p/(1 + p), p the price."""
    load = [[LOAD, 0, 0], [-LOAD, 0, 0]]
    equilibrium = Equilibrium.of_disks([[0, 0], [1, 0]], [0.5, 0.5], [[0, 1]], load)
    spread = 0.5 * LOAD
    cost = 2 * (equilibrium.virial / spread) ** 2  # two bodies
    found = least_energy_within(equilibrium, spread=spread)
    assert equilibrium.virial == pytest.approx(LOAD)
    assert found.normal == pytest.approx([LOAD * cost / (1 + cost)])


test_bad_input_has_a_clear_message = refusals(
    (lambda: Equilibrium.of_disks([[0, 0]], [1], [[0, 1]], [[0, 0, 0]]), "pairs: a disk that does"),
    (lambda: Equilibrium.of_disks([[0, 0]], [1], [[0, -1]], [[0, 0]]), "normal: that of a wall"),
    (lambda: least_energy_within(grooves([1]), spread=1), "load: virial nan N"),
    (lambda: nearest(flower(), np.ones(12), np.zeros(12), 0), "sigma: 0 N at contact 0"),
    (lambda: nearest(flower(), np.ones(12), np.ones(12), [1, 2]), "tolerance: shape"),
    (lambda: ensemble(flower(), 0.0), "scale: 0.0. A force > 0"),
    (lambda: ensemble(flower(), 1.0, -1.0), "spread: numbers ≥ 0"),
    (lambda: ensemble(squeezed(), np.inf), "scale: an even law has no end"),
    (lambda: ensemble(grooves([-LOAD]), 1.0), "load: no forces that push balance it"),
)


def test_stiff_balances_are_sampled_with_few_sweeps():
    """Six contacts share a load but for 2 % of it: draws alone step by so much and do not converge in
    8,000 sweeps."""
    found = shared([0.02 * LOAD], draws=500, most_sweeps=8000, seed=1)
    assert found.status == "converged"


def test_least_energy_of_a_deep_jam_is_that_of_the_solver():
    """Its reactions add up to 34 times the load of a disk; the solver's are those of least norm."""
    contacts, solution = of_jam(600)
    equilibrium = Equilibrium.of_answer(contacts, solution)
    found = least_energy_within(equilibrium)
    assert solution.canonical
    assert found.status == "solved"
    largest = solution.reaction.max()
    assert largest > 30 * np.abs(equilibrium.load).max()
    np.testing.assert_allclose(found.normal, solution.reaction, atol=1e-6 * largest)
