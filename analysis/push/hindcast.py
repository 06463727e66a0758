"""A push trial computed after the event, and the scores of models and baselines."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import product
from typing import Any

import numpy as np
from scipy.special import logsumexp

from analysis.push.row import (
    ARMS,
    RIGID_STEP_S,
    SOFT_SHARE,
    Inputs,
    Moved,
    inputs_of,
    rigid,
    soft,
    steps,
)
from analysis.push.trial import SPEED_OVER_S, Trial, onset, speed_of
from analysis.support.parallel import Progress
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
    """Hold what a model or a baseline scores in s cases."""

    onset: Floats  # (s, n) s after the push reached the first
    scores: Mapping[str, Floats]  # (s,) each of SCORES, root mean squares over all but the first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cases(Scored):
    """Hold what a model scores in s cases, and the contact with the first.

    largest, impulse: (s,) N and N·s; largest is NaN for rigid people"""

    largest: Floats
    impulse: Floats
    possible: Flags  # (s,) whether the case can be


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


# Contact stiffness of people (N/m): chest against chest, between, Helbing's, the product's own.
STIFFNESSES = (2e3, 5e3, 2e4, 1.2e5, 1e6)
RIGID = "rigid"
BATCHES = 10
# CPU seconds of a time step of a batch, and of each person in it.
STEP_S, PERSON_S = 2e-5, 5e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hindcast:
    """Hold a trial, what was not known of it, and what came out."""

    trial: Trial
    inputs: Inputs
    models: dict[str, Cases]  # what each makes of all cases, by name
    base: dict[str, Scored]  # scores of baselines
    odds: dict[str, Odds]  # over the likeliest, of each model that has a possible case

    def together(self) -> list[str]:
        """Name the models that are not ten times less likely than the likeliest."""
        return [name for name, one in self.odds.items() if not one.out]

    def likely(self, name: str) -> list[tuple[float, float]]:
        """Give 5 and 95 % of posture, largest force (N) and impulse (N·s) of a model's possible
        cases, weighted by the likelihood of the measured onsets."""
        one = self.models[name]
        logs = log_likelihood(self.trial, one, error_of(self.trial, self.models))
        return [likely(each, logs) for each in (self.inputs.arms, one.largest, one.impulse)]

    def better(self, name: str) -> dict[str, float]:
        """Give the share of possible cases in which a model beats every baseline, by score."""
        one, others = self.models[name], list(self.base.values())
        if not one.possible.any():
            return dict.fromkeys(SCORES, np.nan)
        return {score: float(better(one, others, score)[one.possible].mean()) for score in SCORES}

    def nearest(self, name: str) -> int:
        """Find the case of a model with the nearest onsets, of those that can be if any can."""
        one = self.models[name]
        far = np.where(one.possible, 0.0, 1e9) + one.scores[ONSET]
        return int(far.argmin())

    def heads(self, name: str) -> Floats:
        """Compute the heads (f, n) m of a model's nearest case."""
        case = [self.nearest(name)]
        drawn = {each.name: getattr(self.inputs, each.name)[case] for each in fields(Inputs)}
        return _moved(self.trial, Inputs(**drawn), name).along[..., 0]


def hindcast(
    trial: Trial,
    arms: Sequence[float] = ARMS,
    stiffnesses: Sequence[float] = STIFFNESSES,
    batches: int = BATCHES,
    progress: Progress | None = None,
) -> Hindcast:
    """Compute every model (penalty, rigid) and baseline in so many batches of cases.

    arms: the least and the most that arms bridge of the room between chests; stiffnesses: N/m"""
    names = [*(f"{stiffness:g}" for stiffness in stiffnesses), RIGID]
    models: dict[str, list[Cases]] = {}
    base: dict[str, list[Scored]] = {}
    drawn = [inputs_of(trial, arms, batch) for batch in range(batches)]
    for batch, inputs in enumerate(drawn):
        for place, name in enumerate(names, start=1):
            models.setdefault(name, []).append(_cases(trial, _moved(trial, inputs, name)))
            if progress:
                progress("rows", (batch + place / len(names)) / batches)
        for name, along in baselines(trial, inputs).items():
            base.setdefault(name, []).append(scored(trial, along))
    inputs = Inputs(**_joined(drawn))
    found = {name: Cases(**_joined(parts)) for name, parts in models.items()}
    return Hindcast(
        trial=trial,
        inputs=inputs,
        models=found,
        base={name: Scored(**_joined(parts)) for name, parts in base.items()},
        odds=odds(trial, inputs, found),
    )


def expected_seconds(trial: Trial) -> float:
    """Estimate the CPU time (s) of a hindcast from its time steps and people."""
    lightest = float(trial.mass.min())
    longest = [RIGID_STEP_S / 4, *(SOFT_SHARE * np.sqrt(lightest / k) for k in STIFFNESSES)]
    many = sum(len(trial.time) * steps(trial, step)[1] for step in longest)
    return BATCHES * many * (STEP_S + PERSON_S * len(trial.mass))


def _moved(trial: Trial, inputs: Inputs, name: str) -> Moved:
    """Move the cases by a model's name: its stiffness, or rigid."""
    return rigid(trial, inputs) if name == RIGID else soft(trial, inputs, float(name))


def _cases(trial: Trial, moved: Moved) -> Cases:
    one = scored(trial, moved.along)
    return Cases(
        onset=one.onset,
        scores=one.scores,
        largest=moved.largest,
        impulse=moved.impulse,
        possible=moved.possible,
    )


def _joined(parts: Sequence[Any]) -> dict[str, Any]:
    """The fields of batches, one batch after the other."""
    found: dict[str, Any] = {}
    for each in fields(parts[0]):
        values = [getattr(part, each.name) for part in parts]
        found[each.name] = (
            {name: np.concatenate([value[name] for value in values]) for name in values[0]}
            if isinstance(values[0], dict)
            else np.concatenate(values)
        )
    return found
