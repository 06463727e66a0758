"""Laws that percussions obey whatever the crowd: balance, admissibility, invariance. What an answer
says of itself: in a line, as a table, as forces, as a picture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscd import ContactLaw, Walls, find_contacts, solve
from tests.crowds import WALLS, disks_at, lattice, line, solved, turn, turned, wall_after


@given(st.integers(0, 10**6))
def test_balance_energy_and_complementarity(seed):
    snapshot = lattice(seed, decades=4.0)
    contacts, solution = solved(snapshot, WALLS)
    momentum = snapshot.mass[:, None] * (solution.right_velocity - snapshot.velocity)
    size = snapshot.mass * np.abs(snapshot.velocity).max() + np.abs(solution.reaction).sum()
    missed = np.abs(momentum - contacts.momentum_change(solution.impulse, len(snapshot)))
    assert (missed.max(1) < 1e-9 * size).all()
    assert solution.energy_change <= 1e-12
    assert solution.reaction.min() >= 0
    approach = contacts.approach_velocity(solution.right_velocity)
    assert approach.max() < 1e-9
    pressed = solution.reaction * contacts.inverse_mass(snapshot.mass)
    assert (np.minimum(pressed, -approach) < 1e-9).all()


@given(st.integers(0, 10**6), st.floats(0, 2 * np.pi))
def test_rotation_turns_the_answer(seed, angle):
    snapshot = lattice(seed, decades=4.0)
    by = turn(angle)
    walls = Walls(start=WALLS.start @ by.T, end=WALLS.end @ by.T)
    (one, a), (two, b) = solved(snapshot, WALLS), solved(turned(snapshot, by), walls)
    assert len(one) == len(two)
    np.testing.assert_allclose(b.right_velocity, a.right_velocity @ by.T, atol=1e-8)


@given(st.integers(0, 10**6))
def test_order_of_disks_does_not_matter(seed):
    snapshot = lattice(seed, decades=4.0)
    order = np.random.default_rng(seed + 1).permutation(len(snapshot))
    parts = snapshot.position, snapshot.velocity, snapshot.radius, snapshot.mass
    a, b = solved(snapshot, WALLS)[1], solved(disks_at(*(one[order] for one in parts)), WALLS)[1]
    np.testing.assert_allclose(b.right_velocity, a.right_velocity[order], atol=1e-8)


@given(st.integers(0, 10**6), st.sampled_from([1e-3, 1e3]), st.sampled_from([1e-2, 1e2]))
def test_units_scale_the_answer(seed, mass_scale, velocity_scale):
    snapshot = lattice(seed, decades=4.0)
    velocity, mass = velocity_scale * snapshot.velocity, mass_scale * snapshot.mass
    scaled = disks_at(snapshot.position, velocity, snapshot.radius, mass)
    a, b = solved(snapshot, WALLS)[1], solved(scaled, WALLS)[1]
    wanted = velocity_scale * a.right_velocity
    np.testing.assert_allclose(b.right_velocity, wanted, atol=1e-8 * velocity_scale)


def solution_of(law=None):
    """A disk of 75 kg at 2 m/s against another one, that stands at a wall."""
    snapshot = disks_at([[0, 0], [0.5, 0]], [[2, 0], [0, 0]], ids=[7, 9])
    return solve(snapshot, find_contacts(snapshot, wall_after(snapshot), tolerance=0.0), law=law)


def test_an_answer_is_said_in_a_line():
    words = "<Percussions: 2 disks, 2 contacts, largest 150 N·s, solved, residual "
    assert repr(solution_of()).startswith(words)
    assert "largest 300 N," in repr(solution_of().over(0.5))


def test_the_percussion_is_the_impulse_and_the_reaction_a_part_of_it():
    """In a rebound dissipation alone parts the disks: nothing is left for the reaction."""
    pair = line([75, 75], [2, 0])
    contacts = find_contacts(pair, tolerance=0.0)
    found = solve(pair, contacts, law=ContactLaw(restitution=0.5))
    np.testing.assert_allclose(found.impulse, [[112.5, 0]])
    assert found.reaction.tolist() == [0.0]
    inelastic = solve(pair, contacts)
    np.testing.assert_allclose(inelastic.impulse, [[75, 0]])
    np.testing.assert_allclose(inelastic.reaction, [75])


def test_forces_are_percussions_over_a_window():
    found = solution_of()
    with pytest.raises(ValueError, match="force: an impact has percussions"):
        _ = found.force
    np.testing.assert_allclose(found.over(0.5).force, [[300, 0], [300, 0]])
    for window in (0.0, -1.0, np.nan, "1"):
        with pytest.raises(ValueError, match=r"^window: "):
            found.over(window)


def test_an_answer_is_a_table():
    table = solution_of().over(0.5).to_dataframe()
    assert list(table) == [
        "first", "second", "is_wall", "nx", "ny", "gap_m", "reaction_Ns", "impulse_x_Ns", "impulse_y_Ns",
        "force_x_N", "force_y_N", "force_N",
    ]  # fmt: skip
    assert table[["first", "second", "is_wall"]].to_numpy().tolist() == [[7, 9, 0], [9, 1, 1]]
    np.testing.assert_allclose(table["impulse_x_Ns"], 150)
    assert "force_x_N" not in solution_of().to_dataframe()
    assert "<table" in solution_of()._repr_html_()


def test_an_answer_is_a_picture():
    axes = solution_of().plot()
    assert axes.figure.axes[1].get_ylabel() == "percussion (N·s)"
    lines = axes.collections[1]
    np.testing.assert_allclose(lines.get_array(), 150)
    assert solution_of().over(0.5).plot().figure.axes[1].get_ylabel() == "contact force (N)"
