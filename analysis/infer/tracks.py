"""What is seen of a crowd before a door: tracks, and the seven numbers that are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from nscd.arrays import Flags, Floats
from nscd.segments import dots, lengths, nearest_on_segment

# s: between instants; over which speeds and accelerations are; and of the window (Hann) that takes the
# sway of heads out, of which so much has to be there.
STEP_S, OVER_S, SMOOTH_S, SEEN = 0.1, 0.4, 2.0, 0.7
# m before the door: where people are counted, and where their motion and distances are measured.
ZONE_M, QUEUE_M = (0.5, 1.5), (0.5, 2.5)
# m: neighbours are nearer; and who is lost so near to the door has left.
NEAR_M, LOST_M = 0.6, 0.5
# Distances are measured in no more instants than these.
INSTANTS = 150
FEWEST = 5  # departures that give a flow
# Each with its unit.
STATISTICS = {
    "flow": "1/s", "density": "1/m²", "speed": "m/s", "nearest_5": "m", "nearest_50": "m",
    "correlation": "–", "acceleration": "m/s²",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gate:
    """Describe the door of a room and the floor before it.

    start, end: (2,) m, of the door; outward: (2,), the unit vector out of the room
    floor: all of the room
    zone: m before the door, where people are counted
    strip: whether the zone is all of the room at these distances from the door's line, not from the
        door itself"""

    start: Floats
    end: Floats
    outward: Floats
    floor: shapely.Geometry
    zone: tuple[float, float] = ZONE_M
    strip: bool = False

    def ahead(self, position: Floats) -> Floats:
        """Give how far (…) m positions (…,2) m are before the line of the door; below 0 behind it."""
        return np.asarray(dots(self.start - position, self.outward))

    def away(self, position: Floats) -> Floats:
        """Give how far (…) m positions (…,2) m are from the zone's door."""
        if self.strip:
            return self.ahead(position)
        flat = position.reshape(-1, 2)
        ends = (np.broadcast_to(end, flat.shape) for end in (self.start, self.end))
        found = lengths(flat - nearest_on_segment(flat, *ends)).reshape(position.shape[:-1])
        return np.where(self.ahead(position) > 0, found, -found)

    @property
    def area(self) -> float:
        """The area (m²) of the zone."""
        low, high = self.zone
        door = shapely.LineString([self.start, self.end])
        if not self.strip:
            ring = door.buffer(high, quad_segs=64).difference(door.buffer(low, quad_segs=64))
            return float(self.floor.intersection(ring).area)
        along, far = np.array([-self.outward[1], self.outward[0]]), 1e4
        corners = [(low, -far), (low, far), (high, far), (high, -far)]
        box = shapely.Polygon([self.start - d * self.outward + s * along for d, s in corners])
        return float(self.floor.intersection(box).area)


def departures(gate: Gate, position: Floats) -> Floats:
    """Tell in which instant each of n people left: (n,), inf for never.

    position: (f,n,2) m, NaN where somebody is not seen. Who is lost near the door left there."""
    seen = np.isfinite(position[..., 0])
    behind = seen & (gate.ahead(position) <= 0)
    number = np.where(behind.any(0), behind.argmax(0), np.inf)
    last = len(seen) - 1 - seen[::-1].argmax(0)
    where = np.take_along_axis(position, last[None, :, None], axis=0)[0]
    lost = np.isinf(number) & seen.any(0) & (last < len(seen) - 1)
    lost &= np.abs(gate.away(where)) <= LOST_M
    return np.where(lost, last, number)


def span_of(left: Floats) -> tuple[int, int]:
    """Give the numbers of the departures between which a crowd is measured: 10 % and 90 % of those
    that are seen. Raises ValueError for fewer than five."""
    count = int(np.isfinite(left).sum())
    if count < FEWEST:
        raise ValueError(f"{count} people leave by the door. At least {FEWEST} are needed")
    return int(0.1 * count), min(count - 1, int(0.9 * count))


def smooth(position: Floats) -> Floats:
    """Smooth tracks (f,n,2) m over SMOOTH_S; NaN where too little of the window is there."""
    half = round(0.5 * SMOOTH_S / STEP_S)
    window = 0.5 + 0.5 * np.cos(np.pi * np.arange(-half, half + 1) / (half + 1))
    pad = np.full((half, *position.shape[1:]), np.nan)
    whole = np.concatenate([pad, position, pad])
    good = np.isfinite(whole)
    filled = np.where(good, whole, 0.0)
    total, weight = np.zeros_like(position), np.zeros_like(position)
    for k, one in enumerate(window):
        total += one * filled[k : k + len(position)]
        weight += one * good[k : k + len(position)]
    enough = (weight >= SEEN * window.sum()) & np.isfinite(position)
    return np.where(enough, total / np.maximum(weight, 1e-9), np.nan)


def measure(gate: Gate, position: Floats, span: tuple[int, int]) -> dict[str, float]:
    """Measure the STATISTICS of tracks from the first to the last departure of a span.

    position: (f,n,2) m, every STEP_S, NaN where somebody is not seen
    span: see `span_of`; where the last one never comes, to the end of the tracks

    flow: departures per second; density: people per m² of the zone
    speed, acceleration: mean speed, and root mean square of the acceleration, over 0.4 s
    nearest_5, nearest_50: 5 % and 50 % of the distances to the nearest head
    correlation: of the velocities of neighbours less the mean velocity

    All but the first two are those of smoothed tracks from 0.5 to 2.5 m before the door; of a strip
    those of tracks as they are, in the zone."""
    left = np.sort(departures(gate, position))
    done = left[np.isfinite(left)]
    begin = int(done[span[0]]) if len(done) > span[0] else 0
    end = int(done[span[1]]) if len(done) > span[1] else len(position) - 1
    counted = min(len(done) - 1, span[1]) - span[0]
    rows = slice(begin, max(end, begin + 1) + 1)
    away = gate.away(position)
    here = (away >= gate.zone[0]) & (away <= gate.zone[1])
    values = {
        "flow": max(counted, 0.5) / (STEP_S * max(end - begin, 1)),
        "density": float(here[rows].sum(1).mean()) / gate.area,
    }
    queue = here if gate.strip else (away >= QUEUE_M[0]) & (away <= QUEUE_M[1])
    tracks = position if gate.strip else smooth(position)
    values |= _moving(tracks, queue, rows)
    values["nearest_5"], values["nearest_50"] = _nearest(tracks, queue, away > 0, rows)
    return {name: values[name] for name in STATISTICS}


def _moving(tracks: Floats, queue: Flags, rows: slice) -> dict[str, float]:
    """Speed, acceleration and the correlation of neighbours in the queue."""
    half = round(0.5 * OVER_S / STEP_S)
    pad = np.full((2 * half, *tracks.shape[1:]), np.nan)
    whole = np.concatenate([pad, tracks, pad])
    before, after = whole[half : -3 * half], whole[3 * half : len(whole) - half]
    velocity = ((after - before) / OVER_S)[rows]
    first, last = whole[: -4 * half], whole[4 * half :]
    change = ((first - 2 * tracks + last) / (2 * half * STEP_S) ** 2)[rows]
    moves = queue[rows] & np.isfinite(velocity[..., 0])
    if not moves.any():
        return {"speed": np.nan, "acceleration": np.nan, "correlation": np.nan}
    mean = velocity[moves].mean(0)
    bends = queue[rows] & np.isfinite(change[..., 0])
    together, pairs = 0.0, 0
    for k in _instants(len(velocity)):
        who = np.flatnonzero(moves[k])
        if len(who) < 2:
            continue
        near = cKDTree(tracks[rows][k, who]).query_pairs(NEAR_M, output_type="ndarray")
        shifted = velocity[k, who] - mean
        together += float((shifted[near[:, 0]] * shifted[near[:, 1]]).sum())
        pairs += len(near)
    scatter = float(((velocity[moves] - mean) ** 2).sum(1).mean())
    return {
        "speed": float(lengths(velocity[moves]).mean()),
        "acceleration": float(np.sqrt((change[bends] ** 2).sum(1).mean())) if bends.any() else np.nan,
        "correlation": together / (pairs * scatter) if pairs and scatter else 0.0,
    }


def _nearest(tracks: Floats, queue: Flags, inside: Flags, rows: slice) -> Sequence[float]:
    found = []
    there = inside & np.isfinite(tracks[..., 0])
    for k in np.arange(len(tracks))[rows][_instants(len(tracks[rows]))]:
        heads = tracks[k, there[k]]
        if len(heads) > 1:
            apart = cKDTree(heads).query(heads, k=2)[0][:, 1]
            found.append(apart[queue[k, there[k]]])
    every = np.concatenate(found) if found else np.zeros(0)
    return [float(q) for q in np.quantile(every, (0.05, 0.5))] if len(every) else [np.nan, np.nan]


def _instants(count: int) -> Sequence[int]:
    """Some instants of so many, evenly chosen."""
    return range(0, count, max(1, count // INSTANTS))
