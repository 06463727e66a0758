"""Approximate Bayesian computation: what runs of known parameters say of a crowd that is only seen.

Of the runs whose statistics are nearest (Mahalanobis distance), a local linear regression carries each
coordinate to the seen statistics, with weights of Epanechnikov and residuals over 1 − leverage
(Beaumont, Zhang, Balding, Genetics 162 (2002) 2025)."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from nscd.arrays import Floats

# Share of runs that are taken, and their least number; the largest leverage that is divided by.
NEAREST, FEWEST, LEVERAGE = 0.3, 40, 0.9
# Of the distance of a crowd to its nearest runs; and which quantiles make an interval.
NEIGHBOURS, INTERVAL = 5, (0.05, 0.5, 0.95)


class Posterior(NamedTuple):
    """Hold a sample (m,k), its weights (m,), the residuals (m,k) of the regression, and how far that is from
    its middle: the variance of a mean there over that in the middle."""

    sample: Floats
    weight: Floats
    residual: Floats
    stretch: float

    def quantiles(self) -> Floats:
        """Give the quantiles INTERVAL (3,k) of each coordinate."""
        order = np.argsort(self.sample, axis=0, kind="stable")
        values, weight = np.take_along_axis(self.sample, order, axis=0), self.weight[order]
        middle = (np.cumsum(weight, axis=0) - 0.5 * weight) / self.weight.sum()
        each = zip(middle.T, values.T, strict=True)
        return np.array([np.interp(INTERVAL, at, value) for at, value in each]).T

    def owed(self, of: int) -> Floats:
        """Give what share (k,) of the scatter of one coordinate goes with each: r² of residuals."""
        apart = self.residual - np.average(self.residual, axis=0, weights=self.weight)
        both, own = (self.weight @ (apart * other) for other in (apart[:, [of]], apart))
        return np.asarray(both**2 / np.maximum(own * own[of], 1e-300))


class Reference(NamedTuple):
    """Hold runs of known coordinates (n,k), without bounds, and the statistics (n,s) seen of each."""

    coordinates: Floats
    statistics: Floats

    def _white(self, seen: Floats) -> tuple[Floats, Floats]:
        """Runs and a crowd, with statistics that do not correlate and scatter by 1."""
        middle, spread = self.statistics.mean(0), np.atleast_2d(np.cov(self.statistics.T))
        inverse = np.linalg.inv(np.linalg.cholesky(spread + 1e-9 * np.eye(len(middle))))
        return (self.statistics - middle) @ inverse.T, (seen - middle) @ inverse.T

    def posterior(self, seen: Floats, without: int | None = None) -> Posterior:
        """Infer the coordinates of a crowd with these statistics (s,), from all runs but one."""
        runs, crowd = self._white(seen)
        distance = np.sqrt(((runs - crowd) ** 2).sum(1))
        if without is not None:
            distance[without] = np.inf
        near = np.argsort(distance, kind="stable")[: min(len(runs) - 1, max(FEWEST, round(NEAREST * len(runs))))]
        weight = 1 - (distance[near] / (distance[near[-1]] + 1e-9)) ** 2 + 1e-6
        terms = np.concatenate([np.ones((len(near), 1)), runs[near] - crowd], axis=1)
        inverse = np.linalg.pinv((terms.T * weight) @ terms)
        hat = inverse @ (terms.T * weight)
        fitted, own = hat @ self.coordinates[near], np.minimum((terms * hat.T).sum(1), LEVERAGE)
        residual = (self.coordinates[near] - terms @ fitted) / (1 - own)[:, None]
        return Posterior(fitted[0] + residual, weight, residual, float(inverse[0, 0] * weight.sum()))

    def left_out(self) -> tuple[Floats, Floats]:
        """Infer each run from all others: quantiles (n,3,k), and how far (n,) the regression stretches."""
        each = [self.posterior(seen, n) for n, seen in enumerate(self.statistics)]
        return np.array([one.quantiles() for one in each]), np.array([one.stretch for one in each])

    def misfit(self, seen: Floats, stretch: Floats | None = None) -> float:
        """Give the share of runs that are nearer to their five nearest runs than this crowd, or whose
        regression stretches less far (n,) where that is more; 1 for a number beyond that of all runs."""
        if ((self.statistics < seen).all(0) | (self.statistics > seen).all(0)).any():
            return 1.0
        runs, crowd = self._white(seen)
        tree = cKDTree(runs)
        own = tree.query(runs, k=NEIGHBOURS + 1)[0][:, 1:].mean(1)
        far = float((own < tree.query(crowd, k=NEIGHBOURS)[0].mean()).mean())
        return far if stretch is None else max(far, float((stretch < self.posterior(seen).stretch).mean()))
