"""Approximate Bayesian computation: what runs of known parameters say of a crowd that is only seen.

Many statistics become few summaries: what a ridge regression on them, their squares and products says of
the coordinates (Fearnhead, Prangle, J. R. Stat. Soc. B 74 (2012) 419), of each run without itself. Of the
runs whose summaries are nearest, a local linear regression carries each coordinate to the seen ones, with
weights of Epanechnikov and residuals over 1 − leverage (Beaumont, Zhang, Balding, Genetics 162 (2002) 2025)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from nscd.arrays import Floats

# Share of runs that are taken, and their least number; the largest leverage that is divided by.
NEAREST, FEWEST, LEVERAGE = 0.3, 40, 0.9
# Of the distance of a crowd to its nearest runs; and which quantiles make an interval.
NEIGHBOURS, INTERVAL = 5, (0.05, 0.5, 0.95)
# Of regressions: the ridge, scatters at which numbers are cut, and what share of the variance makes a summary;
# and how far covariances of residuals are drawn to none.
RIDGE, CUT, TOLD, SHRINK = 0.01, 2.5, 0.4, 0.05


class Posterior(NamedTuple):
    """Hold a sample (m,k), its weights (m,), and the residuals (m,k) of the regression."""

    sample: Floats
    weight: Floats
    residual: Floats

    def quantiles(self) -> Floats:
        """Give the quantiles INTERVAL (3,k) of each coordinate."""
        order = np.argsort(self.sample, axis=0, kind="stable")
        values, weight = np.take_along_axis(self.sample, order, axis=0), self.weight[order]
        middle = (np.cumsum(weight, axis=0) - 0.5 * weight) / self.weight.sum()
        each = zip(middle.T, values.T, strict=True)
        return np.array([np.interp(INTERVAL, at, value) for at, value in each]).T

    def owed(self, of: int) -> Floats:
        """Give what share (k,) of the scatter of one coordinate goes with each: r² of residuals."""
        difference = self.residual - np.average(self.residual, axis=0, weights=self.weight)
        both, own = (self.weight @ (difference * other) for other in (difference[:, [of]], difference))
        return np.asarray(both**2 / np.maximum(own * own[of], 1e-300))


class Quadratic:
    """A ridge regression of values (n,k) on numbers (n,s), their squares and products.

    left_out: (n,k), of each the value that the regression on all others gives"""

    def __init__(self, numbers: Floats, values: Floats) -> None:
        self.middle, self.scatter = numbers.mean(0), numbers.std(0) + 1e-9
        self.offset, terms = values.mean(0), self._terms(numbers)
        spread = terms.T @ terms + RIDGE * len(terms) * np.eye(terms.shape[1])
        hat = np.linalg.solve(spread, terms.T)
        self.weight = hat @ (values - self.offset)
        own = np.minimum((terms * hat.T).sum(1) + 1 / len(terms), LEVERAGE)[:, None]
        self.left_out = values - (values - self(numbers)) / (1 - own)

    def _terms(self, numbers: Floats) -> Floats:
        scaled = np.clip((numbers - self.middle) / self.scatter, -CUT, CUT)
        one, other = np.triu_indices(scaled.shape[1])
        return np.concatenate([scaled, scaled[:, one] * scaled[:, other] - (one == other)], axis=1)

    def __call__(self, numbers: Floats) -> Floats:
        """Give the values (m,k) of numbers (m,s)."""
        return np.asarray(self.offset + self._terms(numbers) @ self.weight)


class Reference:
    """Runs of known coordinates (n,k), and the statistics (n,s) seen of each."""

    def __init__(self, coordinates: Floats, statistics: Floats) -> None:
        self.coordinates, self.statistics = coordinates, statistics
        self._scatter = coordinates.std(0) + 1e-12
        self._summary = Quadratic(statistics, coordinates / self._scatter)
        informative = 1 - ((self._summary.left_out - coordinates / self._scatter) ** 2).mean(0)
        self._informative = np.flatnonzero(informative >= min(TOLD, informative.max()))
        self.summaries = self._summary.left_out[:, self._informative]
        self._usual = Quadratic(self.summaries, statistics)

    def summary(self, observed: Floats) -> Floats:
        """Give the summaries of a crowd with these statistics (s,)."""
        return np.asarray(self._summary(observed[None])[0, self._informative])

    def posterior(self, observed: Floats, without: int | None = None) -> Posterior:
        """Infer the coordinates of a crowd with these statistics (s,), or of a run from all others."""
        crowd = self.summary(observed) if without is None else self.summaries[without]
        distance = np.sqrt(((self.summaries - crowd) ** 2).sum(1))
        if without is not None:
            distance[without] = np.inf
        near = np.argsort(distance, kind="stable")[: min(len(distance) - 1, max(FEWEST, round(NEAREST * len(distance))))]
        weight = 1 - (distance[near] / (distance[near[-1]] + 1e-9)) ** 2 + 1e-6
        terms = np.concatenate([np.ones((len(near), 1)), self.summaries[near] - crowd], axis=1)
        hat = np.linalg.pinv((terms.T * weight) @ terms) @ (terms.T * weight)
        fitted, own = hat @ self.coordinates[near], np.minimum((terms * hat.T).sum(1), LEVERAGE)
        residual = (self.coordinates[near] - terms @ fitted) / (1 - own)[:, None]
        return Posterior(fitted[0] + residual, weight, residual)

    def unusual(self, observed: Floats) -> Floats:
        """Give by how many standard deviations statistics (s,) differ from those of runs with such summaries."""
        rest = self.statistics - self._usual.left_out
        return np.asarray((observed - self._usual(self.summary(observed)[None])[0]) / (rest.std(0) + 1e-12))

    def left_out(self) -> Floats:
        """Infer each run from all others: quantiles (n,3,k)."""
        return np.array([self.posterior(observed, n).quantiles() for n, observed in enumerate(self.statistics)])

    def misfit(self, observed: Floats) -> float:
        """Give the share of runs that are less odd than a crowd with these statistics (s,).

        Odd is who is far from the five runs with the nearest summaries, or whose statistics are not those
        that runs with such summaries have (Mahalanobis distance of what is left of them)."""
        crowd = self.summary(observed)
        tree, rest = cKDTree(self.summaries), self.statistics - self._usual.left_out
        spread = np.atleast_2d(np.cov(rest.T))
        spread = (1 - SHRINK) * spread + SHRINK * np.diag(np.diag(spread)) + 1e-12 * np.eye(len(observed))
        rest = np.concatenate([rest, (observed - self._usual(crowd[None])[0])[None]])
        near = tree.query(self.summaries, k=NEIGHBOURS + 1)[0][:, 1:].mean(1), tree.query(crowd, k=NEIGHBOURS)[0].mean()
        odd = np.append(*near), np.einsum("ij,ij->i", rest, np.linalg.solve(spread, rest.T).T)
        worst = np.maximum(*((each[:, None] > each[:-1]).mean(1) + 1e-6 * each / each[:-1].max() for each in odd))
        return float((worst[:-1] < worst[-1]).mean())
