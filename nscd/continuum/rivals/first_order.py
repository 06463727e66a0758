"""The first-order macroscopic crowd: the pressure of paper (20), as complementarity and printed."""

from __future__ import annotations

import enum
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from skfem import Mesh

from nscd.arrays import Flags, Floats
from nscd.continuum.active_set import bounded_minimum, factorised, judged
from nscd.continuum.left_velocity import Field
from nscd.continuum.rivals.cells import Cells
from nscd.percussions import Status


class PlaceEquation(enum.StrEnum):
    """Choose how (20) is read; p = 0 on exits and free borders in all three.

    complementarity: p ≥ 0, −Δp ≥ −∇·u_d, ∂ₙp ≥ u_d·n on walls, equalities where p > 0: what a
        crowd does that can be pressed but not pulled.
    equality: −Δp = −∇·u_d, ∂ₙp = u_d·n: walls and people also pull (p < 0).
    printed: −Δp = −∇·u_d, ∂ₙp = 0, so that a crowd that walks into a wall goes through it.
    """

    COMPLEMENTARITY = "complementarity"
    EQUALITY = "equality"
    PRINTED = "printed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstOrderFlow:
    """Hold what (20) gives on a mesh of n vertices and m cells.

    pressure: (n,) m²/s, p, P1: times a uniform density (kg/m²) it is a percussion per length
        (N·s/m) like −½ tr σ of (11), and that over δt a pressure (N/m).
    desired_velocity: (m,d) m/s, the mean of u_d in the cells.
    right_velocity: (m,d) m/s, u⁺ = u_d − ∇p.
    pressed: (n,), the vertices with p > 0 (all but the open border in the two equalities).
    residual: dimensionless, the largest |min(p_i/c_i, r_i)| (|r_i| for an equality) over ‖u_d‖∞,
        recomputed from p; r_i = (∫∇p·∇φ_i − b_i)/∫|∇φ_i| is the speed at which the crowd closes up
        around vertex i, c_i the p that changes it by one.
    status, reason: solved where the residual is within the tolerance, else why not.
    """

    mesh: Mesh
    equation: PlaceEquation
    pressure: Floats
    desired_velocity: Floats
    right_velocity: Floats
    pressed: Flags
    residual: float
    status: Status
    reason: str
    iterations: int
    seconds: float


def first_order_flow(
    mesh: Mesh,
    desired_velocity: ArrayLike | Field,
    *,
    equation: PlaceEquation | str = PlaceEquation.COMPLEMENTARITY,
    tolerance: float = 1e-9,
) -> FirstOrderFlow:
    """Solve (20) with P1 elements.

    desired_velocity: u_d, (d,) m/s, (n,d) one per vertex, a function of points (m,d) → (m,d), or
        (m,d) one per cell, which gives no values on walls and so not the printed form.
    equation: how (20) is read.
    tolerance: dimensionless, of the residual.

    Find p, 0 on exits and free borders, with ∫∇p·∇q = b(q) for all q, or ∫∇p·∇(q − p) ≥ b(q − p)
    for all q ≥ 0 (complementarity: an obstacle problem, by a primal-dual active set), where
    b(q) = ∫u_d·∇q, less ∫u_d·n q over the walls as printed. The complementarity makes u⁺ the
    velocity nearest to u_d in L² among those with ∇·u⁺ ≥ 0 and u⁺·n ≤ 0 on walls, so that
    ∫|u_d|² = ∫|u⁺|² + ∫|∇p|² (Maury, Roudneff-Chupin, Santambrogio, Math. Models Methods Appl. Sci.
    20 (2010) 1787–1821).

    Raises ValueError naming the field for a wrong shape or value, an unknown equation, or a mesh as
    `Cells` refuses it.
    """
    begin = time.perf_counter()
    if equation not in list(PlaceEquation):
        raise ValueError(f"equation: unknown {equation!r}; there are: {', '.join(PlaceEquation)}")
    if not tolerance > 0:
        raise ValueError(f"tolerance: {tolerance}; a positive number is needed")
    equation, cells = PlaceEquation(equation), Cells(mesh)
    pulls = equation is not PlaceEquation.COMPLEMENTARITY
    desired = cells.mean_velocity(desired_velocity, "desired_velocity")
    load = cells.moment(desired)
    if equation is PlaceEquation.PRINTED:
        load = load - cells.wall_flux(desired_velocity, "desired_velocity")
    found = pressure_of(cells, np.ones(mesh.nelements), load, pulls=pulls)
    p = found.pressure
    residual = found.closing / (float(np.abs(desired).max()) or 1.0)
    status, reason = judged(residual, tolerance, "the pressure", found.unsettled)
    return FirstOrderFlow(
        mesh=mesh,
        equation=equation,
        pressure=p,
        desired_velocity=desired,
        right_velocity=desired - cells.gradient(p),
        pressed=~cells.open if pulls else p > 0,
        residual=residual,
        status=status,
        reason=reason,
        iterations=found.iterations,
        seconds=time.perf_counter() - begin,
    )


class Pressed(NamedTuple):
    """Hold a pressure p.

    pressure: (n,).
    closing: m/s, the speed at which a vertex still closes up or is pressed without need.
    iterations: of the active set.
    unsettled: what to say where the active set did not settle, else empty.
    """

    pressure: Floats
    closing: float
    iterations: int
    unsettled: str


def pressure_of(cells: Cells, weight: Floats, load: Floats, *, pulls: bool) -> Pressed:
    """Minimise ½∫w|∇p|² − b·p over P1 fields p that are 0 on the open border.

    weight: (m,), w.
    load: (n,), b.
    pulls: whether p may be negative.

    closing is the largest |min(p_i A_ii/c_i, r_i/c_i)|, |r_i/c_i| if it pulls, with r = Ap − b and
    c_i = ∫|∇φ_i|.
    """
    matrix, inside = cells.stiffness(weight), np.flatnonzero(~cells.open)
    # rows of the identity where p = 0 is given
    keep = sparse.diags_array((~cells.open).astype(np.float64))
    inner = sparse.csc_array(
        keep @ matrix @ keep + sparse.diags_array(cells.open.astype(np.float64))
    )
    inner.eliminate_zeros()
    if pulls:
        p, iterations, unsettled = factorised(inner).solve(keep @ load), 1, ""
    else:
        # the active set bounds from above, so z = −p ≤ 0
        start, most = np.zeros(len(inside), dtype=bool), np.zeros(len(inside))
        found = bounded_minimum(inner, -(keep @ load), inside, most, start=start)
        p = np.where(cells.open, 0.0, 0.0 - found.z)
        iterations, unsettled = found.iterations, found.unsettled
    closing = ((matrix @ p - load) / cells.span)[inside]
    if not pulls:
        closing = np.minimum((p * matrix.diagonal() / cells.span)[inside], closing)
    return Pressed(p, float(np.abs(closing).max(initial=0.0)), iterations, unsettled)
