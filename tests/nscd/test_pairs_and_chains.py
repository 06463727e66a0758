"""Percussions against closed forms: pairs, chains, dissipation; equal, unequal and extreme
masses."""

import numpy as np
import pytest

from nscd import ContactLaw, Walls, find_contacts, solve
from tests.crowds import disks_at, line


def answer(snapshot, walls=None, **law):
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    found = solve(snapshot, contacts, law=ContactLaw(**law), tolerance=1e-10)
    assert found.status == "solved"
    return found


MASSES = {
    "equal": np.full(10, 75.0),
    "unequal": np.array([50.0, 93, 61, 75, 88, 52, 99, 70, 64, 81]),
    "extreme": np.array([1.0, 1e6, 3.0, 1e5, 10.0, 1e3, 1.0, 1e6, 2.0, 1.0]),
}


@pytest.mark.parametrize("mass", MASSES.values(), ids=MASSES.keys())
def test_free_chain(mass):
    """Paper (5), (6): U = Σm u⁻/Σm and λ(i,i+1) = λ(i−1,i) − m_i (U − u_i⁻)."""
    left = np.linspace(2.0, 0.0, len(mass))
    found = answer(line(mass, left))
    common = (mass @ left) / mass.sum()
    reaction = np.cumsum(mass * (left - common))[:-1]
    np.testing.assert_allclose(found.right_velocity[:, 0], common, atol=1e-10)
    np.testing.assert_allclose(found.reaction, reaction, rtol=1e-10, atol=1e-10 * reaction.max())


@pytest.mark.parametrize("mass", MASSES.values(), ids=MASSES.keys())
def test_chain_against_a_wall(mass):
    """u⁺ = 0 and λ(i,i+1) = Σ_{j≤i} m_j u_j⁻; the last one is the wall's."""
    left = np.full(len(mass), 2.0)
    snapshot = line(mass, left)
    end = snapshot.position[-1, 0] + 0.25
    found = answer(snapshot, Walls(start=[[end, -1]], end=[[end, 1]]))
    np.testing.assert_allclose(found.right_velocity, 0, atol=2e-10)
    np.testing.assert_allclose(found.reaction, np.cumsum(mass * left), rtol=1e-10)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 1e6])
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_pair_restitution(ratio, restitution):
    """Two bodies: p = m_eff (1+e) U, separation velocity e U."""
    snapshot = line([75.0, 75.0 * ratio], [2.0, -1.0])
    found = answer(snapshot, restitution=restitution)
    m_eff = 75 * ratio / (1 + ratio)
    np.testing.assert_allclose(
        found.impulse, [[m_eff * (1 + restitution) * 3.0, 0]], rtol=1e-10, atol=1e-12
    )
    separation = found.right_velocity[1, 0] - found.right_velocity[0, 0]
    np.testing.assert_allclose(separation, 3 * restitution, atol=3e-10)
    assert found.energy_error < 1e-10
    assert found.momentum_error < 1e-12


def test_oblique_pair_only_collides_along_the_normal():
    snapshot = disks_at([[0, 0], [0.4, 0.3]], [[2, 0], [0, 0]])
    found = answer(snapshot)
    np.testing.assert_allclose(found.impulse, [[60 * 0.8, 60 * 0.6]], rtol=1e-10)


@pytest.mark.parametrize(("k", "e"), [(10.0, 0.0), (37.5, 0.0), (75.0, 1 / 3), (375.0, 9 / 11)])
def test_pair_dissipation_is_restitution(k, e):
    """e = max(0, (k − m_eff)/(k + m_eff)), m_eff = 37.5."""
    found = answer(line([75.0, 75.0], [2.0, 0.0]), dissipation=k)
    assert found.right_velocity[1, 0] - found.right_velocity[0, 0] == pytest.approx(2 * e, abs=1e-9)
    assert found.impulse[0, 0] == pytest.approx(37.5 * (1 + e) * 2, rel=1e-10)


def test_four_disks_of_the_paper():
    """Fig. 1: k = 10 with m = 75 is inelastic (λ¹² = 92.5, p¹² = 112.5); with m = 1 it is nearly
    elastic."""
    heavy = answer(line([75.0] * 4, [2.0, 0, 0, 0]), dissipation=10.0)
    assert heavy.reaction[0] == pytest.approx(92.5, rel=1e-10)
    np.testing.assert_allclose(heavy.impulse[:, 0], [112.5, 75, 37.5], rtol=1e-10)
    light = answer(line([1.0] * 4, [2.0, 0, 0, 0]), dissipation=10.0)
    np.testing.assert_allclose(
        light.right_velocity[:, 0], [-0.7907, 0.9302, 0.9302, 0.9302], atol=5e-5
    )


def test_four_disks_open_beyond_three_quarters_of_the_mass():
    """Contact 1–2 opens only for k > 3m/4 = 56.25, not for k > 37.5 as for a pair."""
    for k, opens in ((56.2, False), (56.3, True)):
        found = answer(line([75.0] * 4, [2.0, 0, 0, 0]), dissipation=k)
        assert (found.right_velocity[1, 0] - found.right_velocity[0, 0] > 1e-6) == opens


def test_maintained_contact_can_pull_and_complementarity_cannot():
    """Disks that part: the equality form (2) pulls, the physical one lets go."""
    snapshot = line([75.0] * 3, [0.0, 1.0, 3.0])
    pulling = answer(snapshot, maintained=True)
    np.testing.assert_allclose(pulling.right_velocity[:, 0], 4 / 3, atol=1e-9)
    np.testing.assert_allclose(pulling.reaction, [-100, -125], rtol=1e-9)
    np.testing.assert_allclose(answer(snapshot).reaction, 0, atol=1e-8)


def test_redundant_triangle_against_a_wall_is_solved_and_its_resultants_are_right():
    """Hexagonal block pressed to a wall: λ is not unique, but it is admissible and stops every
    disk."""
    rows = [(0.5 * i + 0.25 * (j % 2), 0.5 * np.sqrt(0.75) * j) for j in range(4) for i in range(5)]
    snapshot = disks_at(rows, [0.0, -2.0])
    walls = Walls(
        start=[[-2, -0.25], [-0.25, -1], [2.5, -1]], end=[[5, -0.25], [-0.25, 3], [2.5, 3]]
    )
    found = answer(snapshot, walls)
    np.testing.assert_allclose(found.right_velocity, 0, atol=1e-9)
    contacts = find_contacts(snapshot, walls, tolerance=1e-9)
    floor = contacts.is_wall & (contacts.second == 0)
    assert found.reaction[floor].sum() == pytest.approx(20 * 75 * 2, rel=1e-9)
    assert found.reaction.min() >= 0


def test_tangential_dissipation_turns_disks_and_keeps_angular_momentum():
    """k_t > 0: the spins take up what the tangential percussion takes from the orbital motion."""
    snapshot = disks_at([[0, 0], [0.4, 0.3]], [[2, 0], [0, 0]], mass=[75, 60])
    found = answer(snapshot, dissipation=0.0, tangential_dissipation=20.0)
    x, m = snapshot.position, snapshot.mass

    def angular(u, w):
        return float((m * (x[:, 0] * u[:, 1] - x[:, 1] * u[:, 0])).sum() + snapshot.inertia @ w)

    assert found.right_spin.min() != 0
    before, after = (
        angular(snapshot.velocity, np.zeros(2)),
        angular(found.right_velocity, found.right_spin),
    )
    assert after == pytest.approx(before, abs=1e-10)
    assert found.energy_change < 0
