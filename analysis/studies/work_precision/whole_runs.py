"""Work against precision of whole runs: by how much each engine and setting is off in what chaos does
not spoil, over replicates; as points, CSV, JSON and a section of the chart's page."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from scipy.stats import t as student

from analysis.dumps import DumpError
from analysis.dumps.windows import RunWindows
from analysis.engines import ENGINES, PENALTY, EngineError, engine
from analysis.engines.record import RunRecord, divided
from analysis.engines.run import EngineRun, run_ahead, run_folder
from analysis.pages.drawing import COLOURS, GRID, MARKERS, label, lead, panels
from analysis.pages.names import engine_name
from analysis.pages.numbers import NONE, number, signed, significant
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import how_varied, variant
from analysis.studies.exposure.limits import Quantity
from analysis.studies.exposure.loads import RunLoads, read_exposure
from analysis.studies.motion.inference import LEVEL
from analysis.studies.motion.study import in_each
from analysis.studies.work_precision.charts import spread
from analysis.studies.work_precision.point import Kept
from analysis.studies.work_precision.window import today
from analysis.support.columns import Columns
from analysis.support.machine import machine
from analysis.support.parallel import Progress

RIGID = "rigid"
# Of the rigid engine: steps over its own, tolerances at its own step.
RIGID_STEPS, RIGID_TOLERANCES = (0.2, 1.0, 4.0), (1e-4, 1e-2)
# Times the scene's stiffness at the safe step; and, at a step so much longer, the first ones.
STIFFER, LONGER, LONGER_AT = (1.0, 10.0, 100.0), 4.0, 2
# Windows of an impact that is run.
FRAMES_OF_IMPACT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSetting:
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
        path = out if self.longer == 1 else out / f"step_{self.longer:g}"
        folder = run_folder(path, made, self.engine)
        return EngineRun(scene=made, engine=self.engine, folder=folder)


def whole_run_settings(scene: Scene, engines: Sequence[str]) -> list[RunSetting]:
    """List the settings of a scene, the reference first: the rigid engine at its shortest step."""
    found = []
    if RIGID in engines:
        own = engine(RIGID).timing(scene).time_step
        steps = [divided(scene.run, fraction * own)[0] for fraction in RIGID_STEPS]
        found += [RunSetting(engine=RIGID, step_s=step) for step in dict.fromkeys(steps)]
        found += [RunSetting(engine=RIGID, step_s=own, tolerance=one) for one in RIGID_TOLERANCES]
    k = scene.contact.stiffness_N_per_m
    for index, name in enumerate(each.NAME for each in PENALTY if each.NAME in engines):
        tried = [(times, 1.0) for times in STIFFER[: 3 - 2 * index]]
        tried += [(times, LONGER) for times in STIFFER[: 0 if index else LONGER_AT]]
        found += [
            RunSetting(engine=name, stiffness_N_per_m=times * k, longer=longer)
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


class Planned(NamedTuple):
    """A run of a setting: of the crowd of that number with impulses, or, without a number, of crowd
    0 without, which is what the engine's own work costs."""

    setting: RunSetting
    crowd: int | None
    run: EngineRun


def runs_of(settings: Sequence[RunSetting], crowds: Sequence[Scene], out: Path) -> list[Planned]:
    """Plan the runs of crowds by settings: OUT/crowd_0/…, and alone OUT/… (impulses cost the rigid
    engine nothing)."""
    plain, found = crowds[0].with_run(impulses=None), []
    for one in settings:
        runs = (one.run(crowd, out / f"crowd_{i}") for i, crowd in enumerate(crowds))
        found += [Planned(one, index, run) for index, run in enumerate(runs)]
        if one.engine != RIGID:
            found.append(Planned(one, None, one.run(plain, out)))
    return found


def whole_runs_of(scene: Scene, count: int, out: Path) -> list[Planned]:
    """Plan the runs of so many crowds by all engines that are there; none of no crowds."""
    if not count:
        return []
    engines = [each.NAME for each in ENGINES if each.find()]
    crowds = crowds_of(scene, count)
    return runs_of(whole_run_settings(crowds[0], engines), crowds, out)


# From rest (s): the crowd is arrested, the cheapest test of stiffness.
ARREST_S = (0.5, 1.0)
# Contacts that pass on less than this share of the largest impulse of an impact hardly touch.
LEAST_SHARE = 1e-2
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
NAME = "whole_runs"


COLUMNS = Columns("whole_runs")


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeRunPoint(Kept):
    """Hold one statistic of one setting: what COLUMNS says of each.

    cpu_seconds is of crowd 0 without impulses, else with_impulses_s. There is no standard error of
    one crowd and of equal ones. The bias is of the crowds that both have (Student's t); it has no
    ends for fewer than two, and where all differ alike, which does not say how far chance
    reaches."""

    EDITION: ClassVar[int] = 1
    WORDS: ClassVar[str] = "whole runs"

    scene: str
    disks: int
    duration_s: float
    method: str
    step_s: float | None
    tolerance: float | None
    stiffness_N_per_m: float | None  # noqa: N815  (the unit is newton)
    longer: float
    crowds: int
    cpu_seconds: float | None
    with_impulses_s: float | None
    quantity: str
    unit: str
    mean: float
    standard_error: float | None
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
        return max(abs(self.bias_low), abs(self.bias_high))

    @property
    def setting(self) -> RunSetting:
        """Give the setting."""
        names = ("step_s", "tolerance", "stiffness_N_per_m", "longer")
        return RunSetting(engine=self.method, **{name: getattr(self, name) for name in names})


@dataclass(slots=True)
class RunResult:
    """What the runs of one setting said."""

    crowds: dict[int, dict[str, float]]  # by number: each statistic
    costs: list[float]  # CPU seconds with impulses
    alone: float | None = None  # CPU seconds without


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WholeRuns:
    """Hold what whole runs of a scene said."""

    scene: Scene  # crowd 0
    crowds: int  # how many were asked for
    points: Sequence[WholeRunPoint]  # setting by setting, the reference first
    failures: Sequence[str]  # runs that did not end well, and why

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Give the statistics that are not zero in the reference, by name."""
        measures = IMPACT if self.scene.drive is None else DRIVEN
        return {name: measures[name] for name in dict.fromkeys(one.quantity for one in self.points)}

    def of(self, quantity: str) -> list[WholeRunPoint]:
        """Give the points of a statistic, the reference first."""
        return [one for one in self.points if one.quantity == quantity]


def measure_whole_runs(
    scene: Scene,
    runs: Sequence[Planned],
    *,
    progress: Progress | None = None,
    processes: int | None = None,
    read_only: bool = False,
) -> WholeRuns:
    """Run what is not finished and read all; with `read_only` what there is. Runs that fail are
    left out and named. Raises ValueError where nothing ended well."""
    if not read_only:
        run_ahead([one.run for one in runs], progress, processes)
    failures: list[str] = []
    found = {one.setting: RunResult({}, []) for one in runs}
    for setting, crowd, run in runs:
        try:
            record = _record(run, read_only)
            if crowd is None:
                found[setting].alone = record.cpu_seconds
                continue
            found[setting].crowds[crowd] = statistics_of(run, record)
            found[setting].costs.append(record.cpu_seconds)
        except (EngineError, DumpError) as error:
            if crowd is not None and not read_only:
                failures.append(f"{setting.title}, crowd {crowd}: {error}")
    results = {setting: one for setting, one in found.items() if one.crowds}
    if not results:
        raise ValueError(f"scene {scene.name}: no whole run ended well: {'; '.join(failures)}")
    requested = len({one.crowd for one in runs} - {None})
    points = list(points_of(scene, results))
    return WholeRuns(scene=scene, crowds=requested, points=points, failures=failures)


def _record(run: EngineRun, read_only: bool) -> RunRecord:
    """The record of a finished run; run again where it is not, unless it is only read."""
    if not read_only:
        return run.record()
    record = RunRecord.read(run.folder)
    record.check_finished(run.folder, run.scene.model_copy(update={"name": "scene"}))
    return record


def points_of(scene: Scene, results: Mapping[RunSetting, RunResult]) -> Iterator[WholeRunPoint]:
    """Yield a point per setting, the reference first, and statistic that is not zero in the
    reference; what is not known is None."""
    measures, day = (IMPACT if scene.drive is None else DRIVEN), today()
    reference = next(iter(results.values()))
    for setting, one in results.items():
        summed = float(np.median(one.costs))
        alone = summed if setting.engine == RIGID else one.alone
        for name, measure in measures.items():
            theirs = {crowd: row[name] for crowd, row in reference.crowds.items() if name in row}
            if not any(theirs.values()):
                continue
            mine = {crowd: row[name] for crowd, row in one.crowds.items()}
            mean, error = _mean(list(mine.values()))
            of_itself = 0.0, None, None
            bias, low, high = of_itself if one is reference else bias_of(mine, theirs)
            named = dataclasses.asdict(setting)
            yield WholeRunPoint(
                scene=scene.name,
                disks=len(scene.snapshot),
                duration_s=scene.run.duration_s,
                method=named.pop("engine"),
                **named,
                crowds=len(mine),
                cpu_seconds=alone,
                with_impulses_s=summed,
                quantity=name,
                unit=measure.unit,
                mean=mean,
                standard_error=error,
                bias=bias,
                bias_low=low,
                bias_high=high,
                reference=one is reference,
                machine=machine(),
                date=day,
            )


def bias_of(
    mine: Mapping[int, float], theirs: Mapping[int, float]
) -> tuple[float | None, float | None, float | None]:
    """Compare the numbers of a setting with those of the reference, crowd with crowd: the bias as
    in `WholeRunPoint`, and the ends of its interval."""
    shared = [crowd for crowd in mine if crowd in theirs]
    mean = sum(theirs[crowd] for crowd in shared) / max(len(shared), 1)
    if not mean:
        return None, None, None
    fraction, error = _mean([(mine[crowd] - theirs[crowd]) / mean for crowd in shared])
    if error is None:
        # nothing says that others differ alike
        alone = len(shared) < min(len(mine), len(theirs), 2)
        return None if alone else fraction, None, None
    reach = error * float(student.ppf(0.5 + LEVEL / 2, len(shared) - 1))
    return fraction, fraction - reach, fraction + reach


def _mean(values: Sequence[float]) -> tuple[float, float | None]:
    """The mean and its standard error, none of one value and of equal ones."""
    error = float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
    return float(np.mean(values)), error or None


def statistics_of(run: EngineRun, record: RunRecord) -> dict[str, float]:
    """Compute the statistics of a run. Raises DumpError."""
    if run.scene.drive is None:
        return _of_impact(RunWindows(run.folder, record.time_step_s))
    return _of_driven(read_exposure(run.folder))


def _of_impact(windows: RunWindows) -> dict[str, float]:
    """Impulses over the whole run."""
    total = windows.window(0, len(windows.times) - 1)
    size = np.hypot(*total.impulse.T)
    counted = size[size > LEAST_SHARE * size.max(initial=0.0)]
    return {
        "walls": float(size[total.is_wall].sum()),
        "contact_sum": float(size.sum()),
        "contact_95": float(np.quantile(counted, 0.95)) if len(counted) else 0.0,
    }


def _of_driven(series: RunLoads) -> dict[str, float]:
    """Means over the windows of the second half, and of the arrest."""
    begins, values = series.time - series.duration + 1e-9, series.values
    late = begins >= 0.5 * series.time[-1]
    arrest = (begins >= ARREST_S[0]) & (series.time <= ARREST_S[1] + 1e-9)
    names = "contact_mean", "contact_95", "flow"
    found = {name: float(values[name][late].mean()) for name in names}
    found["walls_95"] = 1e-3 * float(np.quantile(values["walls"][late], 0.95))
    if not np.array_equal(late, arrest):  # in a run of 1 s both are the same
        found["walls"] = 1e-3 * float(values["walls"][late].mean())
    if arrest.any() and series.time[-1] >= ARREST_S[1] - 1e-9:
        found["walls_arrest"] = 1e-3 * float(values["walls"][arrest].mean())
    return found


PANELS = 3
# Between words above a panel, as a share of its width.
APART = 0.06


def whole_runs_section(found: WholeRuns) -> Section:
    """Put whole runs into words, a picture and a table."""
    words, scene = Words(__name__), found.scene
    values = {
        "reference": found.points[0].setting.title if found.points else NONE,
        "crowds": found.crowds,
        "duration": scene.run.duration_s,
        "varied": how_varied(scene, found.crowds),
        "driven": scene.drive is not None,
        "heads": heads_of(found),
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


def heads_of(found: WholeRuns) -> list[str]:
    """Name the columns of statistics, with their units."""
    return [f"{one.title} ({one.unit})" for one in found.quantities.values()]


def whole_runs_rows(found: WholeRuns) -> list[list[str]]:
    """List a row per setting: crowds, CPU seconds, and each statistic with its error."""
    rows: dict[RunSetting, list[str]] = {}
    for one in found.points:
        costs = (significant(cost, 2) for cost in (one.cpu_seconds, one.with_impulses_s))
        row = rows.setdefault(one.setting, [one.setting.title, str(one.crowds), *costs])
        row.append(_cell(one, min(one.crowds, found.points[0].crowds)))
    return list(rows.values())


def _cell(one: WholeRunPoint, shared: int) -> str:
    """The mean of a reference; of others by how much they are above it, with 90 %."""
    if one.reference:
        if one.standard_error is None:
            return in_each(number(one.mean), one.crowds, "replicates")
        return f"{significant(one.mean)} ± {significant(one.standard_error, 2)}"
    if one.bias is None:
        return NONE
    if one.bias_low is None or one.bias_high is None:
        return in_each(signed(one.bias), shared, "replicates")
    return f"{signed(one.bias)} ({signed(one.bias_low)} to {signed(one.bias_high)})"


def whole_runs_picture(found: WholeRuns) -> Figure:
    """Draw the error of each statistic against CPU time, all engines on one picture."""
    lines = -(-len(found.quantities) // PANELS)
    figure, every = panels(13.0, 1.0 + 4.0 * lines, lines, PANELS)
    for axes, (name, measure) in zip(every, found.quantities.items(), strict=False):
        _draw(axes, found.of(name))
        axes.set_title(measure.title, pad=52)
        label(axes, "CPU time of a run (s)", "above the reference (%)")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    for axes in every[len(found.quantities) :]:
        axes.axis("off")
    handles, labels = every[0].get_legend_handles_labels()
    legend = dict(zip(labels, handles, strict=True))
    figure.legend(legend.values(), legend, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw(axes: Axes, points: Sequence[WholeRunPoint]) -> None:
    """One panel: an engine has a colour and a marker, which is hollow where it is coarse."""
    engines = list(dict.fromkeys(one.method for one in points))
    styles = {name: (COLOURS[n % len(COLOURS)], MARKERS[n]) for n, name in enumerate(engines)}
    for one in points:
        (colour, marker), coarse = styles[one.method], one.setting.is_coarse
        ends = [one.bias, one.bias_low, one.bias_high]
        fraction, low, high = (np.nan if end is None else 100 * end for end in ends)
        reach = np.nan_to_num([[fraction - low], [high - fraction]])  # no bar where nothing is known
        axes.errorbar(
            [_seconds(one)], [fraction], yerr=reach, fmt=marker, color=colour, capsize=3,
            mfc="white" if coarse else colour, label="_" if coarse else engine_name(one.method),
        )  # fmt: skip
    axes.axhline(0.0, color=GRID, zorder=0)
    axes.set_xscale("log")
    axes.margins(x=0.1, y=0.12)
    named = sorted((one for one in points if not one.setting.is_coarse), key=_seconds)
    _name(axes, named, [styles[one.method][0] for one in named])


def _seconds(one: WholeRunPoint) -> float:
    return np.nan if one.cpu_seconds is None else one.cpu_seconds


def _name(axes: Axes, named: Sequence[WholeRunPoint], colours: Sequence[str]) -> None:
    """Write the settings above a panel, side by side in the order of their cost, each with a line
    to its point: points lie too near to each other for words."""
    left, right = np.log(axes.get_xlim())
    at = (np.log([_seconds(one) for one in named]) - left) / (right - left)
    turned: dict[str, Any] = {"rotation": 90, "ha": "center", "va": "bottom", "fontsize": 8}
    for one, fraction, colour in zip(named, spread(at, APART), colours, strict=True):
        point = (_seconds(one), np.nan if one.bias is None else 100 * one.bias)
        lead(axes, one.setting.short, point, (fraction, 1.03), colour, **turned)
