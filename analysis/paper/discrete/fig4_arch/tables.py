"""Tables of the arch: by dissipation, over random arches, by the number of people."""

from collections.abc import Sequence

import numpy as np

from analysis.pages.section import Cell, Table
from analysis.pages.words import Words
from analysis.paper.discrete.fig4_arch.dissipation import Trial
from analysis.paper.discrete.fig4_arch.random_crowds import Sample


def dissipation(words: Words, trials: Sequence[Trial]) -> Table:
    """Tabulate forces, interval and energy by dissipation."""
    rows: list[Sequence[Cell]] = []
    for trial in trials:
        force, reaction, answer = trial.forces, trial.reactions, trial.arch.answer
        numbers = (
            force.mean(),
            np.quantile(force, 0.95),
            force.max(),
            force.min(),
            reaction.mean(),
            reaction.max(),
            trial.arch.carried()[trial.most],
            trial.arch.distance()[trial.most],
            trial.upper - trial.lower,
            trial.energy_share,
        )
        acts = "along and across" if trial.across else "along only"
        status = "; ".join([str(answer.status), *answer.warnings])
        rows.append((acts, trial.dissipation, status, *map(float, numbers)))
    return words.table("table_dissipation", rows)


def seeds(words: Words, kind: str, samples: Sequence[Sample]) -> Table:
    """Tabulate mean, spread and range of each quantity over arches of one size."""
    quantities = (
        ("mean sum of normal magnitudes (N)", [s.mean_N for s in samples]),
        ("largest sum of normal magnitudes (N)", [s.largest_N for s in samples]),
        ("width of its interval (N)", [s.upper_N - s.lower_N for s in samples]),
        ("its distance from the middle of the exit (m)", [s.distance_m for s in samples]),
        ("its angle from the axis of the exit, size (°)", [abs(s.angle_degrees) for s in samples]),
        ("largest contact force (N)", [s.largest_contact_N for s in samples]),
        ("its distance (m)", [s.contact_distance_m for s in samples]),
        ("largest vector sum (N)", [s.largest_resultant_N for s in samples]),
        ("its distance (m)", [s.resultant_distance_m for s in samples]),
        ("share of contacts that open", [s.opening / s.contacts for s in samples]),
        ("redundant contacts", [float(s.redundant) for s in samples]),
        ("largest overlap / mean diameter", [s.overlap_share for s in samples]),
    )
    measures = (np.mean, np.std, np.min, np.median, np.max)
    rows: list[Sequence[Cell]] = [
        (quantity, *(float(measure(of)) for measure in measures)) for quantity, of in quantities
    ]
    return words.table("table_seeds", rows, kind=kind, shown=samples)


def sizes(words: Words, samples: Sequence[Sample]) -> Table:
    """Tabulate means over the arches of each number of people."""
    rows: list[Sequence[Cell]] = []
    for people in sorted({s.people for s in samples}):
        same = [s for s in samples if s.people == people]
        mean = {
            name: float(np.mean([getattr(s, name) for s in same]))
            for name in Sample.__dataclass_fields__
            if name != "profile"
        }
        rows.append(
            (
                people,
                len(same),
                mean["reach_m"],
                mean["contacts"] / people,
                mean["mean_N"],
                mean["largest_N"],
                float(np.std([s.largest_N for s in same])),
                mean["distance_m"],
                mean["largest_resultant_N"],
                mean["resultant_distance_m"],
                mean["redundant"],
                mean["overlap_share"],
                sum(s.solved for s in same),
            )
        )
    return words.table("table_sizes", rows)
