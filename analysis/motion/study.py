"""A scene in motion: its runs by several models and of several replicates, and each model over its
replicates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError
from analysis.engines import PENALTY, EngineError, engine
from analysis.engines.guard import RunStoppedError
from analysis.engines.run import EngineRun, run_ahead, run_folder
from analysis.motion.inference import (
    Difference,
    Sample,
    correlation_windows,
    differences,
    range_of_counts,
    range_of_windows,
)
from analysis.motion.series import MEASURES, Series, read_series
from analysis.pages.names import engine_name
from analysis.pages.numbers import number, significant
from analysis.scene.scene import Scene
from analysis.scene.variation import variant
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.stepping import StepError

# What two models are compared in, all at once.
COMPARED = (*MEASURES, "wall_line_load")


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Hold a mean with the range that holds 90 % of further windows, of other replicates too.

    mean, low, high: in the unit of the measure; the range is NaN of a single replicate
    replicates, windows: of each, how many there are
    independent: how many of all windows count as independent, by their correlation time
    alike: how many windows there are, where all are equal; else 0. Equal numbers do not say by how
        much others vary, so their range, of no width, is no certainty
    """

    mean: float
    low: float
    high: float
    replicates: int
    windows: int
    independent: float
    alike: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensemble:
    """Hold the series of one model over its replicates.

    title: of the model, as a page names it
    engine: its name in commands
    series: one per replicate
    last_s: s, how much of the end of each run counts
    """

    title: str
    engine: str
    series: Sequence[Series]
    last_s: float

    def windows(self, measure: str) -> list[Floats]:
        """Give the windows (w,) of each replicate that count. The flow and the lifetime of arches
        are one number per replicate: people pass one by one, and in a window there are none or
        one."""
        if measure == "arch_lifetime":
            lives = [series.lifetimes(self.last_s) for series in self.series]
            return [np.array([np.mean(one)]) for one in lives if len(one)]
        chosen = [series.values[measure][series.last(self.last_s)] for series in self.series]
        return [values.mean(keepdims=True) for values in chosen] if measure == "flow" else chosen

    def sample(self, measure: str) -> Sample:
        """Give one number per replicate; of the flow how many people passed."""
        windows = self.windows(measure)
        if measure == "flow":
            return Sample.of_counts(np.concatenate(windows) * self._counted_s(), self._counted_s())
        return Sample.of_windows(windows)

    def interval(self, measure: str) -> Interval:
        """Give the mean, and the range that holds 90 % of further windows; of the flow, the counts
        of further replicates."""
        windows = self.windows(measure)
        low = high = mean = float("nan")
        independent, alike = 0.0, 0
        if windows:
            pooled = np.concatenate(windows)
            mean = float(pooled.mean())
            independent = len(pooled) / correlation_windows(windows)
            alike = 0 if np.ptp(pooled) or measure == "flow" else len(pooled)
        if len(windows) > 1 and measure == "flow":
            sample = self.sample(measure)
            low, high = (end * sample.unit for end in range_of_counts(sample.values))
        elif len(windows) > 1:
            low, high = range_of_windows(windows)
            high = min(high, 1.0) if measure == "arch_share" else high
            low, high = min(low, mean), max(high, mean)
        return Interval(
            mean=mean,
            low=low,
            high=high,
            replicates=len(windows),
            windows=len(windows[0]) if windows else 0,
            independent=independent,
            alike=alike,
        )

    def differences(self, other: Ensemble) -> dict[str, Difference]:
        """Say by how much each quantity is above that of another model, largest effects first, with
        one correction for all; empty where either has fewer than three replicates."""
        return _differences(self, other)

    def _counted_s(self) -> float:
        """How long the windows of a replicate that count last together (s)."""
        first = self.series[0]
        return float(first.last(self.last_s).sum()) * first.window_s


@lru_cache(maxsize=64)  # a page says them in several places
def _differences(one: Ensemble, other: Ensemble) -> dict[str, Difference]:
    both = [key for key in COMPARED if one.windows(key) and other.windows(key)]
    mine, theirs = ({key: of.sample(key) for key in both} for of in (one, other))
    return differences(mine, theirs)


# The other friction, of people and walls alike, that a scene without friction is run with.
FRICTION = 0.4
# From so many crowds on all models have all; else the costliest have the fewest that tell models
# apart.
MANY, FEW = 10, 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionStudy:
    """Hold the models of one scene, each with the series of its crowds.

    scene: crowd 0
    crowds: how many were asked for
    last_s: s, how much of the end of each run counts
    failures, warnings: what a reader should know
    limits: files of users' limits
    """

    scene: Scene
    ensembles: Sequence[Ensemble]
    crowds: int
    last_s: float
    failures: Sequence[str]
    warnings: Sequence[str]
    limits: tuple[Path, ...] = ()

    @property
    def friction(self) -> float:
        """The friction of all models."""
        return self.scene.contact.friction

    @property
    def reference(self) -> Ensemble | None:
        """The rigid model, where it ran."""
        return next((one for one in self.ensembles if one.engine == "rigid"), None)


def motion_runs(
    scene: Scene, engines: Sequence[str], stiffnesses: Sequence[float], crowds: int, out: Path
) -> dict[str, list[EngineRun]]:
    """List the runs that a study needs, by the title of the model. Impulses are summed in all.

    The first engine with springs runs at each stiffness, further ones at the first. Of ten crowds or
    more all run everything. Of fewer only three run at the stiffnesses after the first, which cost
    most, and further engines run crowd 0, since they agree with the first contact by contact."""
    variants = [variant(scene, number).with_run(impulses=True) for number in range(crowds)]
    soft = [known.NAME for known in PENALTY if known.NAME in engines]
    runs: dict[str, list[EngineRun]] = {}
    for name in engines:
        for k in _stiffnesses(scene, name, soft, stiffnesses):
            costly = name in soft and k != stiffnesses[0]
            least = 1 if name in soft[1:] else FEW if costly else crowds
            least = crowds if crowds >= MANY else least
            made = [one.with_contact(stiffness_N_per_m=k) for one in variants[:least]]
            title = model_title(made[0], name)
            if len(made) < crowds:
                title += f", {len(made)} replicates" if len(made) > 1 else ", one replicate"
            runs[title] = [
                EngineRun(scene=one, engine=name, folder=_folder(out, one, name, index))
                for index, one in enumerate(made)
            ]
    return runs


def _stiffnesses(
    scene: Scene, name: str, soft: Sequence[str], stiffnesses: Sequence[float]
) -> Sequence[float]:
    if name not in soft:
        return [scene.contact.stiffness_N_per_m]
    return stiffnesses if name == soft[0] else stiffnesses[:1]


def model_title(scene: Scene, name: str) -> str:
    """Name the model of a run: the engine with its stiffness or step, and friction where it has
    some."""
    if name in (known.NAME for known in PENALTY):
        setting = f"k = {number(scene.contact.stiffness_N_per_m)} N/m"
    else:
        setting = f"h = {number(1e3 * engine(name).timing(scene).time_step)} ms"
    friction = f", μ = {significant(scene.contact.friction)}" if scene.contact.friction else ""
    return f"{engine_name(name)}, {setting}{friction}"


def _folder(out: Path, scene: Scene, name: str, index: int) -> Path:
    """Crowd by crowd, apart from the scene's own runs, which have no impulses."""
    friction = scene.contact.friction
    return run_folder(
        out / (f"friction_{friction:g}" if friction else "") / f"crowd_{index}", scene, name
    )


def study_motion(
    scene: Scene,
    runs: Mapping[str, Sequence[EngineRun]],
    last_s: float,
    progress: Progress | None = None,
    limits: tuple[Path, ...] = (),
) -> MotionStudy:
    """Run what is not finished, on all cores, and read the series of all. A run that fails or is
    stopped is left out and named."""
    run_ahead([run for every in runs.values() for run in every], progress)
    ensembles: list[Ensemble] = []
    failures: list[str] = []
    warnings: list[str] = []
    for title, every in runs.items():
        series = []
        for index, run in enumerate(every):
            try:
                series.append(read_series(run.folder, run.record().time_step_s, limits))
            except (EngineError, DumpError, StepError) as error:
                said = f"{title}, crowd {index}: {error}"
                (failures if isinstance(error, RunStoppedError) else warnings).append(said)
        if series:
            last = min(last_s, float(series[0].time[-1]))
            name = every[0].engine
            ensembles.append(Ensemble(title=title, engine=name, series=series, last_s=last))
    crowds = max((len(every) for every in runs.values()), default=0)
    return MotionStudy(
        scene=scene,
        ensembles=ensembles,
        crowds=crowds,
        last_s=last_s,
        failures=failures,
        warnings=sorted(set(warnings)),
        limits=limits,
    )
