"""Whether something is uniform with respect to the distance to the exit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import kruskal

from analysis.pages.section import Verdict
from analysis.paper.discrete.pressed_crowd.arch import Arch
from nscd.arrays import Floats

LEAST_PEOPLE = 5  # in a ring that counts
CHANCE, RATIO = 1e-3, 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Uniformity:
    """How a quantity differs between rings of 1 m about the exit.

    least, most: of the rings' means
    chance: p of the hypothesis that the rings are alike (Kruskal–Wallis)
    scatter: standard deviation over mean of people in one ring
    """

    least: float
    most: float
    chance: float
    scatter: float

    @classmethod
    def of(cls, arch: Arch, values: Floats) -> Uniformity:
        """Compare the rings of an arch by values (n,) of its people."""
        ring = arch.rings()
        groups = [values[ring == r] for r in range(int(ring.max()) + 1)]
        groups = [group for group in groups if len(group) >= LEAST_PEOPLE]
        means = [group.mean() for group in groups]
        varies = np.ptp(np.concatenate(groups)) > 0
        return cls(
            least=float(min(means)),
            most=float(max(means)),
            chance=float(kruskal(*groups).pvalue) if varies else 1.0,
            scatter=float(np.mean([g.std() / g.mean() for g in groups if g.mean() > 0])),
        )

    @property
    def ratio(self) -> float:
        """The largest mean over the least."""
        return self.most / max(self.least, np.finfo(float).tiny) if self.most > 0 else 1.0

    @property
    def verdict(self) -> Verdict:
        """“Not uniform” holds where the rings differ beyond chance (p < 10⁻³) and their means by
        half or more; in part if only the first is so."""
        if self.chance >= CHANCE:
            return Verdict.FAILS
        return Verdict.of(True, self.ratio >= RATIO)
