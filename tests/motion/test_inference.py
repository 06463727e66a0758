"""Ranges and verdicts over replicates: against enumeration, and against what they promise. Two
runs of one crowd by impulses over windows: known differences, counted people, refusals."""

import dataclasses
import shutil

import numpy as np
import pytest
from scipy.stats import binom, permutation_test, poisson

from analysis import engines
from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines.record import RunRecord
from analysis.engines.run import simulate
from analysis.studies.motion.inference import Sample, differences, next_to_zero, range_of_counts

from analysis.studies.motion.inference import range_of_windows  # isort: skip
from analysis.scene.shipped_scenes import make
from analysis.studies.motion.pairwise import _paired, check_same_crowd, compare_windows

TENTH = 0.1 + 1e-12


def alone(mine, theirs, **kinds):
    """The difference of one quantity."""
    samples = (Sample(values=np.array(values, dtype=float), **kinds) for values in (mine, theirs))
    (found,) = (differences(*({"x": one} for one in samples)) or {"x": None}).values()
    return found


def by_scipy(mine, theirs):
    """Two-sided p of the difference of means, over all ways to share out the labels."""
    how = {"n_resamples": np.inf, "alternative": "greater", "vectorized": True}
    difference = lambda x, y, axis: np.abs(x.mean(axis) - y.mean(axis))  # noqa: E731
    return permutation_test((mine, theirs), difference, **how).pvalue


def test_the_interval_is_of_the_shifts_that_an_exact_permutation_test_does_not_exclude():
    random = np.random.default_rng(3)
    for count, other in ((3, 4), (4, 4), (5, 3)):
        mine, theirs = random.normal(12, 2, count), random.normal(10, 2, other)
        found = alone(mine, theirs, noise=1.0)
        assert found.probability == pytest.approx(by_scipy(mine, theirs))
        for end in (found.low, found.high):
            shift = end * theirs.mean()
            inside = shift + 1e-3 * (mine.mean() - theirs.mean() - shift)
            outside = 2 * shift - inside
            assert by_scipy(mine - inside, theirs) > TENTH > by_scipy(mine - outside, theirs)
        assert found.least == pytest.approx(max(found.value - found.low, found.high - found.value))


def test_an_effect_is_shifted_by_what_is_added():
    """The interval moves with the effect, so that `least` is what would just have been seen."""
    theirs, mine = np.array([10.0, 11.0, 9.5, 10.4, 10.1]), np.array([10.2, 9.7, 10.9, 10.0, 10.3])
    found = alone(mine, theirs)
    assert not found.significant
    for to, observed in ((0.97, False), (1.01, True)):
        moved = mine + theirs.mean() * (to * found.least - found.value)
        assert alone(moved, theirs).significant == observed


def test_a_door_that_closes_is_the_first_difference():
    """Nobody passes in any replicate, against 2 to 4 per second: other quantities come after it,
    however sure they are."""
    walls = [np.array([9.0, 9.1, 9.2]), np.array([5.0, 5.1, 5.2, 5.3, 5.1])]
    flow = [np.array([0.0, 0, 0]), np.array([2.0, 2, 2, 3, 4])]
    mine, theirs = (
        {"walls": Sample(values=wall), "flow": Sample.of_counts(count, 1.0)}
        for wall, count in zip(walls, flow, strict=True)
    )
    found = differences(mine, theirs)
    assert list(found) == ["flow", "walls"]
    assert (found["flow"].stops, found["flow"].significant, found["flow"].value) == (True, True, -1)
    back = differences(theirs, mine)["flow"]
    assert (back.stops, back.relative, back.value) == (True, False, pytest.approx(2.6))
    # three against three have 20 permutations, two of them as far apart: p = 0.1
    three = differences({"flow": Sample.of_counts(flow[0], 1.0)}, {"flow": theirs["flow"]})
    assert three["flow"].probability == pytest.approx(1 / 56)
    some = Sample.of_counts(np.array([0.0, 1, 2]), 1.0)
    assert not differences({"flow": mine["flow"]}, {"flow": some})["flow"].stops


def test_rounding_is_no_difference():
    """1.3·10⁻¹³ % is none, whichever way all replicates have it."""
    theirs = np.array([2.0, 3.0, 4.0, 3.5, 2.5])
    for mine in (theirs * (1 - 1.3e-15), theirs[::-1] * (1 + 1e-12), np.full(5, 3.0) * (1 + 1e-15)):
        found = alone(mine, theirs)
        assert (found.value, found.significant) == (0.0, False)
    assert alone(np.full(3, 7.0), np.full(3, 7.0) * (1 + 1e-13)).probability == 1
    # ten times, to a digit that is known, is one
    assert alone(np.full(4, 7.0), np.full(4, 7.1)).significant
    assert alone([0.0] * 3, [0.0] * 3) is None
    assert alone([1.0, 2.0], [3.0, 4.0, 5.0]) is None


def test_nothing_falls_below_nothing():
    """What is never negative is not more than 100 % less, nor is a flow below zero."""
    found = alone([1.0, 0, 2, 1], [3.0, 0, 7, 2])
    assert found.low >= (-1 if found.relative else -3.0)
    assert range_of_windows([np.array([0.0, 5.0]), np.array([1.0, 0.0])])[0] == 0


def test_a_mean_next_to_zero_is_no_measure_of_another():
    assert next_to_zero(np.array([0.0, 0.0, 5.0]))
    assert next_to_zero(np.zeros(4))
    assert not next_to_zero(np.array([4.0, 5.0, 5.0]))
    assert not alone([5.0, 6, 5], [0.0, 0.001, 0.3]).relative


@pytest.mark.parametrize("count", [3, 5])
def test_a_model_differs_from_itself_in_any_quantity_in_one_case_of_ten(count):
    """Four quantities, of which two go together, one is skewed and one is a count."""
    random = np.random.default_rng(count)

    def model():
        base = random.normal(size=(2, count))
        return {
            "a": Sample(values=100 + base[0], noise=0.5),
            "b": Sample(values=50 + base[0] + 0.5 * base[1], noise=0.5),
            "c": Sample(values=random.lognormal(size=count)),
            "flow": Sample.of_counts(random.poisson(4.0, count).astype(float), 1.0),
        }

    draws = 150
    found = (differences(model(), model()).values() for _ in range(draws))
    cells = sum(any(one.significant for one in every) for every in found)
    assert cells <= binom.ppf(0.999, draws, 0.1)
    assert cells >= binom.ppf(0.001, draws, 0.03)  # it is a test, and tells models apart


@pytest.mark.parametrize("counts", [[2, 2, 5], [1, 4, 4], [0, 0, 0], [0] * 10])
def test_a_range_of_counts_by_enumeration(counts):
    """With a variance equal to the mean, a further count is binomial given the sum."""
    counts = np.array(counts, dtype=float)
    assert counts.var(ddof=1) == pytest.approx(counts.mean())
    total, fraction = int(counts.sum()), 1 / (len(counts) + 1)
    y = np.arange(60)
    few = (binom.cdf(y, total + y, fraction) <= 0.05) & (total > 0)
    selected = y[(binom.sf(y - 1, total + y, fraction) > 0.05) & ~few]
    assert range_of_counts(counts) == (selected[0], selected[-1])


@pytest.mark.parametrize("mean", [0.5, 2.0, 7.0])
@pytest.mark.parametrize("count", [3, 5, 10])
def test_ranges_of_counts_hold_nine_in_ten_of_poissons(mean, count):
    random = np.random.default_rng(5)
    collected = []
    for _ in range(150):
        low, high = range_of_counts(random.poisson(mean, count).astype(float))
        collected.append(poisson.cdf(high, mean) - poisson.cdf(low - 1, mean))
    assert 0.88 < np.mean(collected) <= 1


@pytest.mark.parametrize("count", [3, 5, 10])
def test_ranges_of_windows_hold_nine_in_ten_of_further_windows(count):
    """Windows of AR(1) with ρ = 0.5 about a level of the replicate; skewed too."""
    random = np.random.default_rng(6)

    def replicates(number):
        noise = random.normal(size=(number, 10))
        for step in range(1, 10):
            noise[:, step] = 0.5 * noise[:, step - 1] + np.sqrt(0.75) * noise[:, step]
        return np.exp(0.2 * (noise + 0.5 * random.normal(size=(number, 1))))

    further = replicates(2000)
    collected = []
    for _ in range(100):
        low, high = range_of_windows(list(replicates(count)))
        collected.append(((further >= low) & (further <= high)).mean())
    assert 0.86 < np.mean(collected) < 0.94


@pytest.mark.parametrize("count", [3, 5])
def test_ranges_of_one_number_per_replicate_are_students(count):
    random = np.random.default_rng(7)
    further = random.normal(10, 1, 2000)
    collected = []
    for _ in range(300):
        low, high = range_of_windows([random.normal(10, 1, 1) for _ in range(count)])
        collected.append(((further >= low) & (further <= high)).mean())
    assert np.mean(collected) == pytest.approx(0.9, abs=0.025)


@pytest.fixture(scope="module")
def scene():
    """30 people before a door; five windows of two frames each."""
    return make("arch", disks=30).with_run(duration_s=1.0, frames=20)


@pytest.fixture(scope="module")
def rigid(scene, tmp_path_factory):
    """A rigid run of the scene."""
    folder = tmp_path_factory.mktemp("runs") / "rigid"
    simulate(scene, "rigid", folder)
    return folder


def changed(folder, to, name, change):
    """A copy of a run whose dump has other lines, sealed again."""
    shutil.copytree(folder, to)
    path = to / name
    path.write_text("".join(map(change, path.read_text().splitlines(keepends=True))))
    RunRecord.read(to).finished(to).write(to)
    return to


def grown(line):
    """A row of impulses with a tenth more in it."""
    words = line.split()
    if len(words) != 5 or not words[0].isdigit():
        return line
    return " ".join([*words[:3], *(repr(1.1 * float(word)) for word in words[3:])]) + "\n"


def test_impulses_that_are_a_tenth_larger_are_found_so(rigid, tmp_path):
    other = changed(rigid, tmp_path / "grown", "impulses.dump", grown)
    compared = compare_windows(rigid, other)
    message = compared.windows
    assert (message["end_s"] - message["start_s"]).round(9).tolist() == [0.1] * 10
    found = compared.paired()
    for name in ("contact_largest", "contact_95", "contact_mean", "person_largest", "walls"):
        assert found[name].more == pytest.approx(0.1, abs=0.003), name
    assert found["flow"].more == found["speed_door"].more == 0.0
    busy = message["contacts_both"] > 10
    assert busy.any()
    for key in ("contact_relative_difference", "person_relative_difference", "sum_difference"):
        assert message[key][busy] == pytest.approx(0.1)
    assert message["contact_correlation"][busy] == pytest.approx(1.0)
    assert not (message["contacts_only_first"] + message["contacts_only_second"]).any()


def test_one_pair_of_runs_has_numbers_and_their_autocorrelation():
    """Of which the definition is written out here; no verdict, whatever they are."""
    random = np.random.default_rng(4)
    first, distance = random.uniform(5, 6, 50), np.cumsum(random.normal(size=50))
    found = _paired(first, first + distance)
    about = distance - distance.mean()
    assert found.autocorrelation == pytest.approx(about[:-1] @ about[1:] / (about @ about))
    assert found.independent < 10
    assert found.more == pytest.approx(distance.mean() / first.mean())
    assert not hasattr(found, "verdict")
    constant = _paired(first, first * (1 + 1e-14))
    assert (constant.more, constant.relative) == (0.0, True)
    assert np.isnan(constant.autocorrelation)
    still = _paired(np.zeros(4), np.ones(4))
    assert (still.more, still.relative) == (1.0, False)


def test_flow_is_the_count_of_those_who_passed(rigid, scene):
    compared = compare_windows(rigid, rigid, 0.5)
    frames = RunWindows(rigid, RunRecord.read(rigid).time_step_s)
    out = [int((frames.at(number).position[:, 0] >= 0).sum()) for number in (0, 10, 20)]
    assert compared.values("flow")[0] == pytest.approx(np.diff(out) / 0.5)
    late = compare_windows(rigid, rigid, last_s=0.3)
    assert late.windows["start_s"].tolist() == pytest.approx([0.7, 0.8, 0.9])


def test_an_engine_with_springs_and_the_rigid_one_pass_on_the_same_impulse(scene, rigid, tmp_path):
    """All of it within 0.5 s from rest, before chaos: the stiffer, the nearer."""
    if engines.engine("lammps").find() is None:
        pytest.skip("LAMMPS is not installed")
    differences = []
    for stiffness in (1e5, 1e7):
        folder = tmp_path / f"{stiffness:g}"
        short = scene.with_run(duration_s=0.5, frames=5, impulses=True)
        simulate(short.with_contact(stiffness_N_per_m=stiffness), "lammps", folder)
        found = compare_windows(rigid, folder).contacts
        one, other = (np.hypot(found[f"{run}_run_x_Ns"], found[f"{run}_run_y_Ns"]).sum()
                      for run in ("first", "second"))  # fmt: skip
        differences.append(abs(other / one - 1))
    assert differences[1] < 0.1
    assert differences[1] < 0.5 * differences[0]


def test_what_is_not_alike_is_not_compared(scene, rigid, tmp_path):
    heavier = scene.snapshot.mass.copy()
    heavier[6] = 80.0
    snapshot = dataclasses.replace(scene.snapshot, mass=heavier)
    for change, message in (
        ({"snapshot": snapshot}, r"mass \(kg\) of disk 7: 80.0, not 75.0"),
        ({"snapshot": make("arch", disks=20).snapshot}, "20 people, not 30"),
        ({"walls": scene.walls[:-1]}, "other walls"),
    ):
        with pytest.raises(DumpError, match=message):
            check_same_crowd((rigid, scene), (tmp_path, scene.model_copy(update=change)))
    check_same_crowd((rigid, scene), (tmp_path, scene.with_contact(stiffness_N_per_m=1e7)))
    with pytest.raises(DumpError, match=r"window: 0\.05 s. Below 0\.1 s"):
        compare_windows(rigid, rigid, 0.05)
    later = shutil.copytree(rigid, tmp_path / "later")
    record = RunRecord.read(later)
    dataclasses.replace(record, time_step_s=1.37 * record.time_step_s).finished(later).write(later)
    with pytest.raises(DumpError, match="no two frames at instants of"):
        compare_windows(rigid, later)
