"""Whether two models approach each other as contacts grow stiffer: a fit over stiffnesses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import linregress, t

from analysis.compare.comparison import FEWEST
from analysis.compare.study import Study
from nscd import Snapshot

LEVEL = 0.90
# Positions (over the mean radius) that differ by less are the same.
SAME = 1e-6
MEASURES: Mapping[str, str] = {
    "contact": "per contact",
    "disk_sum": "per sum at a disk",
    "disk_vector": "per resultant of a disk",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Hold the power of k with which a difference grows: power, and its 90 % interval."""

    power: float
    low: float
    high: float

    @property
    def verdict(self) -> str:
        """Say what the interval allows to conclude."""
        if self.high < 0:
            return "approach each other"
        return "move apart" if self.low > 0 else "do not approach each other measurably"


def fit_power(stiffnesses: Sequence[float], differences: Sequence[float]) -> Fit | None:
    """Fit log(difference) = power · log(k) + c by least squares; None for fewer than four finite
    differences above 0. The interval is Student's, of the scatter about the line."""
    pairs = [(k, d) for k, d in zip(stiffnesses, differences, strict=True) if 0 < d < np.inf]
    if len({k for k, _ in pairs}) < FEWEST:
        return None
    found = linregress(*np.log(np.array(pairs)).T)
    reach = float(t.ppf(0.5 + LEVEL / 2, len(pairs) - 2)) * found.stderr
    return Fit(power=found.slope, low=found.slope - reach, high=found.slope + reach)


def moved_between(study: Study, engine: str) -> float:
    """Return the largest distance (m) between the places of a person in the runs of an engine; of
    runs begun anew of the people who were left, and between neighbouring stiffnesses."""
    mine = [c.snapshot for c in study.comparisons if c.record.engine == engine]
    if engine not in study.anew:
        return max((_apart(mine[0], one) for one in mine), default=0.0)
    return max(_apart(one, other) for one, other in pairwise(mine))


def _apart(one: Snapshot, other: Snapshot) -> float:
    """The largest distance (m) between the places of a person, of those in both."""
    _, here, there = np.intersect1d(one.ids, other.ids, return_indices=True)
    way = one.position[here] - other.position[there]
    return float(np.hypot(*way.T).max(initial=0.0))
