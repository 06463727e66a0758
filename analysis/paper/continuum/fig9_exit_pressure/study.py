"""Fig. 9: both models in the room before the exit, and largest pressures on ever finer meshes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import curve_fit

from analysis.paper.answers import Answer
from analysis.paper.continuum.exit_room import (
    BODY,
    EXIT,
    ROOM,
    body_mean,
    body_pressure,
    from_exit,
    map_of,
    to_exit,
)
from nscd.arrays import Flags, Floats
from nscd.continuum.closed_forms.point_exit import point_sink
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.left_velocity import toward_exit
from nscd.continuum.medium import table_1_medium
from nscd.continuum.mesh import mesh_of
from nscd.continuum.pressure import LargestPressure, largest_pressures
from nscd.continuum.rivals.cells import Cells
from nscd.continuum.rivals.first_order import FirstOrderFlow, PlaceEquation, first_order_flow
from nscd.continuum.space import Space

SPEED = 1.7  # m/s
CROWD = table_1_medium()
NEAR, FAR, AT_EXIT = 1.0, 3.0, 0.3  # m from the exit
HALVINGS = 3


@dataclass(frozen=True, eq=False)
class Field:
    """A pressure in the room.

    name: of the model.
    pressure: (n,) N·s/m at the map's points, a percussion per length.
    answer: status, reason and residual.
    """

    name: str
    pressure: Floats
    answer: CollisionAnswer | FirstOrderFlow

    @property
    def largest(self) -> float:
        """N·s/m."""
        return float(self.pressure.max())

    @property
    def from_exit(self) -> float:
        """m, the distance of the largest from the exit."""
        return from_exit(self.pressure)

    def band(self, least: float, most: float = np.inf) -> float:
        """Average over the points between these distances (m) from the exit, N·s/m."""
        distance = to_exit(map_of().points)
        inside = (distance >= least) & (distance <= most)
        return float(np.average(self.pressure[inside], weights=map_of().area[inside]))

    @property
    def at_exit(self) -> float:
        """Mean within AT_EXIT of the exit, as a share of the largest."""
        return self.band(0.0, AT_EXIT) / self.largest

    @property
    def speeds(self) -> tuple[float, float]:
        """m/s, mean |u⁺| of (20) over the triangles within NEAR of the exit, and beyond FAR."""
        assert isinstance(self.answer, FirstOrderFlow)
        flow, cells = self.answer, Cells(self.answer.mesh)
        far = to_exit(flow.mesh.p[:, flow.mesh.t].mean(1).T)
        speed = np.hypot(*flow.right_velocity.T)
        near, away = (
            float(np.average(speed[some], weights=cells.measure[some]))
            for some in (far <= NEAR, far >= FAR)
        )
        return near, away


@dataclass(frozen=True, eq=False)
class Fit:
    """A Gaussian A exp(−r²/2s²) of the distance r from the exit's middle.

    height, width: A, N·s/m, and s, m.
    values: (n,) N·s/m at the map's points.
    explained: R² at the points that it was fitted to.
    """

    height: float
    width: float
    values: Floats
    explained: float


@dataclass(frozen=True, eq=False)
class Pressures:
    """The room by (11), and by (20) in its three forms, times ρ."""

    answer: CollisionAnswer
    flows: dict[PlaceEquation, FirstOrderFlow]

    @cached_property
    def proposed(self) -> Field:
        """−½ tr σ of (11) over a body."""
        return Field("(11)", body_pressure(self.answer), self.answer)

    @cached_property
    def first_order(self) -> dict[PlaceEquation, Field]:
        """ρp of (20) over a body."""
        space, found = self.answer.space, {}
        for equation, flow in self.flows.items():
            values = np.zeros(space.scalar.N)
            values[space.scalar.nodal_dofs[0]] = CROWD.rho * flow.pressure
            pressure = body_mean(space, np.asarray(space.scalar.interpolate(values)))
            found[equation] = Field(f"ρ·(20), {equation}", pressure, flow)
        return found

    @property
    def complementarity(self) -> Field:
        """(20) with p ≥ 0."""
        return self.first_order[PlaceEquation.COMPLEMENTARITY]

    @property
    def printed(self) -> Field:
        """(20) as it stands in the paper."""
        return self.first_order[PlaceEquation.PRINTED]

    @property
    def fields(self) -> list[Field]:
        """All of them."""
        return [self.proposed, *self.first_order.values()]

    @property
    def relative_error(self) -> Floats:
        """(n,), |p − ρp of (20)| over the largest p, with (20) as complementarity."""
        other, p = self.complementarity.pressure, self.proposed.pressure
        error: Floats = np.abs(p - other) / p.max()
        return error

    @property
    def radius(self) -> Floats:
        """(n,) m, the distance from the middle of the exit."""
        radius: Floats = np.hypot(*map_of().points.T)
        return radius

    @property
    def from_jamb(self) -> float:
        """m, the distance of the largest pressure from the nearer jamb."""
        x, y = map_of().points[self.proposed.pressure.argmax()]
        return float(np.hypot(x, abs(y) - 0.5 * EXIT))

    @property
    def in_the_exit(self) -> float:
        """N·s/m, the pressure in the middle of the exit."""
        return float(self.proposed.pressure[self.radius.argmin()])

    def gaussian(self, within: float = np.inf) -> Fit:
        """Fit a Gaussian to the points with r ≤ `within` (m)."""
        r, p = self.radius, self.proposed.pressure
        chosen = r <= within

        def shape(r: Floats, a: float, s: float) -> Floats:
            value: Floats = a * np.exp(-(r**2) / (2 * s**2))
            return value

        weight = map_of().area[chosen] ** -0.5
        best, _ = curve_fit(shape, r[chosen], p[chosen], p0=(p.max(), 1.0), sigma=weight)
        height, width = map(float, best)
        values = shape(r, height, width)
        return Fit(height, width, values, self.explained(values, chosen))

    @cached_property
    def sink(self) -> Floats:
        """(n,) N·s/m, the closed form of (11) for a point exit."""
        return point_sink(self.radius, SPEED, float(CROWD.rho), CROWD.k_v)

    def explained(self, values: Floats, chosen: Flags | None = None) -> float:
        """R² = 1 − Σ(p − values)²/Σ(p − mean)², weighted by area, at the chosen points (n,)."""
        inside = np.ones(len(values), dtype=bool) if chosen is None else chosen
        p, area = self.proposed.pressure[inside], map_of().area[inside]
        mean = area @ p / area.sum()
        return float(1 - area @ (p - values[inside]) ** 2 / (area @ (p - mean) ** 2))

    @property
    def answers(self) -> list[tuple[str, Answer]]:
        """All answers, named."""
        return [("(11)", self.answer), *((f"(20), {e}", flow) for e, flow in self.flows.items())]


def solve_room(mesh: float) -> Pressures:
    """Solve both models on one mesh of side `mesh` (m)."""
    triangles, left = mesh_of(ROOM, mesh), toward_exit(ROOM, SPEED)
    return Pressures(
        collide(Space(triangles), CROWD, left),
        {e: first_order_flow(triangles, left, equation=e) for e in PlaceEquation},
    )


@dataclass(frozen=True, eq=False)
class RawMaxima:
    """Largest pressures, in any triangle and over a body, on ever finer meshes.

    uniform, graded: meshes of one side, and those that are graded to the jambs.
    """

    uniform: Sequence[LargestPressure]
    graded: Sequence[LargestPressure]

    @property
    def growth(self) -> float:
        """Mean factor of the raw maximum per halving of uniform meshes."""
        return float((self.uniform[-1].raw / self.uniform[0].raw) ** (1 / HALVINGS))

    @property
    def unsettled(self) -> float:
        """Relative change of the mean over a body at the last halving of graded meshes."""
        return self.graded[-1].body / self.graded[-2].body - 1


def raw_maxima(size: float) -> RawMaxima:
    """Take largest pressures on meshes of the sides 2·size, size, … (m)."""
    sizes = [2 * size / 2**k for k in range(HALVINGS + 1)]
    left = toward_exit(ROOM, SPEED)
    return RawMaxima(
        largest_pressures(ROOM, CROWD, left, BODY, sizes, grading=1.0),
        largest_pressures(ROOM, CROWD, left, BODY, sizes[:-1], grading=0.4),
    )
