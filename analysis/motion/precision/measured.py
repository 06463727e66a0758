"""What whole runs say, over crowds: numbers that chaos does not spoil, and how far each setting is
from the reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines import EngineError
from analysis.engines.record import RunRecord
from analysis.engines.run import EngineRun, run_ahead
from analysis.motion.inference import LEVEL
from analysis.motion.precision.settings import Setting, SettingRuns
from analysis.motion.series import Measure, Series, read_series
from analysis.scene.scene import Scene
from analysis.support.progress import Progress
from nscd.arrays import Floats

# From rest (s): the crowd is arrested, the cheapest test of stiffness.
ARREST_S = (0.5, 1.0)
# Contacts that pass on less than this share of the largest impulse of an impact hardly touch.
LEAST_SHARE = 1e-2
NAN = float("nan")
DRIVEN: Mapping[str, Measure] = {
    "walls_arrest": Measure(title="load on all walls, 0.5–1 s", unit="kN"),
    "walls": Measure(title="load on all walls", unit="kN"),
    "walls_95": Measure(title="95 % over time of that load", unit="kN"),
    "contact_mean": Measure(title="mean contact force", unit="N"),
    "contact_95": Measure(title="95 % contact force", unit="N"),
    "flow": Measure(title="people through the door per second", unit="1/s"),
}
IMPACT: Mapping[str, Measure] = {
    "walls": Measure(title="impulse on all walls", unit="N·s"),
    "contact_sum": Measure(title="sum of all contact impulses", unit="N·s"),
    "contact_95": Measure(title="95 % contact impulse", unit="N·s"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bias:
    """Hold by what share of the reference a setting is above it, on the crowds that both have.

    error: standard error of the share; low, high: its 90 % interval (Student's t); NaN of fewer
        than two crowds, and where all differ alike, which does not say how far chance reaches
    crowds: how many both have
    """

    share: float
    error: float
    low: float
    high: float
    crowds: int

    @property
    def within(self) -> float:
        """Give the end of the interval that is farther from zero: what the error is at most."""
        return farther(self.low, self.high)


def farther(low: float, high: float) -> float:
    """Give how far from zero the farther end of an interval is."""
    return max(abs(low), abs(high))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """Hold the statistics of one setting, crowd by crowd.

    crowds: (c,) their numbers
    values: (c,) per statistic, in its unit
    cpu_seconds: s, of a whole run: of crowd 0 without impulses, else the median
    with_impulses: s, the median of the runs that sum impulses
    """

    setting: Setting
    crowds: Sequence[int]
    values: Mapping[str, Floats]
    cpu_seconds: float
    with_impulses: float

    def mean(self, name: str) -> tuple[float, float]:
        """Give the mean of the crowds and its standard error, NaN of one crowd and of equal ones."""
        values = self.values[name]
        return float(values.mean()), _standard_error(values)

    def bias(self, reference: Measured, name: str) -> Bias:
        """Compare with the reference, crowd with crowd."""
        shared = [number for number in self.crowds if number in reference.crowds]
        mine, theirs = (
            np.array([one.values[name][list(one.crowds).index(number)] for number in shared])
            for one in (self, reference)
        )
        if self is reference or not shared or not theirs.mean():
            share = 0.0 if self is reference else NAN
            return Bias(share=share, error=NAN, low=NAN, high=NAN, crowds=len(shared))
        share = float((mine - theirs).mean() / theirs.mean())
        error = _standard_error(mine - theirs) / abs(float(theirs.mean()))
        count = len(shared)
        reach = error * float(student.ppf(0.5 + LEVEL / 2, count - 1))
        low, high = share - reach, share + reach
        return Bias(share=share, error=error, low=low, high=high, crowds=count)


def _standard_error(values: Floats) -> float:
    if len(values) < 2:
        return NAN
    return float(np.std(values, ddof=1)) / float(np.sqrt(len(values))) or NAN


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Precision:
    """Hold what whole runs of a scene said.

    scene: crowd 0
    crowds: how many were asked for
    every: the settings that have results, the reference first
    failures: runs that did not end well, and why
    """

    scene: Scene
    crowds: int
    every: Sequence[Measured]
    failures: Sequence[str]

    @property
    def reference(self) -> Measured:
        """Give what the others are measured from."""
        return self.every[0]

    @property
    def statistics(self) -> dict[str, Measure]:
        """Give the statistics that are not zero in the reference, by name."""
        known = IMPACT if self.scene.drive is None else DRIVEN
        values = self.reference.values
        return {name: known[name] for name in known if name in values and values[name].mean()}


def measure(
    scene: Scene,
    runs: Sequence[SettingRuns],
    *,
    progress: Progress | None = None,
    processes: int | None = None,
    read_only: bool = False,
) -> Precision:
    """Run what is not finished and read all; with `read_only` what there is. Runs that fail are
    left out and named. Raises ValueError where nothing ended well."""
    if not read_only:
        run_ahead([run for one in runs for run in one.every], progress, processes)
    failures: list[str] = []
    found = (_measured(one, failures, read_only) for one in runs)
    every = [one for one in found if one is not None]
    if not every:
        raise ValueError(f"scene {scene.name}: no whole run ended well: {'; '.join(failures)}")
    crowds = max(len(one.crowds) for one in runs)
    return Precision(scene=scene, crowds=crowds, every=every, failures=failures)


def _measured(runs: SettingRuns, failures: list[str], read_only: bool) -> Measured | None:
    rows, costs, crowds = [], [], []
    for number, run in runs.crowds.items():
        try:
            record = _record(run, read_only)
            rows.append(statistics_of(run, record))
        except (EngineError, DumpError) as error:
            if not read_only:
                failures.append(f"{runs.setting.title}, crowd {number}: {error}")
            continue
        costs.append(record.cpu_seconds)
        crowds.append(number)
    if not rows:
        return None
    summed = float(np.median(costs))
    try:
        own = _record(runs.alone, read_only).cpu_seconds if runs.alone else summed
    except EngineError:
        own = float("nan")
    return Measured(
        setting=runs.setting,
        crowds=crowds,
        values={name: np.array([row[name] for row in rows]) for name in rows[0]},
        cpu_seconds=own,
        with_impulses=summed,
    )


def _record(run: EngineRun, read_only: bool) -> RunRecord:
    """The record of a finished run; run again where it is not, unless it is only read."""
    if not read_only:
        return run.record()
    record = RunRecord.read(run.folder)
    record.check_finished(run.folder, run.scene.model_copy(update={"name": "scene"}))
    return record


def statistics_of(run: EngineRun, record: RunRecord) -> dict[str, float]:
    """Compute the statistics of a run. Raises DumpError."""
    if run.scene.drive is None:
        return _of_impact(RunWindows(run.folder, record.time_step_s))
    return _of_driven(read_series(run.folder, record.time_step_s))


def _of_impact(windows: RunWindows) -> dict[str, float]:
    """Impulses over the whole run."""
    whole = windows.window(0, len(windows.times) - 1)
    size = np.hypot(*whole.impulse.T)
    counted = size[size > LEAST_SHARE * size.max(initial=0.0)]
    return {
        "walls": float(size[whole.is_wall].sum()),
        "contact_sum": float(size.sum()),
        "contact_95": float(np.quantile(counted, 0.95)) if len(counted) else 0.0,
    }


def _of_driven(series: Series) -> dict[str, float]:
    """Means over the windows of the second half, and of the arrest."""
    begins, values = series.time - series.window_s + 1e-9, series.values
    late = begins >= 0.5 * series.time[-1]
    arrest = (begins >= ARREST_S[0]) & (series.time <= ARREST_S[1] + 1e-9)
    found = {
        name: float(values[name][late].mean()) for name in ("contact_mean", "contact_95", "flow")
    }
    found["walls_95"] = 1e-3 * float(np.quantile(values["walls"][late], 0.95))
    if not np.array_equal(late, arrest):  # in a run of 1 s both are the same
        found["walls"] = 1e-3 * float(values["walls"][late].mean())
    if arrest.any() and series.time[-1] >= ARREST_S[1] - 1e-9:
        found["walls_arrest"] = 1e-3 * float(values["walls"][arrest].mean())
    return found
