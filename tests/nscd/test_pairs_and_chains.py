"""Percussions against closed forms: pairs, chains, dissipation; equal, unequal and extreme masses.
Dissipation pushes and never pulls: p_n = k_n max(C(u⁺ + u⁻), 0) + λ, against closed forms,
exact arithmetic and the law itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.studies.work_precision.window import rigid_reference
from benchmarks.problems.families import masses
from nscd import ContactLaw, Walls, _core, find_contacts, solve
from tests.crowds import disks_at, line, part_of_a_lattice, solved, wall_after
from tests.nscd.exact import exact_velocity


def solution_of(snapshot, walls=None, **law):
    return solved(snapshot, walls, **law)[1]


MASSES = {
    "equal": np.full(10, 75.0),
    "unequal": np.array([50.0, 93, 61, 75, 88, 52, 99, 70, 64, 81]),
    "extreme": np.array([1.0, 1e6, 3.0, 1e5, 10.0, 1e3, 1.0, 1e6, 2.0, 1.0]),
}


@pytest.mark.parametrize("mass", MASSES.values(), ids=MASSES.keys())
def test_free_chain(mass):
    """Paper (5), (6): U = Σm u⁻/Σm and λ(i,i+1) = λ(i−1,i) − m_i (U − u_i⁻)."""
    left = np.linspace(2.0, 0.0, len(mass))
    found = solution_of(line(mass, left))
    common = (mass @ left) / mass.sum()
    reaction = np.cumsum(mass * (left - common))[:-1]
    np.testing.assert_allclose(found.right_velocity[:, 0], common, atol=1e-10)
    np.testing.assert_allclose(found.reaction, reaction, rtol=1e-10, atol=1e-10 * reaction.max())


@pytest.mark.parametrize("mass", MASSES.values(), ids=MASSES.keys())
def test_chain_against_a_wall(mass):
    """u⁺ = 0 and λ(i,i+1) = Σ_{j≤i} m_j u_j⁻; the last one is the wall's."""
    left = np.full(len(mass), 2.0)
    snapshot = line(mass, left)
    found = solution_of(snapshot, wall_after(snapshot))
    np.testing.assert_allclose(found.right_velocity, 0, atol=2e-10)
    np.testing.assert_allclose(found.reaction, np.cumsum(mass * left), rtol=1e-10)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 1e6])
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_pair_restitution(ratio, restitution):
    """Two bodies: p = m_eff (1+e) U, separation velocity e U."""
    snapshot = line([75.0, 75.0 * ratio], [2.0, -1.0])
    found = solution_of(snapshot, restitution=restitution)
    m_eff = 75 * ratio / (1 + ratio)
    wanted = [[m_eff * (1 + restitution) * 3.0, 0]]
    np.testing.assert_allclose(found.impulse, wanted, rtol=1e-10, atol=1e-12)
    separation = found.right_velocity[1, 0] - found.right_velocity[0, 0]
    np.testing.assert_allclose(separation, 3 * restitution, atol=3e-10)
    assert found.energy_error < 1e-10
    assert found.momentum_error < 1e-12


def test_oblique_pair_only_collides_along_the_normal():
    snapshot = disks_at([[0, 0], [0.4, 0.3]], [[2, 0], [0, 0]])
    found = solution_of(snapshot)
    np.testing.assert_allclose(found.impulse, [[60 * 0.8, 60 * 0.6]], rtol=1e-10)


@pytest.mark.parametrize(("k", "e"), [(10.0, 0.0), (37.5, 0.0), (75.0, 1 / 3), (375.0, 9 / 11)])
def test_pair_dissipation_is_restitution(k, e):
    """e = max(0, (k − m_eff)/(k + m_eff)), m_eff = 37.5."""
    found = solution_of(line([75.0, 75.0], [2.0, 0.0]), dissipation=k)
    assert found.right_velocity[1, 0] - found.right_velocity[0, 0] == pytest.approx(2 * e, abs=1e-9)
    assert found.impulse[0, 0] == pytest.approx(37.5 * (1 + e) * 2, rel=1e-10)


def test_four_disks_of_the_paper():
    """Fig. 1: k = 10 with m = 75 is inelastic (λ¹² = 92.5, p¹² = 112.5), with m = 1 nearly elastic."""
    heavy = solution_of(line([75.0] * 4, [2.0, 0, 0, 0]), dissipation=10.0)
    assert heavy.reaction[0] == pytest.approx(92.5, rel=1e-10)
    np.testing.assert_allclose(heavy.impulse[:, 0], [112.5, 75, 37.5], rtol=1e-10)
    light = solution_of(line([1.0] * 4, [2.0, 0, 0, 0]), dissipation=10.0)
    wanted = [-0.7907, 0.9302, 0.9302, 0.9302]
    np.testing.assert_allclose(light.right_velocity[:, 0], wanted, atol=5e-5)


def test_four_disks_open_beyond_three_quarters_of_the_mass():
    """Contact 1–2 opens only for k > 3m/4 = 56.25, not for k > 37.5 as for a pair."""
    for k, opens in ((56.2, False), (56.3, True)):
        found = solution_of(line([75.0] * 4, [2.0, 0, 0, 0]), dissipation=k)
        assert (found.right_velocity[1, 0] - found.right_velocity[0, 0] > 1e-6) == opens


def test_maintained_contact_can_pull_and_complementarity_cannot():
    """Disks that part: the equality form (2) pulls, the physical one lets go."""
    snapshot = line([75.0] * 3, [0.0, 1.0, 3.0])
    pulling = solution_of(snapshot, maintained=True)
    np.testing.assert_allclose(pulling.right_velocity[:, 0], 4 / 3, atol=1e-9)
    np.testing.assert_allclose(pulling.reaction, [-100, -125], rtol=1e-9)
    np.testing.assert_allclose(solution_of(snapshot).reaction, 0, atol=1e-8)


def test_redundant_triangle_against_a_wall_is_solved_and_its_resultants_are_right():
    """Hexagonal block pressed to a wall: λ is not unique, but admissible, and stops every disk."""
    rows = [(0.5 * i + 0.25 * (j % 2), 0.5 * np.sqrt(0.75) * j) for j in range(4) for i in range(5)]
    snapshot = disks_at(rows, [0.0, -2.0])
    start, end = [[-2, -0.25], [-0.25, -1], [2.5, -1]], [[5, -0.25], [-0.25, 3], [2.5, 3]]
    contacts, found = solved(snapshot, Walls(start=start, end=end))
    np.testing.assert_allclose(found.right_velocity, 0, atol=1e-9)
    floor = contacts.is_wall & (contacts.second == 0)
    assert found.reaction[floor].sum() == pytest.approx(20 * 75 * 2, rel=1e-9)
    assert found.reaction.min() >= 0


def test_tangential_dissipation_turns_disks_and_keeps_angular_momentum():
    """k_t > 0: the spins take up what the tangential percussion takes from the orbital motion."""
    snapshot = disks_at([[0, 0], [0.4, 0.3]], [[2, 0], [0, 0]], mass=[75, 60])
    found = solution_of(snapshot, dissipation=0.0, tangential_dissipation=20.0)
    x, m = snapshot.position, snapshot.mass

    def angular(u, w):
        return float((m * (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])).sum() + snapshot.inertia @ w)

    assert found.right_spin.min() != 0
    before = angular(snapshot.velocity, np.zeros(2))
    assert angular(found.right_velocity, found.right_spin) == pytest.approx(before, abs=1e-10)
    assert found.energy_change < 0


FLOOR = Walls(start=[[-5.0, -0.25]], end=[[9.0, -0.25]])
PARTING = [
    {"dissipation": 100.0},
    {"restitution": 0.5},
    {"restitution": 0.5, "tangential_dissipation": 20.0},
    {"restitution": 0.99, "friction": 0.3},
    {"tangential_dissipation": 20.0},
]
ROUNDING = 1e-9


@pytest.mark.parametrize("law", PARTING, ids=lambda law: " ".join(law))
def test_those_who_part_are_left_alone(law):
    """Two who walk apart, sliding past each other; one who walks off a wall."""
    pair = disks_at([[0, 0], [0.5, 0]], [[-1.0, 0.3], [1.0, -0.4]])
    _, found = solved(pair, **law)
    assert np.array_equal(found.impulse, [[0, 0]])
    assert np.array_equal(found.right_velocity, pair.velocity)
    assert np.array_equal(found.right_spin, [0, 0])
    leaving = disks_at([[0, 0]], [[0.5, 2.0]])
    _, found = solved(leaving, FLOOR, **law)
    assert np.array_equal(found.impulse, [[0, 0]])
    assert np.array_equal(found.right_velocity, leaving.velocity)


@pytest.mark.parametrize("restitution", [0.3, 0.9])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_who_is_knocked_away_is_not_pulled_back(restitution, friction):
    """A hits B head on; C, behind B's shoulder, approaches B slowly. B leaves faster than C came: A
    and B rebound as a pair, C goes on as it was."""
    turn = np.radians(110.0)
    towards = np.array([np.cos(turn), np.sin(turn)])
    anchor, velocity = [[-0.5, 0], [0, 0], 0.5 * towards], [[2.0, 0], [0, 0], -0.05 * towards]
    start = disks_at(anchor, velocity, mass=[60.0, 90.0, 75.0])
    contacts, found = solved(start, restitution=restitution, friction=friction)
    closing = contacts.approach_velocity(start.velocity)
    assert closing == pytest.approx([2.0, 0.05])
    p = (1 + restitution) * 36.0 * 2.0
    np.testing.assert_allclose(found.impulse, [[p, 0], [0, 0]], atol=1e-6)
    np.testing.assert_allclose(found.right_velocity[:, 0], [2 - p / 60, p / 90, -0.05 * towards[0]])
    assert not found.warnings


def test_energy_can_grow_where_a_contact_that_opens_is_caught_up_with():
    """u₁⁻ = 1, u₂⁻ = 0, u₃⁻ = v, contact 1–2 nearly elastic: 2 and 3 go on together at s = (2 +
    v)/3, and the energy has grown by m v(1 − v)/3."""
    v = 0.4
    row = disks_at([[0, 0], [0.5, 0], [1.0, 0]], [[1.0, 0], [0, 0], [v, 0]])
    _, found = solved(row, restitution=1 - 1e-5)
    s = (2 + v) / 3
    np.testing.assert_allclose(found.right_velocity[:, 0], [s - 1, s, s], rtol=1e-4)
    assert found.energy_change == pytest.approx(75 * v * (1 - v) / 3, rel=1e-4)
    assert found.energy_error < 1e-9
    (warning,) = found.warnings
    assert "energy grew by 6 J" in warning


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("restitution", [0.2, 0.9])
def test_the_answer_is_that_of_exact_arithmetic(seed, restitution):
    snapshot = part_of_a_lattice(seed, 9, 0.6)
    law = ContactLaw(restitution=restitution)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    k, _ = law.coefficients(contacts.inverse_mass(snapshot.mass))
    exact = exact_velocity(snapshot, contacts, snapshot.velocity, k).astype(float)
    found = solve(snapshot, contacts, law=law)
    assert np.abs(found.right_velocity - exact).max() < 1e-9
    reference = rigid_reference(snapshot, contacts, snapshot.velocity, law)
    error = np.sqrt((snapshot.mass[:, None] * (reference.right_velocity - exact) ** 2).sum())
    assert error <= reference.bound < 1e-5


@settings(max_examples=25)
@given(
    st.integers(0, 10**6), st.integers(2, 40), st.sampled_from([0.0, 0.5, 0.99]),
    st.sampled_from([None, 30.0]), st.sampled_from([0.0, 0.4]),
)  # fmt: skip
def test_no_contact_pulls_and_the_law_holds(seed, n, restitution, across, friction):
    snapshot = part_of_a_lattice(seed, n, 0.6)
    law = ContactLaw(restitution=restitution, tangential_dissipation=across, friction=friction)
    contacts = find_contacts(snapshot, FLOOR, tolerance=1e-9)
    found = solve(snapshot, contacts, law=law)
    assert found.status == "solved"
    along = (found.impulse * contacts.normal).sum(1)
    k, _ = law.coefficients(contacts.inverse_mass(snapshot.mass))
    before, after = map(contacts.approach_velocity, (snapshot.velocity, found.right_velocity))
    size = ROUNDING * k.max(initial=1.0)
    assert along.min(initial=0.0) >= -size
    np.testing.assert_allclose(along, found.reaction + k * np.maximum(before + after, 0), atol=size)
    opening = (before < 0) & (found.reaction <= 0)
    assert not found.impulse[opening].any()


def test_signs_that_nobody_can_know_do_not_change_for_ever(monkeypatch):
    """Masses of 75 g to 75 t: some C(u⁺ + u⁻) is 0 to rounding, and k_n would act and not act. Of
    these 40 crowds a dozen took all 60 rounds; which ones is chance."""
    result, before = [], _core.solve_impact
    listened = lambda *a, **b: result.append(before(*a, **b)) or result[-1]  # noqa: E731
    monkeypatch.setattr(_core, "solve_impact", listened)
    for seed in range(1, 41):
        case = masses(60, seed)
        how = {"law": ContactLaw(restitution=0.7), "tolerance": 1e-10}
        found = solve(case.snapshot, case.contacts, left_velocity=case.left_velocity, **how)
        assert result[-1].rounds <= 10, seed
        assert found.status == "solved", seed
        assert found.residual < 1e-10, seed
