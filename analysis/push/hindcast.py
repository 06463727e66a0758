"""A hindcast of a push trial: every model and baseline, with inputs that no trial was used for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.push.row import ARMS, Inputs, Moved, inputs_of, rigid, soft
from analysis.push.scores import APART, SCORES, Scored, baselines, better, odds, scored
from analysis.push.trial import Trial, read_trial
from analysis.support.progress import Progress

# Contact stiffness of people (N/m): chest against chest, between, Helbing's, the product's own.
STIFFNESSES = (2e3, 5e3, 2e4, 1.2e5, 1e6)
RIGID = "rigid"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hindcast:
    """Hold a trial, what was not known of it, and what came out.

    moved: heads and forces of each model, by name; scored: scores of models; base: of baselines;
    odds: of models, over the likeliest
    """

    trial: Trial
    inputs: Inputs
    moved: dict[str, Moved]
    scored: dict[str, Scored]
    base: dict[str, Scored]
    odds: dict[str, float]

    def together(self) -> list[str]:
        """Name the models that the onsets do not tell apart from the likeliest."""
        return [name for name, share in self.odds.items() if share * APART > 1]

    def better(self, name: str) -> dict[str, float]:
        """Give the share of cases in which a model beats every baseline, by score."""
        return {
            score: better(self.scored[name], list(self.base.values()), score) for score in SCORES
        }


def hindcast(
    file: Path,
    wall_m: float | None = None,
    arms: Sequence[float] = ARMS,
    stiffnesses: Sequence[float] = STIFFNESSES,
    progress: Progress | None = None,
) -> Hindcast:
    """Read a trial and compute every model (LAMMPS, rigid) and baseline.

    wall_m: where a wall crosses the row, as x or y of the file; arms: postures; stiffnesses: N/m

    Raises TrialError and EngineError."""
    trial = read_trial(file, wall_m)
    inputs = inputs_of(trial, arms)
    moved: dict[str, Moved] = {}
    for number, stiffness in enumerate(stiffnesses):
        moved[f"{stiffness:g}"] = soft(trial, inputs, stiffness)
        if progress:
            progress("rows", (number + 1) / (len(stiffnesses) + 1))
    moved[RIGID] = rigid(trial, inputs)
    found = {name: scored(trial, model.along) for name, model in moved.items()}
    base = {name: scored(trial, along) for name, along in baselines(trial, inputs).items()}
    return Hindcast(
        trial=trial,
        inputs=inputs,
        moved=moved,
        scored=found,
        base=base,
        odds=odds(trial, found),
    )
