"""Figure 4: a crowd of equal masses pressed to an exit."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.compare.statistics import exponent
from analysis.compare.study import Study
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Section
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.discrete.fig4_arch import charts, claims, tables
from analysis.paper.discrete.fig4_arch.claims import BLOCKED, FLOWING, HEAPS
from analysis.paper.discrete.fig4_arch.dissipation import Maintained, Trial, dissipation_trials
from analysis.paper.discrete.fig4_arch.random_crowds import (
    PEOPLE,
    Sample,
    heaps,
    survey,
    survey_runs,
    warnings_of,
)
from analysis.paper.discrete.pressed_crowd.arch import Arch
from analysis.paper.discrete.pressed_crowd.crowds import (
    BLOCKED_SEEDS,
    STIFFNESSES,
    Blocked,
    blocked,
    blocked_runs,
)
from analysis.paper.discrete.pressed_crowd.section import (
    CrowdWords,
    arch_runs,
    arch_study,
    without_crowd,
)
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress
from nscd.arrays import Floats


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowd by every engine, and the random ones; without an engine none of the latter."""
    return [*arch_runs(read_scene("arch"), runs), *survey_runs(runs), *blocked_runs(runs)]


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 4. `runs` keeps the engine runs; an engine that is missing becomes a warning."""
    try:
        found = arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return without_crowd("4", Words(__package__).text("title"), str(error))
    missing: list[str] = []
    samples = survey(runs, missing, progress)
    jams = [jam for jam in blocked(runs, missing, progress) if jam.at_rest]
    section = _section(found, samples, jams, heaps(progress))
    return replace(section, warnings=[*missing, *section.warnings])


def _section(
    found: Study, samples: Sequence[Sample], jams: Sequence[Blocked], grown: Sequence[Sample]
) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    trials, pull = dissipation_trials(arch), Maintained.of(arch)
    soft = [jam for jam in jams if jam.stiffness == STIFFNESSES[0]]
    several = len({s.people for s in samples}) > 1
    crowds = {
        HEAPS: grown,
        FLOWING: [s for s in samples if s.people == PEOPLE],
        BLOCKED: [Sample.of(jam.arch, jam.seed) for jam in soft],
    }
    crowds = {kind: some for kind, some in crowds.items() if some}
    words = Words(__package__, arch=arch, trials=trials, pull=pull, samples=samples, grown=grown)
    crowd = CrowdWords(arch, found)
    pictures = [
        crowd.snapshot_picture("fig_4_arch"),
        words.picture("fig_4_dissipation", charts.dissipation(trials)),
        crowd.engines_picture("fig_4_engines"),
        words.picture("fig_4_seeds", charts.seeds(crowds)),
    ]
    every = [crowd.maxima_table(), tables.dissipation(words, trials), crowd.engines_table()]
    every += [tables.seeds(words, kind, some) for kind, some in crowds.items()]
    if several:
        pictures.append(words.picture("fig_4_sizes", charts.sizes(samples)))
        every.append(tables.sizes(words, samples))
    stiffness = found.scene.contact.stiffness_N_per_m
    at_rest = {k: [jam.comparison for jam in jams if jam.stiffness == k] for k in STIFFNESSES}
    section = words.section(
        "4",
        largest=arch.normal_forces().max(),
        opening=arch.opening(),
        approach=(arch.approach(_as_printed(arch)), arch.approach(arch.answer.right_velocity)),
        growth=lambda name: exponent(*(_numbers(samples, of) for of in ("people", name))),
        several=several,
        stopped=(len(soft), len(BLOCKED_SEEDS)),
        pictures=pictures,
        tables=every,
        claims=[
            *([claims.contact_forces(words, BLOCKED, at_rest)] if all(at_rest.values()) else ()),
            claims.contact_forces(words, "a crowd that flows", {stiffness: found.comparisons}),
            *claims.places(words, crowds),
            claims.maintained(words, arch, pull, crowds),
            claims.dissipation(words, trials),
        ],
        warnings=[*crowd.warnings(), *warnings_of([*samples, *grown]), *_trial_warnings(trials)],
    )
    return replace(section, words=[*crowd.items(), *section.words])


def _numbers(samples: Sequence[Sample], name: str) -> Floats:
    return np.array([getattr(s, name) for s in samples], dtype=np.float64)


def _as_printed(arch: Arch) -> Floats:
    """The right velocities (n,2) m/s of (7) as printed: u⁺ = u⁻ + Cᵀλ with the λ that solve (8)."""
    push = arch.answer.reaction[:, None] * arch.contacts.normal
    printed: Floats = arch.left_velocity - arch.contacts.momentum_change(push, len(arch.snapshot))
    return printed


def _trial_warnings(trials: Sequence[Trial]) -> list[str]:
    own = [f"{trial.name}: {words}" for trial in trials for words in trial.arch.answer.warnings]
    return unsolved((trial.name, trial.arch.answer) for trial in trials) + own
