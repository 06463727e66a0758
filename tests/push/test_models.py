"""Pushed rows: collisions in closed form, other engines, and trials with a known truth."""

import dataclasses

import numpy as np
import pytest

from analysis import engines
from analysis.push.hindcast import (
    ONSET,
    Cases,
    baselines,
    hindcast,
    inputs_of,
    most_force,
    most_impulse,
    odds,
    onsets,
    rigid,
    soft,
)
from analysis.push.trial import read_trial
from tests.push.oracles import by_lammps, case_of, made, row_of, stepped

SPEED, GAP, RATE = 1.0, 0.2, 25
SOFT = (2e3, 2e4)
needs_lammps = pytest.mark.skipif(
    engines.engine("lammps").find() is None, reason="LAMMPS is not installed"
)


def going(frames=30, speed=SPEED):
    """Two people, the first of whom goes at a constant speed from the first frame on."""
    return row_of([80.0, 80.0], speed * np.arange(frames) / RATE)


def ways(trial, moved):
    return moved.along[:, 1:, 0] - trial.along[0, 1:]


def test_two_rigid_people_collide_in_closed_form():
    """Without a floor the second leaves at the speed of the first, when the gap has closed."""
    row = going()
    moved = rigid(row, case_of([GAP], 1e6))
    expected = np.maximum(row.time - GAP / SPEED, 0.0) * SPEED
    np.testing.assert_allclose(ways(row, moved)[:, 0], expected, atol=1e-4)
    assert moved.impulse[0] == pytest.approx(80.0 * SPEED, rel=1e-4)


def test_the_floor_takes_speed():
    """A pushed person who is then left alone goes U τ (1 − exp(−t/τ))."""
    row = going(frames=50)
    row.pushed[6:] = row.pushed[6]
    shown = ways(row, rigid(row, case_of([GAP], 0.5)))[:, 0]
    # rigid from 0.2 to 0.24 s: then alone at 1 m/s
    expected = 0.04 + SPEED * 0.5 * (1 - np.exp(-(row.time[6:] - row.time[6]) / 0.5))
    np.testing.assert_allclose(shown[6:], expected, atol=4e-3)


def test_a_soft_collision_in_closed_form():
    """A critically damped contact that never pulls: the second is overtaken by its own spring. In
    the overlap d, d'' + 2w d' + w² d = 0 with w² = k/m: d = v t exp(−w t), the force is
    m (2w d' + w² d), at most 2 w m v at once, and it ends at w t = 2, with the second at v (1 + e⁻²)."""
    row = going()
    moved, w = soft(row, case_of([GAP], 1e6), 5e4), np.sqrt(5e4 / 80.0)
    assert moved.largest[0] == pytest.approx(2 * w * 80.0 * SPEED, rel=0.06)
    last = np.diff(ways(row, moved)[:, 0])[-5:] * RATE
    np.testing.assert_allclose(last, SPEED * (1 + np.exp(-2)), rtol=2e-2)


def pushed_row(wall):
    """Five people, a smooth push of 0.2 m in 0.6 s, their gaps and the floor's time."""
    phase = np.clip(np.arange(40) / RATE / 0.6, 0, 1)
    first = 0.2 * (phase - np.sin(2 * np.pi * phase) / (2 * np.pi))
    gap = np.array([0.03, 0.06, 0.02, 0.05] + [0.045] * wall)
    return row_of([80, 70, 95, 60, 75], first, 5.0 if wall else None), gap


@pytest.mark.parametrize("wall", [False, True])
def test_rigid_rows_are_those_of_the_rigid_engine(wall):
    row, gap = pushed_row(wall)
    moved = rigid(row, case_of(gap, 0.8))
    expected, impulse = stepped(row, gap, 0.8)
    np.testing.assert_allclose(ways(row, moved), expected, atol=3e-3)
    assert moved.impulse[0] == pytest.approx(impulse, rel=0.04)
    assert (expected[-1, -1] < 0.046) == wall


@needs_lammps
@pytest.mark.parametrize(("stiffness", "wall"), [(1e6, False), (2e4, True)])
def test_soft_rows_are_those_of_lammps(tmp_path, stiffness, wall):
    row, gap = pushed_row(wall)
    moved = soft(row, case_of(gap, 0.8), stiffness)
    expected, largest, impulse = by_lammps(row, gap, 0.8, stiffness, tmp_path)
    np.testing.assert_allclose(ways(row, moved), expected, atol=2e-3)
    assert moved.largest[0] == pytest.approx(largest, rel=0.02)
    assert moved.impulse[0] == pytest.approx(impulse, rel=0.02)


def test_a_wall_stops_the_row_and_makes_a_case_impossible():
    gap = [GAP, GAP, 0.1]
    for far, possible in ((sum(gap) - 0.01, True), (sum(gap) + 0.05, False)):
        row = row_of([80.0] * 3, np.linspace(0, far, 30), wall=5.0)
        row.along[:, 1:] += row.pushed[:, None]  # as far as everybody was measured to go
        moved = rigid(row, case_of(gap, 0.5))
        assert moved.possible.tolist() == [possible]
        assert moved.along[-1, 2, 0] - moved.along[0, 2, 0] <= 0.1 + 1e-9
    hard = soft(row, case_of(gap, 0.5), 1e6)
    assert hard.impulse[0] > most_impulse(row, np.array([0.5]))[0]
    assert not hard.possible.any()


def test_posture_and_room_at_the_wall_are_two_inputs(tmp_path):
    file, wall, *_ = made(tmp_path, 1, "5000")
    trial = read_trial(file, wall)
    first, other = (inputs_of(trial, (0.0, 0.9), batch) for batch in (0, 1))
    assert abs(np.corrcoef(first.arms, first.wall)[0, 1]) < 0.1
    assert (first.arms.max(), first.wall.max()) == pytest.approx((0.9, 1.0), abs=0.01)
    assert len(np.unique(first.arms)) == len(np.unique(first.wall)) == len(first.tau)
    # posture says nothing of the room at the wall, nor that room of the room between people
    assert abs(np.corrcoef(first.arms, first.gap[:, -1])[0, 1]) < 0.1
    assert abs(np.corrcoef(first.wall, first.gap[:, 0])[0, 1]) < 0.1
    assert not np.isin(first.arms, other.arms).any()


def test_baselines_know_no_mechanics():
    row = going()
    base = {name: ways(row, scored_) for name, scored_ in _as_moved(row, [GAP]).items()}
    assert np.ptp(base["nobody"]) == 0
    np.testing.assert_allclose(base["geometry"][:, 0], np.maximum(row.pushed - GAP, 0), atol=1e-9)
    late = np.interp(row.time - GAP / SPEED, row.time, row.pushed)
    np.testing.assert_allclose(base["copy"][:, 0], late, atol=1e-9)


def _as_moved(row, gap):
    still = rigid(row, case_of(gap, 0.5))
    return {
        name: dataclasses.replace(still, along=along)
        for name, along in baselines(row, case_of(gap, 0.5)).items()
    }


def test_odds_are_given_only_where_all_draws_agree():
    """Against closed form; where batches disagree no order is settled; impossible cases are not
    ranked."""
    row = going()
    inputs = dataclasses.replace(
        inputs_of(row, (0, 1), 0),
        arms=np.array([0, 1, 0, 1.0]),
        wall=np.zeros(4),
        batch=np.array([0, 0, 1, 1]),
    )

    def off(errors, possible=(1, 1, 1, 1)):
        """Four cases in which the second is so much (σ = 0.08 s) too early."""
        onset = onsets(row, row.along) - np.outer(errors, [0.0, 0.08])
        scores = {ONSET: 0.08 * np.array(errors)}
        able = np.array(possible, bool)
        return Cases(onset=onset, scores=scores, largest=onset, impulse=onset, possible=able)

    models = {
        "early": off([3, 3, 3, 3]),
        "mixed": off([3, 3, 0, 0]),
        "one": off([1, 1, 0, 0]),
        "never": off([0, 0, 0, 0], (0, 0, 0, 0)),
        "partly": off([0, 0, 0, 99], (1, 1, 1, 0)),
        "far": off([9, 9, 9, 9]),
    }
    found = odds(row, inputs, models)
    assert "never" not in found
    assert found["partly"].share == 1
    assert found["one"].share == pytest.approx((np.exp(-0.5) + 1) / 2)
    early = found["early"]
    assert early.share == pytest.approx(np.exp(-4.5))
    assert (early.low, early.high) == pytest.approx((np.exp(-4.5), np.exp(-1.125)))
    # with 2 σ it is three times less likely only
    assert (early.settled, early.out) == (True, False)
    assert (found["mixed"].settled, found["far"].out) == (False, True)


@pytest.mark.parametrize("wall", [False, True])
def test_the_truth_is_inside_what_is_said(tmp_path, wall):
    """Trials with a known truth: it is not excluded, and its force and impulse lie in the range of
    the models that are not; no range is above what the measured Σ m v allows; and another range of
    postures does not exclude what is likeliest."""
    missed = []
    for seed in range(4):
        name = f"{SOFT[seed % len(SOFT)]:g}"
        file, end, largest, impulse = made(tmp_path, seed, name, wall)
        trial = read_trial(file, end)
        found, other = (hindcast(trial, arms, SOFT, 2) for arms in ((0, 1), (0, 0.5, 0.75, 0.9)))
        said = np.array([found.likely(one)[1:] for one in found.together()])
        force, through = ((np.nanmin(said[:, k]), np.nanmax(said[:, k])) for k in (0, 1))
        missed += [name not in found.together(), name not in other.together()]
        missed += [not force[0] <= largest <= force[1], not through[0] <= impulse <= through[1]]
        best = max(found.odds, key=lambda one: found.odds[one].share)
        assert best in other.together()
        assert force[1] <= most_force(trial, SOFT[-1])
        assert through[1] <= most_impulse(trial, np.array([0.1]))[0]
    # 16 statements; of the ranges, which hold 5 to 95 %, one in ten may miss
    assert sum(missed) <= 1, missed
