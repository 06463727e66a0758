"""Intervals over crowds and instants, and the series that they are made of. Arches that somebody
drew: who is in them, and how long they live."""

import numpy as np
import pytest

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows, Window
from analysis.engines.run import simulate
from analysis.studies.exposure.loads import (
    MEASURES,
    RunLoads,
    arch_in,
    arches_of,
    read_exposure,
    share_of,
)
from analysis.studies.exposure.times import time_until
from analysis.studies.motion.study import Model, difference_words, differences_of, interval_cell

from analysis.studies.motion.study import least_words  # isort: skip
from analysis.pages.numbers import integer
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make, variant
from nscd import find_contacts
from tests.crowds import disks_at


def ensemble(samples):
    """An ensemble whose wall loads are the samples, one row per crowd."""
    every = []
    for row in np.asarray(samples, dtype=float):
        values = {key: row for key in (*MEASURES, "wall_line_load") if key != "flow"}
        when = {"time": 0.1 * np.arange(1, len(row) + 1), "duration": np.full(len(row), 0.1)}
        every.append(RunLoads(scene=None, ids=[], loads={}, values=values, **when))
    return Model(title="model", series=every, last_s=100.0)


def test_a_range_is_of_all_windows_of_all_replicates():
    found = ensemble(np.arange(200).reshape(4, 50)).interval("walls")
    assert (found.mean, found.replicates, found.windows) == (99.5, 4, 50)
    # replicates that lie so far apart are few independent ones, whose range is wider than all
    assert found.low == 0
    assert found.high > 199
    mixed = np.random.default_rng(0).permutation(200).reshape(4, 50)
    found = ensemble(mixed).interval("walls")
    assert (found.low, found.high) == pytest.approx((9.05, 189.95), abs=1.5)


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
    found = differences_of(ensemble(alike), ensemble(base))["walls"]
    assert not found.significant
    assert found.low < found.value < found.high
    above = differences_of(ensemble(1.1 * alike), ensemble(base))["walls"]
    assert above.significant
    assert above.value == pytest.approx(0.1, abs=0.02)
    assert differences_of(ensemble(base[:2]), ensemble(base)) == {}


def leaving(*replicates):
    """Five people of each of these replicates, who get out at these times (s) of 2 s."""
    series = [RunLoads(scene=None, ids=[], loads={}, duration=np.full(4, 0.5), values={"flow": np.zeros(4)},
                       time=np.array([0.5, 1, 1.5, 2.0]), out=np.append(out, np.full(5 - len(out), np.inf)))
              for out in replicates]  # fmt: skip
    return Model(title="model", series=series, last_s=100.0)


def test_flow_is_of_those_after_the_first_from_then_on():
    """Two in the 1.6 s to the end, one in 0.8 s, and all four others in 1 s; never fewer than none."""
    model = leaving([0.4, 1.0, 1.2], [1.2, 1.9], [0.3, 0.4, 0.5, 1.0, 1.3])
    assert model.sample("flow").values == pytest.approx([2 / 1.6, 1 / 0.8, 4 / 1.0])
    found = model.interval("flow")
    assert (found.mean, found.low, found.replicates) == (pytest.approx(6.5 / 3), 0.0, 3)
    assert found.high > 4
    still, walks = leaving([], [], [], []), leaving([0.1, 1.1], [0.1, 1.2], [0.2, 1.2], [0.4, 0.9])
    assert interval_cell(still.interval("flow")) == "0 (0 – 0.5)"
    assert differences_of(still, walks)["flow"].stops
    assert [time_until(one, 2) for one in walks.series] == [1.1, 1.2, 1.2, 0.9]
    assert time_until(walks.series[0]) == np.inf
    with pytest.raises(ValueError, match=r"count: 6\. 5 people were inside"):
        time_until(walks.series[0], 6)


def test_equal_numbers_are_no_range_of_no_width():
    """Three replicates have the same load: that says nothing of what a fourth would have."""
    same = ensemble(np.full((3, 1), 0.5))
    assert interval_cell(same.interval("walls")) == "0.5 in each of 3 moments"
    people = ensemble(np.full((3, 4), 12.0)).interval("walls")
    assert interval_cell(people, integer) == "12 in each of 12 moments"
    assert interval_cell(ensemble([[0.5, 0.7]]).interval("walls")) == "0.6"
    assert least_words(differences_of(same, same)["walls"], "N") == "all equal"
    # a share of time is at most all of it
    assert ensemble([[1.0, 0.2, 1.0], [1.0, 1.0, 0.9]]).interval("arch_share").high == 1


def test_a_model_that_nearly_stands_is_no_measure_of_another():
    """Replicates of which one walks: a ratio of means could be anything, their difference is
    known."""
    random = np.random.default_rng(2)
    stand = np.where(np.arange(10) < 9, 1e-5, 0.08)[:, None] * random.uniform(0.9, 1.1, (10, 30))
    walk = random.uniform(0.15, 0.19, (10, 30))
    found = differences_of(ensemble(walk), ensemble(stand))["walls"]
    assert not found.relative
    assert found.value == pytest.approx(walk.mean() - stand.mean())
    assert 0.08 < found.low <= found.value <= found.high < 0.2
    value, low, high = difference_words(found, "m/s")
    assert (value[0], value[-4:], low[0], high[-4:]) == ("+", " m/s", "+", " m/s")
    assert difference_words(found, "1/s")[0].endswith(" per s")
    assert "%" not in "".join(difference_words(found, "m/s"))
    back = differences_of(ensemble(stand), ensemble(walk))["walls"]
    assert difference_words(back, "m/s")[0][-1] == "%"
    # nothing at all, as of arches where there are none
    assert "walls" not in differences_of(ensemble(0 * walk), ensemble(0 * walk))


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
    simulate(scene, "rigid", tmp_path / "run")
    series = read_exposure(tmp_path / "run")
    assert series.duration == pytest.approx(np.full(15, 0.1))
    assert (series.values["flow"] >= 0).all()
    inside = 60 - (series.values["flow"] * series.duration).sum()
    push = 75.0 * scene.drive.speed_m_per_s / scene.drive.relaxation_time_s
    # the front wall takes a share of it, the side walls what is squeezed aside
    assert 0.2 < series.values["walls"][-5:].mean() / (inside * push) < 1.5
    assert (series.values["person_largest"] >= series.values["contact_largest"]).all()


def test_a_run_without_impulses_says_what_to_do(tmp_path):
    scene = make("arch", disks=10).with_run(duration_s=0.2, frames=2)
    record = simulate(scene, "rigid", tmp_path / "run")
    (tmp_path / "run" / "impulses.dump").unlink()
    with pytest.raises(DumpError, match=r"impulses.dump: no such file. Run the scene again"):
        RunWindows(tmp_path / "run", record.time_step_s)


@pytest.fixture(scope="module")
def door():
    """A wall along y with a door from (0, -0.5) to (0, 0.5); people come from x < 0."""
    return read_scene("arch")


# Five people on a half circle before the door, the first and the last at the walls; a sixth behind.
PLACES = [(-0.2, -0.8), (-0.6, -0.55), (-0.8, 0.0), (-0.6, 0.55), (-0.2, 0.8), (-1.2, 0.0)]
# The walls beside the door, as the scene numbers them.
LOWER, UPPER = 1, 2
RING = [(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 5, 0), (1, LOWER, 1), (5, UPPER, 1)]


def window(contacts, start=0.0, newtons=100.0, positions=PLACES):
    """A window of 0.1 s in which these contacts press with so many newtons."""
    keys = np.array(sorted(contacts), dtype=np.int64).reshape(-1, 3)
    now = disks_at(positions, radius=0.2)
    impulse = np.column_stack([np.full(len(keys), 0.1 * newtons), np.zeros(len(keys))])
    return Window(start=start, end=start + 0.1, now=now, keys=keys, impulse=impulse)


def test_a_ring_from_wall_to_wall_is_an_arch(door):
    assert arch_in(door, window(RING)) == {1, 2, 3, 4, 5}
    behind = [(2, 6, 0), (4, 6, 0)]
    assert arch_in(door, window([*RING, *behind])) == {1, 2, 3, 4, 5}
    without_keystone = [c for c in RING if c not in ((2, 3, 0), (3, 4, 0))]
    assert arch_in(door, window([*without_keystone, *behind])) == {1, 2, 4, 5, 6}


@pytest.mark.parametrize("missing", RING)
def test_a_gap_anywhere_opens_it(door, missing):
    assert not arch_in(door, window([c for c in RING if c != missing]))


def test_who_hardly_presses_has_passed_or_is_far_is_no_part_of_it(door):
    assert not arch_in(door, window(RING, newtons=9.0))
    beyond = [*PLACES[:2], (0.1, 0.0), *PLACES[3:]]
    assert not arch_in(door, window(RING, positions=beyond))
    far = [*PLACES[:2], (-1.9, 0.0), *PLACES[3:]]
    assert not arch_in(door, window(RING, positions=far))


def test_an_arch_lives_as_long_as_the_same_people_form_it(door):
    other = [*[c for c in RING if c not in ((2, 3, 0), (3, 4, 0))], (2, 6, 0), (4, 6, 0)]
    shown = [RING, RING, other, [], RING, RING, RING]
    found = arches_of(door, [window(c, start=0.1 * n) for n, c in enumerate(shown)])
    assert [arch.lifetime for arch in found] == pytest.approx([0.2, 0.1, 0.3])
    assert [arch.start for arch in found] == pytest.approx([0.0, 0.2, 0.4])
    total = window([], start=0.0)
    assert share_of(total, found) == pytest.approx(1.0)
    assert share_of(window([], start=0.3), found) == pytest.approx(0.0)
