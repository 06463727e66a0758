"""What an answer says of itself: in a line, as a table, as forces, as a picture."""

import numpy as np
import pytest

from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve


def answer(law=None):
    """A disk of 75 kg at 2 m/s against another one, that stands at a wall."""
    snapshot = Snapshot(
        position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25] * 2, mass=[75] * 2,
        ids=[7, 9],
    )  # fmt: skip
    contacts = find_contacts(snapshot, Walls(start=[[0.75, -1]], end=[[0.75, 1]]), tolerance=0.0)
    return solve(snapshot, contacts, law=law)


def test_an_answer_is_said_in_a_line():
    assert repr(answer()).startswith(
        "<Percussions: 2 disks, 2 contacts, largest 150 N·s, solved, residual "
    )
    assert "largest 300 N," in repr(answer().over(0.5))


def test_the_percussion_is_the_impulse_and_the_reaction_a_part_of_it():
    """In a rebound dissipation alone parts the disks: nothing is left for the reaction."""
    pair = Snapshot(
        position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25] * 2, mass=[75] * 2
    )
    contacts = find_contacts(pair, tolerance=0.0)
    found = solve(pair, contacts, law=ContactLaw(restitution=0.5))
    np.testing.assert_allclose(found.impulse, [[112.5, 0]])
    assert found.reaction.tolist() == [0.0]
    inelastic = solve(pair, contacts)
    np.testing.assert_allclose(inelastic.impulse, [[75, 0]])
    np.testing.assert_allclose(inelastic.reaction, [75])


def test_forces_are_percussions_over_a_window():
    found = answer()
    with pytest.raises(ValueError, match="force: an impact has percussions"):
        _ = found.force
    np.testing.assert_allclose(found.over(0.5).force, [[300, 0], [300, 0]])
    for window in (0.0, -1.0, np.nan, "1"):
        with pytest.raises(ValueError, match=r"^window: "):
            found.over(window)


def test_an_answer_is_a_table():
    table = answer().over(0.5).to_dataframe()
    assert list(table) == [
        "first", "second", "is_wall", "nx", "ny", "gap_m", "reaction_Ns", "impulse_x_Ns", "impulse_y_Ns",
        "force_x_N", "force_y_N", "force_N",
    ]  # fmt: skip
    assert table[["first", "second", "is_wall"]].to_numpy().tolist() == [[7, 9, 0], [9, 1, 1]]
    np.testing.assert_allclose(table["impulse_x_Ns"], 150)
    assert "force_x_N" not in answer().to_dataframe()
    assert "<table" in answer()._repr_html_()


def test_an_answer_is_a_picture():
    axes = answer().plot()
    assert axes.figure.axes[1].get_ylabel() == "percussion (N·s)"
    lines = axes.collections[1]
    np.testing.assert_allclose(lines.get_array(), 150)
    assert answer().over(0.5).plot().figure.axes[1].get_ylabel() == "contact force (N)"
