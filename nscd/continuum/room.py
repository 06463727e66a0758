"""A polygonal room: the border of the crowd, cut into walls, exits and free border (Fig. 7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
import shapely
from numpy.typing import ArrayLike

from nscd.arrays import Floats, Frozen, number, numbers, read_only
from nscd.bodies import Walls

Border = Literal["wall", "exit", "free"]
KINDS: tuple[Border, ...] = get_args(Border)

# Lengths below this share of the room's extent are rounding.
ROUNDING = 1e-9


class Exit(NamedTuple):
    """Cut an exit into an outline.

    edge: its number.
    start, end: m, along that edge."""

    edge: int
    start: float
    end: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room(Frozen):
    """Hold the area Ω that a crowd fills, a simple polygon, less the pillars that stand in it.

    outline: (v,2) m, vertices, counter-clockwise after construction (the other way round is
        turned).
    border: (v,), what edge i, from vertex i to vertex i+1, is: "wall" (Γ_w), "exit" (Γ_e) or "free"
        (Γ_f, the border of the crowd without an obstacle).
    pillars: (v,2) m each, polygons within the outline, all wall, clockwise after construction; the
        room is to the left of every edge.

    A round wall must not be drawn as a polygon of many edges: a crowd that is pressed to it is held
    in both directions at every corner, however obtuse, and cannot slide along it as along the round
    wall (Babuška's paradox).

    Raises ValueError naming the field for a wrong shape, an outline or pillar that is no simple
    polygon, a pillar that is not inside or touches another, an unknown kind of border or a room
    without a wall."""

    outline: Floats
    border: tuple[Border, ...]
    pillars: tuple[Floats, ...] = ()

    def __post_init__(self) -> None:
        outline, ccw = _loop(self.outline, "outline", "room")
        border: tuple[Border, ...] = tuple(self.border)
        if len(border) != len(outline):
            raise ValueError(f"border: {len(border)} kinds for {len(outline)} edges")
        for edge, kind in enumerate(border):
            if kind not in KINDS:
                raise ValueError(f"border: edge {edge} is {kind!r}. Wall, exit or free is needed")
        if not ccw:
            # edge i ran from vertex i; seen the other way round it starts at vertex i+1
            outline, border = outline[::-1], border[-2::-1] + border[-1:]
        object.__setattr__(self, "outline", read_only(outline, (-1, 2), "outline"))
        object.__setattr__(self, "border", border)
        object.__setattr__(self, "pillars", self._clockwise_pillars())
        if "wall" not in self.kinds:
            raise ValueError("border: the room has no wall")

    def _clockwise_pillars(self) -> tuple[Floats, ...]:
        space, turned = shapely.Polygon(self.outline), []
        for one, pillar in enumerate(self.pillars):
            name = f"pillars: number {one}"
            loop, ccw = _loop(pillar, name, "pillar")
            # a pillar that is cut out of the space must leave it in one piece, with one more hole
            rest = shapely.difference(space, shapely.Polygon(loop))
            one_more = len(space.interiors) + 1
            if rest.geom_type != "Polygon" or len(rest.interiors) != one_more:
                beside = "touches its border or another pillar"
                raise ValueError(f"{name} is not inside the room, or {beside}")
            space = rest
            turned.append(read_only(loop[::-1] if ccw else loop, (-1, 2), name))
        return tuple(turned)

    @property
    def kinds(self) -> tuple[Border, ...]:
        """(s,), what each edge of `segments` is: those of the outline, then the pillars' walls."""
        wall: Border = "wall"
        return self.border + (wall,) * sum(map(len, self.pillars))

    @property
    def segments(self) -> Floats:
        """(s,2,2) m, start and end of each edge, of the outline, then of the pillars."""
        loops = (self.outline, *self.pillars)
        return np.concatenate([np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in loops])

    def pieces(self, kind: Border) -> Floats:
        """List the start and end (k,2,2) m of the edges of one kind, the room on their left."""
        return self.segments[[b == kind for b in self.kinds]]

    @property
    def jambs(self) -> Floats:
        """(j,2) m, where a wall ends at an exit or a free border: σ ~ r^(−1/2) there."""
        changes = [
            (a == "wall") != (b == "wall")
            for a, b in zip(self.border[-1:] + self.border, self.border, strict=False)
        ]
        return self.outline[changes]

    @property
    def area(self) -> float:
        """m², without the pillars."""
        return float(shapely.Polygon(self.outline, self.pillars).area)


def room_of_outline(
    outline: ArrayLike,
    *,
    exits: Sequence[Exit | tuple[int, float, float]] = (),
    border: Sequence[Border] | None = None,
    pillars: Sequence[ArrayLike] = (),
) -> Room:
    """Make the room within an outline.

    outline: (v,2) m.
    exits: cut into its walls.
    border: what its edges are; walls by default.
    pillars: (v,2) m each, standing in it.

    Raises ValueError for an exit that is wider than its wall, lies beyond it, overlaps another exit
    or is in no wall."""
    vertices = _open(outline, "outline")
    kinds: Sequence[Border] = ["wall"] * len(vertices) if border is None else border
    Room(outline=vertices, border=tuple(kinds))
    cuts: dict[int, list[tuple[float, float]]] = {}
    for exit_, (edge, start, end) in enumerate(exits):
        name = f"exits: exit {exit_}"
        start, end = number(start, name), number(end, name)
        if not 0 <= edge < len(vertices) or kinds[edge] != "wall":
            raise ValueError(f"{name} is in edge {edge}, which is no wall")
        length = float(np.hypot(*(vertices[(edge + 1) % len(vertices)] - vertices[edge])))
        span, width_text = f"from {start:g} to {end:g} m", f"{end - start:g} m wide"
        if not start < end:
            raise ValueError(f"{name} runs {span}. It needs a width")
        if end - start > length * (1 + ROUNDING):
            raise ValueError(f"{name} is {width_text}, its wall only {length:g} m long")
        if start < -ROUNDING * length or end > length * (1 + ROUNDING):
            raise ValueError(f"{name} {span} ends beyond its wall of {length:g} m")
        cuts.setdefault(edge, []).append((max(start, 0.0), min(end, length)))
    points: list[Floats] = []
    pieces: list[Border] = []
    for edge, kind in enumerate(kinds):
        first, way = vertices[edge], vertices[(edge + 1) % len(vertices)] - vertices[edge]
        length, at = float(np.hypot(*way)), 0.0
        for start, end in (*sorted(cuts.get(edge, [])), (length, length)):
            if start < at - ROUNDING * length:
                raise ValueError(f"exits: two exits overlap in edge {edge}")
            for begin, finish, piece in ((at, start, kind), (start, end, "exit")):
                if finish - begin > ROUNDING * length:
                    points.append(first + way * (begin / length))
                    pieces.append("exit" if piece == "exit" else kind)
            at = end
    standing = tuple(numbers(pillar, "pillars") for pillar in pillars)
    return Room(outline=np.array(points), border=tuple(pieces), pillars=standing)


def room_of_walls(walls: Walls, *, exits: ArrayLike = ()) -> Room:
    """Make the room that walls and exits enclose together.

    exits: (k,2,2) m, by their ends.

    Walls and exits meet end to end; closed loops of walls inside are pillars. Raises ValueError where
    they leave a gap, enclose more than one room, or an exit reaches over a wall, that is, is wider
    than its space."""
    lines = [shapely.LineString(pair) for pair in zip(walls.start, walls.end, strict=True)]
    kinds: list[Border] = ["wall"] * len(lines)
    extent = max(float(np.ptp(np.vstack([walls.start, walls.end]), axis=0).max()), 1e-300)
    pairs = numbers(exits, "exits")
    pairs = pairs.reshape(0, 2, 2) if pairs.size == 0 else pairs
    for one, ends in enumerate(read_only(pairs, (-1, 2, 2), "exits")):
        opening = shapely.LineString(ends)
        for wall, line in enumerate(lines[: len(walls)]):
            if opening.intersection(line.buffer(ROUNDING * extent)).length > 1e-6 * extent:
                width_text = f"number {one} ({opening.length:g} m wide)"
                raise ValueError(f"exits: {width_text} reaches over wall {wall + 1}")
        lines.append(opening)
        kinds.append("exit")
    rooms, cuts, dangles, _ = shapely.polygonize_full(lines)
    faces = shapely.get_parts(rooms)
    loose = [*shapely.get_parts(cuts), *shapely.get_parts(dangles)]
    if len(faces) == 0 or loose:
        x, y = _loose_end(lines)
        add = "Add a wall or an exit there"
        raise ValueError(f"walls: the room is not closed at ({x:g}, {y:g}) m. {add}")
    largest = max(faces, key=lambda face: shapely.Polygon(face.exterior).area)
    if len(faces) != 1 + len(largest.interiors):
        raise ValueError(f"walls: they enclose {len(faces)} rooms. One is needed")

    def kinds_of(loop: Floats) -> tuple[Border, ...]:
        middle = shapely.points(0.5 * (loop + np.roll(loop, -1, axis=0)))
        return tuple(kinds[int(np.argmin(shapely.distance(point, lines)))] for point in middle)

    pillars = tuple(np.array(ring.coords)[:-1] for ring in largest.interiors)
    for pillar in pillars:
        if set(kinds_of(pillar)) != {"wall"}:
            x, y = pillar[0]
            raise ValueError(f"walls: the pillar at ({x:g}, {y:g}) m has an exit or a free border")
    outline = np.array(largest.exterior.coords)[:-1]
    return Room(outline=outline, border=kinds_of(outline), pillars=pillars)


def square_room(side: float, exit_width: float) -> Room:
    """Make the paper's room (section 3.2.2): a square with an exit in the middle of one side.

    side, exit_width: m. The exit lies on x = 0 around the origin, the room at −side ≤ x ≤ 0, as in
        the scene `arch`."""
    half = 0.5 * side
    corners = [[0.0, -half], [0.0, half], [-side, half], [-side, -half]]
    door = Exit(0, half - 0.5 * exit_width, half + 0.5 * exit_width)
    return room_of_outline(corners, exits=[door])


def _open(value: ArrayLike, name: str) -> Floats:
    """The vertices (v,2) of a loop, without a last one that repeats the first."""
    loop = read_only(value, (-1, 2), name)
    return loop[:-1] if len(loop) > 1 and np.array_equal(loop[0], loop[-1]) else loop


def _loop(value: ArrayLike, name: str, what: str) -> tuple[Floats, bool]:
    """The vertices (v,2) of a simple polygon, and whether they turn left."""
    loop = _open(value, name)
    if len(loop) < 3:
        few = f"{len(loop)} vertices do not close a {what}"
        raise ValueError(f"{name}: {few}. At least 3 are needed")
    ring, minimum = shapely.LinearRing(loop), (ROUNDING * np.ptp(loop, axis=0).max()) ** 2
    if not ring.is_simple or shapely.Polygon(ring).area <= minimum:
        raise ValueError(f"{name}: the edges touch or cross each other, or enclose no area")
    return loop, bool(ring.is_ccw)


def _loose_end(lines: list[shapely.LineString]) -> tuple[float, float]:
    """A point where an odd number of lines ends."""
    ends: dict[tuple[float, float], int] = {}
    for line in lines:
        for x, y in line.coords:
            ends[(x, y)] = ends.get((x, y), 0) + 1
    return next((point for point, count in ends.items() if count % 2), next(iter(ends)))
