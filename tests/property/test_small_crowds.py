"""Small crowds are solved in one compiled call, with the answer of the ladder."""

import dataclasses
import importlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve
from nscd.solvers import at_once
from nscd.solvers.small import solve_small

SOLVING = importlib.import_module("nscd.solve")
WALLS = Walls(start=[[-1, -0.25]], end=[[9, -0.25]])


def crowd(seed, n, kept, decades=0.0):
    """A triangular lattice of which a share is kept: pairs, chains, rings and jams."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(n / kept)))
    sites = np.array(
        [
            [0.5 * i + 0.25 * (j % 2), 0.25 * np.sqrt(3) * j]
            for i in range(side)
            for j in range(side)
        ]
    )
    chosen = rng.permutation(len(sites))[:n]
    return Snapshot(
        position=sites[chosen],
        velocity=rng.normal(size=(n, 2)),
        radius=np.full(n, 0.25),
        mass=60.0 * 10.0 ** rng.uniform(-decades, decades, n),
    )


def by_ladder(snapshot, contacts, tolerance, **search):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SOLVING, "solve_small", lambda *_: None)
        return solve(snapshot, contacts, tolerance=tolerance, **search)


@settings(max_examples=40)
@given(
    st.integers(0, 10**6), st.integers(2, 40), st.floats(0.15, 1.0), st.floats(0.0, 2.0),
    st.booleans(),
)  # fmt: skip
def test_the_answer_is_that_of_the_ladder(seed, n, kept, decades, canonical):
    snapshot = crowd(seed, n, kept, decades)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found = solve(snapshot, contacts, tolerance=1e-10, canonical=canonical)
    other = by_ladder(snapshot, contacts, 1e-10, canonical=canonical)
    same = ("status", "solver", "choice", "canonical", "iterations", "warnings")
    assert [getattr(found, name) for name in same] == [getattr(other, name) for name in same]
    for name in ("right_velocity", "reaction", "impulse", "energy_change", "energy_error"):
        size = np.abs(getattr(other, name)).max(initial=1.0)
        np.testing.assert_allclose(getattr(found, name), getattr(other, name), atol=1e-11 * size)
    assert found.residual == pytest.approx(other.residual, rel=1e-6, abs=1e-15)
    assert found.momentum_error == pytest.approx(other.momentum_error, rel=1e-6, abs=1e-15)
    assert found.velocity_error == pytest.approx(other.velocity_error, rel=0.1, abs=1e-15)


@pytest.mark.parametrize(
    ("n", "kept", "decades", "rung", "solver"),
    [
        (12, 0.2, 0.0, at_once.TREES, "tree"),
        (64, 0.6, 0.0, at_once.DESCENT, "active_set"),
        (64, 0.85, 0.0, at_once.MARGINAL, "interior_point"),
        (64, 0.85, 2.0, at_once.UNEVEN, "interior_point"),
    ],
)
def test_each_rung_is_taken(n, kept, decades, rung, solver):
    """Everybody walks to the middle."""
    still = crowd(4, n, kept, decades)
    inward = still.position.mean(0) - still.position
    snapshot = dataclasses.replace(still, velocity=inward)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    small = solve_small(snapshot, contacts, snapshot.velocity, 1e-10, True)
    assert small.rung == rung
    answer, other = solve(snapshot, contacts, tolerance=1e-10), by_ladder(snapshot, contacts, 1e-10)
    assert answer.status == "solved"
    assert answer.solver == other.solver == solver
    assert answer.canonical
    assert answer.iterations == other.iterations == small.iterations
    np.testing.assert_allclose(answer.right_velocity, other.right_velocity, atol=1e-12)


def test_what_is_not_within_the_tolerance_is_left_to_the_ladder():
    crowded = crowd(4, 64, 0.85)
    contacts = find_contacts(crowded, WALLS, tolerance=1e-9)
    assert solve_small(crowded, contacts, crowded.velocity, 1e-10, True) is not None
    assert solve_small(crowded, contacts, crowded.velocity, 1e-17, True) is None
    assert solve(crowded, contacts, tolerance=1e-14).status == "solved"


def test_a_contact_of_nobody_is_refused():
    pair = Snapshot(position=[[0, 0], [1, 0]], velocity=[[1, 0], [0, 0]], radius=[0.5] * 2, mass=[1, 1])  # fmt: skip
    touching = find_contacts(pair, tolerance=0)
    other = Contacts(
        first=[0], second=[7], is_wall=[False], normal=touching.normal, gap=touching.gap,
        point=touching.point,
    )  # fmt: skip
    with pytest.raises(ValueError, match="disk index 7 where there are 2 disks"):
        solve(pair, other)


def test_laws_that_do_more_than_push_take_the_ladder():
    assert ContactLaw().plain
    assert ContactLaw(tangential_dissipation=0.0).plain
    for law in (
        ContactLaw(dissipation=1.0),
        ContactLaw(restitution=0.0),
        ContactLaw(tangential_dissipation=1.0),
        ContactLaw(friction=0.1),
        ContactLaw(wall_friction=0.1),
        ContactLaw(maintained=True),
    ):
        assert not law.plain
