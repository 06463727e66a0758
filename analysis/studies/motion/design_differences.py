"""What designs of one room are compared in: numbers of a run, from the first who leaves to the last,
differences of designs with one correction for all, and after how many replicates to look."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from math import ceil, inf, nan, sqrt
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from analysis.dumps import DumpError
from analysis.engines import EngineError
from analysis.engines.run import EngineRun, finished_run
from analysis.studies.exposure.loads import RunLoads, read_exposure, walls_beside
from analysis.studies.motion.inference import LEVEL, ROUNDING
from nscd.arrays import Floats

# The time until so many tenths of all are out is compared: as many as every run reaches.
TENTHS = range(10, 0, -1)
UNTIL = "time_until"
# How many more replicates the next look has.
GROWTH = 1.5


class Quantity(NamedTuple):
    """Name what designs are compared in.

    says: a sentence with the difference (size: with its unit) and the word for less or more of it
    value: of a run and the windows (t,) that count; NaN where the run has no such number
    paired: whether replicates of one number are subtracted from each other: where their correlation in
        three other crowds was above 0.5 (docs/results/designs.md), not in those that are judged"""

    title: str
    unit: str
    says: str
    words: tuple[str, str]
    value: Callable[[RunLoads, slice], float]
    paired: bool = False


def _mean(key: str) -> Callable[[RunLoads, slice], float]:
    return lambda run, some: float(run.values[key][some].mean()) if key in run.values else nan


def _beside(side: int) -> Callable[[RunLoads, slice], float]:
    """The mean load (kN/m) of the worst metre of the walls on one side of the door."""

    def value(run: RunLoads, some: slice) -> float:
        loads = run.loads["wall_line_load"][some][:, walls_beside(run.scene)[side] - 1]
        return float(loads.max(axis=1).mean()) if loads.shape[1] else nan

    return value


def _largest_metre(run: RunLoads, some: slice) -> float:
    return float(run.values["wall_line_load"][some].max()) if run.scene.walls else nan


def _largest_contact(run: RunLoads, some: slice) -> float:
    return float(run.values["contact_largest"][some].max())


def _flow(run: RunLoads, some: slice) -> float:
    """People per second after the first, until the last."""
    after = float(run.duration[some][1:].sum())
    left = _leaving(run)[some][1:].sum()
    return nan if "flow" not in run.values else float(left) / after if after else 0.0


LESS, SIZE = ("less", "more"), ("smaller", "larger")
# Every row of a comparison. The load on walls is read by these, and nowhere else.
QUANTITIES: Mapping[str, Quantity] = {
    "wall_left": Quantity("wall left of the door, worst metre", "kN/m",
                          "the wall left of the door bears {size} {more}", LESS, _beside(0), True),
    "wall_right": Quantity("wall right of the door, worst metre", "kN/m",
                           "the wall right of the door bears {size} {more}", LESS, _beside(1), True),
    "metre_largest": Quantity("largest load on any metre of wall", "kN/m",
                              "the most loaded metre of wall bears {size} {more}", LESS, _largest_metre),
    "contact_largest": Quantity("largest contact force", "N", "the largest contact force is {size} {more}",
                                SIZE, _largest_contact),
    "contact_mean": Quantity("mean contact force", "N", "the mean contact force is {size} {more}", SIZE,
                             _mean("contact_mean"), True),
    "flow": Quantity("people leaving", "1/s", "{number} {more} people leave per second",
                     ("fewer", "more"), _flow),
    UNTIL: Quantity("time until {out} are out", "s", "{out} are out {size} {more}",
                    ("earlier", "later"), lambda run, some: nan),
    "density_door": Quantity("density within 2 m of the door", "1/m²",
                             "the density before the door is {size} {more}", ("lower", "higher"),
                             _mean("density_door"), True),
    "speed_door": Quantity("speed within 2 m of the door", "m/s",
                           "people before the door are {size} {more}", ("slower", "faster"),
                           _mean("speed_door"), True),
}  # fmt: skip


def _leaving(run: RunLoads) -> Floats:
    """How many (t,) leave in each window; a person who steps back is no minus."""
    if "flow" not in run.values:
        return np.zeros(len(run.time))
    gone = np.maximum.accumulate(np.cumsum(run.values["flow"] * run.duration))
    return np.diff(np.rint(gone), prepend=0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Hold the numbers of one run by QUANTITIES, and when people leave: (k,) s, first to last."""

    values: Mapping[str, float]
    left: Floats
    people: int


def outcome_of(run: RunLoads) -> Outcome:
    """Take the numbers of a run over the windows from the first to the last in which somebody leaves;
    of all windows where nobody does, or where there is no door."""
    left = _leaving(run)
    some = np.flatnonzero(left)
    chosen = slice(some[0], some[-1] + 1) if len(some) else slice(None)
    values = {key: one.value(run, chosen) for key, one in QUANTITIES.items()}
    return Outcome(values=values, left=np.repeat(run.time, left.astype(int)), people=len(run.ids))


def measured(run: EngineRun) -> tuple[Outcome | None, float, str]:
    """Run, or take what is there, and read its numbers. Give the CPU time (s) of both, and why it
    failed."""
    began = time.process_time()
    try:
        record = finished_run(run.scene, run.engine, run.folder) or run.record()
        outcome = outcome_of(read_exposure(run.folder))
    except (EngineError, DumpError) as error:
        return None, 0.0, str(error)
    return outcome, record.cpu_seconds + time.process_time() - began, ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Hold by how much the mean of a design is above that of the first, in the unit of the quantity.

    error, freedom: standard error and its degrees of freedom; 0 where all replicates are alike
    half: of the interval, and the least difference that would have been seen; infinite where all
        replicates are alike, whose spread says nothing of others
    delta: Cliff's δ: how much more often a run of the design is above one of the first than below
    base: the mean of the first"""

    value: float
    error: float
    freedom: float
    half: float
    delta: float
    base: float
    paired: bool

    @property
    def ends(self) -> tuple[float, float]:
        """The interval."""
        return self.value - self.half, self.value + self.half

    @property
    def significant(self) -> bool:
        """Whether the interval excludes zero."""
        return abs(self.value) > self.half

    def half_at(self, times: float, alpha: float) -> float:
        """Foretell half of the interval of so many times the replicates, from the spread of these."""
        return _half(self.error / sqrt(times), self.freedom * times, alpha)


def _half(error: float, freedom: float, alpha: float) -> float:
    return float(student.ppf(1 - alpha / 2, freedom)) * error if error else inf


def difference(mine: Floats, base: Floats, alpha: float, *, paired: bool) -> Difference:
    """Compare numbers of the replicates (n,) of a design with those of the first, replicate by
    replicate or by Welch's t. A run is one number, however many windows it has. alpha: how often the
    interval may miss."""
    n, rounding = len(mine), ROUNDING * float(np.abs([mine, base]).max())
    parts = np.array([(mine - base).var(ddof=1)] if paired else [mine.var(ddof=1), base.var(ddof=1)])
    square = float(parts.sum()) / n
    freedom = (n - 1) * float(parts.sum() ** 2 / (parts**2).sum()) if square else 1.0
    error = sqrt(square) if square > rounding**2 else 0.0
    more = float(mine.mean() - base.mean())
    return Difference(
        value=more if abs(more) > rounding else 0.0, error=error, freedom=freedom,
        half=_half(error, freedom, alpha), delta=float(np.sign(mine[:, None] - base).mean()),
        base=float(base.mean()), paired=paired,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """Hold the numbers (n,) of the replicates of each design by QUANTITIES that all designs have.

    reached: so many are out in every run, for the time until then; 0 without"""

    values: Sequence[Mapping[str, Floats]]
    reached: int

    def differences(self, alpha: float, *, paired: bool = True) -> list[dict[str, Difference]]:
        """Compare every design after the first with it. In a share `alpha` of such comparisons any
        interval of them all misses, by Bonferroni; paired: whether replicates of a number belong
        together at all."""
        base, *others = self.values
        each = alpha / max(1, len(base) * len(others))
        return [
            {key: difference(one[key], base[key], each, paired=paired and QUANTITIES[key].paired)
             for key in base}
            for one in others
        ]  # fmt: skip


def table_of(designs: Sequence[Sequence[Outcome]]) -> Table:
    """Put the outcomes of the replicates of each design, as many of each, into columns."""
    every = [one for outcomes in designs for one in outcomes]
    out, people = min(len(one.left) for one in every), max(one.people for one in every)
    reached = next((n for tenth in TENTHS if 0 < (n := tenth * people // 10) <= out), 0)

    def number(one: Outcome, key: str) -> float:
        return float(one.left[reached - 1]) if key == UNTIL and reached else one.values[key]

    columns = [
        {key: np.array([number(one, key) for one in outcomes]) for key in QUANTITIES}
        for outcomes in designs
    ]
    has = [key for key in QUANTITIES if all(np.isfinite(one[key]).all() for one in columns)]
    return Table(values=[{key: one[key] for key in has} for one in columns], reached=reached)


def interim_levels(first: int) -> Iterator[tuple[int, float]]:
    """Give the numbers of replicates at which to look, and how often an interval of that look may
    miss: 1/2, 1/6, 1/12 … of 10 %, so that all looks together miss in 10 %."""
    size = first
    for number in count(1):
        yield size, (1 - LEVEL) / (number * (number + 1))
        size = ceil(GROWTH * size)


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Say when to stop: where an interval excludes zero, or half of it is at most a share of the first
    design's mean, or a number in a unit; unit: of the quantities asked for, all where empty."""

    fraction: float = 0.0
    number: float = 0.0
    unit: str = ""

    @classmethod
    def parse(cls, text: str) -> Target:
        """Read `decided`, `decided kN/m`, `10%` or `0.2 kN/m`. Raises ValueError for anything else."""
        units = {one.unit for one in QUANTITIES.values()}
        found = re.fullmatch(r"(decided|[\d.]+(?:e[+-]?\d+)?) *(.*)", text.strip())
        first, unit = found.groups() if found else ("", "")
        unit = unit.replace("per ", "1/").replace("m2", "m²")
        if first == "decided" and unit in {"", *units}:
            return cls(unit=unit)
        with suppress(ValueError):
            if 0 < (number := float(first)) < inf and unit in {"%", *units}:
                return cls(fraction=number / 100) if unit == "%" else cls(number=number, unit=unit)
        raise ValueError(
            f"--until {text}: decided, a share such as 10%, or a difference is needed. Its unit is "
            f"one of {', '.join(sorted(units))}"
        )

    def of(self, key: str) -> bool:
        """Whether a quantity is asked for."""
        return not self.unit or QUANTITIES[key].unit == self.unit

    def width(self, found: Difference) -> float:
        """Give the half of an interval that is narrow enough: 0 where none is."""
        return self.number or self.fraction * abs(found.base)

    def answered(self, found: Difference) -> bool:
        """Tell whether an interval excludes zero or is narrow enough."""
        return found.significant or found.half <= self.width(found)


def needed(found: Difference, target: Target, sizes: tuple[int, int, int], family: int) -> int:
    """Foretell after how many replicates a quantity is answered; 0 where more than the most are needed.

    sizes: the first look, how many replicates there are, and the most
    family: how many intervals there are"""
    first, now, maximum = sizes
    for size, alpha in interim_levels(first):
        half = found.half_at(size / now, alpha / family)
        if size > maximum or (size > now and (half < abs(found.value) or half <= target.width(found))):
            return size if size <= maximum else 0
    raise AssertionError
