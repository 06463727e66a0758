"""Whole runs as points: one per setting and statistic, as CSV and JSON."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from analysis.motion.precision.measured import Precision, farther
from analysis.motion.precision.settings import Setting
from analysis.scene.scene import first_problem
from analysis.support.files import write_json, write_rows
from analysis.support.machine import machine

FORMAT, NAME = 1, "whole_runs"


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeRunPoint:
    """Hold one statistic of one setting.

    scene, disks, duration_s: what was run
    method, step_s, tolerance, stiffness_N_per_m, longer: as in `Setting`
    crowds: how many
    cpu_seconds, with_impulses_s: s, of a whole run, as in `Measured`
    quantity, unit, mean, standard_error: over the crowds, in the unit
    bias, bias_low, bias_high: by what share the mean is above the reference, and the 90 % interval
    reference: whether it is what the others are measured from
    machine, date: where and when it was measured (ISO date)
    """

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
    reference: bool
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
        return Setting(
            engine=self.method,
            step_s=self.step_s,
            tolerance=self.tolerance,
            stiffness_N_per_m=self.stiffness_N_per_m,
            longer=self.longer,
        )


COLUMNS = tuple(field.name for field in dataclasses.fields(WholeRunPoint))
_READER = TypeAdapter(list[WholeRunPoint])


def points_of(found: Precision) -> Iterator[WholeRunPoint]:
    """Yield a point per setting and statistic; what is not known is None."""
    scene, today = found.scene, datetime.now(UTC).date().isoformat()
    for one in found.every:
        for name, statistic in found.statistics.items():
            setting, (mean, error) = one.setting, one.mean(name)
            bias = one.bias(found.reference, name)
            yield WholeRunPoint(
                scene=scene.name,
                disks=len(scene.snapshot),
                duration_s=scene.run.duration_s,
                method=setting.engine,
                step_s=setting.step_s,
                tolerance=setting.tolerance,
                stiffness_N_per_m=setting.stiffness_N_per_m,
                longer=setting.longer,
                crowds=len(one.crowds),
                cpu_seconds=_known(one.cpu_seconds),
                with_impulses_s=_known(one.with_impulses),
                quantity=name,
                unit=statistic.unit,
                mean=mean,
                standard_error=_known(error),
                bias=_known(bias.share),
                bias_low=_known(bias.low),
                bias_high=_known(bias.high),
                reference=one is found.reference,
                machine=machine(),
                date=today,
            )


def _known(value: float) -> float | None:
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
