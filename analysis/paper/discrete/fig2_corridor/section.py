"""Figure 2: a push in a corridor; percussions act at a distance, soft contacts pass a wave on."""

from pathlib import Path

import numpy as np

from analysis.compare.statistics import penalty_difference
from analysis.engines.run import EngineRun
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Claim, Section, Table, Verdict
from analysis.pages.words import Words
from analysis.paper.discrete.fig2_corridor import charts, final, push, study
from analysis.paper.discrete.fig2_corridor.push import Push
from analysis.paper.discrete.fig2_corridor.study import Corridor, final_runs, push_runs
from analysis.support.progress import Progress


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the pushes, and the longer runs to the final positions."""
    return push_runs(runs) + final_runs(runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 2: the network of percussions, how far the push goes, and the wave that soft
    contacts make of it.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning.
    """
    corridor = Corridor.of(runs, progress)
    words = Words(
        __package__,
        corridor=corridor,
        gaps=corridor.gaps,
        study=study,
        push=push,
        names=ENGINE_NAMES,
    )
    pictures = [
        words.picture("fig_2_network", charts.network(corridor)),
        words.picture("fig_2_final", charts.final(corridor.finals, corridor.scene), final=final),
        words.picture("fig_2_decay", charts.decay(corridor)),
    ]
    if corridor.waves:
        pictures.append(words.picture("fig_2_wave", charts.wave(corridor)))
    if corridor.inelastic and corridor.damped:
        pictures.append(words.picture("fig_2_impulses", charts.impulses(corridor)))
    return words.section(
        "2",
        pictures=pictures,
        tables=_tables(words, corridor),
        claims=_claims(words, corridor),
        warnings=corridor.warnings,
    )


def _claims(words: Words, corridor: Corridor) -> list[Claim]:
    to_the_end = corridor.reach >= corridor.distance.max() - 1e-9
    rigid = corridor.finals[0]
    claims = [
        words.claim("non_local", Verdict.of(corridor.far > 0 and to_the_end)),
        words.claim(
            "displacement",
            Verdict.of(rigid.moved == len(rigid.displaced), rigid.moved > 0),
            final=final,
        ),
    ]
    powers = [front.power for front in corridor.fronts]
    if powers:
        # the interaction at a distance is there without a wave: what is right of it is the wave
        wave_grows = min(powers) > 0.1
        verdict = Verdict.PARTLY if wave_grows else Verdict.HOLDS
        claims.append(words.claim("shock_wave", verdict, powers=powers))
    return claims


def _tables(words: Words, corridor: Corridor) -> list[Table]:
    gaps = corridor.gaps
    columns = (gaps.distance, gaps.flux, gaps.gained, gaps.columns, gaps.largest)
    speeds: list[list[Cell]] = []
    for one in corridor.waves:
        closed, last = corridor.long_wave(one.stiffness), float(one.first_arrivals[1][-1])
        name, ratio = ENGINE_NAMES[one.engine], one.speed / closed - 1
        speeds.append([name, one.restitution, one.stiffness, last, one.speed, closed, ratio])
    shares: list[list[Cell]] = [
        [
            ENGINE_NAMES[one.engine],
            one.restitution,
            one.damping,
            one.stiffness,
            one.difference,
            one.numbers["contact_correlation"],
            one.numbers["contacts_only_penalty"],
            one.comparison.balance.closure_error,
            _between_engines(one, corridor.pushes),
        ]
        for one in corridor.pushes
        if one.restitution != study.ELASTIC
    ]
    finals: list[tuple[str | float, ...]] = [
        (
            one.model,
            one.moved,
            *(float(f(one.displaced)) for f in (np.mean, np.median, np.max)),
            float(np.sqrt(((one.position - corridor.finals[0].position) ** 2).sum(1).mean())),
        )
        for one in corridor.finals
    ]
    return [
        words.table("table_gaps", [[float(v) for v in row] for row in zip(*columns, strict=True)]),
        words.table("table_front", speeds),
        words.table("table_impulses", shares),
        words.table("table_final", finals, final=final),
    ]


def _between_engines(one: Push, pushes: list[Push]) -> Cell:
    for other in pushes:
        same = (other.stiffness, other.restitution) == (one.stiffness, one.restitution)
        if same and other.engine != one.engine:
            return penalty_difference(one.comparison, other.comparison)
    return "–"
