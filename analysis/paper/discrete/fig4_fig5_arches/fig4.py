"""Figure 4 of the paper: a crowd of equal masses pressed to an exit."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

from analysis.compare.study import Study
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Section
from analysis.paper.discrete.fig4_fig5_arches.charts import engines_picture, snapshot_picture
from analysis.paper.discrete.fig4_fig5_arches.claims import place_claim, ring_claim
from analysis.paper.discrete.fig4_fig5_arches.dissipation import (
    DISSIPATIONS,
    Maintained,
    dissipation_claim,
    dissipation_picture,
    dissipation_table,
    dissipation_trials,
    maintained_claim,
    trial_warnings,
)
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import Arch
from analysis.paper.discrete.fig4_fig5_arches.random_charts import (
    seeds_picture,
    seeds_table,
    sizes_picture,
    sizes_table,
)
from analysis.paper.discrete.fig4_fig5_arches.random_crowds import (
    BLOCKED_SEEDS,
    PEOPLE,
    Sample,
    blocked,
    blocked_runs,
    growth,
    survey,
    survey_runs,
    warnings_of,
)
from analysis.paper.discrete.fig4_fig5_arches.study import (
    arch_runs,
    arch_study,
    own_warnings,
    snapshot_words,
    without_crowd,
)
from analysis.paper.discrete.fig4_fig5_arches.tables import engines_table, maxima_table
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress

NUMBER, TITLE = "4", "An arch at the exit, equal masses"


def engine_runs(runs: Path) -> list[EngineRun]:
    """The crowd by every engine, and the random ones. Without an engine there are none of the
    latter."""
    found = arch_runs(read_scene("arch"), runs)
    with contextlib.suppress(EngineError):
        found += [*survey_runs(runs).values(), *blocked_runs(runs).values()]
    return found


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Figure 4 remade. `runs` keeps the engine runs; an engine that is missing becomes a
    warning."""
    try:
        found = arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return without_crowd(NUMBER, TITLE, str(error))
    samples: list[Sample] = []
    jams: list[Sample] = []
    missing: list[str] = []
    try:
        samples = survey(runs, progress)
        jams = blocked(runs, progress)
    except EngineError as error:
        missing.append(f"random arches: {error}")
    return _section(found, samples, jams, missing)


def _section(
    found: Study, samples: Sequence[Sample], jams: Sequence[Sample], missing: Sequence[str]
) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    trials = dissipation_trials(arch)
    pull = Maintained.of(arch)
    opening = arch.contacts.approach_velocity(arch.answer.right_velocity) < -1e-6
    same = [s for s in samples if s.people == PEOPLE]
    pictures = [
        snapshot_picture(arch, "fig_4_arch"), dissipation_picture(trials), engines_picture(found.comparisons, "fig_4_engines"),
    ]  # fmt: skip
    tables = [maxima_table(arch), dissipation_table(trials), engines_table(found.comparisons)]
    claims = [
        maintained_claim(len(arch.contacts), int(opening.sum()), pull),
        dissipation_claim(trials),
    ]
    words = snapshot_words(arch, found)
    if same:
        pictures.append(seeds_picture(same))
        tables.append(
            seeds_table(
                same, f"{len(same)} random arches of {PEOPLE} people of 75 kg, still flowing"
            )
        )
        claims = [
            place_claim(
                same, "resultant_distance_m", "the vector sum of a person's contact forces"
            ),
            place_claim(same, "distance_m", "the sum of the normal magnitudes at a person"),
            place_claim(same, "contact_distance_m", "the force of a single contact"),
            ring_claim(same, "crowds that flow"),
            *claims,
        ]
    if jams:
        tables.append(
            seeds_table(
                jams,
                f"Exits that an arch really blocks: {jams[0].people} disks of 0.30 m (scene `jam`), "
                f"{len(jams)} of {len(BLOCKED_SEEDS)} crowds came to rest",
            )
        )
        claims.append(ring_claim(jams, "crowds at rest behind a blocked exit"))
    if len({s.people for s in samples}) > 1:
        pictures.append(sizes_picture(samples))
        tables.append(sizes_table(samples))
        words.append(_growth_words(samples))
    gained = sum(t.arch.answer.energy_change > 0 for t in trials)
    words.append(
        f"Energy was gained in {gained} of {len(trials)} impacts with dissipation k from 0 to "
        f"{DISSIPATIONS[-1]:g} kg; the balance closes to {max(t.arch.answer.energy_error for t in trials):.0e}."
    )
    printed = arch.left_velocity - arch.contacts.momentum_change(
        arch.answer.reaction[:, None] * arch.contacts.normal, len(arch.snapshot)
    )
    violation = float(arch.contacts.approach_velocity(printed).max())
    kept = float(arch.contacts.approach_velocity(arch.answer.right_velocity).max())
    differs = [
        f"(7) prints u⁺ = u⁻ + Cᵀλ. With these λ the disks would run into each other at up to {violation:.3g} m/s; "
        f"u⁺ = u⁻ − M⁻¹Cᵀλ leaves at most {kept:.1e} m/s.",
        f"(8) keeps every contact closed, W λ = C u⁻. Its shortest solution pulls in {pull.pulling} of "
        f"{len(arch.contacts)} contacts, by up to {pull.strongest_N / 1e3:.3g} kN ({pull.total_N / 1e3:.4g} kN in all), and "
        f"pushes with up to {pull.push_N / 1e3:.3g} kN. With 0 ≤ λ ⟂ −C u⁺ ≥ 0 nothing pulls, the largest push is "
        f"{arch.normal_forces().max() / 1e3:.3g} kN, and {int(opening.sum())} contacts open. (8) is also badly conditioned: the "
        f"least singular value of C M^(-1/2) is {pull.spread:.1e} of the largest, and W squares that. "
        f"`ContactLaw(maintained=True)` answers: {pull.answer.status}, residual {pull.answer.residual:.1e}.",
        "A percussion is not a force: f = p/τ with the relaxation time τ of the drive, which the paper leaves out.",
        "“Norm of the contact force applied on each pedestrian” can be the vector sum or the sum of magnitudes: both are shown.",
        "The paper prints neither positions nor radii, and not how its arch came about. This crowd was gathered by a penalty "
        "model and is still flowing, so that overlaps of up to "
        f"{arch.overlap_share():.2g} of a diameter stand in the positions; the percussions take overlapping disks as touching.",
        "4d does not say which k were tried, nor whether k acts across contacts too: both are shown.",
    ]
    return Section(
        number=NUMBER,
        title=TITLE,
        words=words,
        pictures=pictures,
        tables=tables,
        differs=differs,
        claims=claims,
        warnings=[*found.warnings, *missing, *warnings_of(samples), *trial_warnings(trials), *own_warnings(arch)],
    )  # fmt: skip


def _growth_words(samples: Sequence[Sample]) -> str:
    def power(name: str) -> str:
        return f"N^{growth(samples, [getattr(s, name) for s in samples]):.2f}"

    return (
        f"With the number N of people the mean sum of magnitudes grows like {power('mean_N')}, the largest like "
        f"{power('largest_N')}, its distance from the exit like {power('distance_m')} (the crowd itself: {power('reach_m')}) and "
        f"the largest vector sum like {power('largest_resultant_N')}."
    )
