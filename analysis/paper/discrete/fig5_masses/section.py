"""Figure 5: a crowd of unequal masses pressed to an exit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.compare.statistics import correlation, relative_difference
from analysis.compare.study import Study
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.section import Cell, Section, Table
from analysis.pages.words import Words
from analysis.paper.discrete.fig5_masses import charts
from analysis.paper.discrete.fig5_masses.uniformity import Uniformity
from analysis.paper.discrete.pressed_crowd.arch import RING_M, Arch
from analysis.paper.discrete.pressed_crowd.section import (
    CrowdWords,
    arch_runs,
    arch_study,
    without_crowd,
)
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowds of unequal and, beside them, of equal masses, by every engine."""
    return arch_runs(read_scene("arch_masses"), runs) + arch_runs(read_scene("arch"), runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 5. `runs` keeps the engine runs; an engine that is missing becomes a warning."""
    words = Words(__package__, ring=RING_M)
    try:
        unequal = arch_study(read_scene("arch_masses"), runs, progress)
        equal = arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return without_crowd("5", words.text("title"), str(error))
    arch = Arch.of(unequal.scene, unequal.comparisons[0].snapshot)
    other = Arch.of(equal.scene, equal.comparisons[0].snapshot)
    archs = {"unequal masses": arch, "equal masses": other}
    crowd = CrowdWords(arch, unequal)
    speed = np.hypot(*arch.answer.right_velocity.T)
    judged = [
        ("the speed on the right", "m/s", Uniformity.of(arch, speed)),
        ("the pressure", "N", Uniformity.of(arch, arch.carried())),
    ]
    section = words.section(
        "5",
        **_with_other_masses(other, equal, unequal),
        pictures=[
            crowd.snapshot_picture("fig_5_arch_masses"),
            words.picture("fig_5_rings", charts.rings(archs)),
            crowd.engines_picture("fig_5_engines"),
        ],
        tables=[crowd.maxima_table(), crowd.engines_table(), _rings_table(words, archs)],
        claims=[
            words.claim("uniformity", found.verdict, quantity=quantity, unit=unit, found=found)
            for quantity, unit, found in judged
        ],
        warnings=crowd.warnings(),
    )
    return replace(section, words=[*crowd.items(), *section.words])


def _with_other_masses(arch: Arch, equal: Study, unequal: Study) -> dict[str, object]:
    """Compare an arch with itself, each person having the mass of the same id in the other one."""
    source, snapshot = unequal.scene.snapshot, arch.snapshot
    order = np.argsort(source.ids)
    mass = source.mass[order][np.searchsorted(source.ids[order], snapshot.ids)]
    swapped = Arch.of(equal.scene, replace(snapshot, mass=mass))
    inside = arch.inside()
    before, after = arch.carried()[inside], swapped.carried()[inside]
    return {
        "mass": mass.mean(),
        "change": relative_difference(before, after),
        "correlation": correlation(before, after),
        "before": before,
        "after": after,
        "status": str(swapped.answer.status),
    }


def _rings_table(words: Words, archs: Mapping[str, Arch]) -> Table:
    rows: list[Sequence[Cell]] = []
    for name, arch in archs.items():
        ring, speed = arch.rings(), np.hypot(*arch.answer.right_velocity.T)
        for r in range(int(ring.max()) + 1):
            at = ring == r
            if at.any():
                means = [float(v[at].mean()) for v in (speed, arch.carried(), arch.resultants())]
                width = f"{r * RING_M:g} – {(r + 1) * RING_M:g}"
                rows.append((name, width, int(at.sum()), *means))
    return words.table("table_rings", rows)
