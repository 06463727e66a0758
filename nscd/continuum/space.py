"""Where w = u⁺ + u⁻ lives: P1 or P2 vector elements, the walls' normal constraints on it, and data
at its points."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse
import skfem

from nscd.arrays import Floats, Indices
from nscd.continuum.left_velocity import Field

# Two walls at a point count as one straight wall when their normals differ by less than this
# (squared sine).
STRAIGHT = 1e-12


class WallPoints(NamedTuple):
    """Hold the c one-sided conditions n·w(x) ≤ g: at each node of each wall, twice in a corner.

    node: (c,), the number of the scalar degree of freedom.
    point: (c,d) m.
    normal: (c,d), out of the room.
    weight: (c,) m, the integral over the wall of the node's shape function (1 in one dimension)."""

    node: Indices
    point: Floats
    normal: Floats
    weight: Floats


@dataclass(frozen=True, eq=False)
class Space:
    """Span vector elements over a mesh.

    mesh: of lines or triangles with boundaries "wall" and, if any, "exit", "free". Curved
        (quadratic) triangle meshes are isoparametric; their walls must be straight.
    order: 1 or 2.

    Raises ValueError for another order, a mesh without a boundary "wall", or one whose wall is
    empty."""

    mesh: skfem.Mesh
    order: int = 1

    def __post_init__(self) -> None:
        if self.order not in (1, 2):
            raise ValueError(f"order: {self.order}. 1 (P1) or 2 (P2) is needed")
        walls = (self.mesh.boundaries or {}).get("wall")
        if walls is None or len(walls) == 0:
            raise ValueError("mesh: no facet is named wall to press the crowd to")

    @property
    def dimension(self) -> int:
        """Of the mesh: 1 or 2."""
        return int(self.mesh.dim())

    @cached_property
    def _scalar(self) -> Any:
        line = self.dimension == 1
        if self.order == 1:
            return skfem.ElementLineP1() if line else skfem.ElementTriP1()
        return skfem.ElementLineP2() if line else skfem.ElementTriP2()

    @cached_property
    def basis(self) -> Any:
        """skfem basis of w; its quadrature is exact for products of two fields with a linear
        density, and more for P1."""
        element = skfem.ElementVector(self._scalar)
        return skfem.Basis(self.mesh, element, intorder=2 * self.order + 2)

    @cached_property
    def scalar(self) -> Any:
        """The scalar basis with the same quadrature points."""
        return self.basis.with_element(self._scalar)

    @cached_property
    def points(self) -> Floats:
        """(elements·q, d) m, the quadrature points, element by element."""
        positions = np.asarray(self.basis.global_coordinates())
        return np.ascontiguousarray(positions.reshape(self.dimension, -1).T)

    @cached_property
    def weights(self) -> Floats:
        """(elements·q,) m^d, what each of the points stands for."""
        return np.asarray(self.basis.dx).ravel()

    def border(self, name: str) -> Any | None:
        """skfem basis of w on the named boundary; None where the mesh has no such facet."""
        facets = (self.mesh.boundaries or {}).get(name)
        if facets is None or len(facets) == 0:
            return None
        return skfem.FacetBasis(
            self.mesh, skfem.ElementVector(self._scalar), facets=facets, intorder=2 * self.order + 2
        )

    @cached_property
    def components(self) -> Indices:
        """(d, nodes), the degree of freedom of component k at scalar node i."""
        one = self.scalar
        table = np.empty((self.dimension, one.N), dtype=np.int64)
        for vector, single in (
            (self.basis.nodal_dofs, one.nodal_dofs),
            (self.basis.facet_dofs, one.facet_dofs),
            (self.basis.interior_dofs, one.interior_dofs),
        ):
            if single is not None and single.size:
                table[:, single[0]] = vector
        return table

    @cached_property
    def nodes(self) -> Floats:
        """(nodes, d) m, the places of the scalar nodes."""
        return np.ascontiguousarray(self.scalar.doflocs.T)

    @cached_property
    def wall(self) -> WallPoints:
        """The one-sided conditions of the walls; neighbouring facets of a straight wall share
        them."""
        edge = self.border("wall")
        assert edge is not None
        facets = edge.find
        length, d = edge.dx.sum(1), self.dimension
        normal = (np.asarray(edge.normals) * edge.dx).sum(2).T / length[:, None]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        ends = self.scalar.nodal_dofs[0][self.mesh.facets[:, facets] if d > 1 else facets[None]].T
        node, normals = ends.ravel(), np.repeat(normal, ends.shape[1], axis=0)
        order = np.argsort(node, kind="stable")
        node, normals = node[order], normals[order]
        # a node of a simple border has at most two wall facets
        straight = np.zeros(len(node), dtype=bool)
        along = (normals[1:] * normals[:-1]).sum(1) > np.sqrt(1 - STRAIGHT)
        straight[1:] = (node[1:] == node[:-1]) & along
        rows = np.empty(len(node), dtype=np.int64)
        rows[order] = np.cumsum(~straight) - 1
        rows = rows.reshape(ends.shape)
        node, normals = node[~straight], normals[~straight]
        if d > 1 and self.order == 2:
            rows = np.column_stack([rows, len(node) + np.arange(len(facets))])
            node = np.concatenate([node, self.scalar.facet_dofs[0][facets]])
            normals = np.concatenate([normals, normal])
        # ∫φ over a facet of length 1: a point, the ends of P1, ends and middle of P2
        fraction = {1: [1.0], 2: [1 / 2, 1 / 2], 3: [1 / 6, 1 / 6, 2 / 3]}[int(rows.size / len(rows))]
        weight = np.zeros(len(node))
        np.add.at(weight, rows, np.outer(length, fraction))
        return WallPoints(node.astype(np.int64), self.nodes[node], normals, weight)

    @cached_property
    def constraints(self) -> sparse.csr_array:
        """(c, unknowns), the matrix C with (Cw)_i = n_i·w at wall point i."""
        wall = self.wall
        columns = self.components[:, wall.node]
        rows = np.tile(np.arange(len(wall.node)), (self.dimension, 1))
        entries = (wall.normal.T.ravel(), (rows.ravel(), columns.ravel()))
        return sparse.csr_array(entries, shape=(len(wall.node), self.basis.N))

    @cached_property
    def local(self) -> tuple[sparse.csc_array, Indices]:
        """(unknowns, unknowns) and (c,): T and s with w = Tz, C T z = z[s]: at wall nodes z holds
        the normal components.

        One wall: w = n z₁ + t z₂. Two walls in a corner: w = N⁻¹z with the rows n₁, n₂ of N."""
        wall, d = self.wall, self.dimension
        columns = self.components[:, wall.node]
        frame = np.empty((len(wall.node), d, d))
        frame[:, :, 0] = wall.normal
        position = columns[0].copy()
        if d == 2:
            frame[:, 0, 1], frame[:, 1, 1] = -wall.normal[:, 1], wall.normal[:, 0]
            twice = np.flatnonzero(wall.node[1:] == wall.node[:-1])
            both = np.stack([wall.normal[twice], wall.normal[twice + 1]], axis=1)
            frame[twice] = np.linalg.inv(both)
            position[twice + 1] = columns[1, twice + 1]
            keep = np.setdiff1d(np.arange(len(wall.node)), twice + 1)
            frame, columns = frame[keep], columns[:, keep]
        row = np.repeat(columns.T[:, :, None], d, axis=2)
        column = np.repeat(columns.T[:, None, :], d, axis=1)
        rest = np.setdiff1d(np.arange(self.basis.N), columns)
        entries = np.concatenate([frame.ravel(), np.ones(len(rest))])
        rows = np.concatenate([row.ravel(), rest])
        matrix = sparse.csc_array((entries, (rows, np.concatenate([column.ravel(), rest]))))
        return matrix, position


def _nodal(space: Space, basis: Any, values: Floats) -> Floats:
    """Values at vertices (n,), linear in between, at the quadrature points (elements, q) of a
    basis."""
    kind = skfem.ElementLineP1 if space.dimension == 1 else skfem.ElementTriP1
    linear = basis.with_element(kind())
    vector = np.empty(linear.N)
    vector[linear.nodal_dofs[0, : len(values)]] = values
    return np.asarray(linear.interpolate(vector))


def values_at(space: Space, basis: Any, field: Field | Floats, name: str) -> Floats:
    """Take a vector field, or vectors (n,d) at the vertices, at the quadrature points of a basis.

    Returns (d, elements, q). Raises ValueError where a function gives another shape than (m,d) or a
    value that is not finite."""
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

    Raises ValueError for another number of values than vertices."""
    if np.ndim(rho) == 0:
        return np.full(space.basis.dx.shape, rho)
    if np.shape(rho) != (space.mesh.nvertices,):
        wanted = f"({space.mesh.nvertices},), one per vertex,"
        raise ValueError(f"density: shape {np.shape(rho)} where {wanted} is needed")
    return _nodal(space, space.basis, np.asarray(rho))


def checked_values(field: Field, points: Floats, name: str) -> Floats:
    """Evaluate a field at points (m,d); ValueError for another shape or a value not finite."""
    values = np.asarray(field(np.ascontiguousarray(points)), dtype=np.float64)
    if values.shape != points.shape:
        shapes = f"{values.shape} where {points.shape} is needed"
        raise ValueError(f"{name}: the function gives shape {shapes}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: the function gives a value that is not finite")
    return values
