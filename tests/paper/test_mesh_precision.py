"""The chart of what a mesh buys: its errors against closed forms, its verdicts against its
numbers."""

import numpy as np
import pytest

from analysis.paper.continuum.mesh_precision import (
    ANNULUS,
    ROOM,
    TABLE,
    Errors,
    Plan,
    Point,
    build,
    evaluated,
    seconds_to,
    study,
)
from nscd.continuum.collision import collide
from nscd.continuum.mesh import mesh_of
from nscd.continuum.space import Space
from nscd.percussions import Status

SMALL = Plan(room=((2.0, 1.0), (2.0, 1.0)), references=(0.9, 0.6), annulus=((8, 16), (4, 8)))


@pytest.fixture(scope="module")
def small():
    return study(SMALL)


def point(cpu_s, error):
    return Point(
        family="P1 graded", size=1.0, unknowns=100, mesh_s=0.25 * cpu_s, solve_s=0.75 * cpu_s,
        errors=Errors(energy=error, pressure=error, load=error), status=Status.SOLVED,
    )  # fmt: skip


def test_seconds_to_a_goal_follow_the_power_law_between_points():
    points = [point(s, 0.1 * s**-0.5) for s in (1.0, 4.0, 16.0)]
    assert seconds_to(points, "energy", 0.04) == pytest.approx(6.25)
    assert seconds_to(points, "load", 0.2) == 1.0
    assert seconds_to(points, "pressure", 0.01) is None


@pytest.mark.parametrize("order", [1, 2])
def test_fields_are_evaluated_anywhere(order):
    """w = (x + 2y + q x², 3y − x), q = 0 for P1: its value and D(w) at any point of another
    mesh."""
    q = 0.5 * (order - 1)
    answer = collide(Space(mesh_of(ROOM, 3.0), order), TABLE, [0.0, 0.0])
    x, y = answer.space.nodes.T
    answer.velocity_sum[:] = np.column_stack([x + 2 * y + q * x**2, 3 * y - x])
    x, y = np.random.default_rng(0).uniform([[-17.9], [-8.9]], [[-0.1], [8.9]], (2, 500))
    w, strain = evaluated(answer, np.stack([x, y]))
    assert w == pytest.approx(np.stack([x + 2 * y + q * x**2, 3 * y - x]), abs=1e-9)
    assert strain[0, 0] == pytest.approx(1 + 2 * q * x, abs=1e-9)
    assert strain[0, 1] == pytest.approx(0.5, abs=1e-9)
    assert strain[1, 1] == pytest.approx(3.0, abs=1e-9)


def test_errors_fall_and_graded_meshes_have_less(small):
    by_family = {}
    for p in small.room:
        assert p.status is Status.SOLVED
        by_family.setdefault(p.family, []).append(p)
    for coarse, fine in by_family.values():
        assert fine.errors.energy < coarse.errors.energy
    for order in ("P1", "P2"):
        uniform, graded = (
            by_family[f"{order} uniform"][-1].errors,
            by_family[f"{order} graded"][-1].errors,
        )
        assert graded.energy < 0.6 * uniform.energy
        assert graded.pressure < 0.2 * uniform.pressure
    assert small.uncertainty.energy < by_family["P2 graded"][-1].errors.energy


def test_errors_of_the_half_annulus_have_their_orders(small):
    """From 8 to 16 cells (P1) and 4 to 8 (P2); the load is of order 2 and better. The wall force is
    the closed form's."""
    assert ANNULUS.wall_force > 0
    p1, p2 = small.annulus[:2], small.annulus[2:]
    assert np.log2(p1[0].errors.energy / p1[1].errors.energy) == pytest.approx(1.0, abs=0.15)
    assert np.log2(p1[0].errors.load / p1[1].errors.load) == pytest.approx(2.0, abs=0.25)
    assert p2[1].errors.energy < 0.6 * p2[0].errors.energy
    assert p2[1].errors.energy < 0.3 * p1[0].errors.energy


def test_section_says_what_its_table_holds():
    section = build(plan=SMALL)
    assert not section.warnings
    assert len(section.tables[0].rows) == 12
    assert all(len(row) == len(section.tables[0].head) for row in section.tables[0].rows)
    verdict = next(words for words in section.words if "pressure over a body:" in words)
    best = [row[7] for row in section.tables[0].rows if row[1] == "P1 uniform"]
    assert (
        f"P1 uniform does not get there (best {min(best, key=lambda s: float(s[:-2]))})" in verdict
    )
    assert "cheapest: P2 graded" in verdict
    figure = section.pictures[0].figure
    assert [len(axes.lines) for axes in figure.axes] == [4, 4, 4, 2]
    assert all("seconds" in axes.get_xlabel() for axes in figure.axes)
