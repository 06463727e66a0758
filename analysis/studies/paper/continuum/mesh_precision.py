"""What a mesh buys: errors of the collision (11) against CPU seconds, with P1 and P2 elements on
uniform and graded meshes, in a room against a fine solution and in the half-annulus."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from matplotlib.tri import Triangulation
from skfem import Mesh

from analysis.pages.drawing import BLUE, GREEN, GREY, ORANGE, PINK, label, legend_below, panels
from analysis.pages.numbers import decimals, percent
from analysis.pages.section import Cell, Section
from analysis.pages.words import Words
from analysis.studies.paper.continuum.exit_room import mean_over
from analysis.studies.paper.solutions import grouped, with_progress
from analysis.support.machine import machine
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.closed_forms import HalfAnnulus
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import Medium, table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import pressure
from nscd.continuum.room import square_room
from nscd.continuum.space import Space
from nscd.percussions import Status
from nscd.stress import Kernel

SIDE, SPEED = 18.0, 1.7  # m, m/s
TABLE = table_1_medium()
ROOM = square_room(SIDE, 1.0)
TOWARD = toward_exit(ROOM, SPEED)
BODY = Kernel(width=0.2)
NEAR, APART = 4.0, 0.25  # m: where pressures over a body are compared
GRADING = {1: 0.4, 2: 0.3}
REFERENCE_GRADING = 0.25
ANNULUS = HalfAnnulus(medium=table_1_medium(surface=0.0), inner=1.0, outer=9.0, speed=SPEED)
QUICK = 0.5  # s: what is faster is timed twice
GOAL = 0.01
QUANTITIES = {
    "energy": "velocity sum, energy norm",
    "pressure": "pressure over a body",
    "load": "load of all walls",
}
STYLES = {
    "P1 uniform": (BLUE, "o", "--", "white"),
    "P1 graded": (BLUE, "o", "-", BLUE),
    "P2 uniform": (ORANGE, "s", "--", "white"),
    "P2 graded": (ORANGE, "s", "-", ORANGE),
    "P1": (GREEN, "^", "-", GREEN),
    "P2": (PINK, "D", "-.", PINK),
}


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


class Errors(NamedTuple):
    """Relative errors: energy, √a(w − w̃, w − w̃)/√a(w,w) without the walls' part of a; pressure;
    load, the walls' whole ∫μ.

    pressure: in the room the largest difference over a body over the largest pressure over a body,
    within 4 m of the exit; in the half-annulus ‖p − p̃‖/‖p‖ in L²."""

    energy: float
    pressure: float
    load: float


class MeshPoint(NamedTuple):
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


class MeshStudy:
    """The points of the room and of the half-annulus; the reference's unknowns, how far the next
    coarser reference is from it, and whether both are solved. CPU seconds are those of this
    process, all its threads."""

    def __init__(self, plan: Plan, progress: Progress | None = None) -> None:
        def in_room(mesh: Mesh, order: int) -> CollisionAnswer:
            return collide(Space(mesh, order), TABLE, TOWARD)

        def in_annulus(mesh: Mesh, order: int) -> CollisionAnswer:
            return collide(Space(mesh, order), ANNULUS.medium, ANNULUS.left_velocity)

        in_room(mesh_of(ROOM, 4.0), 1)  # what the first call loads and compiles is not counted
        meshes = (mesh_of(ROOM, size, grading=REFERENCE_GRADING) for size in plan.references)
        coarse, fine = (in_room(mesh, 2) for mesh in meshes)
        errors, wanted = compared_with(fine), list[Callable[[], MeshPoint]]()
        for order, sizes in zip((1, 2), plan.room, strict=True):
            solve = partial(in_room, order=order)
            for name, grading in (("uniform", 1.0), ("graded", GRADING[order])):
                for size in sizes:
                    make = partial(mesh_of, ROOM, size, grading=grading)
                    wanted.append(partial(point, f"P{order} {name}", size, make, solve, errors))
        in_the_room = len(wanted)
        for order, counts in zip((1, 2), plan.annulus, strict=True):
            solve = partial(in_annulus, order=order)
            for cells in counts:
                make = partial(ANNULUS.mesh, cells, curved=order == 2)
                wanted.append(partial(point, f"P{order}", cells, make, solve, annulus_errors))
        found = [one() for one in with_progress(wanted, "meshes", progress)]
        self.room, self.annulus = found[:in_the_room], found[in_the_room:]
        self.reference_unknowns, self.uncertainty = int(fine.space.basis.N), errors(coarse)
        self.reference_solved = all(one.status is Status.SOLVED for one in (coarse, fine))


def point(
    family: str,
    size: float,
    make: Callable[[], Mesh],
    solve: Callable[[Mesh], CollisionAnswer],
    errors: Callable[[CollisionAnswer], Errors],
) -> MeshPoint:
    """Time a mesh and its collision, the best of two where they are quick, and take its errors."""
    times = list[tuple[float, float]]()
    while len(times) < 2 and sum(map(sum, times)) <= QUICK:
        begin = time.process_time()
        mesh = make()
        middle = time.process_time()
        solution = solve(mesh)
        times.append((middle - begin, time.process_time() - middle))
    mesh_s, solve_s = map(min, zip(*times, strict=True))
    unknowns = int(solution.space.basis.N)
    return MeshPoint(family, size, unknowns, mesh_s, solve_s, errors(solution), solution.status)


def compared_with(reference: CollisionAnswer) -> Callable[[CollisionAnswer], Errors]:
    """Compare answers in the same room with a fine solution, at its quadrature points."""
    basis = reference.space.basis
    points = np.asarray(basis.global_coordinates()).reshape(2, -1)
    exact, exact_strain = evaluated(reference, points)
    area, load = np.asarray(basis.dx).ravel(), float(reference.wall_force.sum())
    # places near the exit where pressures over a body are compared
    steps = np.arange(-NEAR, NEAR + APART / 2, APART)
    x, y = np.meshgrid(steps[: len(steps) // 2 + 1], steps)
    at = np.column_stack([x[np.hypot(x, y) <= NEAR], y[np.hypot(x, y) <= NEAR]])

    def over_bodies(strain: Floats) -> Floats:
        """−½k_v tr D averaged with BODY."""
        p = -0.5 * TABLE.k_v * (strain[0, 0] + strain[1, 1])
        return mean_over(BODY, np.ascontiguousarray(points.T), area, p, at)[:, 0]

    exact_p = over_bodies(exact_strain)

    def errors(other: CollisionAnswer) -> Errors:
        w, strain = evaluated(other, points)
        difference, of = (w - exact, strain - exact_strain), (exact, exact_strain)
        return Errors(
            energy=_energy_fraction(difference, of, area, TABLE),
            pressure=float(np.abs(over_bodies(strain) - exact_p).max() / exact_p.max()),
            load=abs(float(other.wall_force.sum()) - load) / load,
        )

    return errors


def annulus_errors(solution: CollisionAnswer) -> Errors:
    """Compare an answer in the half-annulus with the closed form."""
    basis = solution.space.basis
    x, area = np.asarray(basis.global_coordinates()), np.asarray(basis.dx)
    w, strain = np.asarray(solution.sum_field), _symmetric(solution.sum_field.grad)
    exact, exact_strain, p = ANNULUS.velocity_sum(x), ANNULUS.strain(x), ANNULUS.pressure(x)
    difference, of = (w - exact, strain - exact_strain), (exact, exact_strain)
    return Errors(
        energy=_energy_fraction(difference, of, area, ANNULUS.medium),
        pressure=float(np.sqrt(((pressure(solution) - p) ** 2 * area).sum() / (p**2 * area).sum())),
        load=abs(float(solution.wall_force.sum()) - ANNULUS.wall_force) / ANNULUS.wall_force,
    )


def _energy_fraction(
    field: tuple[Floats, Floats], of: tuple[Floats, Floats], area: Floats, medium: Medium
) -> float:
    """√(∫ρ|w|² + k_v|D|²) of a field (w, D) over that of another."""
    rho = float(np.mean(medium.rho))
    one, two = (
        float(((rho * (w**2).sum(0) + medium.k_v * (d**2).sum((0, 1))) * area).sum())
        for w, d in (field, of)
    )
    return float(np.sqrt(one / two))


def _symmetric(gradient: Any) -> Floats:
    array = np.asarray(gradient)
    return np.asarray(0.5 * (array + array.swapaxes(0, 1)))


def evaluated(solution: CollisionAnswer, points: Floats) -> tuple[Floats, Floats]:
    """w (2,q) and D(w) (2,2,q) of an answer on straight triangles at points (2,q) within its
    room."""
    basis = solution.space.scalar
    mesh = basis.mesh
    # skfem's own finder tries every triangle for a point that is not in one of the next few
    cells = Triangulation(mesh.p[0], mesh.p[1], mesh.t.T).get_trifinder()(*points)
    local = basis.mapping.invF(points[:, :, None], tind=cells)
    w, gradient = np.zeros_like(points), np.zeros((2, *points.shape))
    for k in range(basis.Nbfun):
        fraction = solution.velocity_sum[basis.element_dofs[k, cells]].T
        shape = basis.elem.gbasis(basis.mapping, local, k, tind=cells)[0]
        w += fraction * np.asarray(shape)[:, 0]
        gradient += fraction[:, None] * np.asarray(shape.grad)[None, :, :, 0]
    return w, _symmetric(gradient)


def picture(study: MeshStudy) -> Figure:
    """Three errors in the room and that of the energy in the half-annulus, each against CPU
    seconds."""
    figure, every = panels(9, 7, 2, 2, grid="major")
    for axes, (name, title) in zip(every, QUANTITIES.items(), strict=False):
        _curves(axes, study.room, name)
        limit = getattr(study.uncertainty, name)
        axes.axhspan(axes.get_ylim()[0], limit, color=GREY, alpha=0.5, lw=0, zorder=0)
        label(axes, title=f"Room: {title}")
    _curves(every[3], study.annulus, "energy")
    label(every[3], title="Half-annulus: velocity sum, energy norm")
    legend_below(figure, every, 6)
    return figure


def _curves(axes: Axes, points: Sequence[MeshPoint], name: str) -> None:
    for family, of in grouped(points, attrgetter("family")).items():
        colour, marker, line, face = STYLES[family]
        words = family if " " in family else f"{family}, half-annulus"
        seconds, errors = zip(*((p.cpu_s, getattr(p.errors, name)) for p in of), strict=True)
        axes.plot(seconds, errors, color=colour, ls=line, marker=marker, mfc=face, label=words)
    label(axes, "CPU seconds, mesh and collision", "relative error", log="xy")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(*axes.get_ylim())


def build(progress: Progress | None = None, plan: Plan | None = None) -> Section:
    """Build the chart of errors against CPU seconds in the room and in the half-annulus."""
    found = MeshStudy(plan or Plan(), progress)
    words = Words(
        __name__,
        **{"found": found, "far": found.uncertainty, "machine": machine()},
        reached={title: _reached(found.room, name) for name, title in QUANTITIES.items()},
    )
    unsolved = [p for p in (*found.room, *found.annulus) if p.status is not Status.SOLVED]
    warnings = [f"{p.family}, {p.size:g}: {p.status}" for p in unsolved]
    return words.section(
        "mesh",
        pictures={"mesh_precision": picture(found)},
        tables={
            "meshes": [_row("room", f"{p.size:g} m", p) for p in found.room]
            + [_row("half-annulus", f"{p.size:g} cells", p) for p in found.annulus]
        },
        warnings=warnings if found.reference_solved else [*warnings, "a reference is not solved"],
    )


def _reached(points: Sequence[MeshPoint], name: str) -> dict[str, Any]:
    """What each family of meshes needs to come to the goal in one quantity.

    seconds: s, CPU time, of the families that get there; best: the least error of each family;
    cheapest: the family that needs least, None where none gets there."""
    of = grouped(points, attrgetter("family"))
    needed = {family: seconds_to(some, name, GOAL) for family, some in of.items()}
    seconds = {family: s for family, s in needed.items() if s is not None}
    best = {family: min(getattr(p.errors, name) for p in some) for family, some in of.items()}
    cheapest = min(seconds, key=seconds.__getitem__, default=None)
    return {"seconds": seconds, "best": best, "cheapest": cheapest}


def seconds_to(points: Sequence[MeshPoint], name: str, goal: float) -> float | None:
    """Read the CPU seconds at which the error falls to the goal, a power law between points.

    None where it does not."""
    errors = [getattr(point.errors, name) for point in points]
    i = next((i for i, error in enumerate(errors) if error <= goal), None)
    if not i:
        return None if i is None else points[0].cpu_s
    before, after = points[i - 1].cpu_s, points[i].cpu_s
    fraction = np.log(errors[i - 1] / goal) / np.log(errors[i - 1] / errors[i])
    return float(before * (after / before) ** fraction)


def _row(where: str, size: str, p: MeshPoint) -> list[Cell]:
    seconds = [decimals(s, 3) for s in (p.mesh_s, p.solve_s)]
    errors = [percent(error, 2) for error in p.errors]
    return [where, p.family, size, p.unknowns, *seconds, *errors, str(p.status)]
