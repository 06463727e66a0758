"""How near predicted forces come to measured ones, on contacts of two inner disks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import rankdata

from analysis.studies.measured.packing import Packing
from nscd.arrays import Floats

CHAINS = 0.1  # of the carrying pairs, the largest
BAND = 0.9  # of the forces should lie in the band


class Scores(NamedTuple):
    """Hold what a prediction is worth.

    correlation: with F of pairs that carry; correlation_all: of all contacts, 0 where none does
    relative_error: median |f − F| / F of pairs that carry
    top_tenth: share of the largest tenth of the carrying pairs that is predicted as such
    auc: chance that a carrying contact is predicted above one that does not carry
    log_likelihood: mean of log N(F − f; σ² + s²) of pairs that carry, s the model's own, fitted; 1/N
    model_sd: s (N)"""

    correlation: float
    correlation_all: float
    relative_error: float
    top_tenth: float
    auc: float
    log_likelihood: float
    model_sd: float


def score(packing: Packing, force: Floats) -> Scores:
    """Compare predicted forces (k,) N of all contacts with the measured ones."""
    inner, carries = packing.inner, packing.carries
    true, found, sigma = packing.force[carries], force[carries], packing.sigma[carries]
    high, low = int(carries.sum()), int((inner & ~carries).sum())
    top = max(1, round(CHAINS * high))
    both = np.intersect1d(np.argsort(true)[-top:], np.argsort(found)[-top:])
    ranks = rankdata(force[inner])[packing.force[inner] > 0].sum()

    def loss(model_sd: float) -> float:
        v = sigma**2 + model_sd**2
        return float((0.5 * np.log(2 * np.pi * v) + (true - found) ** 2 / 2 / v).mean())

    best = minimize_scalar(loss, bounds=(0, 10 * float(true.mean())), method="bounded")
    return Scores(
        correlation=_correlation(true, found),
        correlation_all=_correlation(packing.force[inner], force[inner]),
        relative_error=float(np.median(np.abs(found - true) / true)),
        top_tenth=len(both) / top,
        auc=float((ranks - high * (high + 1) / 2) / (high * low)) if low else float("nan"),
        log_likelihood=-float(best.fun),
        model_sd=float(best.x),
    )


def _correlation(one: Floats, other: Floats) -> float:
    """Of Pearson; 0 where one of both is constant."""
    same = not (np.ptp(one) and np.ptp(other))
    return 0.0 if same else float(np.corrcoef(one, other)[0, 1])


def bands(packing: Packing, draws: Floats, model_error: float) -> tuple[float, float, float]:
    """Compare bands of 90 % of draws (d,k) N, with the noise of the experiment and a model error (N)
    added, with the measured forces.

    Returns the share held of pairs that carry; of contacts with nothing detected (a band that begins
    below the least detected force); and the mean width over the mean measured force."""
    sides = np.where(packing.sides == 1, 1, 2)
    sigma = np.hypot(packing.error.of(draws, sides), model_error)
    noisy = draws + sigma * np.random.default_rng(0).normal(size=draws.shape)
    low, high = np.quantile(noisy, [0.5 - BAND / 2, 0.5 + BAND / 2], axis=0)
    force, carries = packing.force, packing.carries
    inside, quiet = (
        (force >= low) & (force <= high),
        (low < packing.least)[packing.inner & ~carries],
    )
    fraction = float(quiet.mean()) if len(quiet) else float("nan")
    width = (high - low)[carries].mean() / force[carries].mean()
    return float(inside[carries].mean()), fraction, float(width)
