"""Fig. 7: the crowd's border of walls, exit and free border, the collision (11) in it, and norms
that have a limit."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from skfem import MeshTri1

from analysis.pages.drawing import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    PINK,
    draw_vectors,
    label_outer,
    panels,
)
from analysis.pages.fields import draw_field, draw_room, rounded
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum.exit_room import BODY, MESH, ROOM, SIDE, slopes
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, toward_exit
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields, body_wall_percussion
from nscd.continuum.room import Exit, Room, room_of_outline
from nscd.continuum.space import Space
from nscd.segments import nearest_on_segment

SPEED = 1.7  # m/s
PUSH = 500.0  # N·s for each metre of free border, inward
HALVINGS = 3
# U/r over a quarter of a circle at each of the two jambs: what a halving adds to ∫|∇u⁻|² in the end
FOREVER = float(np.pi * SPEED**2 * np.log(2))
CROWD = table_1_medium()
ROUNDING = 1e-9  # of the speed
# ∫|∇u⁻|² has no limit where it still grows by this share of what it does in the end, and ∫|∇w|² one
# where its changes shrink to less than this share
GROWS, SHRINKS = 0.5, 0.8
BAR = 1 / 4000  # m for each N·s/m
ARROW = 0.8  # m


def crowd_in_a_corner() -> Room:
    """Make a crowd that fills a corner of a room with a 1 m exit and stands round a pillar; behind
    it nothing holds it."""
    return room_of_outline(
        [[0.0, 0.0], [0.0, 6.0], [-3.0, 6.0], [-5.5, 4.8], [-6.5, 2.5], [-6.5, 0.0]],
        exits=[Exit(0, 1.5, 2.5)],
        border=["wall", "free", "free", "free", "free", "wall"],
        pillars=[[[-2.6, 3.3], [-2.0, 3.3], [-2.0, 3.9], [-2.6, 3.9]]],
    )


def inward(room: Room) -> Field:
    """Push along the inward normal of the free border: (m,2) m → (m,2) N·s/m."""
    pieces = np.array(room.pieces("free"))
    along = pieces[:, 1] - pieces[:, 0]
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]

    def push(points: Floats) -> Floats:
        away = [np.hypot(*(nearest_on_segment(points, *piece) - points).T) for piece in pieces]
        return np.asarray(PUSH * normal[np.argmin(away, axis=0)])

    return push


class BorderRun:
    """The corner's crowd by (11).

    enters: m/s, the largest u⁺·n on walls (n out of the room), 0 where nobody enters one
    apart: largest |μ (u⁺·n)| over the largest μ times the speed: 0 where the wall pushes only those
        who stay
    load: N·s, what the walls give in all
    pressure: (n,) N·s/m over a body at the points shown (n,2) m"""

    def __init__(self, name: str, solution: CollisionAnswer, shown: Floats) -> None:
        self.name, self.solution = name, solution
        wall, force = solution.space.wall, solution.wall_force
        normal = (solution.right_velocity[wall.node] * wall.normal).sum(1)
        self.enters, self.load = max(float(normal.max()), 0.0), float(force.sum())
        self.apart = float(np.abs(force * normal).max() / (force.max() * SPEED))
        self.pressure = body_fields(solution, BODY, shown).pressure


class Norms(NamedTuple):
    """One uniform mesh of the square room: its side (m), unknowns, ∫|∇u⁻|² and ∫|∇w|² (m²/s²)."""

    side: float
    unknowns: int
    left: float
    total: float


def norms(side: float) -> tuple[Norms, CollisionAnswer]:
    """Solve the square room on a uniform mesh of a side (m)."""
    left, space = toward_exit(ROOM, SPEED), Space(mesh_of(ROOM, side, grading=1.0))
    solution = collide(space, CROWD, left)
    before = sum((slope**2).sum(1) for slope in slopes(left, space.points, 1e-7))
    total = (np.asarray(solution.sum_field.grad) ** 2).sum((0, 1)).ravel()
    unknowns = int(space.basis.N)
    found = Norms(side, unknowns, float(before @ space.weights), float(total @ space.weights))
    return found, solution


def border(room: Room, run: BorderRun, shown: MeshTri1) -> Figure:
    """Draw the room's mesh and kinds of border; p at the vertices of `shown`, μ over a body, r_ext
    on the free border."""
    figure, (left, right) = panels(11.0, 5.4, 1, 2, sharex=True, sharey=True)
    mesh, wall, push = run.solution.space.mesh, run.solution.space.wall, inward(room)
    left.triplot(*mesh.p, mesh.t.T, color=GREY, lw=0.4)
    for words, anchor, colour in (
        ("$Γ_w$, wall", (0.15, 5.0), BLACK),
        ("$Γ_e$, exit", (0.15, 1.9), ORANGE),
        ("$Γ_f$, free", (-7.6, 4.0), BLUE),
    ):
        left.annotate(words, anchor, color=colour, fontsize=10)
    behind = {"fc": "white", "ec": "none", "pad": 1}
    left.annotate("Ω, the crowd", (-4.6, 1.0), fontsize=10, bbox=behind)
    drawn = draw_field(right, shown, run.pressure, rounded(float(run.pressure.max())))
    figure.colorbar(drawn, ax=right, label="pressure over a body (N·s/m)", shrink=0.9)
    mu = body_wall_percussion(run.solution, 0.1)
    ends = wall.point + BAR * mu[:, None] * wall.normal
    # the pillar's bars would hide the pressure around it
    outer = (mu > 0) & (np.abs(wall.point).min(1) < 1e-9)
    for start, end in zip(wall.point[outer], ends[outer], strict=True):
        right.plot(*np.stack([start, end]).T, color=PINK, lw=1)
    for start, end in room.pieces("free"):
        at = start + np.linspace(0.1, 0.9, 4)[:, None] * (end - start)
        vector = push(at)
        vector *= ARROW / np.hypot(*vector.T).max()
        draw_vectors(right, at - vector, vector, width=0.004, color=BLUE)
    for axes in (left, right):
        draw_room(axes, room)
        axes.set(xlim=(-7.8, 1.6), ylim=(-1.0, 7.0))
    label_outer((left, right))
    return figure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 7: the three kinds of border, (11) there, which left velocities it takes."""
    room = crowd_in_a_corner()
    space, shown = Space(mesh_of(room, mesh)), mesh_of(room, 1.25 * mesh)
    left = toward_exit(room, SPEED)
    at = np.ascontiguousarray(shown.p.T)
    push = f"push of {PUSH:g} N·s/m"
    alone, pushed = both = [
        BorderRun("no push", collide(space, CROWD, left), at),
        BorderRun(push, collide(space, CROWD, left, external=inward(room)), at),
    ]
    if progress:
        progress("Fig. 7", 0.5)
    meshes, solutions = zip(*(norms(2.5 * mesh / 2**k) for k in range(HALVINGS + 1)), strict=True)
    growth = np.diff([one.left for one in meshes])
    change = np.abs(np.diff([one.total for one in meshes]))
    enters, difference = (max(getattr(one, name) for one in both) for name in ("enters", "apart"))
    pulls = min(float(one.solution.wall_force.min()) for one in both)
    impenetrable = max(enters / SPEED, difference) < ROUNDING and pulls >= 0
    unique = Verdict.of(bool(change[-1] < SHRINKS * change[-2]), False)
    words = Words(
        __name__,
        **{"alone": alone, "pushed": pushed, "growth": growth, "change": change, "side": SIDE},
        **{"enters": enters / SPEED, "pulls": pulls, "apart": difference},
    )
    names = [f"square room, side {one.side:g} m" for one in meshes]
    return words.section(
        "7",
        pictures={"fig_7_border": border(room, pushed, shown)},
        tables={"runs": [_row(one) for one in both], "norms": meshes},
        claims={
            "impenetrable": Verdict.of(impenetrable),
            "unique": unique if growth[-1] > GROWS * FOREVER else Verdict.HOLDS,
        },
        warnings=unsolved(
            [*((one.name, one.solution) for one in both), *zip(names, solutions, strict=True)]
        ),
    )


def _row(run: BorderRun) -> list[Cell]:
    a, e = run.solution, run.solution.energy
    energies = [e.before, e.change, e.volume, e.surface, e.wall, e.external, e.error]
    pressing = [run.enters, run.load, float(run.pressure.max())]
    return [run.name, int(a.space.basis.N), *pressing, *energies, a.residual, str(a.status)]
