"""Velocities constant in each cell of a mesh, and gradients of P1 fields: for the rivals of
(11)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from skfem import LinearForm, Mesh

from nscd.arrays import Floats, Mask, numbers, read_only
from nscd.continuum.left_velocity import Field
from nscd.continuum.space import Space, values_at


@LinearForm  # type: ignore[untyped-decorator]
def _flux(q: Any, x: Any) -> Any:
    """∫f q on a boundary."""
    return x.f * q


@dataclass(frozen=True, eq=False)
class Cells:
    """Hold the m cells (lines or straight triangles) of a mesh with a boundary "wall", and "exit"
    or "free" where p = 0.

    Pressures and stresses are P1, velocities constant in a cell: a pair without locking, in which u
    − ∇p is exact.

    Raises ValueError for a curved mesh, one without a wall, or one without exit and free border:
    the pressure of a closed room is known up to a constant only."""

    mesh: Mesh

    def __post_init__(self) -> None:
        if self.mesh.doflocs.shape[1] != self.mesh.nvertices:
            raise ValueError("mesh: curved cells. Straight ones are needed")
        _ = self._space
        if not self.open.any():
            raise ValueError(
                "mesh: no exit and no free border. The pressure would be known up to a constant"
            )

    @cached_property
    def _space(self) -> Space:
        return Space(self.mesh, 1)

    @property
    def dimension(self) -> int:
        """Of the mesh: 1 or 2."""
        return int(self.mesh.dim())

    @cached_property
    def measure(self) -> Floats:
        """(m,) m², the area of each cell (length in one dimension, m)."""
        return np.asarray(self._space.basis.dx.sum(1))

    @cached_property
    def open(self) -> Mask:
        """(n,), the vertices on an exit or a free border, where nothing holds the crowd."""
        vertices = np.zeros(self.mesh.nvertices, dtype=bool)
        for name in ("exit", "free"):
            facets = (self.mesh.boundaries or {}).get(name)
            if facets is not None and len(facets):
                vertices[
                    np.ravel(self.mesh.facets[:, facets] if self.dimension > 1 else facets)
                ] = True
        return vertices

    @cached_property
    def slopes(self) -> list[sparse.csr_array]:
        """For each direction the matrix (m,n) that takes values at the vertices to their P1
        derivative in the cells (1/m)."""
        basis = self._space.scalar
        t, count = self.mesh.t, self.mesh.nelements
        local = [np.asarray(basis.basis[k][0].grad)[:, :, 0] for k in range(len(t))]
        rows, columns = np.tile(np.arange(count), len(t)), t.ravel()
        shape = (count, self.mesh.nvertices)
        return [
            sparse.csr_array((np.concatenate([g[k] for g in local]), (rows, columns)), shape=shape)
            for k in range(self.dimension)
        ]

    @cached_property
    def span(self) -> Floats:
        """(n,) m, ∫|∇φ_i| of each vertex's hat function (1 or 2 in one dimension): a moment
        ∫u·∇φ_i over it is a velocity."""
        squared = sum((matrix.multiply(matrix) for matrix in self.slopes[1:]), self.slopes[0] ** 2)
        return np.asarray(np.sqrt(squared).T @ self.measure)

    def mean_velocity(self, velocity: ArrayLike | Field, name: str) -> Floats:
        """Average a velocity in each cell, (m,d) m/s: (d,), (n,d) one per vertex, (m,d) one per
        cell, or a function.

        Where n = m an array is one per vertex. Raises ValueError, with this name, for another shape
        or a value not finite."""
        n, m, d = self.mesh.nvertices, self.mesh.nelements, self.dimension
        if not callable(velocity):
            shape = np.shape(velocity)
            if shape not in ((d,), (n, d), (m, d)):
                raise ValueError(
                    f"{name}: shape {shape} where ({d},), ({n}, {d}) (vertices), "
                    f"({m}, {d}) (cells) or a function is needed"
                )
            values = read_only(velocity, (-1,) * len(shape), name)
            if shape != (n, d):
                return np.broadcast_to(values, (m, d)).copy()
            return np.asarray(values[self.mesh.t].mean(0))
        basis = self._space.basis
        at_points = values_at(self._space, basis, velocity, name)
        return np.asarray((at_points * basis.dx).sum(2) / self.measure).T

    def wall_flux(self, velocity: ArrayLike | Field, name: str) -> Floats:
        """Integrate ∫u·n φ_i over the walls, (n,) m²/s (m/s in one dimension), of one vector, one
        per vertex, or a function.

        Raises ValueError, with this name, for one per cell, which has no values on walls."""
        edge, n, d = self._space.border("wall"), self.mesh.nvertices, self.dimension
        assert edge is not None
        if not callable(velocity):
            if np.shape(velocity) not in ((d,), (n, d)):
                raise ValueError(
                    f"{name}: values in cells have none on walls. Give ({d},), ({n}, {d}) or a function"
                )
            velocity = np.broadcast_to(numbers(velocity, name), (n, d))
        normal = (values_at(self._space, edge, velocity, name) * np.asarray(edge.normals)).sum(0)
        return np.asarray(_flux.assemble(edge.with_element(self._space.scalar.elem), f=normal))

    def moment(self, velocity: Floats) -> Floats:
        """Integrate ∫u·∇φ_i, (n,), of a velocity (m,d) in the cells."""
        parts = (g.T @ (self.measure * u) for g, u in zip(self.slopes, velocity.T, strict=True))
        return np.asarray(sum(parts))

    def integral(self, values: Floats) -> Floats:
        """Integrate ∫f φ_i, (n,), of the P1 field with values f (n,) at the vertices, lumped:
        f_i ∫φ_i."""
        d = self.dimension
        fraction = np.tile(self.measure / (d + 1), d + 1)
        weight = np.bincount(self.mesh.t.ravel(), fraction, self.mesh.nvertices)
        return np.asarray(values * weight)

    def stiffness(self, weight: Floats) -> sparse.csc_array:
        """Assemble ∫w ∇p·∇q, (n,n), with a weight w (m,) per cell."""
        scale = sparse.diags_array(self.measure * weight)
        parts = [g.T @ scale @ g for g in self.slopes]
        return sparse.csc_array(sum(parts[1:], parts[0]))

    def gradient(self, values: Floats) -> Floats:
        """Take ∇p in the cells, (m,d), of values (n,) at the vertices."""
        return np.stack([g @ values for g in self.slopes], axis=1)
