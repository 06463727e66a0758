"""What was seen of a crowd: tracks of a film or trajectory, or the numbers of a table."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from analysis.scene.real.trajectory import Recording, TrajectoryError
from analysis.scene.scene import Room, read_room
from analysis.studies.infer.crowd import OF_NEAREST, PRIOR, Site, gate_of
from analysis.studies.infer.tracks import FEWEST, STEP_S, Gate, departures, measure, span_of
from analysis.support import reading
from analysis.support.reading import UnreadableError
from nscd.arrays import Floats
from nscd.segments import lengths

# Columns of a table of crowds, what they are called here, and what no crowd has more of: people per s
# and metre of door, per m², m/s.
FLOW = "flow_per_s"
COLUMNS = {FLOW: ("flow", 8.0), "density_per_m2": ("density", 15.0), "speed_m_per_s": ("speed", 3.0)}
PEOPLE, ZONE, MOST_PEOPLE = ("people", "n"), ("zone_start_m", "zone_end_m"), 2000
# s: frames may be so far apart; the share of people who may come late; and m that a crowd may walk back.
LONGEST_S, LATE, AWAY_M = 0.5, 0.2, 0.5
# Velocities at the start are means over so many steps before and after it.
SETS_OFF = 10


# s: of frames that are farther apart these say nothing.
SHAKEN_S, SHAKEN = 0.2, ("sway", "shaking", "speed_99", "acceleration")


class Observations(NamedTuple):
    """Hold where a crowd was, its statistics, what is to be said of it, and windows of it: from, to (s) and
    the statistics of each, in the order of the site's parts."""

    site: Site
    statistics: dict[str, float]
    notes: list[str]
    windows: Sequence[tuple[float, float, dict[str, float]]] = ()


def seen_in_tracks(recording: Recording, room: Room, path: str, window_s: float | None = None) -> Observations:
    """Measure a film or trajectory in a room (path: its file, for messages), from the last instant on in
    which the most people are before the door.

    window_s: of the windows that are measured too, as far as five people leave in them

    Raises TrajectoryError or SceneError for fewer than five departures, frames more than 0.5 s
    apart, and people of whom more than a fifth come later."""
    file, step = recording.file, recording.step_s
    if not step <= LONGEST_S:
        raise TrajectoryError(f"{file}: frames are {step:.3g} s apart. At most {LONGEST_S:g} s is needed")
    position = _sampled(recording)
    there = np.isfinite(position[..., 0])
    gate = gate_of(room, path, position[there])
    before = there & (gate.ahead(position) > 0)
    before &= shapely.contains_xy(gate.floor, np.where(there, position[..., 0], 1e9), position[..., 1])
    _check_way(file, path, gate, position)
    position, before = position[:, before.any(0)], before[:, before.any(0)]
    if not before.any():
        raise TrajectoryError(f"{file}: nobody is before the door of {path}. Is the unit right (m, cm)? Is an axis turned?")
    count = before.sum(1)
    first = len(count) - 1 - int(count[::-1].argmax())
    late = int((~before[: first + 1].any(0)).sum())
    if late > LATE * len(before[0]):
        raise TrajectoryError(f"{file}: {late} of {len(before[0])} people come when most are there. Give less of it")
    notes = [f"people who come later and are not simulated: {late}"] * (late > 0)
    if earlier := int((~before[first:].any(0)).sum()):
        notes.append(f"people who are gone before most are there, not compared: {earlier}")
    start, still = position[first, before[first]], before[first:].any(0)
    steps = np.diff(position[max(first - SETS_OFF, 0) : first + SETS_OFF + 1, before[first]], axis=0)
    velocity = np.nansum(steps, axis=0) / (STEP_S * np.maximum(np.isfinite(steps).sum(0), 1))
    position = position[first:, still]
    left = departures(gate, position)
    if (gone := int(np.isfinite(left).sum())) < FEWEST:
        raise TrajectoryError(f"{file}: {gone} people leave by the door. At least {FEWEST} are needed")
    if stay := position.shape[1] - gone:
        notes.append(f"people who do not leave while they are seen: {stay}. All simulated people leave")
    # not more departures than there are simulated people
    gone = min(gone, len(start))
    each, span, windows, parts = np.sort(left)[:gone], span_of(gone), [], []
    statistics = measure(gate, position, span)
    for begin in np.arange(0.0, STEP_S * each[-1], window_s) if window_s else ():
        low, high = np.searchsorted(each, np.array([begin, begin + window_s]) / STEP_S).tolist()
        if (high := min(high, span[1])) - low >= FEWEST - 1:
            parts.append((low, high))
            windows.append((begin, begin + window_s, measure(gate, position, parts[-1])))
    if step > SHAKEN_S:
        for one in (statistics, *(one for *_, one in windows)):
            one |= dict.fromkeys(SHAKEN, np.nan)
        notes.append(f"frames are {step:.2g} s apart: {', '.join(SHAKEN)} are not compared")
    near = np.nan_to_num(statistics["nearest_5"], nan=1.0)
    site = Site(
        room=room, gate=gate, people=len(start), span=span, start=start, velocity=velocity,
        duration_s=STEP_S * float(each[span[1]]), parts=tuple(parts),
        largest_m=float(np.clip(OF_NEAREST * near, 1.2 * PRIOR["radius_m"][0], PRIOR["radius_m"][1])),
    )  # fmt: skip
    return Observations(site, statistics, notes, windows)


def _check_way(file: Path, path: str, gate: Gate, position: Floats) -> None:
    """Raise TrajectoryError where half of the people or more end farther from the door than they begin."""
    away, observed = gate.away(position), np.isfinite(position[..., 0])
    ends = (np.take_along_axis(away, at[None], 0)[0] for at in (observed.argmax(0), len(observed) - 1 - observed[::-1].argmax(0)))
    if (way := float(np.median(np.subtract(*ends)[observed.any(0)]))) < -AWAY_M:
        raise TrajectoryError(
            f"{file}: people walk away from the door of {path}, {-way:.2g} m in the median. Is an axis mirrored or turned?"
        )


def _sampled(recording: Recording) -> Floats:
    """The tracks (f,n,2) m every STEP_S, NaN where somebody is not seen."""
    rows = recording.data.sort_values(["id", "time"], kind="stable")
    begin, end = float(rows.time.min()), float(rows.time.max())
    time = begin + STEP_S * np.arange(int((end - begin) / STEP_S + 1e-6) + 1)
    tracks = []
    for _, one in rows.groupby("id"):
        when = one.time.to_numpy()
        track = np.stack([np.interp(time, when, one[axis].to_numpy()) for axis in "xy"], axis=1)
        after = np.clip(np.searchsorted(when, time - 1e-6), 0, len(when) - 1)
        gap = when[after] - when[np.maximum(after - 1, 0)]
        track[(time < when[0] - 1e-6) | (time > when[-1] + 1e-6) | (gap > LONGEST_S + 1e-6)] = np.nan
        tracks.append(track)
    return np.stack(tracks, axis=1)


def seen_in_table(file: Path, room: Room, path: str, row: str | None = None) -> Observations:
    """Read flow (1/s), density (1/m²) and speed (m/s) of a crowd from a table, in a room (path: its file).

    row: of several, by its first cell. Raises UnreadableError naming the column, for what is missing
    and for numbers that no crowd has."""
    table = csv.DictReader(reading.read_text(file).splitlines())
    names = list(table.fieldnames or ())
    found = [one for one in table if row is None or one[names[0]] == row]
    if len(found) != 1:
        raise UnreadableError(f"{file}: {len(found)} rows{f' {row!r}' if row else ''}. Name one of its rows with --row")
    used = [*COLUMNS, *ZONE, who := next((name for name in PEOPLE if name in names), PEOPLE[0])]
    reading.note_unused(file, "columns", [name for name in names[found[0][names[0]] == row :] if name not in used])
    cells: dict[str, float] = {}
    for name in used:
        cell = (found[0].get(name) or "").strip()
        if (cell or name in (FLOW, who)) and not reading.NUMBER.fullmatch(cell):
            raise UnreadableError(f"{file}: {name}: {cell[:40]!r}. A number is needed")
        cells |= {name: float(cell)} if cell else {}
    if cells[who] != round(cells[who]) or not FEWEST <= cells[who] <= MOST_PEOPLE:
        raise UnreadableError(f"{file}: {who}: {cells[who]:g}. A whole number from {FEWEST} to {MOST_PEOPLE} is needed")
    gate, people = gate_of(room, path, np.zeros((0, 2))), int(cells[who])
    low, high = (cells.get(name, usual) for name, usual in zip(ZONE, gate.zone, strict=True))
    gate = replace(gate, zone=(low, high), strip=True)
    if not (0 <= low < high and gate.area(gate.zone) > 0):
        raise UnreadableError(f"{file}: {', '.join(ZONE)}: from {low:g} to {high:g} m before the door is no floor")
    for column in COLUMNS.keys() & cells.keys():
        maximum = COLUMNS[column][1] * (float(lengths(gate.end - gate.start)) if column == FLOW else 1.0)
        if not 0 < cells[column] <= maximum:
            raise UnreadableError(f"{file}: {column}: {cells[column]:g}. No crowd has that: above 0 to {maximum:.3g} is needed")
    statistics = {name: cells[column] for column, (name, _) in COLUMNS.items() if column in cells}
    span = span_of(people)
    duration = (span[1] + 1) / statistics["flow"] + 2.0
    return Observations(Site(room=room, gate=gate, people=people, span=span, duration_s=duration), statistics, [])


def see(
    file: Path, room: Path, row: str | None = None, without: Sequence[str] = (), window_s: float | None = None,
    **of_tracks: Any,
) -> Observations:  # fmt: skip
    """Read what was seen: a table that has a column flow_per_s, else tracks; without: statistics that are not
    compared; window_s: see `seen_in_tracks`; of_tracks: see `Recording.read`.

    Raises ValueError in one line naming the file, and the line, column or person."""
    stated, _ = read_room(room, complete=False)
    if FLOW.encode() not in reading.start_of(file, reading.LONGEST_LINE).partition(b"\n")[0]:
        if row is not None:
            raise ValueError(f"--row: only of a table with a column {FLOW}")
        observed = seen_in_tracks(Recording.read(file, **of_tracks), stated, str(room), window_s)
    elif window_s is not None:
        raise ValueError(f"--window: only of a trajectory, and {file} is a table")
    elif of_tracks:
        raise ValueError(f"--{next(iter(of_tracks)).replace('_', '-')}: only of a trajectory, and {file} is a table")
    else:
        observed = seen_in_table(file, stated, str(room), row)
    for name in without:
        if name not in observed.statistics or len(observed.statistics) == 1:
            raise ValueError(f"--without: {name!r}. There are: {', '.join(observed.statistics)}")
        for one in (observed.statistics, *(one for *_, one in observed.windows)):
            del one[name]
        observed.notes.append(f"{name} is not compared")
    return observed
