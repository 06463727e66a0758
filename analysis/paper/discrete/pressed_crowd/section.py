"""What figures 4 and 5 say alike of a pressed crowd: its forces, and the engines beside them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Comparison
from analysis.compare.statistics import correlation, relative_difference
from analysis.compare.study import Study, study
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.pages.names import engine_label
from analysis.pages.section import Cell, Picture, Section, Table
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.discrete.pressed_crowd import charts
from analysis.paper.discrete.pressed_crowd.arch import Arch, carried_interval
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd.indeterminacy.determinacy import admissible_determinacy, determinacy

EVERY: Sequence[str] = [engine.NAME for engine in PENALTY]
NEAR_M = 3.0  # where the density is measured


def arch_runs(scene: Scene, runs: Path) -> list[EngineRun]:
    """List the scene by every engine."""
    return [EngineRun.of(scene, engine, runs) for engine in EVERY]


def arch_study(scene: Scene, runs: Path, progress: Progress | None) -> Study:
    """Run the scene by every engine, and compare each with its percussions.

    Raises EngineError if no engine gathered the crowd."""
    found = study(scene, EVERY, [scene.contact.stiffness_N_per_m], runs, progress)
    if not found.comparisons:
        raise EngineError("; ".join(found.failures))
    return found


def without_crowd(number: str, title: str, reason: str) -> Section:
    """Make what is left of a section where no engine gathered its crowd."""
    return Section(
        number=number, title=title, words=(), pictures=(), tables=(), differs=(), warnings=(reason,)
    )


class CrowdWords:
    """The words, tables and pictures of one crowd: arch is that of the first engine of `found`."""

    def __init__(self, arch: Arch, found: Study) -> None:
        self.arch, self.found, self.words = arch, found, Words(__package__)

    def items(self) -> list[str]:
        """Say how dense the crowd is, what its people carry, and what of it is determined."""
        arch, inside, distance = self.arch, self.arch.inside(), self.arch.distance()
        carried, resultant = arch.carried(), arch.resultants()
        most, most_vector = arch.largest(carried), arch.largest(resultant)
        lower, upper = carried_interval(arch, most)
        drive = arch.snapshot.mass * np.hypot(*arch.left_velocity.T) / arch.window
        return self.words.items(
            "words",
            inside=int(inside.sum()),
            people=len(inside),
            time=self.found.scene.analysis.time_s,
            density=(inside & (distance <= NEAR_M)).sum() / (0.5 * np.pi * NEAR_M**2),
            near=NEAR_M,
            engine=engine_label(self.found.comparisons[0]),
            unbalanced=self.found.comparisons[0].balance.unbalanced,
            drive=drive.mean(),
            vectors=(resultant[inside].mean(), resultant[most_vector], distance[most_vector]),
            sums=(carried[inside].mean(), carried[most], distance[most]),
            angle=arch.angle_degrees()[most],
            ends=(lower, upper),
            fixed=upper - lower < 1e-6 * upper,
            contacts=len(arch.contacts),
            known=determinacy(arch.contacts, len(arch.snapshot)),
            sure=int(admissible_determinacy(arch.contacts, arch.answer).determined.sum()),
        )

    def maxima_table(self) -> Table:
        """Tabulate the forces on the people inside, and where the largest are."""
        arch, inside = self.arch, self.arch.inside()
        rows: list[Sequence[Cell]] = []
        for name, values in (
            ("sum of normal magnitudes", arch.carried()),
            ("vector sum", arch.resultants()),
        ):
            most = arch.largest(values)
            middle, high = np.quantile(values[inside], (0.5, 0.95))
            sizes = values[inside].mean(), middle, high, values[most]
            place = arch.distance()[most], arch.angle_degrees()[most]
            rows.append((name, *map(float, (*sizes, *place)), int(arch.snapshot.ids[most])))
        return self.words.table("table_maxima", rows)

    def engines_table(self) -> Table:
        """Tabulate the sums of magnitudes by each engine against the percussions."""
        return self.words.table("table_engines", [_engine_row(c) for c in self.found.comparisons])

    def snapshot_picture(self, name: str) -> Picture:
        """Draw the crowd and its percussions."""
        figure = charts.snapshot(self.arch)
        return Picture(name=name, caption=self.words.text("snapshot"), figure=figure)

    def engines_picture(self, name: str) -> Picture:
        """Draw the percussions against each engine."""
        figure = charts.engines(self.found.comparisons)
        return Picture(name=name, caption=self.words.text("engines"), figure=figure)

    def warnings(self) -> list[str]:
        """List what a reader has to know of the runs and the answer."""
        own = unsolved([("percussions of the snapshot", self.arch.answer)])
        return [*self.found.warnings, *own]


def _engine_row(comparison: Comparison) -> Sequence[Cell]:
    penalty, rigid = comparison.disk_sums()
    distance = Arch.of(comparison.scene, comparison.snapshot).distance()
    return (
        engine_label(comparison),
        float(penalty.mean()),
        float(rigid.mean()),
        float(penalty.max()),
        float(distance[penalty.argmax()]),
        float(rigid.max()),
        float(distance[rigid.argmax()]),
        correlation(penalty, rigid),
        relative_difference(penalty, rigid),
        comparison.balance.unbalanced,
        str(comparison.answer.status),
    )
