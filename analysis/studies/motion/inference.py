"""Statistics of replicates: ranges that hold further replicates, and differences of two models with
one correction for all quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
from scipy.special import betainc
from scipy.stats import t as student

from nscd.arrays import Floats, Mask

LEVEL = 0.90
TAIL = 0.5 - LEVEL / 2
# Numbers that differ by less than this share of the largest are equal but for rounding.
ROUNDING = 1e-9
# Of a p that counts as a difference.
ALPHA = 1 - LEVEL + ROUNDING
# Below this an autocorrelation is noise.
UNCORRELATED = 0.05
# A test permutes the labels of replicates in every way, or of more than ALL ways in DRAWN.
ALL, DRAWN = 5000, 2000
# The noise within replicates counts like so many further degrees of freedom (moderated t: Smyth
# 2004, Stat. Appl. Genet. Mol. Biol. 3, 3): few replicates that are alike by chance are no proof.
OF_NOISE = 2.0
# Of replicates: fewer of either model are not compared.
FEWEST = 3
# An end of an interval: how often its first guess is doubled, and then halved.
DOUBLINGS, HALVINGS = 20, 16
# As many values have extremes that hold 90 % of further ones.
NINETEEN = 19
# A difference is a share of the other mean, unless the interval of that reaches below this share of
# its high end.
NEXT_TO_ZERO = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """Hold a quantity of one model, one number per replicate.

    unit: of the quantity per unit of the values: 1, or 1/s where counts become a rate"""

    values: Floats  # (n,) means over windows; of a count how many were counted
    noise: float = 0.0  # variance that such a number has from the chance within a replicate
    unit: float = 1.0
    is_count: bool = False  # whether the values are counts

    @classmethod
    def of_windows(cls, windows: Sequence[Floats]) -> Sample:
        """Take the mean of the windows (w,) of each replicate, and their noise by correlation."""
        inside = float(np.mean([one.var() for one in windows]))
        count = min(map(len, windows)) / correlation_windows([w - w.mean() for w in windows])
        values = np.array([one.mean() for one in windows])
        return cls(values=values, noise=inside / count)

    @classmethod
    def of_counts(cls, counts: Floats, seconds: float) -> Sample:
        """Take counts over so many seconds, which are Poisson-like: their noise is their mean."""
        return cls(
            values=np.rint(counts), noise=float(counts.mean()), unit=1 / seconds, is_count=True
        )


    @classmethod
    def of_rates(cls, counts: Floats, seconds: Floats) -> Sample:
        """Take counts over seconds of their own (n,) as rates, whose noise is that of such counts."""
        return cls(values=counts / seconds, noise=float(counts.mean() / seconds.mean() ** 2), is_count=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Hold by how much the mean of one model is above that of another.

    value: a share of the other mean; in the unit of the quantity where that is next to zero
    low, high: the joint 90 % interval of all quantities of this pair of models
    least: the smallest difference, either way, that these replicates would have shown; infinite
        where they are too few for any
    stops: whether one model counts nothing in any replicate and the other something in each"""

    value: float
    low: float
    high: float
    least: float
    relative: bool  # whether all of these are shares
    probability: float  # p of the joint permutation test
    stops: bool = False

    @property
    def significant(self) -> bool:
        """Whether the models differ: p is at most 10 %, for all quantities together."""
        return self.probability <= ALPHA


def differences(mine: Mapping[str, Sample], theirs: Mapping[str, Sample]) -> dict[str, Difference]:
    """Compare the quantities that all replicates of two models have, largest effects first.

    The labels of the replicates are permuted, all quantities of a replicate together (Westfall &
    Young 1993, max-t, single-step). A quantity differs where its moderated |t| is beyond what the
    largest of all quantities reaches in 90 % of the permutations. If both models are one, any
    quantity is called different in at most 10 % of such comparisons, whatever the distributions. A
    count of zero in all replicates of one model and in none of the other is the largest effect.

    None is compared where a model has fewer than three replicates, nor one that is zero in all."""
    sizes = [
        max((len(one.values) for one in every.values()), default=0) for every in (mine, theirs)
    ]
    if min(sizes) < FEWEST:
        return {}
    labels = _labels(*sizes)
    tests = {
        name: _Test(mine[name], theirs[name], labels)
        for name in mine
        if name in theirs
        and [len(mine[name].values), len(theirs[name].values)] == sizes
        and mine[name].unit == theirs[name].unit  # counted for as long
    }
    every = np.array([test.observed() for test in tests.values()])
    found = {
        name: test.difference(np.delete(every, number, axis=0).max(axis=0, initial=0.0))
        for number, (name, test) in enumerate(tests.items())
        if test.values.any()
    }
    return dict(sorted(found.items(), key=lambda item: (not item[1].stops, item[1].probability)))


class _Test:
    """One quantity under all permutations of the labels."""

    def __init__(self, mine: Sample, theirs: Sample, labels: Mask) -> None:
        self.mine, self.theirs, self.labels = mine, theirs, labels
        self.values = np.concatenate([mine.values, theirs.values])
        self.rounding = ROUNDING * float(np.abs(self.values).max())
        self.noise = 0.5 * (mine.noise + theirs.noise)
        zero = self.values == 0
        stops = mine.is_count and zero.any() and not zero.all()
        self.stops = stops & ((labels == zero).all(1) | (labels == ~zero).all(1))

    def sizes(self, shift: float) -> Floats:
        """|t| (permutations,) where `mine` is less by a shift."""
        labels, mine = self.labels, self.labels[0]
        first, second = int(mine.sum()), int((~mine).sum())
        weight = 1 / first + 1 / second
        values = self.values - mine * shift
        values = values - values.mean()
        sums = np.abs(labels @ values)
        inside = np.maximum((values**2).sum() - sums**2 * weight, 0.0)
        variance = (inside + OF_NOISE * self.noise) / (first + second - 2 + OF_NOISE)
        difference = np.where(sums * weight > self.rounding, sums * weight, 0.0)
        # a variance that is rounding is none: replicates that are all alike
        spread = np.sqrt(np.where(variance > self.rounding**2, variance, 0.0) * weight)
        return np.divide(difference, spread, out=np.where(difference > 0, np.inf, 0.0), where=spread > 0)

    def observed(self) -> Floats:
        """|t| (permutations,) of the replicates as they are; infinite where a flow stops."""
        return np.where(self.stops, np.inf, self.sizes(0.0))

    def difference(self, rest: Floats) -> Difference:
        """The difference with the interval of all shifts that are not excluded."""
        value, other = (float(one.values.mean()) for one in (self.mine, self.theirs))
        value = 0.0 if abs(value - other) <= self.rounding else value - other
        down, up = self._reach(rest, value, -1), self._reach(rest, value, 1)
        relative = not next_to_zero(self.theirs.values)
        size = other if relative else 1 / self.mine.unit
        return Difference(
            value=value / size,
            low=max(value - down, -other) / size,  # nothing here is ever negative
            high=(value + up) / size,
            least=max(down, up) / size,
            relative=relative,
            probability=_probability(self.observed(), rest),
            stops=bool(self.stops[0]),
        )

    def _reach(self, rest: Floats, value: float, sign: int) -> float:
        """How far from the value a shift is excluded, by bisection; infinite where none is."""
        near, far = 0.0, float(np.ptp(self.values) + np.sqrt(self.noise)) + self.rounding
        for _ in range(DOUBLINGS):
            if _probability(self.sizes(value + sign * far), rest) <= ALPHA:
                break
            near, far = far, 2 * far
        else:
            return float("inf")
        for _ in range(HALVINGS):
            middle = 0.5 * (near + far)
            is_excluded = _probability(self.sizes(value + sign * middle), rest) <= ALPHA
            near, far = (near, middle) if is_excluded else (middle, far)
        return far if far > 2 * self.rounding else 0.0


def _probability(sizes: Floats, rest: Floats) -> float:
    """p of |t| (permutations,), the first of which was observed; rest: the largest |t|
    (permutations,) of all other quantities."""
    return float(np.mean(np.maximum(sizes, rest) >= sizes[0] * (1 - ROUNDING)))


def _labels(first: int, second: int) -> Mask:
    """Which replicates (permutations, n) are called the first model's, as observed in row 0."""
    every = first + second
    if comb(every, first) <= ALL:
        chosen = np.array(list(combinations(range(every), first)))
    else:
        random = np.random.default_rng(0)
        drawn = random.permuted(np.tile(np.arange(every), (DRAWN, 1)), axis=1)[:, :first]
        chosen = np.vstack([np.arange(first), drawn])
    labels = np.zeros((len(chosen), every), dtype=bool)
    np.put_along_axis(labels, chosen, True, axis=1)
    return labels


def next_to_zero(values: Floats) -> bool:
    """Tell whether the interval of a mean (Student's t) reaches down to next to zero, so that a
    share of it means nothing."""
    mean, count = float(values.mean()), len(values)
    half = 0.0
    if count > 1:
        half = student.ppf(1 - TAIL, count - 1) * float(values.std(ddof=1)) / np.sqrt(count)
    return not mean - half > NEXT_TO_ZERO * (mean + half)


def range_of_windows(windows: Sequence[Floats]) -> tuple[float, float]:
    """Give the range that holds 90 % of the windows of further replicates.

    windows: (w,) of each replicate. The quantiles of all are moved away from their median as a
    prediction by Student's t is wider from as many independent windows as there are; below 19
    windows, whose extremes hold less, they are that prediction."""
    pooled = np.concatenate(windows)
    independent = max(len(pooled) / correlation_windows(windows), 2.0)
    if len(pooled) < NINETEEN:
        middle, half = float(pooled.mean()), _reach_of_t(independent) * float(pooled.std(ddof=1))
        return max(middle - half, 0.0), middle + half
    middle = float(np.median(pooled))
    wider = _reach_of_t(independent) / _reach_of_t(len(pooled))
    low, high = middle + wider * (np.quantile(pooled, [TAIL, 1 - TAIL], method="weibull") - middle)
    return max(float(low), 0.0), float(high)


def _reach_of_t(count: float) -> float:
    """How many standard deviations from the mean of so many values 90 % of further ones are."""
    return float(student.ppf(1 - TAIL, count - 1) * np.sqrt(1 + 1 / count))


def range_of_counts(counts: Floats) -> tuple[float, float]:
    """Give the range that holds 90 % of the counts of further replicates; at least, if they are
    Poisson's.

    Given the sum K of n counts and a further count y, y is binomial of K + y with p = 1/(n + 1): it
    is in the range unless a tail there is 5 % or less (Nelson 1970, J. Qual. Technol. 2, 86). Where
    the variance is f times the mean, moderated as that of a test, all counts are taken over f."""
    total, n = float(counts.sum()), len(counts)
    over = 1.0
    if total and n > 1:
        over = float(counts.var(ddof=1)) * n / total
        over = ((n - 1) * over + OF_NOISE) / (n - 1 + OF_NOISE)
    # far into the upper tail
    y = np.arange(0.0, 10 + 10 * over + 5 * total)
    minimum, maximum = np.ones((2, len(y)))
    maximum[1:] = betainc(y[1:] / over, total / over + 1, 1 / (n + 1))  # P(as many or more)
    if total:
        minimum = betainc(total / over, y / over + 1, n / (n + 1))  # P(as few or fewer)
    likely = y[(minimum > TAIL) & (maximum > TAIL)]
    return float(likely[0]), float(likely[-1])


def correlation_windows(samples: Sequence[Floats]) -> float:
    """Count how many windows make one independent one: 1 + 2 Σ ρ of the windows of a replicate about
    the mean of all, until the correlation is lost; at most all windows of a replicate."""
    every = np.stack(samples) - np.concatenate(samples).mean()
    windows = every.shape[1]
    variance = float((every**2).mean())
    total = 1.0
    for lag in range(1, windows):
        rho = float((every[:, lag:] * every[:, :-lag]).mean()) / variance if variance else 0.0
        if rho < UNCORRELATED:
            break
        total += 2 * rho
    return min(total, float(windows))
