"""The integrals of the collision problem, and data at the points where they are taken."""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem import BilinearForm, ElementLineP1, ElementTriP1, Functional, LinearForm
from skfem.helpers import ddot, dot, sym_grad

from nscd.arrays import Floats
from nscd.continuum.left_velocity import Field
from nscd.continuum.space import Space


@BilinearForm  # type: ignore[untyped-decorator]
def volume(u: Any, v: Any, x: Any) -> Any:
    """∫ρ u·v + k_v D(u):D(v)."""
    return x.rho * dot(u, v) + x.k_v * ddot(sym_grad(u), sym_grad(v))


@BilinearForm  # type: ignore[untyped-decorator]
def surface(u: Any, v: Any, x: Any) -> Any:
    """∫k_s u·v on a boundary."""
    return x.k_s * dot(u, v)


@LinearForm  # type: ignore[untyped-decorator]
def momentum(v: Any, x: Any) -> Any:
    """∫ρ u·v."""
    return x.rho * dot(x.u, v)


@LinearForm  # type: ignore[untyped-decorator]
def traction(v: Any, x: Any) -> Any:
    """∫r·v on a boundary."""
    return dot(x.r, v)


@Functional  # type: ignore[untyped-decorator]
def dissipated(x: Any) -> Any:
    """∫k_v |D(w)|²."""
    return x.k_v * ddot(sym_grad(x.w), sym_grad(x.w))


@Functional  # type: ignore[untyped-decorator]
def gain(x: Any) -> Any:
    """½∫ρ(|w − u|² − |u|²), the change of kinetic energy from u⁻ = u to u⁺ = w − u."""
    right = np.asarray(x.w) - x.u
    return 0.5 * x.rho * (dot(right, right) - dot(x.u, x.u))


def _linear(space: Space) -> Any:
    return ElementLineP1() if space.dimension == 1 else ElementTriP1()


def _nodal(space: Space, basis: Any, values: Floats) -> Floats:
    """Values at vertices (n,), linear in between, at the quadrature points (elements, q) of a
    basis."""
    linear = basis.with_element(_linear(space))
    vector = np.empty(linear.N)
    vector[linear.nodal_dofs[0, : len(values)]] = values
    field: Floats = np.asarray(linear.interpolate(vector))
    return field


def values_at(space: Space, basis: Any, field: Field | Floats, name: str) -> Floats:
    """Take a vector field, or vectors (n,d) at the vertices, at the quadrature points of a basis.

    Returns (d, elements, q). Raises ValueError where a function gives another shape than (m,d) or a
    value that is not finite.
    """
    if not callable(field):
        return np.stack([_nodal(space, basis, component) for component in field.T])
    points = np.asarray(basis.global_coordinates())
    values = checked_values(field, points.reshape(len(points), -1).T, name)
    return np.ascontiguousarray(values.T.reshape(points.shape))


def nodal_values(space: Space, field: Field | Floats, name: str) -> Floats:
    """Take a vector field, or vectors (n,d) at the vertices, at the nodes of a space, (nodes,d)."""
    if callable(field):
        return checked_values(field, space.nodes, name)
    if space.order == 1:
        return field.copy()
    one, mesh = space.scalar, space.mesh
    values = np.empty((one.N, space.dimension))
    values[one.nodal_dofs[0]] = field
    if space.dimension == 1:
        values[one.interior_dofs[0]] = field[mesh.t].mean(0)
    else:
        values[one.facet_dofs[0]] = field[mesh.facets].mean(0)
    return values


def density_at(space: Space, rho: float | Floats) -> Floats:
    """Take a density, one number or (n,) one per vertex, at the quadrature points (elements, q).

    Raises ValueError for another number of values than vertices.
    """
    if np.ndim(rho) == 0:
        return np.full(space.basis.dx.shape, rho)
    if np.shape(rho) != (space.mesh.nvertices,):
        raise ValueError(
            f"density: shape {np.shape(rho)} where ({space.mesh.nvertices},), one per vertex, is "
            "needed"
        )
    return _nodal(space, space.basis, np.asarray(rho))


def checked_values(field: Field, points: Floats, name: str) -> Floats:
    """Evaluate a field at points (m,d); ValueError for another shape or a value not finite."""
    values = np.asarray(field(np.ascontiguousarray(points)), dtype=np.float64)
    if values.shape != points.shape:
        raise ValueError(
            f"{name}: the function gives shape {values.shape} where {points.shape} is needed"
        )
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: the function gives a value that is not finite")
    return values
