"""How near a motion comes to the measured one: onsets, positions, closest heads; and the baselines
that a model has to beat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.push.row import Inputs
from analysis.push.trial import Trial, onset, speed_of
from nscd.arrays import Floats

# Who does not move has this onset (s); positions are compared for so long after the push (s).
NEVER_S, POSITION_S = 2.0, 0.8
# A model beats a baseline where its score is smaller by at least so large a share.
MARGIN = 0.1
# Two models are told apart where one is this many times as likely as the other.
APART = 10.0
ONSET, POSITION, CLOSEST = SCORES = ("onset_rms_s", "position_rms_m", "closest_rms_m")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scored:
    """Hold what a model or a baseline scores in s cases.

    onset: (s, n) s after the push reached the first
    scores: (s,) each of SCORES, root mean squares over all but the first
    """

    onset: Floats
    scores: Mapping[str, Floats]


def onsets(trial: Trial, along: Floats) -> Floats:
    """Find when each head (f, n) m is faster than 0.15 m/s, in s (n,) after the first was; 2 s for
    never."""
    found = [onset(trial.time, speed) for speed in speed_of(trial.time, along).T]
    late = [NEVER_S if at is None else at - trial.start_s for at in found]
    return np.minimum(late, NEVER_S)


def scored(trial: Trial, along: Floats) -> Scored:
    """Score heads (s, f, n) m against the measured ones, which are treated alike."""
    early = trial.time <= trial.start_s + POSITION_S
    found = np.array([onsets(trial, case) for case in along])
    late = found[:, 1:] - onsets(trial, trial.along)[1:]
    off = (along - trial.along)[:, early, 1:]
    near = closest(along) - closest(trial.along)
    return Scored(
        onset=found,
        scores={
            ONSET: np.sqrt((late**2).mean(1)),
            POSITION: np.sqrt((off**2).mean((1, 2))),
            CLOSEST: np.sqrt((near**2).mean(1)),
        },
    )


def closest(along: Floats) -> Floats:
    """Find the smallest distance (…, n − 1) m of neighbours' heads (…, f, n) m."""
    return np.asarray(np.diff(along, axis=-1).min(-2))


def baselines(trial: Trial, inputs: Inputs) -> dict[str, Floats]:
    """Give the heads (s, f, n) m of what knows no mechanics, by name.

    nobody: only the first moves; copy: everybody moves as the first did, later by the time that the
    first at its fastest takes to go the gaps before; geometry: everybody is carried along once the
    gaps have closed, and stays where the push ends."""
    first = trial.along[:, 0] - trial.along[0, 0]
    cases, n = len(inputs.gap), len(trial.mass)
    closed = np.cumsum(inputs.gap[:, : n - 1], axis=1)
    start = np.broadcast_to(trial.along[0], (cases, len(first), n)).copy()
    fastest = float(speed_of(trial.time, trial.along[:, 0]).max())
    farthest = np.maximum.accumulate(np.maximum(first, 0.0))
    names = {name: start.copy() for name in ("nobody", "copy", "geometry")}
    for along in names.values():
        along[:, :, 0] += first
    for case, gaps in enumerate(closed):
        for person, gap in enumerate(gaps, start=1):
            late = np.interp(trial.time - gap / fastest, trial.time, first)
            names["copy"][case, :, person] += late
            carried = np.maximum(farthest - gap, 0.0)
            names["geometry"][case, :, person] += _before_wall(trial, inputs, case, person, carried)
    return names


def _before_wall(trial: Trial, inputs: Inputs, case: int, person: int, moved: Floats) -> Floats:
    """Who is carried stops where those in front stand at the wall (f,) m."""
    if trial.wall is None:
        return moved
    return np.asarray(np.minimum(moved, inputs.gap[case, person:].sum()))


def better(model: Scored, others: Sequence[Scored], score: str) -> float:
    """Give the share of cases in which a model scores better than all baselines, by a tenth."""
    best = np.min([other.scores[score] for other in others], axis=0)
    return float((model.scores[score] < (1 - MARGIN) * best).mean())


def odds(trial: Trial, models: Mapping[str, Scored]) -> dict[str, float]:
    """Compute how likely the measured onsets are under each model, over the likeliest: the mean
    over its cases of exp(−½ Σ (difference/σ)²).

    σ is the time between two frames, or the smallest root mean square of all cases of all models,
    whichever is larger: what no model reaches tells none apart."""
    measured = onsets(trial, trial.along)[1:]
    least = min(float(model.scores[ONSET].min()) for model in models.values())
    sigma = max(float(trial.time[1]), least)
    far = {
        name: -0.5 * (((model.onset[:, 1:] - measured) / sigma) ** 2).sum(1)
        for name, model in models.items()
    }
    top = max(float(each.max()) for each in far.values())
    likely = {name: float(np.exp(each - top).mean()) for name, each in far.items()}
    return {name: value / max(likely.values()) for name, value in likely.items()}
