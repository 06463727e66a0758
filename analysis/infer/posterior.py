"""Approximate Bayesian computation: what runs of known parameters say of a crowd that is only seen.

Of the runs whose statistics are nearest (Mahalanobis distance), a local linear regression carries each
parameter to the seen statistics, with weights of Epanechnikov and residuals over 1 − leverage
(Beaumont, Zhang, Balding, Genetics 162 (2002) 2025)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from nscd.arrays import Floats

# Share of runs that are taken, and their least number; largest leverage that is divided by.
NEAREST, FEWEST, LEVERAGE = 0.3, 40, 0.9
# A crowd is farther from its nearest runs than so many runs are from theirs: nothing fits.
NEIGHBOURS, FITS = 5, 0.95
INTERVAL = (0.05, 0.5, 0.95)


class Posterior(NamedTuple):
    """Hold a weighted sample: coordinates (m,k), the weight of each (m,), and residuals (m,k)."""

    sample: Floats
    weight: Floats
    residual: Floats

    def quantiles(self, at: tuple[float, ...] = INTERVAL) -> Floats:
        """Give quantiles (q,k) of each coordinate."""
        order = np.argsort(self.sample, axis=0)
        values = np.take_along_axis(self.sample, order, axis=0)
        weight = np.cumsum(self.weight[order], axis=0)
        middle = (weight - 0.5 * self.weight[order]) / weight[-1]
        columns = zip(middle.T, values.T, strict=True)
        return np.array([np.interp(at, one, value) for one, value in columns]).T

    def owed(self, of: int) -> Floats:
        """Give what share (k,) of the scatter of one coordinate goes with each: the squared weighted
        correlation of residuals."""
        shifted = self.residual - np.average(self.residual, axis=0, weights=self.weight)
        both = (self.weight[:, None] * shifted * shifted[:, [of]]).sum(0)
        own = (self.weight[:, None] * shifted * shifted).sum(0)
        return np.asarray(both**2 / np.maximum(own * own[of], 1e-300))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """Hold runs of known parameters.

    coordinates: (n,k), of parameters and of what follows from them, without bounds
    statistics: (n,s), what was seen of each run"""

    coordinates: Floats
    statistics: Floats

    def _white(self, seen: Floats) -> tuple[Floats, Floats]:
        """Runs and a crowd with statistics that do not correlate and scatter by 1."""
        middle = self.statistics.mean(0)
        scatter = np.atleast_2d(np.cov(self.statistics.T)) + 1e-9 * np.eye(len(middle))
        inverse = np.linalg.inv(np.linalg.cholesky(scatter))
        return (self.statistics - middle) @ inverse.T, (seen - middle) @ inverse.T

    def posterior(self, seen: Floats, without: int | None = None) -> Posterior:
        """Infer the coordinates of a crowd with these statistics (s,), from all runs but one."""
        runs, crowd = self._white(seen)
        distance = np.sqrt(((runs - crowd) ** 2).sum(1))
        if without is not None:
            distance[without] = np.inf
        count = min(len(runs) - 1, max(FEWEST, round(NEAREST * len(runs))))
        near = np.argsort(distance, kind="stable")[:count]
        reach = max(float(distance[near[-1]]) * (1 + 1e-9), 1e-12)
        weight = 1 - (distance[near] / reach) ** 2 + 1e-6
        terms = np.concatenate([np.ones((count, 1)), runs[near] - crowd], axis=1)
        inverse = np.linalg.pinv((terms.T * weight) @ terms)
        hat = inverse @ (terms.T * weight)
        fitted = hat @ self.coordinates[near]
        leverage = np.minimum((terms * hat.T).sum(1), LEVERAGE)
        residual = (self.coordinates[near] - terms @ fitted) / (1 - leverage)[:, None]
        return Posterior(fitted[0] + residual, weight, residual)

    def left_out(self) -> Floats:
        """Infer each run from all others: quantiles INTERVAL, (n,3,k)."""
        each = enumerate(self.statistics)
        return np.array([self.posterior(seen, n).quantiles() for n, seen in each])

    def misfit(self, seen: Floats) -> float:
        """Give the share of runs that are nearer to their five nearest runs than this crowd."""
        runs, crowd = self._white(seen)
        tree = cKDTree(runs)
        own = tree.query(runs, k=NEIGHBOURS + 1)[0][:, 1:].mean(1)
        return float((own < tree.query(crowd, k=NEIGHBOURS)[0].mean()).mean())
