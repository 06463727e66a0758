"""What was seen of a crowd: tracks of a film or trajectory, or the three numbers of a table."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from analysis.infer.crowd import Site, gate_of
from analysis.infer.tracks import FEWEST, STEP_S, departures, measure, span_of
from analysis.scene.real.trajectory import Recording, TrajectoryError
from analysis.scene.scene import Room, read_room
from analysis.support import reading
from analysis.support.reading import UnreadableError
from nscd.arrays import Floats
from nscd.segments import lengths

# Columns of a table of crowds, and what they are called here.
FLOW, PEOPLE = "flow_per_s", ("people", "n")
COLUMNS = {FLOW: "flow", "density_per_m2": "density", "speed_m_per_s": "speed"}
ZONE = ("zone_start_m", "zone_end_m")
# More people per metre of door and second, people per m², and m/s, has no crowd.
MOST = {"flow": 8.0, "density": 15.0, "speed": 3.0}
# s: frames may be so far apart; and the share of people who may come late.
LONGEST_S, LATE = 0.5, 0.2


class Seen(NamedTuple):
    """Hold where a crowd was, its statistics, and what is to be said of it."""

    site: Site
    statistics: dict[str, float]
    notes: list[str]


def seen_in_tracks(recording: Recording, room: Room, path: str) -> Seen:
    """Measure a film or trajectory in a room (path: its file, for messages), from the last instant on in
    which the most people are before the door.

    Raises TrajectoryError or SceneError for fewer than five departures, frames more than 0.5 s
    apart, and people of whom more than a fifth come later."""
    file, step = recording.file, recording.step_s
    if not step <= LONGEST_S:
        raise TrajectoryError(f"{file}: frames are {step:.3g} s apart. At most {LONGEST_S:g} s is needed")
    position = _sampled(recording)
    there = np.isfinite(position[..., 0])
    if not there.any():
        raise TrajectoryError(f"{file}: nobody is seen")
    gate = gate_of(room, path, position[there])
    flat = shapely.contains_xy(gate.floor, np.where(there, position[..., 0], 1e9), position[..., 1])
    waiting = flat & there & (gate.ahead(position) > 0)
    position, waiting = position[:, waiting.any(0)], waiting[:, waiting.any(0)]
    count = waiting.sum(1)
    if not count.any():
        raise TrajectoryError(f"{file}: nobody is before the door of {path}. Is the unit right (m, cm)?")
    first = len(count) - 1 - int(count[::-1].argmax())
    late = int((~waiting[: first + 1].any(0)).sum())
    position, notes = position[first:], []
    if late > LATE * position.shape[1]:
        raise TrajectoryError(
            f"{file}: {late} of {position.shape[1]} people come after most are there. Give a part of it "
            "in which a crowd leaves"
        )
    if late:
        notes = [f"{late} people come later and are not simulated"]
    try:
        left = departures(gate, position)
        span = span_of(left)
    except ValueError as error:
        raise TrajectoryError(f"{file}: {error}") from None
    start = position[0, waiting[first]]
    site = Site(
        room=room, gate=gate, people=len(start), span=span, start=start,
        duration_s=STEP_S * float(np.sort(left)[span[1]]),
    )  # fmt: skip
    return Seen(site, measure(gate, position, span), notes)


def _sampled(recording: Recording) -> Floats:
    """The tracks (f,n,2) m every STEP_S, NaN where somebody is not seen."""
    rows = recording.data.sort_values(["id", "time"], kind="stable")
    begin, end = float(rows.time.min()), float(rows.time.max())
    time = begin + STEP_S * np.arange(int((end - begin) / STEP_S + 1e-6) + 1)
    tracks = []
    for _, one in rows.groupby("id"):
        when = one.time.to_numpy()
        after = np.clip(np.searchsorted(when, time - 1e-6), 1, len(when) - 1) if len(when) > 1 else 0
        track = np.stack([np.interp(time, when, one[axis].to_numpy()) for axis in "xy"], axis=1)
        gone = (time < when[0] - 1e-6) | (time > when[-1] + 1e-6)
        if len(when) > 1:
            gone |= when[after] - when[after - 1] > LONGEST_S + 1e-6
        track[gone] = np.nan
        tracks.append(track)
    return np.stack(tracks, axis=1)


def seen_in_table(file: Path, room: Room, path: str, row: str | None = None) -> Seen:
    """Read flow (1/s), density (1/m²) and speed (m/s) of a crowd from a table, in a room (path: its file).

    row: of several, by its first cell. Raises UnreadableError naming the column, for what is missing
    and for numbers that no crowd has."""
    rows = csv.DictReader(reading.read_text(file).splitlines())
    names = list(rows.fieldnames or ())
    found = [one for one in rows if row is None or one[names[0]] == row]
    if len(found) != 1:
        which = f"{len(found)} rows" if row is None else f"{len(found)} rows of {names[0]} {row!r}"
        raise UnreadableError(f"{file}: {which}. Name one with --row")
    used = [*COLUMNS, *ZONE, next((name for name in PEOPLE if name in names), PEOPLE[0])]
    reading.note_unused(file, "columns", [name for name in names[1:] if name not in used])
    cells = {name: _number(file, name, found[0][name]) for name in used if found[0].get(name)}
    for name in (FLOW, used[-1]):
        if name not in cells:
            raise UnreadableError(f"{file}: {name}: a number is needed")
    people = cells[used[-1]]
    if people != round(people) or not FEWEST <= people <= 5000:
        raise UnreadableError(f"{file}: {used[-1]}: {people:g}. A whole number from 5 to 5000 is needed")
    gate = gate_of(room, path, np.zeros((0, 2)))
    low, high = (cells.get(name, usual) for name, usual in zip(ZONE, gate.zone, strict=True))
    if not 0 <= low < high:
        raise UnreadableError(f"{file}: {ZONE[0]}: {low:g} m is not below {ZONE[1]}, {high:g} m")
    gate = replace(gate, zone=(low, high), strip=True)
    if not gate.area > 0:
        raise UnreadableError(f"{file}: {ZONE[0]}: no floor is so far before the door")
    statistics = {COLUMNS[name]: value for name, value in cells.items() if name in COLUMNS}
    width = float(lengths(gate.end - gate.start))
    for column, name in COLUMNS.items():
        value, most = statistics.get(name, 0.5 * MOST[name]), MOST[name]
        most *= width if name == "flow" else 1.0
        if not 0 < value <= most:
            raise UnreadableError(
                f"{file}: {column}: {value:g}. No crowd has more than {most:.3g}, or 0 and less"
            )
    count = int(people)
    span = int(0.1 * count), min(count - 1, int(0.9 * count))
    duration = (span[1] + 1) / statistics["flow"] + 2.0
    return Seen(Site(room=room, gate=gate, people=count, span=span, duration_s=duration), statistics, [])


def _number(file: Path, name: str, cell: str) -> float:
    if not reading.NUMBER.fullmatch(cell.strip()):
        raise UnreadableError(f"{file}: {name}: {cell[:40]!r} is no number")
    return float(cell)


def see(file: Path, room: Path, row: str | None = None, **of_file: object) -> Seen:
    """Read what was seen: a table that has a column flow_per_s, or else tracks; of_file: see
    `Recording.read`.

    Raises ValueError in one line naming the file, and the line, column or person."""
    stated, _ = read_room(room, whole=False)
    head = reading.start_of(file, reading.LONGEST_LINE).partition(b"\n")[0]
    if FLOW.encode() in head:
        if given := [name for name, value in of_file.items() if value not in (None, False, "s")]:
            raise ValueError(f"--{given[0].replace('_', '-')}: only of a trajectory")
        return seen_in_table(file, stated, str(room), row)
    if row is not None:
        raise ValueError("--row: only of a table with a column flow_per_s")
    return seen_in_tracks(Recording.read(file, **of_file), stated, str(room))  # type: ignore[arg-type]
