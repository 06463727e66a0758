"""At the jambs w ~ r^(1/2): what that does to the error of P1 and P2, and what graded meshes give
back."""

import numpy as np
import pytest

from nscd.continuum.collision import collide
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.room import square_room
from nscd.continuum.space import Space
from nscd.percussions import Status

ROOM = square_room(6.0, 1.0)
MEDIUM = table_1_medium(person=1.0)


def solved(size, grading, order):
    """Unknowns, and the minimum ½a(w,w) − 2∫ρu⁻·w of a crowd that walks at 1 m/s into the wall with
    the exit."""
    answer = collide(Space(mesh_of(ROOM, size, grading=grading), order), MEDIUM, [1.0, 0.0])
    assert answer.status is Status.SOLVED
    w, dx = np.asarray(answer.sum_field), answer.space.basis.dx
    inertia = (answer.density_field * (0.5 * w**2 - 2 * w * answer.left_field).sum(0) * dx).sum()
    return answer.space.basis.N, inertia - answer.energy.volume - answer.energy.surface


@pytest.fixture(scope="module")
def least():
    """The minimum by P2, graded below 1/4; what a finer mesh still changes is a quarter of the
    smallest error below."""
    coarse, fine = (solved(size, 0.22, 2)[1] for size in (0.15, 0.1))
    assert 0 < coarse - fine < 5e-4
    return fine


@pytest.mark.parametrize(
    ("order", "grading", "sizes"),
    [
        (1, 1.0, (0.4, 0.1)),
        (1, 0.5, (0.4, 0.1)),
        (1, 0.3, (0.4, 0.1)),
        (2, 1.0, (0.8, 0.2)),
        (2, 0.5, (0.8, 0.2)),
        (2, 0.4, (0.8, 0.2)),
        (2, 0.3, (0.8, 0.2)),
    ],
)
def test_energy_order_is_the_smallest_of_the_element_and_of_the_singularities(
    least, order, grading, sizes
):
    """‖w_h − w‖ ~ N^(−s/2), s = min(order, 1/(2 grading), 3/2): each ring of triangles around a
    jamb costs what r^(1/2) leaves of it, and where a side wall begins to hold the crowd w ~
    r^(3/2), on which the mesh is not graded.

    w_h is admissible here (u⁻·n is constant on each wall), so the error in the norm of a is at most
    √(2(J(w_h) − J(w)))."""
    (n, coarse), (m, fine) = (solved(size, grading, order) for size in sizes)
    assert fine - least > 1e-3
    observed = np.log((coarse - least) / (fine - least)) / np.log(m / n)
    assert observed == pytest.approx(min(order, 1 / (2 * grading), 1.5), abs=0.12)
