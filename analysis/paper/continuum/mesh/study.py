"""The collision (11) on many meshes: CPU seconds and errors, in a room against a fine solution and
in the half-annulus."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.tri import Triangulation
from skfem import Mesh

from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.closed_forms.half_annulus import HalfAnnulus
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import Medium, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import pressure
from nscd.continuum.room import square_room
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.stress import Kernel, smear

SPEED = 1.7  # m/s
TABLE = table_1_medium()
ROOM = square_room(18.0, 1.0)
TOWARD = toward_exit(ROOM, SPEED)
BODY = Kernel(width=0.2)
NEAR, APART = 4.0, 0.25  # m: where pressures over a body are compared
GRADING = {1: 0.4, 2: 0.3}
REFERENCE_GRADING = 0.25
ANNULUS = HalfAnnulus(
    medium=table_1_medium(surface=0.0),
    inner=1.0,
    outer=9.0,
    speed=SPEED,
)
QUICK = 0.5  # s: what is faster is timed twice


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Sides of the triangles (m) of P1 and P2 in the room and of the two references, and cells
    along the annulus' radius."""

    room: tuple[tuple[float, ...], tuple[float, ...]] = (
        (2.0, 1.0, 0.5, 0.25, 0.16),
        (2.0, 1.0, 0.5, 0.3),
    )
    references: tuple[float, float] = (0.4, 0.26)
    annulus: tuple[tuple[int, ...], tuple[int, ...]] = ((8, 16, 32, 64), (4, 8, 16, 32))


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Relative errors: energy, √a(w − w̃, w − w̃)/√a(w,w) without the walls' part of a; pressure;
    load, the walls' whole ∫μ.

    pressure: in the room the largest difference over a body over the largest pressure over a body,
    within 4 m of the exit; in the half-annulus ‖p − p̃‖/‖p‖ in L²."""

    energy: float
    pressure: float
    load: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One solved mesh: its family ("P1 uniform"), side (m) or cells along the radius, unknowns, CPU
    seconds of the mesh and of the collision, errors, status."""

    family: str
    size: float
    unknowns: int
    mesh_s: float
    solve_s: float
    errors: Errors
    status: Status

    @property
    def cpu_s(self) -> float:
        """Mesh and collision."""
        return self.mesh_s + self.solve_s


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """The points of the room and of the half-annulus; the reference's unknowns, how far the next
    coarser reference is from it, and whether both are solved."""

    room: tuple[Point, ...]
    annulus: tuple[Point, ...]
    reference_unknowns: int
    uncertainty: Errors
    reference_solved: bool


def study(plan: Plan, progress: Progress | None = None) -> Study:
    """Solve all meshes of the plan. CPU seconds are those of this process, all its threads."""
    tell: Progress = progress or (lambda label, share: None)
    _room_answer(mesh_of(ROOM, 4.0), 1)  # what the first call loads and compiles is not counted
    coarse, fine = (
        _Reference(_room_answer(mesh_of(ROOM, size, grading=REFERENCE_GRADING), 2))
        for size in plan.references
    )
    tell("meshes", 0.2)
    room: list[Point] = []
    for order, sizes in zip((1, 2), plan.room, strict=True):
        for name, grading in (("uniform", 1.0), ("graded", GRADING[order])):
            for size in sizes:
                solved = _timed(
                    partial(mesh_of, ROOM, size, grading=grading),
                    partial(_room_answer, order=order),
                )
                room.append(_point(f"P{order} {name}", size, solved, fine.errors(solved.answer)))
            tell("meshes", 0.2 + 0.6 * len(room) / (2 * sum(map(len, plan.room))))
    annulus: list[Point] = []
    for order, counts in zip((1, 2), plan.annulus, strict=True):
        for cells in counts:
            solved = _timed(
                partial(ANNULUS.mesh, cells, curved=order == 2),
                partial(_annulus_answer, order=order),
            )
            annulus.append(_point(f"P{order}", cells, solved, _annulus_errors(solved.answer)))
    tell("meshes", 1.0)
    return Study(
        room=tuple(room),
        annulus=tuple(annulus),
        reference_unknowns=int(fine.answer.space.basis.N),
        uncertainty=fine.errors(coarse.answer),
        reference_solved=all(r.answer.status is Status.SOLVED for r in (coarse, fine)),
    )


@dataclass(frozen=True, eq=False)
class _Reference:
    """A fine solution; others are compared at its quadrature points."""

    answer: CollisionAnswer

    @cached_property
    def points(self) -> Floats:
        """Quadrature points (2,q) m."""
        return np.asarray(self.answer.space.basis.global_coordinates()).reshape(2, -1)

    @cached_property
    def fields(self) -> tuple[Floats, Floats]:
        """w (2,q) and D(w) (2,2,q) there."""
        return _evaluated(self.answer, self.points)

    def errors(self, other: CollisionAnswer) -> Errors:
        """Of another answer in the same room."""
        (w, strain), (exact, exact_strain) = _evaluated(other, self.points), self.fields
        p, exact_p = self._over_bodies(strain), self._over_bodies(exact_strain)
        load = float(self.answer.wall_force.sum())
        area = np.asarray(self.answer.space.basis.dx).ravel()
        return Errors(
            energy=_share(w - exact, strain - exact_strain, exact, exact_strain, area, TABLE),
            pressure=float(np.abs(p - exact_p).max() / exact_p.max()),
            load=abs(float(other.wall_force.sum()) - load) / load,
        )

    def _over_bodies(self, strain: Floats) -> Floats:
        """−½k_v tr D averaged with BODY, at places APART near the exit."""
        x, y = np.meshgrid(
            np.arange(-NEAR, APART / 2, APART), np.arange(-NEAR, NEAR + APART / 2, APART)
        )
        at = np.column_stack([x[np.hypot(x, y) <= NEAR], y[np.hypot(x, y) <= NEAR]])
        area = np.asarray(self.answer.space.basis.dx).reshape(-1, 1)
        p = -0.5 * TABLE.k_v * (strain[0, 0] + strain[1, 1])[:, None]
        sums, _ = smear(np.ascontiguousarray(self.points.T), np.hstack([area, area * p]), BODY, at)
        return np.asarray(sums[:, 1] / sums[:, 0])


def _room_answer(mesh: Mesh, order: int) -> CollisionAnswer:
    return collide(Space(mesh, order), TABLE, TOWARD)


def _annulus_answer(mesh: Mesh, order: int) -> CollisionAnswer:
    return collide(Space(mesh, order), ANNULUS.medium, ANNULUS.left_velocity)


class _Solved(NamedTuple):
    """An answer and the CPU seconds of its mesh and of the collision."""

    answer: CollisionAnswer
    mesh_s: float
    solve_s: float


def _timed(make: Callable[[], Mesh], solve: Callable[[Mesh], CollisionAnswer]) -> _Solved:
    """The best of two where they are quick."""
    best: _Solved | None = None
    while True:
        begin = time.process_time()
        mesh = make()
        middle = time.process_time()
        answer = solve(mesh)
        now = _Solved(answer, middle - begin, time.process_time() - middle)
        if best is not None:
            return _Solved(answer, min(best.mesh_s, now.mesh_s), min(best.solve_s, now.solve_s))
        if now.mesh_s + now.solve_s > QUICK:
            return now
        best = now


def _point(family: str, size: float, solved: _Solved, errors: Errors) -> Point:
    return Point(
        family=family,
        size=size,
        unknowns=int(solved.answer.space.basis.N),
        mesh_s=solved.mesh_s,
        solve_s=solved.solve_s,
        errors=errors,
        status=solved.answer.status,
    )


def _annulus_errors(answer: CollisionAnswer) -> Errors:
    basis = answer.space.basis
    x, area = np.asarray(basis.global_coordinates()), np.asarray(basis.dx)
    w, strain = np.asarray(answer.sum_field), _symmetric(answer.sum_field.grad)
    exact, exact_strain, p = ANNULUS.velocity_sum(x), ANNULUS.strain(x), ANNULUS.pressure(x)
    return Errors(
        energy=_share(w - exact, strain - exact_strain, exact, exact_strain, area, ANNULUS.medium),
        pressure=float(np.sqrt(((pressure(answer) - p) ** 2 * area).sum() / (p**2 * area).sum())),
        load=abs(float(answer.wall_force.sum()) - ANNULUS.wall_force) / ANNULUS.wall_force,
    )


def _share(
    w: Floats, strain: Floats, of: Floats, of_strain: Floats, area: Floats, medium: Medium
) -> float:
    """√(∫ρ|w|² + k_v|D|²) of a field over that of another."""

    def energy(v: Floats, d: Floats) -> float:
        density = float(np.mean(medium.rho)) * (v**2).sum(0) + medium.k_v * (d**2).sum((0, 1))
        return float((density * area).sum())

    return float(np.sqrt(energy(w, strain) / energy(of, of_strain)))


def _symmetric(gradient: Any) -> Floats:
    array = np.asarray(gradient)
    return np.asarray(0.5 * (array + array.swapaxes(0, 1)))


def _evaluated(answer: CollisionAnswer, points: Floats) -> tuple[Floats, Floats]:
    """w (2,q) and D(w) (2,2,q) of an answer on straight triangles at points (2,q) within its
    room."""
    basis = answer.space.scalar
    mesh = basis.mesh
    # skfem's own finder tries every triangle for a point that is not in one of the next few
    cells = Triangulation(mesh.p[0], mesh.p[1], mesh.t.T).get_trifinder()(*points)
    local = basis.mapping.invF(points[:, :, None], tind=cells)
    w, gradient = np.zeros_like(points), np.zeros((2, *points.shape))
    for k in range(basis.Nbfun):
        share = answer.velocity_sum[basis.element_dofs[k, cells]].T
        shape = basis.elem.gbasis(basis.mapping, local, k, tind=cells)[0]
        w += share * np.asarray(shape)[:, 0]
        gradient += share[:, None] * np.asarray(shape.grad)[None, :, :, 0]
    return w, _symmetric(gradient)
