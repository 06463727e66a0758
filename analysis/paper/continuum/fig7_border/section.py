"""Figure 7: the crowd's border of walls, exit and free border, and the collision (11) solved in
it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.pages.section import Cell, Claim, Picture, Section, Table, Verdict
from analysis.paper.continuum.exit_room import BODY, MESH, ROOM, SIDE, medium, warn
from analysis.paper.continuum.fig7_border.charts import border
from analysis.support.progress import Progress
from nscd.arrays import Floats
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import Field, toward_exit
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import body_fields
from nscd.continuum.room import Exit, Room, room_of_outline
from nscd.continuum.space import Space
from nscd.segments import nearest_on_segment

SPEED = 1.7  # m/s
PUSH = 500.0  # N·s for each metre of free border, inward
HALVINGS = 3


def crowd_in_a_corner() -> Room:
    """A crowd that fills a corner of a room with a 1 m exit and stands round a pillar; behind it
    nothing holds it."""
    outline = [[0.0, 0.0], [0.0, 6.0], [-3.0, 6.0], [-5.5, 4.8], [-6.5, 2.5], [-6.5, 0.0]]
    pillar = [[-2.6, 3.3], [-2.0, 3.3], [-2.0, 3.9], [-2.6, 3.9]]
    return room_of_outline(
        outline,
        exits=[Exit(0, 1.5, 2.5)],
        border=["wall", "free", "free", "free", "free", "wall"],
        pillars=[pillar],
    )


@dataclass(frozen=True, eq=False)
class Run:
    """The corner's crowd with and without a push from behind."""

    name: str
    answer: CollisionAnswer

    @cached_property
    def normal_speed(self) -> Floats:
        """u⁺·n at the wall points (c,) m/s; n out of the room."""
        wall = self.answer.space.wall
        speed: Floats = (self.answer.right_velocity[wall.node] * wall.normal).sum(1)
        return speed

    @property
    def apart(self) -> float:
        """Largest |μ (u⁺·n)| over the largest μ times the speed: 0 where the wall pushes only those
        who stay."""
        force = self.answer.wall_force
        return float(np.abs(force * self.normal_speed).max() / (force.max() * SPEED))

    def pressure(self, points: Floats) -> Floats:
        """Over a body (n,) N·s/m."""
        return body_fields(self.answer, BODY, points).pressure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Figure 7 remade: the three kinds of border, what (11) gives there, and which left velocities
    it takes."""
    warnings: list[str] = []
    room = crowd_in_a_corner()
    space, left = Space(mesh_of(room, mesh)), toward_exit(room, SPEED)
    shown = mesh_of(room, 1.25 * mesh)
    points = np.ascontiguousarray(shown.p.T)
    pushed = collide(space, medium(), left, external=_inward(room))
    runs = [Run("no push", collide(space, medium(), left)), Run(f"push of {PUSH:g} N·s/m", pushed)]
    for run in runs:
        warn(warnings, run.name, run.answer.status, run.answer.reason)
    if progress:
        progress("Fig. 7", 0.5)
    norms = _norms(2.5 * mesh, warnings)
    first, last = norms[1].left - norms[0].left, norms[-1].left - norms[-2].left
    peaks = [float(run.pressure(points).max()) for run in runs]
    return Section(
        number="7",
        title="The border of the crowd, and the collision in it",
        words=[
            "What the paper says: the crowd fills a domain Ω whose border is made of walls Γ_w, which it cannot "
            "enter, exits Γ_e, "
            "where nothing acts, and free borders Γ_f, where others may push (r_ext). With a left velocity in H¹ "
            "there is one right "
            "velocity.",
            "What is computed: a crowd of 7 people/m² in a corner with a 1 m exit and a pillar, Table 1, all "
            f"wanting {SPEED:g} m/s "
            f"toward the exit; alone, and pushed from behind with {PUSH:g} N·s for each metre of free border.",
            f"What is found: the answers have residuals up to {max(run.answer.residual for run in runs):.1e} "
            "(table). The push raises the largest "
            "pressure over a body from "
            f"{peaks[0]:.0f} to {peaks[1]:.0f} N·s/m and the load of the walls from {runs[0].answer.wall_force.sum():.0f} to "
            f"{runs[1].answer.wall_force.sum():.0f} N·s. The stress that (11) makes of a push on the free border "
            "dies away over h = "
            f"{medium().length:.2f} m.",
            "The paper's own desired velocity, toward the nearest point of the exit, is not in H¹: at the jambs its "
            "gradient is U/r. "
            f"On meshes that are halved ∫|∇u⁻|² grows by {first:.2f}, then {last:.2f} m²/s² (πU² ln 2 = "
            f"{np.pi * SPEED**2 * np.log(2):.2f} for each "
            "halving in the limit, for ever). Written for w = u⁺ + u⁻, (11) needs u⁻ only in L² and with a normal "
            "part at the walls; "
            "then w is in H¹ and has a limit, and u⁺ = w − u⁻ jumps where u⁻ does.",
        ],
        pictures=[
            Picture(
                name="fig_7_border",
                caption="Left: the mesh and the border: walls thick, exit dotted, free border dashed. Right: pressure over a "
                "body with the push (arrows: r_ext, to scale among themselves), and the percussion that the outer "
                "walls give (bars, "
                "1 m for 4000 N·s/m).",
                figure=border(room, runs[1].answer, shown, runs[1].pressure(points), _inward(room)),
            )
        ],
        tables=[_table(runs, peaks), _norms_table(norms)],
        differs=[
            "r_ext ∈ L²(Ω) must be L²(Γ_f): it is given on the border only. φ_s takes the velocity itself, not D of it.",
            "k_s acts here only on walls that the crowd presses; as printed it also pulls at those who leave a wall.",
        ],
        claims=_claims(runs, norms),
        warnings=warnings,
    )


def _inward(room: Room) -> Field:
    """PUSH along the inward normal of the free border."""
    pieces = np.array(room.pieces("free"))
    along = pieces[:, 1] - pieces[:, 0]
    length = np.hypot(*along.T)
    inward = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]

    def push(points: Floats) -> Floats:
        away = [np.hypot(*(nearest_on_segment(points, *piece) - points).T) for piece in pieces]
        pressed: Floats = PUSH * inward[np.argmin(away, axis=0)]
        return pressed

    return push


@dataclass(frozen=True, slots=True, kw_only=True)
class Norms:
    """One uniform mesh of the square room: side (m), unknowns, ∫|∇u⁻|² and ∫|∇w|² (m²/s²)."""

    side: float
    unknowns: int
    left: float
    total: float


def _norms(size: float, warnings: list[str]) -> list[Norms]:
    left, rows = toward_exit(ROOM, SPEED), []
    for k in range(HALVINGS + 1):
        side = size / 2**k
        space = Space(mesh_of(ROOM, side, grading=1.0))
        answer = collide(space, medium(), left)
        warn(warnings, f"square room, side {side:g} m", answer.status, answer.reason)
        basis, step = space.basis, 1e-7
        places = np.asarray(basis.global_coordinates())
        points, squares = places.reshape(2, -1).T, np.zeros(places[0].size)
        for shift in step * np.eye(2):
            slope = (left(points + shift) - left(points - shift)) / (2 * step)
            squares += (slope**2).sum(1)
        total = float(((np.asarray(answer.sum_field.grad) ** 2).sum((0, 1)) * basis.dx).sum())
        rows.append(
            Norms(
                side=side,
                unknowns=int(basis.N),
                left=float((squares.reshape(places[0].shape) * basis.dx).sum()),
                total=total,
            )
        )
    return rows


def _claims(runs: list[Run], norms: list[Norms]) -> list[Claim]:
    enters = max(float(run.normal_speed.max()) for run in runs) / SPEED
    pulls = min(float(run.answer.wall_force.min()) for run in runs)
    apart = max(run.apart for run in runs)
    steps = np.diff([n.left for n in norms])
    settles = np.abs(np.diff([n.total for n in norms]))
    # U/r over a quarter of a circle at each of the two jambs
    forever = np.pi * SPEED**2 * np.log(2)
    grows, converges = bool(steps[-1] > 0.5 * forever), bool(settles[-1] < 0.8 * settles[-2])
    return [
        Claim(
            where="3.1, (11)",
            statement="the impenetrability condition: the crowd does not enter the walls, which only push",
            verdict=Verdict.HOLDS if max(enters, apart) < 1e-9 and pulls >= 0 else Verdict.FAILS,
            reason=f"largest u⁺·n {max(enters, 0):.1g} of the speed, least wall force {pulls:.2g} N·s; where a wall "
            f"pushes u⁺·n is {apart:.1g}",
        ),
        Claim(
            where="3.1",
            statement="if u⁻ ∈ H¹(Ω) there is a unique right-velocity u⁺ ∈ H¹(Ω) (used for the room of 3.2.2)",
            verdict=Verdict.PARTLY
            if grows and converges
            else Verdict.FAILS
            if grows
            else Verdict.HOLDS,
            reason=f"the left velocity of 3.2.2 is not in H¹: ∫|∇u⁻|² grows by {steps[0]:.2f} and {steps[-1]:.2f} "
            "m²/s² at the first and last "
            f"halving of the mesh. For w = u⁺ + u⁻ the problem is well posed: ∫|∇w|² changes by {settles[0]:.2f} and "
            f"{settles[-1]:.2f}",
        ),
    ]


def _table(runs: list[Run], peaks: list[float]) -> Table:
    rows: list[list[Cell]] = []
    for run, peak in zip(runs, peaks, strict=True):
        a = run.answer
        rows.append([run.name, int(a.space.basis.N), max(float(run.normal_speed.max()), 0.0), float(a.wall_force.sum()), peak,
                     a.energy.before, a.energy.change, a.energy.volume, a.energy.surface, a.energy.wall, a.energy.external,
                     a.energy.error, a.residual, str(a.status)])  # fmt: skip
    return Table(
        caption="The crowd in the corner: largest u⁺·n on walls, what the walls give, pressure over a body, energy "
        "balance (J): "
        "change = volume + surface + wall + push.",
        head=["push", "unknowns", "largest u⁺·n (m/s)", "walls (N·s)", "largest p (N·s/m)", "energy before", "change", "volume",
              "surface", "wall", "push", "error of the balance", "residual", "status"],
        rows=rows,
    )  # fmt: skip


def _norms_table(norms: list[Norms]) -> Table:
    return Table(
        caption=f"The square room of {SIDE:g} m on uniform meshes: ∫|∇u⁻|² has no limit, ∫|∇w|² has one.",
        head=["side (m)", "unknowns", "∫|∇u⁻|² (m²/s²)", "∫|∇w|² (m²/s²)"],
        rows=[[n.side, n.unknowns, n.left, n.total] for n in norms],
    )
