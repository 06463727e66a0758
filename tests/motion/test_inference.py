"""Ranges and verdicts over replicates: against enumeration, and against what they promise."""

import numpy as np
import pytest
from scipy.stats import binom, permutation_test, poisson

from analysis.motion.inference import (
    Sample,
    differences,
    next_to_zero,
    range_of_counts,
    range_of_windows,
)

TENTH = 0.1 + 1e-12


def alone(mine, theirs, **kinds):
    """The difference of one quantity."""
    samples = (Sample(values=np.array(values, dtype=float), **kinds) for values in (mine, theirs))
    (found,) = (differences(*({"x": one} for one in samples)) or {"x": None}).values()
    return found


def by_scipy(mine, theirs):
    """Two-sided p of the difference of means, over all ways to share out the labels."""
    return permutation_test(
        (mine, theirs),
        lambda x, y, axis: np.abs(x.mean(axis) - y.mean(axis)),
        n_resamples=np.inf,
        alternative="greater",
        vectorized=True,
    ).pvalue


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
    for to, seen in ((0.97, False), (1.01, True)):
        moved = mine + theirs.mean() * (to * found.least - found.value)
        assert alone(moved, theirs).significant == seen


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
    told = sum(
        any(one.significant for one in differences(model(), model()).values()) for _ in range(draws)
    )
    assert told <= binom.ppf(0.999, draws, 0.1)
    assert told >= binom.ppf(0.001, draws, 0.03)  # it is a test, and tells models apart


@pytest.mark.parametrize("counts", [[2, 2, 5], [1, 4, 4], [0, 0, 0], [0] * 10])
def test_a_range_of_counts_by_enumeration(counts):
    """With a variance equal to the mean, a further count is binomial given the sum."""
    counts = np.array(counts, dtype=float)
    assert counts.var(ddof=1) == pytest.approx(counts.mean())
    total, share = int(counts.sum()), 1 / (len(counts) + 1)
    kept = [
        y
        for y in range(60)
        if binom.sf(y - 1, total + y, share) > 0.05
        and (not total or binom.cdf(y, total + y, share) > 0.05)
    ]
    assert range_of_counts(counts) == (kept[0], kept[-1])


@pytest.mark.parametrize("mean", [0.5, 2.0, 7.0])
@pytest.mark.parametrize("count", [3, 5, 10])
def test_ranges_of_counts_hold_nine_in_ten_of_poissons(mean, count):
    random = np.random.default_rng(5)
    held = []
    for _ in range(150):
        low, high = range_of_counts(random.poisson(mean, count).astype(float))
        held.append(poisson.cdf(high, mean) - poisson.cdf(low - 1, mean))
    assert 0.88 < np.mean(held) <= 1


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
    held = []
    for _ in range(100):
        low, high = range_of_windows(list(replicates(count)))
        held.append(((further >= low) & (further <= high)).mean())
    assert 0.86 < np.mean(held) < 0.94


@pytest.mark.parametrize("count", [3, 5])
def test_ranges_of_one_number_per_replicate_are_students(count):
    random = np.random.default_rng(7)
    further = random.normal(10, 1, 2000)
    held = []
    for _ in range(300):
        low, high = range_of_windows([random.normal(10, 1, 1) for _ in range(count)])
        held.append(((further >= low) & (further <= high)).mean())
    assert np.mean(held) == pytest.approx(0.9, abs=0.025)
