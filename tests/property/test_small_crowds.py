"""Small crowds are solved in one compiled call, with the answer of the ladder."""

import dataclasses
import importlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve
from nscd.solvers.small import SOLVED, UNSETTLED, solve_small

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


def by_ladder(snapshot, contacts, tolerance):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SOLVING, "solve_small", lambda *_: None)
        return solve(snapshot, contacts, tolerance=tolerance)


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(2, 40), st.floats(0.15, 1.0), st.floats(0.0, 0.6))
def test_the_answer_is_that_of_the_ladder(seed, n, kept, decades):
    snapshot = crowd(seed, n, kept, decades)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    found, other = solve(snapshot, contacts, tolerance=1e-10), by_ladder(snapshot, contacts, 1e-10)
    same = ("status", "solver", "choice", "canonical", "iterations", "warnings")
    assert [getattr(found, name) for name in same] == [getattr(other, name) for name in same]
    for name in ("right_velocity", "reaction", "impulse", "energy_change", "energy_error"):
        size = np.abs(getattr(other, name)).max(initial=1.0)
        np.testing.assert_allclose(getattr(found, name), getattr(other, name), atol=1e-11 * size)
    assert found.residual == pytest.approx(other.residual, rel=1e-6, abs=1e-15)
    assert found.momentum_error == pytest.approx(other.momentum_error, rel=1e-6, abs=1e-15)
    assert found.velocity_error == pytest.approx(other.velocity_error, rel=0.1, abs=1e-15)


@pytest.mark.parametrize(("kept", "end"), [(0.6, SOLVED), (0.85, UNSETTLED)])
def test_each_way_to_end_is_taken(kept, end):
    """Everybody walks to the middle. Where the packing is marginal, the descent is a start for the
    interior point, whose iterations are added."""
    still = crowd(4, 64, kept)
    inward = still.position.mean(0) - still.position
    snapshot = dataclasses.replace(still, velocity=inward)
    contacts = find_contacts(snapshot, WALLS, tolerance=1e-9)
    small = solve_small(snapshot, contacts, snapshot.velocity, 1e-10)
    assert small.end == end
    answer, other = solve(snapshot, contacts, tolerance=1e-10), by_ladder(snapshot, contacts, 1e-10)
    assert answer.status == "solved"
    assert answer.solver == ("active_set" if end == SOLVED else "interior_point")
    assert answer.iterations == other.iterations
    assert (answer.iterations > small.iterations) == (end == UNSETTLED)
    np.testing.assert_allclose(answer.right_velocity, other.right_velocity, atol=1e-12)


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
