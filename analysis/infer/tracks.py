"""What is seen of a crowd before a door: tracks, and the seven numbers that are compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from nscd.arrays import Flags, Floats
from nscd.segments import dots, lengths, nearest_on_segment

# s: between instants; over which speeds and accelerations are; and of the window (Hann) that takes the
# sway of heads out, of which such a share has to be there.
STEP_S, OVER_S, SMOOTH_S, SEEN = 0.1, 0.4, 2.0, 0.7
# m before the door: where people are counted, and where motion and distances are measured.
ZONE_M, QUEUE_M = (0.5, 1.5), (0.5, 2.5)
# m: neighbours are nearer; and who is lost so near to the door has left.
NEAR_M, LOST_M = 0.6, 0.5
# Distances are measured in about so many instants; and fewer departures give no flow.
INSTANTS, FEWEST = 150, 5
STATISTICS = {
    "flow": "1/s", "density": "1/m²", "speed": "m/s", "nearest_5": "m", "nearest_50": "m",
    "correlation": "–", "acceleration": "m/s²",
}  # fmt: skip


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

    @property
    def area(self) -> float:
        """The area (m²) of the zone."""
        (low, high), along = self.zone, 1e4 * np.array([-self.outward[1], self.outward[0]])
        door = shapely.LineString([self.start, self.end])
        zone = door.buffer(high, quad_segs=64).difference(door.buffer(low, quad_segs=64))
        if self.strip:
            near, far = (self.start - d * self.outward for d in (low, high))
            zone = shapely.Polygon([near - along, near + along, far + along, far - along])
        return float(self.floor.intersection(zone).area)


def departures(gate: Gate, position: Floats) -> Floats:
    """Tell in which instant each of n people left: (n,), inf for never; who is lost near the door left there.

    position: (f,n,2) m, NaN where somebody is not seen"""
    seen = np.isfinite(position[..., 0])
    behind = seen & (gate.ahead(position) <= 0)
    last = len(seen) - 1 - seen[::-1].argmax(0)
    where = np.take_along_axis(position, last[None, :, None], axis=0)[0]
    lost = seen.any(0) & (last < len(seen) - 1) & (np.abs(gate.away(where)) <= LOST_M)
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
        sum(one * whole[k : k + len(position)] for k, one in enumerate(window))
        for whole in (np.pad(np.where(good, position, 0.0), pad), np.pad(good.astype(float), pad))
    )
    enough = good & (weight >= SEEN * window.sum())
    return np.where(enough, total / np.maximum(weight, 1e-9), np.nan)


def measure(gate: Gate, position: Floats, span: tuple[int, int]) -> dict[str, float]:
    """Measure the STATISTICS of tracks from the first to the last departure of a span (`span_of`).

    position: (f,n,2) m, every STEP_S, NaN where somebody is not seen

    flow: departures per second; density: people per m² of the zone
    speed, acceleration: mean, and root mean square, over 0.4 s
    nearest_5, nearest_50: 5 % and 50 % of the distances to the nearest head
    correlation: of the velocities of neighbours less the mean velocity

    All but the first two are those of smoothed tracks from 0.5 to 2.5 m before the door; of a strip
    those of tracks as they are, in the zone. NaN is what nobody shows."""
    left = np.sort(departures(gate, position))
    begin, end = (int(min(left[k], len(position) - 1)) for k in span)
    counted = max(min(int(np.isfinite(left).sum()) - 1, span[1]) - span[0], 0.5)
    rows, away = slice(begin, max(end, begin + 1) + 1), gate.away(position)
    here = (away >= gate.zone[0]) & (away <= gate.zone[1])
    density = float(here[rows].sum(1).mean()) / gate.area
    queue = here if gate.strip else (away >= QUEUE_M[0]) & (away <= QUEUE_M[1])
    tracks = position if gate.strip else smooth(position)
    half = round(0.5 * OVER_S / STEP_S)
    whole = np.pad(tracks, [(2 * half, 2 * half), (0, 0), (0, 0)], constant_values=np.nan)
    velocity = (whole[3 * half : len(whole) - half] - whole[half : -3 * half]) / OVER_S
    change = (whole[: -4 * half] - 2 * tracks + whole[4 * half :]) / OVER_S**2
    speed, acceleration = (each[rows][queue[rows] & np.isfinite(each[rows][..., 0])] for each in (velocity, change))
    values = np.full(5, np.nan)
    if len(speed) and len(acceleration):
        lag = velocity[rows] - speed.mean(0)
        *values[1:3], pairs = _neighbours(tracks[rows], lag, queue[rows], away[rows] > 0)
        values[0], values[4] = lengths(speed).mean(), np.sqrt((acceleration**2).sum(1).mean())
        values[3] = pairs / max(float(((speed - speed.mean(0)) ** 2).sum(1).mean()), 1e-12)
    return dict(zip(STATISTICS, [counted / (STEP_S * max(end - begin, 1)), density, *values.tolist()], strict=True))


def _neighbours(tracks: Floats, lag: Floats, queue: Flags, inside: Flags) -> Sequence[float]:
    """5 % and 50 % of distances to the nearest, and the mean product of what velocities of neighbours lag."""
    found, product = [np.zeros(0)], [np.zeros(0)]
    for k in range(0, len(tracks), max(1, len(tracks) // INSTANTS)):
        who = np.flatnonzero(inside[k] & np.isfinite(tracks[k, :, 0]))
        if len(who) > 1:
            tree, mine = cKDTree(tracks[k, who]), queue[k, who]
            found.append(tree.query(tracks[k, who], k=2)[0][mine, 1])
            one, other = who[tree.query_pairs(NEAR_M, output_type="ndarray").T]
            dot = dots(lag[k, one], lag[k, other])
            product.append(dot[queue[k, one] & queue[k, other] & np.isfinite(dot)])
    distances, products = np.concatenate(found), np.concatenate(product)
    if not len(distances):
        return np.nan, np.nan, np.nan
    return [*np.quantile(distances, (0.05, 0.5)).tolist(), float(products.mean()) if len(products) else 0.0]
