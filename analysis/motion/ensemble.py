"""Intervals over crowds and instants, and whether two models differ by more than they vary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from analysis.motion.series import Series
from nscd.arrays import Floats

LEVEL = 0.90
RESAMPLES = 2000
# Below this an autocorrelation is noise.
UNCORRELATED = 0.05
# A quantity whose interval reaches from its high end below this share of it is next to zero: a
# ratio to it may be tenfold by chance.
NEXT_TO_ZERO = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Hold a median with a 90 % interval over crowds and instants.

    median, low, high: in the unit of the measure
    crowds, windows: of each, how many there are
    independent: how many of all windows count as independent, by their correlation time
    alike: how many numbers there are, where all are equal; else 0. Equal numbers do not say by how
        much others vary, so their interval, of no width, is no certainty
    """

    median: float
    low: float
    high: float
    crowds: int
    windows: int
    independent: float
    alike: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Hold by how much one number is above another.

    value: a share of the other; in the unit of the quantity where that is next to zero
    low, high: 90 % interval of it
    relative: whether it is a share
    """

    value: float
    low: float
    high: float
    relative: bool = True

    @property
    def distinguishable(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensemble:
    """Hold the series of one model over its crowds.

    title: of the model, as a page names it
    engine: its name in commands
    series: one per crowd
    last_s: s, how much of the end of each run counts
    """

    title: str
    engine: str
    series: Sequence[Series]
    last_s: float

    def samples(self, measure: str) -> list[Floats]:
        """Give the windows (w,) of each crowd that count. The flow and the lifetime of arches are
        one number per crowd: people pass one by one, and in a window there are none or one."""
        if measure == "arch_lifetime":
            lives = [series.lifetimes(self.last_s) for series in self.series]
            return [np.array([np.mean(one)]) for one in lives if len(one)]
        chosen = [series.values[measure][series.last(self.last_s)] for series in self.series]
        return [values.mean(keepdims=True) for values in chosen] if measure == "flow" else chosen

    def interval(self, measure: str) -> Interval:
        """Give the median and the 90 % interval of all windows of all crowds."""
        samples = self.samples(measure)
        if not samples:
            none = float("nan")
            return Interval(median=none, low=none, high=none, crowds=0, windows=0, independent=0.0)
        pooled = np.concatenate(samples)
        low, high = _ends(pooled)
        return Interval(
            median=float(np.median(pooled)),
            low=low,
            high=high,
            crowds=len(samples),
            windows=len(samples[0]),
            independent=len(pooled) / correlation_windows(samples),
            alike=0 if np.ptp(pooled) else len(pooled),
        )

    def above(self, other: Ensemble, measure: str) -> Difference | None:
        """Compare the medians with those of another model, by drawing crowds again (bootstrap, its
        quantiles farther out the fewer crowds there are).

        None where both are zero, where either has fewer than three crowds, and where the crowds of
        each are all equal: nothing says then how far chance reaches."""
        mine, theirs = self.samples(measure), other.samples(measure)
        if min(len(mine), len(theirs)) < 3:
            return None
        random = np.random.default_rng(0)
        drawn, others = _drawn(mine, random), _drawn(theirs, random)
        if not (drawn.any() or others.any()):
            return None
        median, reference = (float(np.median(np.concatenate(one))) for one in (mine, theirs))
        relative = not next_to_zero(*_ends(others))
        apart = drawn / others - 1 if relative else drawn - others
        if not np.ptp(apart):
            return None
        low, high = _ends(apart, _tail(min(len(mine), len(theirs))))
        value = median / reference - 1 if relative else median - reference
        return Difference(value=value, low=low, high=high, relative=relative)


def next_to_zero(low: float, high: float) -> bool:
    """Tell whether an interval of a quantity that is not negative reaches down to next to zero, so
    that a share of it means nothing."""
    return not low > NEXT_TO_ZERO * high


def _ends(values: Floats, tail: float = 0.5 - LEVEL / 2) -> tuple[float, float]:
    """The interval of values that leaves out a share at either end; of 90 % where that is left
    out."""
    low, high = np.quantile(values, [tail, 1 - tail])
    return float(low), float(high)


def _tail(crowds: int) -> float:
    """The share of drawn medians to leave out at either end for a 90 % interval.

    Few crowds drawn again vary less than crowds do: three would hold the truth 76 times in 100
    instead of 90, five 83 times. The quantiles are moved out as Student's t is beyond the normal
    one: Φ(−√(n/(n − 1)) t) (Hesterberg 2015, Am. Stat. 69, 371–386, expanded percentiles)."""
    reach = np.sqrt(crowds / (crowds - 1)) * student.ppf(0.5 + LEVEL / 2, crowds - 1)
    return float(norm.cdf(-reach))


def _drawn(samples: Sequence[Floats], random: np.random.Generator) -> Floats:
    """The medians of as many crowds, drawn with replacement, RESAMPLES times."""
    chosen = random.integers(0, len(samples), (RESAMPLES, len(samples)))
    medians: Floats = np.median(np.stack(samples)[chosen].reshape(RESAMPLES, -1), axis=1)
    return medians


def correlation_windows(samples: Sequence[Floats]) -> float:
    """Count how many windows make one independent one: 1 + 2 Σ ρ of the windows of a crowd about
    the mean of all, until the correlation is lost; at most all windows of a crowd."""
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
