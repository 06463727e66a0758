"""Figure 5: a crowd of unequal masses pressed to an exit."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import kruskal

from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.drawing import BLACK, BLUE, ORANGE, label, panels
from analysis.pages.section import Cell, Section, Table, Verdict
from analysis.pages.words import Words
from analysis.scene.scene import read_scene
from analysis.studies.paper.discrete import pressed_crowd
from analysis.support.parallel import Progress
from nscd.arrays import Floats

LEAST_PEOPLE = 5  # in a ring that counts
CHANCE, RATIO = 1e-3, 1.5


class Uniformity(NamedTuple):
    """How a quantity differs between rings of 1 m about the exit.

    verdict: “not uniform” holds where the rings differ beyond chance (p < 10⁻³) and their means by
        half or more; in part if only the first is so"""

    least: float  # of the rings' means
    most: float  # of the rings' means
    ratio: float  # the largest mean over the least
    chance: float  # p of the hypothesis that the rings are alike (Kruskal–Wallis)
    scatter: float  # standard deviation over mean of people in one ring
    verdict: Verdict


def uniformity(arch: pressed_crowd.Arch, values: Floats) -> Uniformity:
    """Compare the rings of an arch by values (n,) of its people."""
    groups = [group for group in arch.by_ring(values) if len(group) >= LEAST_PEOPLE]
    means = [float(group.mean()) for group in groups]
    varies = np.ptp(np.concatenate(groups)) > 0
    chance = float(kruskal(*groups).pvalue) if varies else 1.0
    minimum, maximum = min(means), max(means)
    ratio = maximum / max(minimum, np.finfo(float).tiny) if maximum > 0 else 1.0
    scatter = float(np.mean([g.std() / g.mean() for g in groups if g.mean() > 0]))
    verdict = Verdict.of(True, ratio >= RATIO) if chance < CHANCE else Verdict.FAILS
    return Uniformity(minimum, maximum, ratio, chance, scatter, verdict)


STYLES = {"unequal masses": ("s-", ORANGE, "."), "equal masses": ("o--", BLUE, "x")}


def rings(archs: Mapping[str, pressed_crowd.Arch]) -> Figure:
    """Draw speed on the right and force of each person, and their means over rings."""
    figure, every = panels(10.5, 4.2, 1, 2)
    for name, arch in archs.items():
        style, colour, dot = STYLES[name]
        inside, distance = arch.inside(), arch.distance()
        speed = np.hypot(*arch.solution.right_velocity.T)
        for axis, values in zip(every, (speed, arch.carried() / 1e3), strict=True):
            axis.plot(distance[inside], values[inside], dot, ms=3, color=colour, alpha=0.35)
            constrained = [(r, at.mean()) for r, at in enumerate(arch.by_ring(values)) if len(at)]
            middles = [(r + 0.5) * pressed_crowd.RING_M for r, _ in constrained]
            means = [m for _, m in constrained]
            words = f"{name}: mean of rings of {pressed_crowd.RING_M:g} m"
            axis.plot(middles, means, style, color=colour, mec=BLACK, label=words)
    names = ("right speed |u⁺| (m/s)", "sum of normal magnitudes (kN)")
    for axis, y in zip(every, names, strict=True):
        x = "distance from the middle of the exit (m)"
        label(axis, x, y, legend="upper right", ylim=(0, None))
    return figure


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowds of unequal and, beside them, of equal masses, by every engine."""
    return pressed_crowd.arch_runs(read_scene("arch_masses"), runs) + pressed_crowd.arch_runs(
        read_scene("arch"), runs
    )


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 5. `runs` keeps the engine runs; an engine that is missing becomes a warning."""
    words = Words(__name__, ring=pressed_crowd.RING_M)
    try:
        unequal = pressed_crowd.arch_study(read_scene("arch_masses"), runs, progress)
        equal = pressed_crowd.arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return pressed_crowd.without_crowd("5", words.text("title"), str(error))
    arch = pressed_crowd.Arch.of(unequal.scene, unequal.comparisons[0].snapshot)
    other = pressed_crowd.Arch.of(equal.scene, equal.comparisons[0].snapshot)
    archs = {"unequal masses": arch, "equal masses": other}
    crowd = pressed_crowd.crowd_parts(arch, unequal, "fig_5_", "arch_masses")
    speed = np.hypot(*arch.solution.right_velocity.T)
    judged = [
        ("the speed on the right", "m/s", uniformity(arch, speed)),
        ("the pressure", "N", uniformity(arch, arch.carried())),
    ]
    snapshot, engines = crowd.pictures
    return words.section(
        "5",
        crowd=crowd.words[0],
        pictures=[snapshot, words.picture("fig_5_rings", rings(archs)), engines],
        tables=[*crowd.tables, _rings_table(words, archs)],
        claims=[
            words.claim("uniformity", found.verdict, quantity=quantity, unit=unit, found=found)
            for quantity, unit, found in judged
        ],
        warnings=crowd.warnings,
    )


def _rings_table(words: Words, archs: Mapping[str, pressed_crowd.Arch]) -> Table:
    rows: list[Sequence[Cell]] = []
    for name, arch in archs.items():
        speed = np.hypot(*arch.solution.right_velocity.T)
        quantities = map(arch.by_ring, (speed, arch.carried(), arch.resultants()))
        for r, parts in enumerate(zip(*quantities, strict=True)):
            if len(parts[0]):
                width = f"{r * pressed_crowd.RING_M:g} – {(r + 1) * pressed_crowd.RING_M:g}"
                rows.append((name, width, len(parts[0]), *(float(v.mean()) for v in parts)))
    return words.table("table_rings", rows)
