"""Intervals over crowds and instants, and the series that they are made of."""

import numpy as np
import pytest

from analysis.dumps import DumpError
from analysis.engines.run import simulate
from analysis.motion.ensemble import Difference, Ensemble
from analysis.motion.intervals import count_cell, difference_cell, difference_words, interval_cell
from analysis.motion.series import MEASURES, Series, read_series
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from analysis.scene.variation import variant
from nscd import find_contacts


def ensemble(samples):
    """An ensemble whose wall loads are the samples, one row per crowd."""
    every = []
    for row in np.asarray(samples, dtype=float):
        values = {key: row for key in MEASURES}
        time = 0.1 * np.arange(1, len(row) + 1)
        every.append(
            Series(time=time, window_s=0.1, values=values, evacuated=row, forces=(row,) * len(row))
        )
    return Ensemble(title="model", engine="rigid", series=every, last_s=100.0)


def test_an_interval_holds_nine_in_ten_of_all_windows():
    found = ensemble(np.arange(200).reshape(4, 50)).interval("walls")
    assert (found.median, found.crowds, found.windows) == (99.5, 4, 50)
    assert (found.low, found.high) == pytest.approx((9.95, 189.05))


def test_windows_count_as_independent_by_their_correlation():
    """AR(1) with ρ = 0.8 has one independent window in (1 + ρ)/(1 − ρ) = 9; white noise all."""
    random = np.random.default_rng(0)
    white = random.normal(size=(20, 400))
    slow = np.zeros_like(white)
    for step in range(1, 400):
        slow[:, step] = 0.8 * slow[:, step - 1] + white[:, step]
    count = 20 * 400
    assert ensemble(white).interval("walls").independent == pytest.approx(count, rel=0.05)
    assert ensemble(slow).interval("walls").independent == pytest.approx(count / 9, rel=0.2)


def test_a_difference_is_told_from_chance():
    random = np.random.default_rng(1)
    base = 100 + random.normal(0, 5, (10, 30))
    alike = 100 + random.normal(0, 5, (10, 30))
    found = ensemble(alike).above(ensemble(base), "walls")
    assert not found.distinguishable
    assert found.low < found.value < found.high
    above = ensemble(1.1 * alike).above(ensemble(base), "walls")
    assert above.distinguishable
    assert above.value == pytest.approx(0.1, abs=0.02)
    assert ensemble(base[:2]).above(ensemble(base), "walls") is None


@pytest.mark.parametrize("crowds", [3, 5])
def test_nine_in_ten_intervals_of_few_crowds_hold_the_truth(crowds):
    """Crowds of one model twice: they differ by chance alone. Without the wider quantiles 0.76 and
    0.83 of the intervals hold zero."""
    random = np.random.default_rng(7)
    told = 0
    for _ in range(150):
        place = 100 + random.normal(0, 2, (2, crowds, 1)) + random.normal(0, 4, (2, crowds, 10))
        told += ensemble(place[0]).above(ensemble(place[1]), "walls").distinguishable
    assert told / 150 < 0.14


def test_equal_numbers_are_no_interval_of_no_width():
    """Three crowds let as many people through: that says nothing of what a fourth would do."""
    same = ensemble(np.full((3, 1), 0.5))
    assert interval_cell(same.interval("flow")) == "0.5 in all 3"
    assert count_cell(ensemble(np.full((3, 4), 12.0)).interval("walls")) == "12 in all 12"
    assert interval_cell(ensemble([[0.5], [0.5], [0.7]]).interval("flow")) == "0.5 (0.5 – 0.68)"
    assert interval_cell(ensemble([[0.5]]).interval("flow")) == "0.5"
    assert same.above(ensemble(np.full((3, 1), 0.4)), "flow") is None
    assert same.above(ensemble([[0.4], [0.4], [0.5]]), "flow") is not None


def test_a_model_that_nearly_stands_is_no_measure_of_another():
    """Ten crowds, most of which stand: a ratio of medians could be anything, their difference is
    known."""
    random = np.random.default_rng(2)
    stand = np.where(np.arange(10) < 5, 1e-5, 0.08)[:, None] * random.uniform(0.9, 1.1, (10, 30))
    walk = random.uniform(0.15, 0.19, (10, 30))
    found = ensemble(walk).above(ensemble(stand), "walls")
    assert not found.relative
    assert found.value == pytest.approx(np.median(walk) - np.median(stand))
    assert 0.08 < found.low <= found.value <= found.high < 0.18
    value, low, high = difference_words(found, "m/s")
    assert (value[0], value[-4:], low[0], high[-4:]) == ("+", " m/s", "+", " m/s")
    assert difference_words(found, "1/s")[0].endswith(" per s")
    assert "%" not in difference_cell(found, "m/s")
    assert difference_words(ensemble(stand).above(ensemble(walk), "walls"), "m/s")[0][-1] == "%"
    # nothing at all, as of arches where there are none, and nothing against something
    assert ensemble(0 * walk).above(ensemble(0 * walk), "walls") is None
    found = ensemble(walk).above(ensemble(0 * walk), "walls")
    assert (found.relative, found.value) == (False, np.median(walk))
    assert difference_words(Difference(value=0.1, low=-0.02, high=0.2, relative=False), "–") == (
        "+0.1", "−0.02", "+0.2")  # fmt: skip


def test_other_crowds_of_a_scene_fit_into_its_room():
    gate = read_scene("gate")
    other = variant(gate, 3)
    near = find_contacts(other.snapshot, gate.wall_segments(), tolerance=0.0)
    moved = other.snapshot.position - gate.snapshot.position
    assert near.gap.min(initial=0.0) >= -1e-9
    assert 0.005 < np.sqrt((moved**2).mean()) < 0.05
    assert variant(gate, 3).digest() == other.digest()
    variant(gate, 9).check("gate")  # the first draw of it has somebody beyond the door
    assert variant(make("arch"), 1).digest() == make("arch", seed=2).digest()


def test_a_pressed_crowd_balances_its_push(tmp_path):
    """60 people at rest at a closed door: the wall takes what all push with, window by window."""
    scene = make("arch", disks=60).with_run(duration_s=1.5, frames=30)
    record = simulate(scene, "rigid", tmp_path / "run")
    series = read_series(tmp_path / "run", record.time_step_s)
    assert series.window_s == pytest.approx(0.1)
    assert len(series.time) == 15
    assert len(series.forces) == 15
    inside = 60 - series.evacuated[-1]
    push = 75.0 * scene.drive.speed_m_per_s / scene.drive.relaxation_time_s
    # the front wall takes a share of it, the side walls what is squeezed aside
    assert 0.2 < series.values["walls"][-5:].mean() / (inside * push) < 1.5
    assert (series.values["person_largest"] >= series.values["contact_largest"]).all()
    assert (np.diff(series.evacuated) >= 0).all()


def test_a_run_without_impulses_says_what_to_do(tmp_path):
    scene = make("arch", disks=10).with_run(duration_s=0.2, frames=2)
    record = simulate(scene, "rigid", tmp_path / "run")
    (tmp_path / "run" / "impulses.dump").unlink()
    with pytest.raises(DumpError, match=r"impulses.dump: no such file; run the scene again"):
        read_series(tmp_path / "run", record.time_step_s)
