"""The script that compares the results of two builds."""

import pytest

from tests.same_numbers import differences

TABLE = {"caption": "Loads", "head": ["wall", "load (N)", "CPU (s)"]}


def section(*rows, **rest):
    return {"tables": [TABLE | {"rows": [list(row) for row in rows]}]} | rest


def test_what_is_added_and_what_time_passes_is_no_changed_number():
    old = section(("left", 3e5, 1.0), words=["10^(-2) of 3,000 N"])
    new = section(("front", 1.0, 2.0), ("left", 3e5, 7.0), words=["10⁻² of 3\u202f000 N"])
    assert list(differences(old, new)) == [".tables.Loads.rows.front: only in the new one"]


def test_an_error_may_move_within_its_own_uncertainty():
    old, new = {"a_error": 0.1, "a_bar": 1e-3}, {"a_error": 0.101, "a_bar": 2e-3}
    assert not list(differences(old, new))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (section(("left", 3e5, 1.0)), section(("left", 3.001e5, 1.0))),
        ({"words": "2 of 3"}, {"words": "2 of 4"}),
        ([{"statement": "s", "verdict": "holds"}], [{"statement": "s", "verdict": "fails"}]),
        ({"a": 1.0}, {}),
        ([1.0], [1.0, 2.0]),
        ({"a_error": 0.1, "a_bar": 1e-3}, {"a_error": 0.103, "a_bar": 1e-3}),
        ({"a_error": 0.1, "a_bar": 1e-3}, {"a_error": 0.1, "a_bar": 0.1}),
    ],
)
def test_what_changed_is_told(old, new):
    assert len(list(differences(old, new))) == 1
