"""A hindcast of a push trial: every model and baseline, with inputs that no trial was used for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

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
from analysis.push.scores import (
    ONSET,
    SCORES,
    Cases,
    Odds,
    Scored,
    baselines,
    better,
    error_of,
    likely,
    log_likelihood,
    odds,
    scored,
)
from analysis.push.trial import Trial
from analysis.support.progress import Progress
from nscd.arrays import Floats

# Contact stiffness of people (N/m): chest against chest, between, Helbing's, the product's own.
STIFFNESSES = (2e3, 5e3, 2e4, 1.2e5, 1e6)
RIGID = "rigid"
BATCHES = 10
# CPU seconds of a time step of a batch, and of each person in it.
STEP_S, PERSON_S = 2e-5, 5e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hindcast:
    """Hold a trial, what was not known of it, and what came out.

    models: what each makes of all cases, by name; base: scores of baselines
    odds: over the likeliest, of each model that has a possible case
    """

    trial: Trial
    inputs: Inputs
    models: dict[str, Cases]
    base: dict[str, Scored]
    odds: dict[str, Odds]

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
