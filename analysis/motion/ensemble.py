"""One model over its replicates: each quantity with its range, and how it differs from another's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analysis.motion.inference import (
    Difference,
    Sample,
    correlation_windows,
    differences,
    range_of_counts,
    range_of_windows,
)
from analysis.motion.series import MEASURES, Series
from nscd.arrays import Floats

# What two models are compared in, all at once.
COMPARED = (*MEASURES, "wall_line_load")


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Hold a mean with the range that holds 90 % of further windows, of other replicates too.

    mean, low, high: in the unit of the measure; the range is NaN of a single replicate
    replicates, windows: of each, how many there are
    independent: how many of all windows count as independent, by their correlation time
    alike: how many windows there are, where all are equal; else 0. Equal numbers do not say by how
        much others vary, so their range, of no width, is no certainty
    """

    mean: float
    low: float
    high: float
    replicates: int
    windows: int
    independent: float
    alike: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensemble:
    """Hold the series of one model over its replicates.

    title: of the model, as a page names it
    engine: its name in commands
    series: one per replicate
    last_s: s, how much of the end of each run counts
    """

    title: str
    engine: str
    series: Sequence[Series]
    last_s: float

    def windows(self, measure: str) -> list[Floats]:
        """Give the windows (w,) of each replicate that count. The flow and the lifetime of arches
        are one number per replicate: people pass one by one, and in a window there are none or
        one."""
        if measure == "arch_lifetime":
            lives = [series.lifetimes(self.last_s) for series in self.series]
            return [np.array([np.mean(one)]) for one in lives if len(one)]
        chosen = [series.values[measure][series.last(self.last_s)] for series in self.series]
        return [values.mean(keepdims=True) for values in chosen] if measure == "flow" else chosen

    def sample(self, measure: str) -> Sample:
        """Give one number per replicate; of the flow how many people passed."""
        windows = self.windows(measure)
        if measure == "flow":
            return Sample.of_counts(np.concatenate(windows) * self._counted_s(), self._counted_s())
        return Sample.of_windows(windows)

    def interval(self, measure: str) -> Interval:
        """Give the mean, and the range that holds 90 % of further windows; of the flow, the counts
        of further replicates."""
        windows = self.windows(measure)
        low = high = mean = float("nan")
        independent, alike = 0.0, 0
        if windows:
            pooled = np.concatenate(windows)
            mean = float(pooled.mean())
            independent = len(pooled) / correlation_windows(windows)
            alike = 0 if np.ptp(pooled) or measure == "flow" else len(pooled)
        if len(windows) > 1 and measure == "flow":
            sample = self.sample(measure)
            low, high = (end * sample.unit for end in range_of_counts(sample.values))
        elif len(windows) > 1:
            low, high = range_of_windows(windows)
            high = min(high, 1.0) if measure == "arch_share" else high
            low, high = min(low, mean), max(high, mean)
        return Interval(
            mean=mean,
            low=low,
            high=high,
            replicates=len(windows),
            windows=len(windows[0]) if windows else 0,
            independent=independent,
            alike=alike,
        )

    def differences(self, other: Ensemble) -> dict[str, Difference]:
        """Say by how much each quantity is above that of another model, largest effects first, with
        one correction for all; empty where either has fewer than three replicates."""
        return _differences(self, other)

    def _counted_s(self) -> float:
        """How long the windows of a replicate that count last together (s)."""
        first = self.series[0]
        return float(first.last(self.last_s).sum()) * first.window_s


@lru_cache(maxsize=64)  # a page says them in several places
def _differences(one: Ensemble, other: Ensemble) -> dict[str, Difference]:
    both = [key for key in COMPARED if one.windows(key) and other.windows(key)]
    mine, theirs = ({key: of.sample(key) for key in both} for of in (one, other))
    return differences(mine, theirs)
