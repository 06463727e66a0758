"""Figure 5 of the paper: a crowd of unequal masses pressed to an exit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.compare.statistics import correlation, relative_difference
from analysis.compare.study import Study
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Section
from analysis.paper.discrete.fig4_fig5_arches.charts import (
    engines_picture,
    rings_picture,
    snapshot_picture,
)
from analysis.paper.discrete.fig4_fig5_arches.claims import uniformity_claim
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import Arch
from analysis.paper.discrete.fig4_fig5_arches.study import (
    arch_runs,
    arch_study,
    own_warnings,
    snapshot_words,
    without_crowd,
)
from analysis.paper.discrete.fig4_fig5_arches.tables import engines_table, maxima_table, rings_table
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress
from nscd import Snapshot

NUMBER, TITLE = "5", "An arch at the exit, unequal masses"


def engine_runs(runs: Path) -> list[EngineRun]:
    """The crowds of unequal and, beside them, of equal masses, by every engine."""
    return arch_runs(read_scene("arch_masses"), runs) + arch_runs(read_scene("arch"), runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Figure 5 remade. `runs` keeps the engine runs; an engine that is missing becomes a
    warning."""
    try:
        unequal = arch_study(read_scene("arch_masses"), runs, progress)
        equal = arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return without_crowd(NUMBER, TITLE, str(error))
    return _section(unequal, equal)


def _section(found: Study, equal: Study) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    archs = {"unequal masses": arch}
    tables = [maxima_table(arch), engines_table(found.comparisons)]
    words = snapshot_words(arch, found)
    if equal is not None:
        other = Arch.of(equal.scene, equal.comparisons[0].snapshot)
        archs["equal masses"] = other
        swapped = Arch.of(equal.scene, _with_masses(other.snapshot, found.scene.snapshot))
        inside = other.inside()
        a, b = other.carried()[inside], swapped.carried()[inside]
        words.append(
            f"On the arch of equal masses itself, the unequal masses alone (mean {swapped.snapshot.mass.mean():.1f} kg) change "
            f"the sums of magnitudes by {relative_difference(a, b):.0%} (rms; correlation {correlation(a, b):.3f}), their mean "
            f"from {a.mean():.0f} to {b.mean():.0f} N and their maximum from {a.max() / 1e3:.1f} to {b.max() / 1e3:.1f} kN "
            f"({swapped.answer.status})."
        )
    tables.append(rings_table(archs))
    return Section(
        number=NUMBER,
        title=TITLE,
        words=words,
        pictures=[
            snapshot_picture(arch, "fig_5_arch_masses"),
            rings_picture(archs),
            engines_picture(found.comparisons, "fig_5_engines"),
        ],
        tables=tables,
        differs=[
            "The paper does not print the masses: whole kilograms, uniform between 50 and 100 kg.",
            "“The pressure” is taken as the sum of the normal magnitudes at a person.",
        ],
        claims=[
            uniformity_claim(arch, np.hypot(*arch.answer.right_velocity.T), "the speed on the right", "m/s"),
            uniformity_claim(arch, arch.carried(), "the pressure", "N"),
        ],
        warnings=[*found.warnings, *own_warnings(arch)],
    )  # fmt: skip


def _with_masses(snapshot: Snapshot, source: Snapshot) -> Snapshot:
    """The snapshot with the masses that the people of the same ids have in `source`."""
    order = np.argsort(source.ids)
    return replace(
        snapshot, mass=source.mass[order][np.searchsorted(source.ids[order], snapshot.ids)]
    )
