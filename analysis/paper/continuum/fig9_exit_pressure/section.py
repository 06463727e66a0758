"""Figure 9: pressure before the exit by the proposed collision and by the first-order model, and
their difference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import curve_fit

from analysis.pages.section import Cell, Claim, Picture, Section, Table, Verdict
from analysis.paper.continuum.exit_room import (
    BODY,
    DENSITY,
    EXIT,
    MESH,
    PERSON,
    ROOM,
    SIDE,
    VOLUME,
    body_mean,
    body_pressure,
    map_of,
    medium,
    solved,
    to_exit,
    warn,
)
from analysis.paper.continuum.fig9_exit_pressure.charts import maps, profiles
from analysis.paper.continuum.fig9_exit_pressure.raw_maximum import raw_maximum
from analysis.support.progress import Progress
from nscd.arrays import Flags, Floats
from nscd.continuum.closed_forms.point_exit import point_sink
from nscd.continuum.collision import CollisionAnswer
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.mesh import mesh_of
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import FirstOrderFlow, PlaceEquation, first_order_flow
from nscd.continuum.space import Space

SPEED = 1.7  # m/s
NEAR, FAR = 1.0, 3.0  # m from the exit
# below this a shape is not called a Gaussian
GAUSSIAN = 0.95


@dataclass(frozen=True, eq=False)
class Room:
    """Both models in the room: (11), and (20) in its three forms; all pressures as percussions
    (N·s/m) at the map's points."""

    answer: CollisionAnswer
    flows: dict[PlaceEquation, FirstOrderFlow]

    @property
    def points(self) -> Floats:
        """(n,2) m."""
        return map_of().points

    @cached_property
    def proposed(self) -> Floats:
        """−½ tr σ of (11) over a body."""
        return body_pressure(self.answer)

    @cached_property
    def first_order(self) -> dict[PlaceEquation, Floats]:
        """ρp of (20) over a body."""
        space, found = self.answer.space, {}
        for equation, flow in self.flows.items():
            values = np.zeros(space.scalar.N)
            values[space.scalar.nodal_dofs[0]] = DENSITY * PERSON * flow.pressure
            found[equation] = body_mean(space, np.asarray(space.scalar.interpolate(values)))
        return found

    @cached_property
    def relative_error(self) -> Floats:
        """|p − ρp of (20)| over the largest p, with (20) as complementarity."""
        other = self.first_order[PlaceEquation.COMPLEMENTARITY]
        error: Floats = np.abs(self.proposed - other) / self.proposed.max()
        return error

    def gaussian(self, within: float = np.inf) -> tuple[Floats, Floats, float]:
        """The best A exp(−r²/2s²) of the distance r (m) from the exit's middle, fitted to the
        points with r ≤ `within`: (A, s), its values everywhere (n,), and R² there."""
        r = np.hypot(*self.points.T)
        chosen = r <= within

        def shape(r: Floats, a: float, s: float) -> Floats:
            value: Floats = a * np.exp(-(r**2) / (2 * s**2))
            return value

        weight = map_of().area[chosen] ** -0.5
        best, _ = curve_fit(
            shape, r[chosen], self.proposed[chosen], p0=(self.proposed.max(), 1.0), sigma=weight
        )
        values: Floats = shape(r, *best)
        return best, values, self.explained(values, chosen)

    @cached_property
    def sink(self) -> Floats:
        """`point_sink` at the points."""
        return point_sink(np.hypot(*self.points.T), SPEED, DENSITY * PERSON, VOLUME * PERSON)

    def explained(self, values: Floats, chosen: Flags | None = None) -> float:
        """R² = 1 − Σ(p − values)²/Σ(p − mean)² of the proposed pressure, weighted by area, at the
        chosen points (n,)."""
        inside = np.ones(len(values), dtype=bool) if chosen is None else chosen
        p, area = self.proposed[inside], map_of().area[inside]
        mean = area @ p / area.sum()
        return float(1 - area @ (p - values[inside]) ** 2 / (area @ (p - mean) ** 2))

    def band(self, values: Floats, least: float, most: float) -> float:
        """Mean over the points between these distances (m) from the exit."""
        inside = (to_exit(self.points) >= least) & (to_exit(self.points) <= most)
        return float(np.average(values[inside], weights=map_of().area[inside]))


def solve_room(mesh: float, warnings: list[str]) -> Room:
    """Both models on one mesh of side `mesh` (m)."""
    triangles, left = mesh_of(ROOM, mesh), toward_exit(ROOM, SPEED)
    answer = solved(Space(triangles), medium(), left, warnings, "(11)")
    flows = {}
    for equation in PlaceEquation:
        flows[equation] = first_order_flow(triangles, left, equation=equation)
        warn(warnings, f"(20), {equation}", flows[equation].status, flows[equation].reason)
    return Room(answer, flows)


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Figure 9 remade: maps and profiles of both pressures, the Gaussian tried, and why no raw
    maximum is published."""
    warnings: list[str] = []
    room = solve_room(mesh, warnings)
    if progress:
        progress("Fig. 9", 0.4)
    raw_table, raw_picture, raw_words = raw_maximum(SPEED, 1.25 * mesh, warnings)
    (height, width), gaussian, good = room.gaussian()
    _, _, close = room.gaussian(FAR)
    middle = room.proposed[np.hypot(*room.points.T).argmin()]
    return Section(
        number="9",
        title="Pressure before the exit: the proposed collision and the first-order model",
        words=[
            "What the paper says: (a) the proposed pressure is a Gaussian, concentrated around the exit; (b) the "
            "pressure of the "
            "first-order model (20) is minimal around the exit, and the velocity largest; (c) their relative error.",
            f"What is computed: the room of Fig. 8, {DENSITY:g} people/m², all want {SPEED:g} m/s toward the exit. Pressure is "
            "p = −½ tr σ of (11), a percussion for each length (N·s/m), as the mean over a body of radius "
            f"{2 * BODY.width:g} m. "
            "(20) gives m²/s; times ρ it is a percussion too, and only so can the two be subtracted.",
            f"What is found for (a): the pressure is largest {_from_jamb(room):.2f} m from a jamb, "
            f"{room.proposed.max():.0f} N·s/m over a body. In the "
            f"middle of the exit it is {middle:.0f}: an exit is free (σn = 0), so that (11) has little pressure "
            "there, as (20) has. "
            f"The best Gaussian ({height:.0f} N·s/m, width {width:.2f} m) has R² = {good:.2f} over the room, and "
            f"{close:.2f} if it is fitted within {FAR:g} m only. For a point exit in a long wall there is a closed form, "
            f"(π/2)U√(k_vρ) = {point_sink(np.zeros(1), SPEED, DENSITY * PERSON, VOLUME * PERSON)[0]:.0f} N·s/m at "
            "the exit and k_v U/r "
            f"far away, an algebraic decay. With nothing fitted it has R² = {room.explained(room.sink):.2f} in this room.",
            _first_order_words(room),
            *raw_words,
        ],
        pictures=[
            Picture(
                name="fig_9_maps",
                caption="(a) Pressure by (11). (b) By (20), as complementarity and as printed, times ρ, on one scale. (c) "
                "|p − ρp of (20)| over the largest p of (11), (20) as complementarity.",
                figure=maps(room.proposed, room.first_order, room.relative_error),
            ),
            Picture(
                name="fig_9_profile",
                caption="Pressure against the distance from the middle of the exit, every point of the room; the "
                "best Gaussian, "
                "and the closed form of (11) for a point exit (not fitted). Right: with logarithmic axes.",
                figure=profiles(
                    np.hypot(*room.points.T),
                    room.proposed,
                    gaussian,
                    room.sink,
                    room.first_order[PlaceEquation.COMPLEMENTARITY],
                ),
            ),
            raw_picture,
        ],
        tables=[_table(room), raw_table],
        differs=[
            "e_d is printed as (x − P)/|x − P|: away from the exit. Here it is (P − x)/|x − P|.",
            "(20) as printed (∂p/∂n = 0, equality) lets people walk into walls; corrected, ∂p/∂n = u_d·n, it pulls (p < 0). As "
            "complementarity p ≥ 0 neither happens. All three are in the table.",
            "The paper subtracts two pressures of different units in Fig. 9c; here (20) is first multiplied by ρ.",
        ],
        claims=_claims(room),
        warnings=warnings,
    )


def _from_jamb(room: Room) -> float:
    """Distance (m) of the largest pressure from the nearer jamb."""
    x, y = room.points[room.proposed.argmax()]
    return float(np.hypot(x, abs(y) - 0.5 * EXIT))


def _first_order_words(room: Room) -> str:
    comp = room.first_order[PlaceEquation.COMPLEMENTARITY]
    printed = room.first_order[PlaceEquation.PRINTED]
    far, wall = (room.points[p.argmax()] for p in (comp, printed))
    return (
        f"What is found for (b): (20) has p = 0 on the exit by its own condition. As complementarity its pressure is largest "
        f"{to_exit(far[None])[0]:.1f} m from the exit, {comp.max():.0f} N·s/m; as printed "
        f"{to_exit(wall[None])[0]:.1f} m away, {printed.max():.0f} N·s/m."
    )


def _fastest(flow: FirstOrderFlow) -> tuple[float, float]:
    """Mean |u⁺| over the triangles within NEAR of the exit, and beyond FAR (m/s)."""
    cells = Cells(flow.mesh)
    middle = flow.mesh.p[:, flow.mesh.t].mean(1).T
    speed, far = np.hypot(*flow.right_velocity.T), to_exit(middle)
    near, away = far <= NEAR, far >= FAR
    return (
        float(np.average(speed[near], weights=cells.measure[near])),
        float(np.average(speed[away], weights=cells.measure[away])),
    )


def _claims(room: Room) -> list[Claim]:
    good, close = room.gaussian()[2], room.gaussian(FAR)[2]
    near, far = room.band(room.proposed, 0.0, NEAR), room.band(room.proposed, FAR, np.inf)
    where = to_exit(room.points[[room.proposed.argmax()]])[0]
    least, speeds = {}, {}
    for equation in (PlaceEquation.PRINTED, PlaceEquation.COMPLEMENTARITY):
        p = room.first_order[equation]
        least[equation] = (room.band(p, 0.0, 0.3) / p.max(), to_exit(room.points[[p.argmax()]])[0])
        speeds[equation] = _fastest(room.flows[equation])
    minimal = [share < 0.25 and place > 0.3 for share, place in least.values()]
    faster = [a > b for a, b in speeds.values()]
    comp, printed = least[PlaceEquation.COMPLEMENTARITY], least[PlaceEquation.PRINTED]
    (a, b), (c, d) = speeds[PlaceEquation.COMPLEMENTARITY], speeds[PlaceEquation.PRINTED]
    return [
        Claim(
            where="3.2.3, Fig. 9a",
            statement="the proposed approach gives a Gaussian form of pressure",
            verdict=_all_or_part([good > GAUSSIAN, close > GAUSSIAN]),
            reason=f"the best Gaussian has R² = {good:.2f} over the room and {close:.2f} within {FAR:g} m; the "
            "closed form for a "
            f"point exit, which falls as 1/r, has {room.explained(room.sink):.2f} over the room with nothing fitted",
        ),
        Claim(
            where="3.2.3, Fig. 9a",
            statement="pressure is concentrated around the exit, and reflects the accumulation of forces near the exit",
            verdict=Verdict.HOLDS if near > 2 * far and where < NEAR else Verdict.FAILS,
            reason=f"{near:.0f} N·s/m on average within {NEAR:g} m, {far:.0f} beyond {FAR:g} m; largest {where:.2f} "
            "m from the exit",
        ),
        Claim(
            where="3.2.3, Fig. 9b",
            statement="in the first-order macroscopic model the pressure is minimal around the exit",
            verdict=_all_or_part(minimal),
            reason=f"within 0.3 m of the exit {comp[0]:.0%} (complementarity) and {printed[0]:.0%} (as printed) of "
            "its largest value, "
            f"which is {comp[1]:.1f} and {printed[1]:.1f} m from the exit; on the exit itself p = 0 is prescribed",
        ),
        Claim(
            where="3.2.3, Fig. 9b",
            statement="consequently, in (20), the velocity is maximum around the exit",
            verdict=_all_or_part(faster),
            reason=f"mean speed within {NEAR:g} m and beyond {FAR:g} m of the exit: {a:.2f} and {b:.2f} m/s "
            f"(complementarity), {c:.2f} "
            f"and {d:.2f} m/s (as printed), where everybody wants {SPEED:g} m/s",
        ),
    ]


def _all_or_part(each: list[bool]) -> Verdict:
    return Verdict.HOLDS if all(each) else Verdict.PARTLY if any(each) else Verdict.FAILS


def _table(room: Room) -> Table:
    fields = {"(11)": room.proposed}
    fields |= {f"ρ·(20), {equation}": p for equation, p in room.first_order.items()}
    status = [str(room.answer.status), *(str(flow.status) for flow in room.flows.values())]
    residual = [room.answer.residual, *(flow.residual for flow in room.flows.values())]
    rows: list[list[Cell]] = []
    for (name, p), state, rest in zip(fields.items(), status, residual, strict=True):
        rows.append(
            [
                name,
                float(p.max()),
                float(to_exit(room.points[[p.argmax()]])[0]),
                float(p.min()),
                room.band(p, 0.0, NEAR),
                room.band(p, FAR, np.inf),
                rest,
                state,
            ]
        )
    return Table(
        caption=f"Pressures over a body as percussions (N·s/m) in the room of {SIDE:g} m; means near and far from the exit.",
        head=["model", "largest", "its distance from the exit (m)", "least", f"mean within {NEAR:g} m",
              f"mean beyond {FAR:g} m", "residual", "status"],
        rows=rows,
    )  # fmt: skip
