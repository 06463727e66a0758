"""Sensors: what a mat on a wall, or a vest on a person, would have read of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, Strict, model_validator

from analysis.dumps.windows import RunWindows, Window
from analysis.engines.record import read_finished
from analysis.scene.scene import Scene
from analysis.studies.exposure.limits import LimitError, Number, read_entries
from analysis.support.columns import Columns
from analysis.support.files import write_rows
from nscd.arrays import Floats
from nscd.segments import nearest_on_segment

Place = Annotated[float, Strict(), Field(ge=0, le=1e9, allow_inf_nan=False)]
Angle = Annotated[float, Strict(), Field(ge=-360, le=360, allow_inf_nan=False)]


class Sensor(BaseModel):
    """A mat from one place of a wall to another, or a vest on the arc of a person, in equal parts that
    read the force which presses on each.

    from_m, to_m: m along the wall from its start; the whole wall where left out
    arc_deg: degrees from the x axis of the room, against the clock
    rate_Hz: readings a second
    cutoff_Hz: of a low pass of first order, τ = 1/(2π cutoff); without it a reading is the mean since
        the one before
    threshold_N: what is less reads 0
    height_m: of a mat, for its pressure"""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z]\w*$")]
    wall: str | None = None
    from_m: Place = 0.0
    to_m: Place | None = None
    height_m: Number | None = None
    person: Annotated[int, Strict(), Field(ge=1)] | None = None
    arc_deg: tuple[Angle, Angle] = (0.0, 360.0)
    parts: Annotated[int, Strict(), Field(ge=1, le=1000)] = 1
    rate_Hz: Number  # noqa: N815  (the unit is hertz)
    cutoff_Hz: Number | None = None  # noqa: N815
    threshold_N: Place = 0.0  # noqa: N815

    @model_validator(mode="after")
    def _of_one(self) -> Sensor:
        inputs, of_mats = self.model_fields_set, {"from_m", "to_m", "height_m"}
        if (self.wall is None) == (self.person is None):
            raise ValueError("wall, of a mat, or person, of a vest, is needed")
        if not_mine := inputs & (of_mats if self.wall is None else {"arc_deg"}):
            raise ValueError(f"{min(not_mine)}: not of a {'mat' if self.wall else 'vest'}")
        if not 0 < self.arc_deg[1] - self.arc_deg[0] <= 360:
            raise ValueError("arc_deg: from the smaller angle to the larger, at most 360 degrees")
        return self

    def placed(self, scene: Scene) -> tuple[int, float, float]:
        """Give the number of the wall or the id of the person, and where the sensor begins and ends: m
        along the wall, or degrees. Raises ValueError where the scene has no such place."""
        if self.person is not None:
            if self.person not in scene.snapshot.ids:
                raise ValueError(f"person: nobody has the id {self.person}")
            if scene.snapshot.compound is not None:
                raise ValueError("person: vests are for people of one disk each")
            return self.person, *self.arc_deg
        names = [wall.name for wall in scene.walls]
        if self.wall not in names:
            raise ValueError(f"wall: {self.wall!r}. There are: {', '.join(names) or 'none'}")
        number = names.index(self.wall)
        length = math.dist(scene.walls[number].start_m, scene.walls[number].end_m)
        end = length if self.to_m is None else self.to_m
        if not self.from_m < end <= length * (1 + 1e-9):
            raise ValueError(
                f"from_m, to_m: {self.from_m:g} to {end:g} m of a wall of {length:g} m"
            )
        return number + 1, self.from_m, end

    def length(self, scene: Scene) -> float:
        """Give the length (m) of a part, along the wall or the outline of the person."""
        who, low, high = self.placed(scene)
        if self.person is None:
            return (high - low) / self.parts
        radius = float(scene.snapshot.radius[scene.snapshot.ids == who][0])
        return math.radians(high - low) * radius / self.parts

    def impulse(self, scene: Scene, window: Window) -> Floats:
        """Sum the impulses (parts,) N·s that press on each part in a window: on a mat what is along the
        normal of its wall, on a vest the size of each contact's."""
        who, low, high = self.placed(scene)
        if self.person is None:
            wall = scene.walls[who - 1]
            mine = window.is_wall & (window.keys[:, 1] == who)
            start, end = np.array(wall.start_m), np.array(wall.end_m)
            way = (end - start) / np.hypot(*(end - start))
            first = np.searchsorted(window.now.ids, window.keys[mine, 0])
            position = (window.now.position[first] - start) @ way
            size = np.abs(window.impulse[mine] @ np.array([-way[1], way[0]]))
        else:
            mine = (window.keys[:, 0] == who) | (~window.is_wall & (window.keys[:, 1] == who))
            position = low + (_directions(scene, window, who)[mine] - low) % 360.0
            size = np.hypot(*window.impulse[mine].T)
        fraction = (position - low) / (high - low) * self.parts
        on = (fraction >= 0) & (fraction < self.parts)
        return np.asarray(np.bincount(fraction[on].astype(int), size[on], self.parts), float)


def _directions(scene: Scene, window: Window, who: int) -> Floats:
    """Where (k,) degrees the contacts of a window are from the centre of a person; of those of others
    it means nothing."""
    now, (first, second) = window.now, window.keys[:, :2].T
    other = now.position[np.searchsorted(now.ids, np.where(first == who, second, first)) % len(now)]
    centre = now.position[np.searchsorted(now.ids, who)]
    for row in np.flatnonzero(window.is_wall & (first == who)):
        wall = scene.walls[second[row] - 1]
        ends = np.array(wall.start_m), np.array(wall.end_m)
        other[row] = nearest_on_segment(centre[None], *ends)[0]
    way = scene.wall_segments().shortest(other - centre)
    return np.asarray(np.degrees(np.arctan2(way[:, 1], way[:, 0])))


def readings(impulse: Floats, end: Floats, sensor: Sensor) -> tuple[Floats, Floats]:
    """Compute the times (s) of the readings of a sensor and the forces (times, parts) N that it reads of
    impulses (t, parts) N·s in windows that end at (t,) s and follow each other from 0.

    Within a window the force is constant, F: without a low pass a reading is the mean since the one
    before; with one it is y of τ y' = F − y, exactly. A reading below the threshold is 0."""
    begin, length = np.concatenate([[0.0], end[:-1]]), np.diff(end, prepend=0.0)
    force = impulse / length[:, None]
    time = np.arange(1, int(end[-1] * sensor.rate_Hz + 1e-9) + 1) / sensor.rate_Hz
    at = np.minimum(np.searchsorted(end, time * (1 - 1e-12)), len(end) - 1)
    since = (time - begin[at])[:, None]
    if sensor.cutoff_Hz is None:
        before = np.concatenate([np.zeros_like(impulse[:1]), np.cumsum(impulse, axis=0)])
        total = before[at] + force[at] * since
        read = np.diff(total, axis=0, prepend=0.0) * sensor.rate_Hz
    else:
        tau = 1 / (2 * np.pi * sensor.cutoff_Hz)
        state = np.zeros_like(before := np.zeros_like(force))
        for n in range(1, len(force)):
            selected = np.exp(-length[n - 1] / tau)
            state[n] = force[n - 1] + (state[n - 1] - force[n - 1]) * selected
        read = force[at] + (state[at] - force[at]) * np.exp(-since / tau)
    return time, np.where(read < sensor.threshold_N, 0.0, read)


SENSORS = Columns("sensors")


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    sensors: Annotated[tuple[Sensor, ...], Field(min_length=1)]


def write_sensors(folder: Path, file: Path) -> Path:
    """Write sensors.csv into the folder of a finished run: a row per reading and part of the sensors of a
    file; return it.

    Raises LimitError naming the file, the sensor and the key, EngineError and DumpError as
    `read_exposure`. Columns: docs/columns.md."""
    sensors = read_entries(file, _File, "sensors").sensors
    scene, record = read_finished(folder)
    frames = list(RunWindows(folder, record.time_step_s).between_frames())
    end = np.array([window.end for window in frames])
    intervals = float(np.diff(end, prepend=0.0).max())
    for one in sensors:
        try:
            one.placed(scene)
        except ValueError as error:
            raise LimitError(f"{file}: sensors {one.name!r} {error}") from None
        if one.rate_Hz * intervals > 1 + 1e-9:
            raise LimitError(
                f"{file}: sensors {one.name!r} rate_Hz: {one.rate_Hz:g}. The run has a frame every "
                f"{intervals:.3g} s, which gives {1 / intervals:.4g} at most (run.frames)"
            )
    write_rows(folder / "sensors.csv", SENSORS, _rows(sensors, scene, frames, end))
    return folder / "sensors.csv"


def _rows(
    sensors: Sequence[Sensor], scene: Scene, frames: Sequence[Window], end: Floats
) -> Iterator[list[object]]:
    for one in sensors:
        impulse = np.array([one.impulse(scene, window) for window in frames])
        length, height = one.length(scene), one.height_m
        for time, forces in zip(*readings(impulse, end, one), strict=True):
            for part, force in enumerate(forces.tolist(), start=1):
                pressure = force / length / height if height else ""
                yield [float(time), one.name, part, force, force / length, pressure]
