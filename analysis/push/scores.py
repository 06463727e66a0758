"""How near a motion comes to the measured one: onsets, positions, closest heads; the baselines
that a model has to beat; and how likely the onsets are under each model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import logsumexp

from analysis.push.row import Inputs
from analysis.push.speeds import SPEED_OVER_S, onset, speed_of
from analysis.push.trial import Trial
from nscd.arrays import Flags, Floats

# Who does not move has this onset (s); positions are compared for so long after the push (s).
NEVER_S, POSITION_S = 2.0, 0.8
# A model beats a baseline where its score is smaller by at least so large a share.
MARGIN = 0.1
# So many times less likely than the likeliest, whatever is weighted, a model is out, and its order
# is settled.
APART, SETTLED = 10.0, 1.25
ONSET, POSITION, CLOSEST = SCORES = ("onset_rms_s", "position_rms_m", "closest_rms_m")
# Logarithms of weights of the share that arms bridge, per unit.
TILTS = (0.0, -2.0, 2.0)
# The smallest error that counts is the one that this share of a model's cases keep below.
NEAREST = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scored:
    """Hold what a model or a baseline scores in s cases.

    onset: (s, n) s after the push reached the first
    scores: (s,) each of SCORES, root mean squares over all but the first
    """

    onset: Floats
    scores: Mapping[str, Floats]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cases(Scored):
    """Hold what a model scores in s cases, and the contact with the first.

    largest, impulse: (s,) N and N·s; largest is NaN for rigid people
    possible: (s,) whether the case can be
    """

    largest: Floats
    impulse: Floats
    possible: Flags


@dataclass(frozen=True, slots=True)
class Odds:
    """Hold how likely a model is, over the likeliest: of all cases, and the least and the most of
    all batches and weightings."""

    share: float
    low: float
    high: float

    @property
    def settled(self) -> bool:
        """Tell whether every batch and weighting finds the model less likely by a quarter."""
        return self.high * SETTLED <= 1

    @property
    def out(self) -> bool:
        """Tell whether every batch and weighting finds it ten times less likely."""
        return self.high * APART <= 1


def onsets(trial: Trial, along: Floats) -> Floats:
    """Find when each head (f, …) m is faster than 0.15 m/s, in s (…) after the first was; 2 s for
    never."""
    return np.minimum(onset(trial.time, speed_of(trial.time, along)) - trial.start_s, NEVER_S)


def scored(trial: Trial, along: Floats) -> Scored:
    """Score heads (f, n, s) m against the measured ones, which are treated alike."""
    early = trial.time <= trial.start_s + POSITION_S
    found = onsets(trial, along)
    late = found[1:] - onsets(trial, trial.along)[1:, None]
    off = along[early, 1:] - trial.along[early, 1:, None]
    near = closest(along) - closest(trial.along)[:, None]
    return Scored(
        onset=found.T,
        scores={
            ONSET: np.sqrt((late**2).mean(0)),
            POSITION: np.sqrt((off**2).mean((0, 1))),
            CLOSEST: np.sqrt((near**2).mean(0)),
        },
    )


def closest(along: Floats) -> Floats:
    """Find the smallest distance (n − 1, …) m of neighbours' heads (f, n, …) m."""
    return np.asarray(np.diff(along, axis=1).min(0))


def baselines(trial: Trial, inputs: Inputs) -> dict[str, Floats]:
    """Give the heads (f, n, s) m of what knows no mechanics, by name.

    nobody: only the first moves; copy: everybody moves as the first did, later by the time that the
    first at its fastest takes to go the gaps before; geometry: everybody is carried along once the
    gaps have closed, until those in front stand at the wall, and stays where the push ends."""
    first = trial.pushed
    closed = np.cumsum(inputs.gap[:, : len(trial.mass) - 1], axis=1).T
    late = closed / float(trial.speed[:, 0].max())
    carried = np.maximum(np.maximum.accumulate(first)[:, None, None] - closed, 0.0)
    if trial.wall is not None:
        carried = np.minimum(carried, np.maximum(inputs.gap.sum(1) - closed, 0.0))
    moved = {
        "nobody": np.zeros_like(carried),
        "copy": np.interp(trial.time[:, None, None] - late, trial.time, first),
        "geometry": carried,
    }
    pushed = np.broadcast_to(trial.along[:, :1, None], (len(first), 1, closed.shape[1]))
    return {
        name: np.concatenate([pushed, trial.along[0, 1:, None] + each], axis=1)
        for name, each in moved.items()
    }


def better(model: Scored, others: Sequence[Scored], score: str) -> Floats:
    """Tell in which cases (s,) a model scores better than all baselines, by a tenth."""
    best = np.min([other.scores[score] for other in others], axis=0)
    return np.asarray(model.scores[score] < (1 - MARGIN) * best)


def error_of(trial: Trial, cases: Mapping[str, Cases]) -> float:
    """Give the error (s) of an onset: the time over which speeds are taken, or what the nearest
    hundredth of the cases of the best model reaches, if that is more."""
    near = [
        float(np.quantile(one.scores[ONSET][one.possible], NEAREST))
        for one in cases.values()
        if one.possible.any()
    ]
    return max(SPEED_OVER_S, float(trial.time[1]), min(near, default=0.0))


def odds(trial: Trial, inputs: Inputs, models: Mapping[str, Cases]) -> dict[str, Odds]:
    """Compare how likely the measured onsets are under models: the mean over possible cases of
    exp(−½ Σ (difference/σ)²), with σ of `error_of`.

    Each batch of cases is asked on its own, with σ and with 2 σ, and with the share that arms
    bridge between people (and before the wall) weighted evenly, and up to seven times less or more
    at its upper end. A model without a possible case has no odds."""
    sigma = error_of(trial, models)
    able = {name: one for name, one in models.items() if one.possible.any()}
    near = {name: log_likelihood(trial, one, sigma) for name, one in able.items()}
    ways = [*product((1.0, 2.0), TILTS, TILTS if trial.wall is not None else (0.0,))]

    def likelihood(name: str, batch: int | None, way: tuple[float, float, float]) -> float:
        chosen = able[name].possible & ((inputs.batch == batch) if batch is not None else True)
        weight = (way[1] * inputs.arms + way[2] * inputs.wall)[chosen]
        found = near[name][chosen] / way[0] ** 2
        return float(logsumexp(weight + found) - logsumexp(weight)) if chosen.any() else np.nan

    whole = {name: likelihood(name, None, (1.0, 0.0, 0.0)) for name in able}
    best = max(whole, key=lambda name: whole[name], default="")
    found = {}
    for name in able:
        ratio = np.exp(
            [
                likelihood(name, batch, way) - likelihood(best, batch, way)
                for batch in np.unique(inputs.batch)
                for way in ways
            ]
        )
        known = not np.isnan(ratio).any()
        found[name] = Odds(
            share=float(np.exp(whole[name] - whole[best])),
            low=float(ratio.min()) if known else 0.0,
            high=float(ratio.max()) if known else np.inf,
        )
    return found


def log_likelihood(trial: Trial, one: Cases, sigma: float) -> Floats:
    """Compute −½ Σ (difference of onsets/σ)² of each case (s,); −∞ of one that cannot be."""
    square = ((one.onset[:, 1:] - onsets(trial, trial.along)[1:]) ** 2).sum(1)
    return np.asarray(np.where(one.possible, -0.5 * square / sigma**2, -np.inf))


def likely(values: Floats, logs: Floats) -> tuple[float, float]:
    """Give the 5 and 95 % of values (s,) weighted by their likelihoods."""
    order = np.argsort(values)
    sums = np.cumsum(np.exp(logs - logs.max())[order])
    low, high = np.searchsorted(sums, np.array([0.05, 0.95]) * sums[-1])
    return float(values[order[low]]), float(values[order[high]])
