"""The way to a door: for every cell of a floor the next corner of the shortest way that is wide enough
for a person, or the door itself."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass

import numpy as np
import shapely

from nscd import Walls, _core
from nscd.arrays import Floats, Indices, Mask
from nscd.segments import dots, lengths

# m, side of a cell where the floor has no more than MOST_CELLS of them.
CELL_M, MOST_CELLS = 0.1, 250_000
# Corners round an end of a wall, on a circle: unit vectors, as numbers since processors round sin
# and cos differently.
QUARTER = np.array(
    [[1.0, 0.0], [0.9238795325112867, 0.3826834323650898], [0.7071067811865476, 0.7071067811865476],
     [0.3826834323650898, 0.9238795325112867]]
)  # fmt: skip
LEFT = QUARTER[:, ::-1] * [-1.0, 1.0]
RING = np.concatenate([QUARTER, LEFT, -QUARTER, -LEFT])
# m of way that a person goes round for a metre that the wall is too near.
AVOIDS = 3.0
# m: walls that are nearer meet.
MEET_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Hold where people go next, wherever they are.

    origin (2,) m, cell m: of a grid
    next: (doors, rows, columns) row of `corners` to which people go from a cell to a door; 0 where
        they go straight to the door, −1 where no way leads to it
    corners: (k,2) m; the first stands for the door
    length: (doors, rows, columns) m, from the middle of a cell
    onward: (doors, k) m, from a corner; infinite without a way"""

    origin: Floats
    cell: float
    next: Indices
    corners: Floats
    length: Floats
    onward: Floats

    def numbers(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Give it as the core takes it: origin, cell, rows and columns (5,), next corners (doors,
        cells), corners, onward."""
        doors, rows, columns = self.next.shape
        grid = np.array([*self.origin, self.cell, rows, columns])
        return grid, self.next.reshape(doors, -1).astype(float), self.corners, self.onward

    def at(self, position: Floats, door: int, table: Floats | Indices) -> Floats:
        """Look up a table of the way to a door at (n,2) m; 0 beyond the grid."""
        column, row = np.floor((position - self.origin) / self.cell).T
        _, rows, columns = table.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        column, row = (np.where(inside, each, 0).astype(np.int64) for each in (column, row))
        return np.where(inside, table[door, row, column], 0.0)

    def corner(self, position: Floats, door: int) -> tuple[Mask, Floats]:
        """Tell who (n,) at (n,2) m goes to a corner first, and where it is, (n,2) m."""
        found = np.maximum(self.at(position, door, self.next), 0).astype(np.int64)
        return found > 0, self.corners[found]

    def to_json(self, walls: Walls) -> str:
        """Write out the walls that it is of, the grid, and its next corners as lists of number of
        cells and corner, by row."""
        content = {
            "walls_m": np.concatenate([walls.start, walls.end], axis=1).tolist(),
            "origin_m": self.origin.tolist(),
            "cell_m": self.cell,
            "rows_columns": self.next.shape[1:],
            "corners_m": self.corners.tolist(),
        }
        lines = [f'"{key}": {json.dumps(value)}' for key, value in content.items()]
        doors = ",\n".join(json.dumps(_runs(np.maximum(one, 0).ravel())) for one in self.next)
        return "{\n" + ",\n".join(lines) + f',\n"next": [\n{doors}\n]' + "\n}\n"


def _runs(values: Indices) -> list[int]:
    """How often and what, one after the other."""
    ends = np.flatnonzero(np.diff(values, append=-1)) + 1
    runs: list[int] = (
        np.stack([np.diff(ends, prepend=0), values[ends - 1]], axis=1).ravel().tolist()
    )
    return runs


def way_of(walls: Walls, doors: Floats, radius: float, clearance: float) -> Way:
    """Find the ways to doors between walls.

    doors: (d,3,2) m, both ends and the unit vector outward of each; nobody goes through another one
    radius: m, of the widest person; a gap of less than 2 radii is shut
    clearance: m, kept from the ends of walls besides, as far as there is room

    Of all ways over the corners (points at radius + clearance from ends of walls) each is the
    shortest (Dijkstra); a cell takes the corner in sight from which the whole way is shortest,
    where a metre too near to a wall counts as AVOIDS m."""
    key = walls.start.tobytes(), walls.end.tobytes(), doors.tobytes()
    return _found(*key, float(radius), float(clearance))


@functools.lru_cache(maxsize=32)
def _found(start: bytes, end: bytes, doors: bytes, radius: float, clearance: float) -> Way:
    ends = [np.frombuffer(each).reshape(-1, 2) for each in (start, end)]
    walls = Walls(start=ends[0], end=ends[1])
    exits = np.frombuffer(doors).reshape(-1, 3, 2)
    points = np.concatenate([walls.start, walls.end, exits[:, 0], exits[:, 1]])
    reach = radius + clearance
    low, high = points.min(0) - 2 * CELL_M, points.max(0) + 2 * CELL_M
    cell = max(CELL_M, float(np.sqrt(np.prod(high - low) / MOST_CELLS)))
    columns, rows = np.ceil((high - low) / cell).astype(int)
    # no middle of a cell is on a wall at a round coordinate
    low = low - 0.382 * cell
    x, y = (low[i] + cell * (0.5 + np.arange(n + 1)) for i, n in enumerate((columns, rows)))
    middles = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    corners = _corners(walls, radius, clearance)
    shut = _with_shut_gaps(walls, 2 * radius)
    searches = [_Search(shut, exits, number, radius, reach, cell) for number in range(len(exits))]
    found = [one.ways(corners, middles, len(x)) for one in searches]
    codes, lengths = (
        np.stack(each).reshape(-1, len(y), len(x)) for each in zip(*found, strict=True)
    )
    used = np.unique(codes[codes > 0])
    renumbered = np.zeros(len(corners) + 1, dtype=np.int64)
    renumbered[used] = np.arange(1, len(used) + 1)
    codes = np.where(codes > 0, renumbered[codes], codes)
    corners = np.concatenate([np.zeros((1, 2)), corners[used - 1]])
    onward = np.stack([one.length for one in searches])[:, np.concatenate([[0], used])]
    return Way(low, cell, codes, corners, lengths, onward)


def _corners(walls: Walls, radius: float, clearance: float) -> Floats:
    """Points (k,2) m round the ends of walls where no wall is nearer than the end: at a distance of
    radius + clearance, or with half or none of the clearance where there is not the room."""
    ends, along = np.concatenate([walls.start, walls.end]), np.tile(walls.end - walls.start, (2, 1))
    _, first = np.unique((ends / MEET_M).round(), axis=0, return_index=True)
    x, y = (along[first] / lengths(along[first])[:, None]).T[:, :, None]
    way = np.stack([x * RING[:, 0] - y * RING[:, 1], y * RING[:, 0] + x * RING[:, 1]], axis=-1)
    way = way.reshape(-1, 2)
    middle, found = np.repeat(ends[first], len(RING), axis=0), np.full(len(way), np.nan)
    for reach in radius + clearance * np.array([0.0, 0.5, 1.0]):
        ring = middle + reach * way
        clear = _core.clear_of(ring, ring, walls.start, walls.end, reach)
        found[clear >= reach * (1 - 1e-6)] = reach
    free: Floats = (middle + found[:, None] * way)[~np.isnan(found)]
    return free


def _with_shut_gaps(walls: Walls, width: float) -> Walls:
    """Walls, and one across each gap between two of them that is narrower than a width (m)."""
    lines = shapely.linestrings(np.stack([walls.start, walls.end], axis=1))
    one, two = np.triu_indices(len(lines), 1)
    distance = shapely.distance(lines[one], lines[two])
    narrow = (distance > MEET_M) & (distance < width * (1 - 1e-9))
    gaps = shapely.shortest_line(lines[one[narrow]], lines[two[narrow]])
    ends = shapely.get_coordinates(gaps).reshape(-1, 2, 2)
    start, end = (
        np.concatenate([old, ends[:, i]]) for i, old in enumerate((walls.start, walls.end))
    )
    return Walls(start=start, end=end)


class _Search:
    """The search for the ways to one door (the row `number` of all)."""

    def __init__(
        self, walls: Walls, doors: Floats, number: int, radius: float, reach: float, cell: float
    ) -> None:
        self.walls, self.doors, self.number = walls, doors, number
        self.radius, self.cell = radius, cell
        (first, last), self.outward = doors[number, :2], doors[number, 2]
        # a person does not fit nearer to the posts
        fraction = min(0.5, reach / float(lengths(last - first)))
        self.door = first + fraction * (last - first), last + fraction * (first - last)

    def sight(self, start: Floats, end: Floats, maximum: float, *, through: bool = False) -> Floats:
        """How far (n,) m walls are from the lines start → end (n,2) m, at most `maximum`; 0 where a
        wall or a door is between, but for the own door where people go through it."""
        clear = _core.clear_of(start, end, self.walls.start, self.walls.end, maximum)
        # several may go to one door
        others = (self.doors != self.doors[self.number]).any((1, 2))
        doors = self.doors[others] if through else self.doors
        if len(doors):
            first, last = (np.ascontiguousarray(doors[:, i]) for i in (0, 1))
            clear[_core.clear_of(start, end, first, last, 1e-12) == 0.0] = 0.0
        return clear

    def to_door(
        self, start: Floats, maximum: float, beyond: float = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """How far (n,) m the door is from (n,2) m, and walls from the line to it, 0 from `beyond`
        (m) past it; and its nearest point (n,2) m."""
        a, b = self.door
        along = b - a
        fraction = np.clip(dots(start - a, along) / max(float(dots(along, along)), 1e-300), 0.0, 1.0)
        nearest = a + fraction[:, None] * along
        clear = self.sight(start, nearest, maximum, through=True)
        clear[dots(start - self.doors[self.number, 0], self.outward) >= beyond] = 0.0
        return lengths(nearest - start), clear, nearest

    def ways(self, corners: Floats, middles: Floats, columns: int) -> tuple[Indices, Floats]:
        """Next corner from 1 (0: the door, −1: none) and length of the way of each middle of a cell
        (n,2) m, row by row."""
        # the first stands for the door: no way over it is shorter
        self.corners = np.concatenate([np.zeros((1, 2)), corners])
        self.onward = np.zeros_like(self.corners)
        self.length = np.concatenate([[-np.inf], self._dijkstra(corners)])
        self.middles, self.columns = middles, columns
        code = self._cells()
        away = self.to_door(middles, 0.0)[0]
        turning = np.flatnonzero(code > 0)
        away[turning] = self._over(turning, code[turning])
        return code, np.where(code < 0, np.inf, away)

    def _dijkstra(self, corners: Floats) -> Floats:
        """The length (k,) m of the way from each corner to the door; infinite without a way."""
        # a side of the ring is a little nearer to the end of the wall than its corners
        width = 0.98 * self.radius
        away, clear, self.onward[1:] = self.to_door(corners, width)
        length = np.where(clear >= width, away, np.inf)
        left = np.ones(len(corners), dtype=bool)
        while np.isfinite(ahead := np.where(left, length, np.inf)).any():
            now = int(np.argmin(ahead))
            left[now] = False
            longer = length[now] + lengths(corners - corners[now])
            tried = np.flatnonzero(left & (longer < length))
            here = np.broadcast_to(corners[now], (len(tried), 2)).copy()
            observed = tried[self.sight(here, corners[tried], width) >= width]
            length[observed], self.onward[observed + 1] = longer[observed], corners[now]
        return length

    def _cells(self) -> Indices:
        """The search over cells: each tries the corners that its neighbours go to."""
        code = np.full(len(self.middles), -1)
        best = np.full(len(self.middles), np.inf)
        steps = np.array([i * self.columns + j for i in (-1, 0, 1) for j in (-1, 0, 1)])
        finite = np.flatnonzero(np.isfinite(self.length))
        along = np.linspace(*self.door, int(np.ptp(self.door, axis=0).max() / self.cell) + 2)
        seeds = np.concatenate([self.corners[finite], along - 0.5 * self.cell * self.outward])
        row = np.floor((seeds - self.middles[0]) / self.cell + 0.5).astype(np.int64)
        cell = row[:, 1] * self.columns + row[:, 0]
        tried = np.concatenate([finite, np.zeros(len(along), dtype=np.int64)])
        while len(cell):
            cell, tried = (cell[:, None] + steps).ravel(), np.repeat(tried, len(steps))
            within = (cell >= 0) & (cell < len(code))
            cell, tried = cell[within], tried[within]
            hopeful = (tried != code[cell]) & (self._over(cell, tried) < best[cell])
            pairs = np.unique(cell[hopeful] * len(self.corners) + tried[hopeful])
            cell, tried = np.divmod(pairs, len(self.corners))
            cost = self._cost(cell, tried)
            order = np.lexsort((cost, cell))
            cell, tried, cost = cell[order], tried[order], cost[order]
            first = np.diff(cell, prepend=-1).astype(bool) & (cost < best[cell] - 1e-9)
            cell, tried = cell[first], tried[first]
            code[cell], best[cell] = tried, cost[first]
        return code

    def _over(self, cell: Indices, tried: Indices) -> Floats:
        """The length (n,) m of the ways from cells over corners; infinite where a cell has its
        corner inside, since who has come to a corner goes on from it."""
        away = lengths(self.corners[tried] - self.middles[cell])
        away[(away < 0.75 * self.cell) & (tried > 0)] = np.inf
        over: Floats = self.length[tried] + away
        return over

    def _cost(self, cell: Indices, tried: Indices) -> Floats:
        """The same length with what is added near walls; infinite where a wall is between."""
        maximum = self.radius + self.cell / np.sqrt(2)
        position, away, clear = self.middles[cell], self._over(cell, tried), np.zeros(len(cell))
        door, rest = np.flatnonzero(tried == 0), np.flatnonzero(tried > 0)
        # a cell on the line of the door has people before it
        away[door], clear[door], _ = self.to_door(position[door], maximum, self.cell)
        to, onward = self.corners[tried[rest]], self.onward[tried[rest]]
        clear[rest] = self.sight(position[rest], to, maximum)
        # nobody turns back to a corner who is past it and sees the next one
        past = np.flatnonzero(dots(position[rest] - to, onward - to) > 0)
        free = self.radius - self.cell / np.sqrt(2)
        observed = self.sight(position[rest[past]], onward[past], free, through=True) >= free
        clear[rest[past[observed]]] = 0.0
        # nor comes back through the door
        start, end = self.door
        beyond, then = (dots(each - start, self.outward) for each in (position[rest], to))
        back = np.flatnonzero((beyond > 0) & (then <= MEET_M))
        fraction = (beyond[back] / (beyond[back] - then[back]))[:, None]
        met = position[rest[back]] + fraction * (to - position[rest])[back]
        through = lengths(met - start) + lengths(met - end) < lengths(end - start) + MEET_M
        clear[rest[back[through]]] = 0.0
        cost: Floats = np.where(clear > 0, away + AVOIDS * (maximum - clear), np.inf)
        return cost
