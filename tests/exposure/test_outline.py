"""Loads along outlines: however a plan cuts, turns, orders and repeats its walls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.studies.exposure.outline import Outlines
from analysis.studies.exposure.walls import OnWalls, beside_doors, loads_on
from nscd import Walls
from tests.crowds import disks_at, drive_to, scene_at

# A room with a door of 1 m, whose outline goes from post to post; a partition of 0.8 m that ends at
# its wall; a pillar; a bench of 0.4 m that stands alone.
SHAPES = [
    [(0, 1.5), (0, 3), (5, 3), (5, 0), (0, 0), (0, 0.5)],
    [(2, 3), (2, 2.2)],
    [(3.5, 1), (4, 1), (4, 1.57), (3.5, 1.57), (3.5, 1)],
    [(1, 1), (1.4, 1)],
]
# The metre of the partition is a metre: it is joined to a wall, and so is its load.
STRETCH = [1.0, 1.0, 1.0, 0.4]


def shape_of(points):
    """The arc lengths of its corners, and the place of others."""
    points = np.array(points, dtype=float)
    ends = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    return ends, lambda arc: np.column_stack([np.interp(arc, ends, x) for x in points.T])


def pieces_of(random, many, gap):
    """Walls (w,2,2), the shape and the arc lengths of each: cut, turned, some twice, in any order."""
    rows = []
    for number, points in enumerate(SHAPES):
        ends, at = shape_of(points)
        cuts = np.unique(np.append(ends, random.uniform(0, ends[-1], many)))
        low, high = cuts[:-1], cuts[1:]
        more = random.integers(len(low), size=min(many, 5))  # parts of pieces once more
        inside = np.sort(random.random((2, len(more))), axis=0) * (high - low)[more] + low[more]
        low, high = (np.append(one, part) for one, part in zip((low, high), inside, strict=True))
        shorter = np.minimum(0.5 * gap, 0.2 * (high - low))
        some = slice(None) if gap else high - low > 1e-9
        ends_of = np.stack([at(low + shorter), at(high - shorter)], axis=1)
        rows += [(*row, number) for row in zip(ends_of[some], low[some], high[some], strict=True)]
    rows = [rows[n] for n in random.permutation(len(rows))]
    walls = np.array([row[0][:: random.choice([1, -1])] for row in rows])
    return walls, np.array([row[1:] for row in rows])


def worst_of(contacts, forces):
    """The largest mean on a metre, by each contact as its begin: of all shapes."""
    found = 0.0
    for number, points in enumerate(SHAPES):
        arc, force = contacts[number], forces[number]
        length = shape_of(points)[0][-1]
        ahead = (arc - arc[:, None]) % length if points[0] == points[-1] else arc - arc[:, None]
        within = (ahead >= 0) & (ahead <= 1.0 + 1e-12)
        found = max(found, (within @ force).max() / STRETCH[number])
    return found


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0, 1, 3, 30, 1000]),
    st.sampled_from([0.0, 0.0, 0.005]),
)
def test_loads_do_not_depend_on_the_pieces_of_walls(seed, many, gap):
    """Contacts are 0.15 m apart, so that a gap of 5 mm moves none out of a metre."""
    random = np.random.default_rng(seed)
    walls, rows = pieces_of(random, many, gap if many < 1000 else 0.0)
    outlines = Outlines.of(Walls(start=walls[:, 0], end=walls[:, 1]))
    assert outlines.length == pytest.approx([15.0, 0.4, 0.8, 2.14], abs=1e-9 + 6 * gap)
    arcs, sizes, wall, position, force = [], [], [], [], []
    for number, points in enumerate(SHAPES):
        ends, at = shape_of(points)
        arc = np.arange(0.04, ends[-1], 0.15)
        size = random.uniform(1, 9, len(arc)) * (random.random(len(arc)) < 0.5)
        arcs.append(arc)
        sizes.append(size)
        mine = np.flatnonzero(rows[:, 2] == number)
        away = np.maximum(rows[mine, 0] - arc[:, None], arc[:, None] - rows[mine, 1])
        wall.append(mine[away.argmin(1)])
        position.append(at(arc))
        force.append(size)
    on = [np.concatenate(one) for one in (wall, position, force)]
    loads, worst = outlines.line_loads(*on)
    assert worst.load == pytest.approx(worst_of(arcs, sizes), rel=1e-12)
    assert loads.max() == pytest.approx(worst.load)
    assert np.hypot(*(on[1] - worst.point).T).min() < 0.5
    full = Outlines.of(Walls(**dict(zip(("start", "end"), whole_walls(), strict=True))))
    same = full.line_loads(whole_of(on[1]), *on[1:])[1]
    assert worst.point == pytest.approx(same.point, abs=1e-9 + gap)
    assert worst.arc == pytest.approx(same.arc, abs=1e-9 + 6 * gap)


def whole_walls():
    return [np.concatenate([np.array(one, dtype=float)[a:b] for one in SHAPES])
            for a, b in ((0, -1), (1, None))]  # fmt: skip


def whole_of(position):
    """The whole wall next to each place."""
    start, end = whole_walls()
    way = end - start
    fraction = ((position[:, None] - start) * way).sum(2) / (way**2).sum(1)
    nearest = start + np.clip(fraction, 0, 1)[..., None] * way
    return np.hypot(*(position[:, None] - nearest).T).T.argmin(1)


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("beyond", [[], [((0, 1), (3, 1)), ((0, 2), (3, 2))], [((0, 1), (-0.4, 1)), ((0, 2), (-0.4, 2))]])
def test_beside_a_door_is_the_metre_from_its_end_left_and_right_of_who_walks_out(turn, beyond):
    """People walk out along x through a door from y = 1 to 2 m in a wall that ends at −0.5 m and at 4 m,
    alone, before a corridor, or with short walls that lead to it."""
    walls = np.array([((0, -0.5), (0, 1)), ((0, 2), (0, 4)), *beyond], dtype=float)
    round_by = np.linalg.matrix_power([[0, -1], [1, 0]], turn).T
    outward, (start, end) = (1, 0) @ round_by, np.array([(0, 1), (0, 2)]) @ round_by
    at = disks_at(np.array([(0.1, 2.0), (0.1, 2.9), (0.1, 3.2), (0.1, 0.5), (0.1, -0.4)]) @ round_by, radius=0.1)
    drive = drive_to(start, end, tuple(map(float, outward)))
    scene = scene_at(at, (walls @ round_by).tolist(), drive=drive, contact={"stiffness_N_per_m": 1e6, "restitution": 0.1},
                     time=0.1, run={"duration_s": 0.1, "frames": 1})  # fmt: skip
    left, right = beside_doors(scene)
    on = OnWalls(wall=np.array([1, 1, 1, 0, 0]), position=at.position, force=np.array([1e3, 2e3, 4e3, 8e3, 5e2]))
    assert (left.name, right.name) == ("left of the door", "right of the door")
    loads = loads_on(scene, [on], [left, right])[0]
    assert loads.tolist() == pytest.approx([3.0, 8.0])


def test_a_period_closes_an_outline_and_of_three_walls_the_straightest_two_go_on():
    walls = Walls(start=[[0, 0], [2, 0]], end=[[2, 0], [5, 0]], period_x=(0.0, 5.0))
    outlines = Outlines.of(walls)
    assert (outlines.length.tolist(), outlines.closed.tolist()) == ([5.0], [True])
    loads, worst = outlines.line_loads(np.array([0, 1]), np.array([[0.2, 0.1], [4.7, 0.1]]), np.array([3.0, 1.0]))
    assert (loads.tolist(), worst.load) == ([4.0, 4.0], 4.0)
    assert worst.arc == pytest.approx(0.075)
    turned = np.array([[np.cos(a), np.sin(a)] for a in np.radians([0, 160, 270])])
    fork = Outlines.of(Walls(start=0 * turned, end=turned))
    assert sorted(fork.length.tolist()) == pytest.approx([1.0, 2.0])
    assert fork.number[0] == fork.number[1] != fork.number[2]
    assert not fork.alone.any()
