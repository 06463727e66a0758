"""What is seen of a crowd before a door: tracks, and the numbers that are compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from nscd.arrays import Floats, Mask
from nscd.segments import dots, lengths, nearest_on_segment

# s: between instants; over which speeds and accelerations are; and of the window (Hann) that takes the
# sway of heads out, of which such a share has to be there.
STEP_S, OVER_S, SMOOTH_S, SEEN = 0.1, 0.4, 2.0, 0.7
# m before the door: where people are counted, where motion is measured, the door itself, where a queue
# is loose and how far distances are measured; and behind it, where people walk on.
ZONE_M, QUEUE_M, DOOR_M, FAR_M, CLOSE_M, OUT_M = (0.5, 1.5), (0.5, 2.5), 0.7, (1.5, 2.5), 1.5, (0.5, 1.5)
# s: over which people pass the door, after which velocities are compared, and in which a crowd sets off.
PASS_S, LATER_S, EARLY_S = 0.8, 1.0, 1.0
# m: neighbours are nearer; and who is lost so near to the door has left.
NEAR_M, LOST_M = 0.6, 0.5
# Of distances to others at the door, and of those to walls, this quantile tells how wide people are.
AT_DOOR, AT_WALL = 0.02, 0.05
# Distances are measured in about so many instants; and fewer departures give no flow.
INSTANTS, FEWEST = 150, 5
STATISTICS = {
    "flow": "1/s", "density": "1/m²", "speed": "m/s", "nearest_5": "m", "nearest_50": "m",
    "correlation": "–", "acceleration": "m/s²", "density_door": "1/m²", "density_far": "1/m²", "speed_far": "m/s",
    "speed_99": "m/s", "third_50": "m", "persistence": "–", "sway": "m", "shaking": "m/s²",
    "door_speed": "m/s", "door_spread": "m/s", "door_gain": "m/s²", "out_speed": "m/s",
    "nearest_door": "m", "wall_5": "m", "early": "m/s",
}
SIGNED = ("correlation", "persistence", "door_gain", "early")  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gate:
    """Describe the door of a room and the floor before it.

    start, end: (2,) m, of the door; outward: (2,), the unit vector out of the room; floor: of the room
    zone: m before the door, where people are counted; strip: whether that is from the door's line"""

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
        """Give how far (…) m positions (…,2) m are from the door, or in a strip from its line."""
        ahead, flat = self.ahead(position), position.reshape(-1, 2)
        if self.strip:
            return ahead
        ends = (np.broadcast_to(end, flat.shape) for end in (self.start, self.end))
        found = lengths(flat - nearest_on_segment(flat, *ends)).reshape(ahead.shape)
        return np.where(ahead > 0, found, -found)

    def area(self, zone: tuple[float, float]) -> float:
        """Give the area (m²) of a zone so many m before the door."""
        (low, high), along = zone, 1e4 * np.array([-self.outward[1], self.outward[0]])
        door = shapely.LineString([self.start, self.end])
        ring = door.buffer(high, quad_segs=64).difference(door.buffer(low, quad_segs=64))
        if self.strip:
            near, far = (self.start - d * self.outward for d in (low, high))
            ring = shapely.Polygon([near - along, near + along, far + along, far - along])
        return float(self.floor.intersection(ring).area)


def departures(gate: Gate, position: Floats) -> Floats:
    """Tell in which instant each of n people left: (n,), inf for never; who is lost near the door left there.

    position: (f,n,2) m, NaN where somebody is not seen"""
    observed = np.isfinite(position[..., 0])
    behind = observed & (gate.ahead(position) <= 0)
    last = len(observed) - 1 - observed[::-1].argmax(0)
    where = np.take_along_axis(position, last[None, :, None], axis=0)[0]
    lost = observed.any(0) & (last < len(observed) - 1) & (np.abs(gate.away(where)) <= LOST_M)
    return np.where(behind.any(0), behind.argmax(0), np.where(lost, last, np.inf))


def span_of(count: int) -> tuple[int, int]:
    """Give the numbers of the departures between which a crowd is measured: from 10 % to 90 % of so many."""
    return int(0.1 * count), int(0.9 * count)


def smooth(position: Floats) -> Floats:
    """Smooth tracks (f,n,2) m over SMOOTH_S; NaN where too little of the window is there."""
    half, good = round(0.5 * SMOOTH_S / STEP_S), np.isfinite(position)
    window = 0.5 + 0.5 * np.cos(np.pi * np.arange(-half, half + 1) / (half + 1))
    pad = [(half, half), (0, 0), (0, 0)]
    total, weight = (
        sum(one * full[k : k + len(position)] for k, one in enumerate(window))
        for full in (np.pad(np.where(good, position, 0.0), pad), np.pad(good.astype(float), pad))
    )
    enough = good & (weight >= SEEN * window.sum())
    return np.where(enough, total / np.maximum(weight, 1e-9), np.nan)


def measure(gate: Gate, position: Floats, span: tuple[int, int]) -> dict[str, float]:
    """Measure the STATISTICS of tracks from the first to the last departure of a span (`span_of`).

    position: (f,n,2) m, every STEP_S, NaN where somebody is not seen

    flow: departures per second; density, _door, _far: people per m² 0.5–1.5, 0–0.7 and 1.5–2.5 m before it
    speed, _far, acceleration: means, and root mean square, over 0.4 s; speed_99: 99 % of speeds anywhere
    nearest_5, _50, third_50: quantiles of the distances to the nearest and third head within 1.5 m
    correlation, persistence: of velocities less their mean: of neighbours, and of a person after 1 s
    sway, shaking: root mean squares of what smoothing takes away, and of accelerations as they are
    door_speed, _spread, _gain: mean and scatter of speeds through the door, and how fast they grow
    out_speed: mean, 0.5–1.5 m behind the door; early: mean speed towards the door in the first second of tracks
    nearest_door: 2 % of the distances to the nearest head within 0.5 m of the door; wall_5: 5 % of those to a wall

    Speeds are those of smoothed tracks from 0.5 to 2.5 m before the door, but at the door and behind it;
    of a strip those of tracks as they are, in the zone. NaN is what nobody shows."""
    left, found = departures(gate, position), dict.fromkeys(STATISTICS, np.nan)
    each = np.sort(left)
    begin, end = (int(min(each[k], len(position) - 1)) for k in span)
    counted = max(min(int(np.isfinite(left).sum()) - 1, span[1]) - span[0], 0.5)
    rows, away = slice(begin, max(end, begin + 1) + 1), gate.away(position)
    found["flow"] = counted / (STEP_S * max(end - begin, 1))
    zones = {"density": gate.zone} | ({} if gate.strip else {"density_door": (0.0, DOOR_M), "density_far": FAR_M})
    for name, (low, high) in zones.items():
        if area := gate.area((low, high)):
            found[name] = float(((away[rows] >= low) & (away[rows] <= high)).sum(1).mean()) / area
    low, high = gate.zone if gate.strip else QUEUE_M
    queue, tracks = (away >= low) & (away <= high), position if gate.strip else smooth(position)
    velocity, change = _changes(tracks, OVER_S)
    raw, shaking = _changes(position, OVER_S)
    mask = {"queue": queue, "far": (away >= FAR_M[0]) & queue, "in": away > 0, "out": (-away >= OUT_M[0]) & (-away <= OUT_M[1])}
    for name, what, where, how in (
        ("speed", velocity, "queue", np.mean), ("speed_far", velocity, "far", np.mean),
        ("speed_99", raw, "in", lambda values: np.quantile(values, 0.99)), ("out_speed", raw, "out", np.mean),
        ("acceleration", change, "queue", _rms), ("shaking", shaking, "queue", _rms), ("sway", position - tracks, "queue", _rms),
    ):  # fmt: skip
        values = lengths(what[rows][mask[where][rows] & np.isfinite(what[rows][..., 0])])
        found[name] = float(how(values)) if len(values) else np.nan
    found |= _door(gate, position, left, (begin, end)) | _widths(gate, position[rows], away[rows])
    way = away[0] - away[min(round(EARLY_S / STEP_S), len(away) - 1)]
    found["early"] = float(way[np.isfinite(way)].mean()) / EARLY_S if np.isfinite(way).any() else np.nan
    good = queue & np.isfinite(velocity[..., 0])
    if good[rows].any():
        lag = velocity - velocity[rows][good[rows]].mean(0)
        variance = max(float((lag[rows][good[rows]] ** 2).sum(1).mean()), 1e-12)
        *distances, pairs = _neighbours(tracks[rows], lag[rows], queue[rows], away[rows])
        found |= zip(("nearest_5", "nearest_50", "third_50"), distances, strict=True)
        found["correlation"] = pairs / variance
        later = round(LATER_S / STEP_S)
        both = good[rows][:-later] & np.isfinite(lag[rows][later:, :, 0])
        if both.any():
            found["persistence"] = float(dots(lag[rows][:-later], lag[rows][later:])[both].mean()) / variance
    return found


def _rms(values: Floats) -> float:
    return float(np.sqrt((values**2).mean()))


def _changes(tracks: Floats, over: float) -> tuple[Floats, Floats]:
    """Velocities and accelerations (f,n,2) over so many seconds."""
    half = round(0.5 * over / STEP_S)
    padded = np.pad(tracks, [(2 * half, 2 * half), (0, 0), (0, 0)], constant_values=np.nan)
    velocity = (padded[3 * half : len(padded) - half] - padded[half : -3 * half]) / over
    return velocity, (padded[: -4 * half] - 2 * tracks + padded[4 * half :]) / over**2


def _door(gate: Gate, position: Floats, left: Floats, between: tuple[int, int]) -> dict[str, float]:
    """How fast people pass the door, how that scatters, and how it grows meanwhile."""
    who = np.flatnonzero((left >= between[0]) & (left <= between[1]))
    velocity, change = _changes(position[:, who], PASS_S)
    when = left[who].astype(int), np.arange(len(who))
    speed, gain = (dots(each[when], gate.outward) for each in (velocity, change))
    speed, gain = speed[np.isfinite(speed)], gain[np.isfinite(gain)]
    found = {"door_speed": speed.mean(), "door_spread": speed.std()} if len(speed) > 1 else {}
    return {name: float(each) for name, each in (found | ({"door_gain": gain.mean()} if len(gain) else {})).items()}


def _widths(gate: Gate, position: Floats, away: Floats) -> dict[str, float]:
    """How near heads come to each other at the door, and to walls: of tracks as they are."""
    walls = gate.floor.boundary.difference(shapely.LineString([gate.start, gate.end]).buffer(1e-6))
    shapely.prepare(walls)
    location, far = (each[:: max(1, len(position) // INSTANTS)] for each in (position, away))
    near = [np.zeros(0)]
    for positions, ahead in zip(location, far, strict=True):
        who = np.flatnonzero(ahead > -LOST_M)
        if len(who) > 1:
            near.append(cKDTree(positions[who]).query(positions[who], k=2)[0][ahead[who] <= LOST_M, 1])
    to_walls = shapely.distance(walls, shapely.points(location[np.abs(far) <= QUEUE_M[1]]))
    each = {"nearest_door": (np.concatenate(near), AT_DOOR), "wall_5": (to_walls, AT_WALL)}
    return {name: float(np.quantile(values, at)) for name, (values, at) in each.items() if len(values)}


def _neighbours(tracks: Floats, lag: Floats, queue: Mask, away: Floats) -> Sequence[float]:
    """5 % and 50 % of distances to the nearest, 50 % of those to the third, and the mean product of what
    velocities of neighbours lag."""
    found, product = [np.zeros((0, 4))], [np.zeros(0)]
    for k in range(0, len(tracks), max(1, len(tracks) // INSTANTS)):
        who = np.flatnonzero((away[k] > 0) & np.isfinite(tracks[k, :, 0]))
        if len(who) > 1:
            tree = cKDTree(tracks[k, who])
            found.append(tree.query(tracks[k, who[away[k, who] <= CLOSE_M]], k=4)[0])
            one, other = who[tree.query_pairs(NEAR_M, output_type="ndarray").T]
            dot = dots(lag[k, one], lag[k, other])
            product.append(dot[queue[k, one] & queue[k, other] & np.isfinite(dot)])
    distances, products = np.concatenate(found), np.concatenate(product)
    third = distances[np.isfinite(distances[:, 3]), 3]
    if not len(third):
        return np.nan, np.nan, np.nan, np.nan
    nearest = np.quantile(distances[:, 1], (0.05, 0.5)).tolist()
    return [*nearest, float(np.median(third)), float(products.mean()) if len(products) else 0.0]
