"""Work against precision of whole runs: by how much each engine and setting is off in what chaos does
not spoil, over replicates; as points, CSV, JSON and a section of the chart's page."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from pydantic import TypeAdapter, ValidationError
from scipy.stats import t as student

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines import ENGINES, PENALTY, EngineError, engine
from analysis.engines.record import RunRecord, divided
from analysis.engines.run import EngineRun, run_ahead, run_folder
from analysis.exposure.limits import Quantity
from analysis.exposure.loads import RunLoads, read_exposure
from analysis.motion.inference import LEVEL
from analysis.motion.study import in_each
from analysis.pages.drawing import COLOURS, GRID, MARKERS, lead
from analysis.pages.names import engine_name
from analysis.pages.numbers import NONE, number, signed, significant
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.scene.scene import Scene, first_problem
from analysis.scene.shipped_scenes import how_varied, variant
from analysis.support.files import write_json, write_rows
from analysis.support.machine import machine
from analysis.support.parallel import Progress
from nscd.arrays import Floats

RIGID = "rigid"
# Of the rigid engine: steps over its own, tolerances at its own step.
RIGID_STEPS, RIGID_TOLERANCES = (0.2, 1.0, 4.0), (1e-4, 1e-2)
# Times the scene's stiffness at the safe step; and, at a step so much longer, the first ones.
STIFFER, LONGER, LONGER_AT = (1.0, 10.0, 100.0), 4.0, 2
# Windows of an impact that is run.
FRAMES_OF_IMPACT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Name an engine with what decides its error.

    stiffness_N_per_m: N/m, of an engine with springs"""

    engine: str
    step_s: float | None = None  # s, of the rigid engine
    tolerance: float | None = None  # of its contact problem; None: its own
    stiffness_N_per_m: float | None = None  # noqa: N815  (the unit is newton)
    longer: float = 1.0  # its step over the safe one

    @property
    def is_coarse(self) -> bool:
        """Tell whether it is looser than its engine's own: tolerance, or a longer step."""
        return self.tolerance is not None or self.longer != 1

    @property
    def short(self) -> str:
        """Name it beside its engine: `5 ms`, `10⁶ N/m`."""
        if self.step_s is not None:
            last = f", to {significant(self.tolerance)}" if self.tolerance else ""
            return f"{significant(1e3 * self.step_s)} ms{last}"
        last = f", {self.longer:g} × step" if self.longer != 1 else ""
        return f"{number(self.stiffness_N_per_m)} N/m{last}"

    @property
    def title(self) -> str:
        """Name it in full: `LAMMPS, 10⁶ N/m`."""
        return f"{engine_name(self.engine)}, {self.short}"

    def of(self, scene: Scene) -> Scene:
        """Return the scene as it is run."""
        if self.step_s is not None:
            return scene.with_run(rigid_step_s=self.step_s, rigid_tolerance=self.tolerance)
        made = scene.with_contact(stiffness_N_per_m=self.stiffness_N_per_m)
        made = made.with_run(time_step_s=None)
        if self.longer == 1:
            return made
        safe = engine(self.engine).timing(made).safe_time_step
        return made.with_run(time_step_s=divided(made.run, self.longer * safe)[0])

    def run(self, scene: Scene, out: Path) -> EngineRun:
        """Name the run of a scene with this setting in the folder."""
        made = self.of(scene)
        place = out if self.longer == 1 else out / f"step_{self.longer:g}"
        return EngineRun(
            scene=made, engine=self.engine, folder=run_folder(place, made, self.engine)
        )


def whole_run_settings(scene: Scene, engines: Sequence[str]) -> list[Setting]:
    """List the settings of a scene, the reference first: the rigid engine at its shortest step."""
    found = []
    if RIGID in engines:
        own = engine(RIGID).timing(scene).time_step
        steps = [divided(scene.run, share * own)[0] for share in RIGID_STEPS]
        found += [Setting(engine=RIGID, step_s=step) for step in dict.fromkeys(steps)]
        found += [Setting(engine=RIGID, step_s=own, tolerance=one) for one in RIGID_TOLERANCES]
    k = scene.contact.stiffness_N_per_m
    for place, name in enumerate(known.NAME for known in PENALTY if known.NAME in engines):
        tried = [(times, 1.0) for times in STIFFER[: 3 - 2 * place]]
        tried += [(times, LONGER) for times in STIFFER[: 0 if place else LONGER_AT]]
        found += [
            Setting(engine=name, stiffness_N_per_m=times * k, longer=longer)
            for times, longer in tried
        ]
    return found


def crowds_of(scene: Scene, count: int) -> list[Scene]:
    """Make the crowds of a scene, as they are run by every setting: with impulses, an impact in
    few frames."""
    changes: dict[str, object] = {"impulses": True, "time_step_s": None}
    if scene.drive is None:
        changes["frames"] = FRAMES_OF_IMPACT
    return [variant(scene, index).with_run(**changes) for index in range(count)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SettingRuns:
    """Hold the runs of one setting.

    alone: crowd 0 without: what the engine's own work costs; None where impulses cost nothing"""

    setting: Setting
    crowds: Mapping[int, EngineRun]  # by their numbers, with impulses
    alone: EngineRun | None

    @property
    def every(self) -> list[EngineRun]:
        """List all runs."""
        return [*self.crowds.values(), *([self.alone] if self.alone else [])]


def runs_of(settings: Sequence[Setting], crowds: Sequence[Scene], out: Path) -> list[SettingRuns]:
    """Name the runs of crowds by settings: OUT/crowd_0/…, and alone OUT/…."""
    plain, found = crowds[0].with_run(impulses=None), []
    for one in settings:
        runs = {i: one.run(crowd, out / f"crowd_{i}") for i, crowd in enumerate(crowds)}
        alone = None if one.engine == RIGID else one.run(plain, out)
        found.append(SettingRuns(setting=one, crowds=runs, alone=alone))
    return found


def whole_runs_of(scene: Scene, count: int, out: Path) -> list[SettingRuns]:
    """Name the runs of so many crowds by all engines that are there; none of no crowds."""
    if not count:
        return []
    engines = [known.NAME for known in ENGINES if known.find()]
    crowds = crowds_of(scene, count)
    return runs_of(whole_run_settings(crowds[0], engines), crowds, out)


# From rest (s): the crowd is arrested, the cheapest test of stiffness.
ARREST_S = (0.5, 1.0)
# Contacts that pass on less than this share of the largest impulse of an impact hardly touch.
LEAST_SHARE = 1e-2
NAN = float("nan")
DRIVEN: Mapping[str, Quantity] = {
    "walls_arrest": Quantity(title="load on all walls, 0.5–1 s", unit="kN"),
    "walls": Quantity(title="load on all walls", unit="kN"),
    "walls_95": Quantity(title="95 % over time of that load", unit="kN"),
    "contact_mean": Quantity(title="mean contact force", unit="N"),
    "contact_95": Quantity(title="95 % contact force", unit="N"),
    "flow": Quantity(title="people through the door per second", unit="1/s"),
}
IMPACT: Mapping[str, Quantity] = {
    "walls": Quantity(title="impulse on all walls", unit="N·s"),
    "contact_sum": Quantity(title="sum of all contact impulses", unit="N·s"),
    "contact_95": Quantity(title="95 % contact impulse", unit="N·s"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bias:
    """Hold by what share of the reference a setting is above it, on the crowds that both have.

    error: standard error of the share; low, high: its 90 % interval (Student's t); NaN of fewer
        than two crowds, and where all differ alike, which does not say how far chance reaches"""

    share: float
    error: float
    low: float
    high: float
    crowds: int  # how many both have

    @property
    def within(self) -> float:
        """Give the end of the interval that is farther from zero: what the error is at most."""
        return farther(self.low, self.high)


def farther(low: float, high: float) -> float:
    """Give how far from zero the farther end of an interval is."""
    return max(abs(low), abs(high))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """Hold the statistics of one setting, crowd by crowd."""

    setting: Setting
    crowds: Sequence[int]  # (c,) their numbers
    values: Mapping[str, Floats]  # (c,) per statistic, in its unit
    cpu_seconds: float  # s, of a whole run: of crowd 0 without impulses, else the median
    with_impulses: float  # s, the median of the runs that sum impulses

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
    """Hold what whole runs of a scene said."""

    scene: Scene  # crowd 0
    crowds: int  # how many were asked for
    every: Sequence[Measured]  # the settings that have results, the reference first
    failures: Sequence[str]  # runs that did not end well, and why

    @property
    def reference(self) -> Measured:
        """Give what the others are measured from."""
        return self.every[0]

    @property
    def statistics(self) -> dict[str, Quantity]:
        """Give the statistics that are not zero in the reference, by name."""
        known = IMPACT if self.scene.drive is None else DRIVEN
        values = self.reference.values
        return {name: known[name] for name in known if name in values and values[name].mean()}


def measure_whole_runs(
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
    for index, run in runs.crowds.items():
        try:
            record = _record(run, read_only)
            rows.append(statistics_of(run, record))
        except (EngineError, DumpError) as error:
            if not read_only:
                failures.append(f"{runs.setting.title}, crowd {index}: {error}")
            continue
        costs.append(record.cpu_seconds)
        crowds.append(index)
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
    return _of_driven(read_exposure(run.folder))


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


def _of_driven(series: RunLoads) -> dict[str, float]:
    """Means over the windows of the second half, and of the arrest."""
    begins, values = series.time - series.duration + 1e-9, series.values
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


FORMAT, NAME = 1, "whole_runs"


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeRunPoint:
    """Hold one statistic of one setting.

    method, step_s, tolerance, stiffness_N_per_m, longer: as in `Setting`
    cpu_seconds, with_impulses_s: s, of a whole run, as in `Measured`
    bias, bias_low, bias_high: by what share the mean is above the reference, and the 90 % interval
    machine, date: where and when it was measured (ISO date)"""

    scene: str  # what was run
    disks: int  # what was run
    duration_s: float  # what was run
    method: str
    step_s: float | None
    tolerance: float | None
    stiffness_N_per_m: float | None  # noqa: N815  (the unit is newton)
    longer: float
    crowds: int  # how many
    cpu_seconds: float | None
    with_impulses_s: float | None
    quantity: str  # over the crowds, in the unit
    unit: str  # over the crowds, in the unit
    mean: float  # over the crowds, in the unit
    standard_error: float | None  # over the crowds, in the unit
    bias: float | None
    bias_low: float | None
    bias_high: float | None
    reference: bool  # whether it is what the others are measured from
    machine: str
    date: str

    @property
    def error(self) -> float | None:
        """Give what the error is at most: the end of the interval that is farther from zero."""
        if self.bias_low is None or self.bias_high is None:
            return None
        return farther(self.bias_low, self.bias_high)

    @property
    def setting(self) -> Setting:
        """Give the setting."""
        names = ("step_s", "tolerance", "stiffness_N_per_m", "longer")
        return Setting(engine=self.method, **{name: getattr(self, name) for name in names})


COLUMNS = tuple(field.name for field in dataclasses.fields(WholeRunPoint))
_READER = TypeAdapter(list[WholeRunPoint])


def points_of(found: Precision) -> Iterator[WholeRunPoint]:
    """Yield a point per setting and statistic; what is not known is None."""
    scene, today = found.scene, datetime.now(UTC).date().isoformat()
    for one in found.every:
        for name, statistic in found.statistics.items():
            setting, (mean, error) = dataclasses.asdict(one.setting), one.mean(name)
            bias = one.bias(found.reference, name)
            yield WholeRunPoint(
                scene=scene.name,
                disks=len(scene.snapshot),
                duration_s=scene.run.duration_s,
                method=setting.pop("engine"),
                **setting,
                crowds=len(one.crowds),
                cpu_seconds=_none_if_nan(one.cpu_seconds),
                with_impulses_s=_none_if_nan(one.with_impulses),
                quantity=name,
                unit=statistic.unit,
                mean=mean,
                standard_error=_none_if_nan(error),
                bias=_none_if_nan(bias.share),
                bias_low=_none_if_nan(bias.low),
                bias_high=_none_if_nan(bias.high),
                reference=one is found.reference,
                machine=machine(),
                date=today,
            )


def _none_if_nan(value: float) -> float | None:
    return value if isfinite(value) else None


def content_of(points: Sequence[WholeRunPoint]) -> dict[str, object]:
    """Give what whole_runs.json holds."""
    return {"format": FORMAT, "points": [dataclasses.asdict(point) for point in points]}


def write_whole_runs(folder: Path, points: Sequence[WholeRunPoint]) -> None:
    """Write whole_runs.json and whole_runs.csv (one row per point), each whole or not at all."""
    write_json(folder / f"{NAME}.json", content_of(points))
    rows = (dataclasses.asdict(point).values() for point in points)
    write_rows(folder / f"{NAME}.csv", COLUMNS, rows)


def read_whole_runs(text: str, origin: str) -> list[WholeRunPoint]:
    """Read what whole_runs.json holds. Raises ValueError naming its origin."""
    try:
        content = json.loads(text)
        if content["format"] != FORMAT:
            raise ValueError(f"format: {content['format']}; {FORMAT} is needed")
        return _READER.validate_python(content["points"])
    except (KeyError, TypeError, ValueError) as error:
        reason = first_problem(error) if isinstance(error, ValidationError) else error
        raise ValueError(f"{origin}: not the whole runs of a chart: {reason}") from None


PANELS = 3
# Between words above a panel, as a share of its width.
APART = 0.06


def whole_runs_section(found: Precision) -> Section:
    """Put whole runs into words, a picture and a table."""
    words, scene = Words(__name__), found.scene
    values = {
        "reference": found.reference.setting.title,
        "crowds": found.crowds,
        "duration": scene.run.duration_s,
        "varied": how_varied(scene, found.crowds),
        "driven": scene.drive is not None,
        "heads": [f"{one.title} ({one.unit})" for one in found.statistics.values()],
    }
    caption, figure = words.text("picture", **values), whole_runs_picture(found)
    return Section(
        number=NAME,
        title=words.text("title"),
        introduction=[words.text("what", **values), words.text("cost")],
        pictures=[Picture(name=NAME, caption=caption, figure=figure)],
        tables=[words.table("table", whole_runs_rows(found), **values)],
        warnings=found.failures,
        files=[f"{NAME}.csv"],
    )


def whole_runs_rows(found: Precision) -> list[list[str]]:
    """List a row per setting: crowds, CPU seconds, and each statistic with its error."""
    rows = []
    for one in found.every:
        costs = (one.cpu_seconds, one.with_impulses)
        cells = [one.setting.title, str(len(one.crowds)), *(significant(cost, 2) for cost in costs)]
        rows.append(cells + [_cell(one, found, name) for name in found.statistics])
    return rows


def _cell(one: Measured, found: Precision, name: str) -> str:
    """The mean of a reference; of others by how much they are above it, with 90 %."""
    if one is found.reference:
        mean, error = one.mean(name)
        if not isfinite(error):
            return in_each(number(mean), len(one.crowds), "replicates")
        return f"{significant(mean)} ± {significant(error, 2)}"
    bias = one.bias(found.reference, name)
    if not isfinite(bias.share):
        return NONE
    if not isfinite(bias.low):
        return in_each(signed(bias.share), bias.crowds, "replicates")
    return f"{signed(bias.share)} ({signed(bias.low)} to {signed(bias.high)})"


def whole_runs_picture(found: Precision) -> Figure:
    """Draw the error of each statistic against CPU time, all engines on one picture."""
    names = list(found.statistics)
    lines = -(-len(names) // PANELS)
    figure = Figure(figsize=(13.0, 1.0 + 4.0 * lines), layout="constrained")
    panels = figure.subplots(lines, PANELS, squeeze=False).ravel()
    for axes, name in zip(panels, names, strict=False):
        _draw(axes, found, name)
        axes.set_title(found.statistics[name].title, pad=52)
        axes.set(xlabel="CPU time of a run (s)", ylabel="above the reference (%)")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    for axes in panels[len(names) :]:
        axes.axis("off")
    handles, labels = panels[0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    figure.legend(known.values(), known, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(axes: Axes, found: Precision, name: str) -> None:
    """One panel: an engine has a colour and a marker, which is hollow where it is coarse."""
    engines = list(dict.fromkeys(one.setting.engine for one in found.every))
    for one in found.every:
        place = engines.index(one.setting.engine) % len(COLOURS)
        bias, colour = one.bias(found.reference, name), COLOURS[place]
        coarse, bar = one.setting.is_coarse, np.array([_reach(bias)]).T
        look: dict[str, Any] = {"fmt": MARKERS[place], "color": colour, "capsize": 3}
        look["mfc"] = "white" if coarse else colour
        label = "_" if coarse else engine_name(one.setting.engine)
        axes.errorbar([one.cpu_seconds], [100 * bias.share], yerr=bar, label=label, **look)
    axes.axhline(0.0, color=GRID, zorder=0)
    axes.set_xscale("log")
    axes.margins(x=0.1, y=0.12)
    _name(axes, found, name, engines)


def _name(axes: Axes, found: Precision, name: str, engines: Sequence[str]) -> None:
    """Write the settings above a panel, side by side in the order of their cost, each with a line
    to its point: points lie too near to each other for words."""
    named = sorted(
        (one for one in found.every if not one.setting.is_coarse), key=lambda one: one.cpu_seconds
    )
    left, right = np.log(axes.get_xlim())
    at = (np.log([one.cpu_seconds for one in named]) - left) / (right - left)
    for place in range(1, len(at)):
        at[place] = max(at[place], at[place - 1] + APART)
    for place in reversed(range(len(at))):
        at[place] = min(at[place], 1.0 - APART * (len(at) - 1 - place))
    for one, share in zip(named, at, strict=True):
        colour = COLOURS[engines.index(one.setting.engine) % len(COLOURS)]
        point = (one.cpu_seconds, 100 * one.bias(found.reference, name).share)
        turned = {"rotation": 90, "ha": "center", "va": "bottom", "fontsize": 8}
        lead(axes, one.setting.short, point, (share, 1.03), colour, **turned)


def _reach(bias: Bias) -> Sequence[float]:
    """How far its bar goes down and up (%); no bar where nothing is known."""
    if not isfinite(bias.low):
        return 0.0, 0.0
    return 100 * (bias.share - bias.low), 100 * (bias.high - bias.share)
