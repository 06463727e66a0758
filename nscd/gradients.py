"""Gradients of right velocities and percussions by the implicit function theorem, on the contacts
that stay open, closed, stuck or sliding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats, Mask, instance, number, read_only
from nscd.bodies import Walls
from nscd.contacts import NO_WALLS
from nscd.percussions import Percussions

# Equations that amplify errors by more than this leave percussions open.
WORST = 1e11


class NoGradientError(ValueError):
    """Say which contact has no margin, or that percussions are not unique."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gradient:
    """Hold the derivatives of a number g by what an impact is given, in units of g.

    position: (n,2) per m; contacts stay contacts
    radius: (n,) per m, of lever and inertia m r²/2 at constant mass; 0 without friction
    left_velocity: (n,2) per m/s, u⁻, which the drive sets
    left_spin: (n,) per rad/s
    wall_start, wall_end: (w,2) per m"""

    position: Floats
    radius: Floats
    left_velocity: Floats
    left_spin: Floats
    wall_start: Floats
    wall_end: Floats


def gradient(
    solution: Percussions,
    walls: Walls | None = None,
    *,
    velocity: ArrayLike | None = None,
    spin: ArrayLike | None = None,
    impulse: ArrayLike | None = None,
    margin: float = 1e-6,
) -> Gradient:
    """Differentiate g = Σ velocity·u⁺ + Σ spin ω⁺ + Σ impulse·p of an answer without dissipation.

    velocity (n,2), spin (n,), impulse (k,2): the weights; 0 where left out. One weight 1 gives the
        gradient of one number
    walls: those of the contacts
    margin: dimensionless, how far each contact must be from another state, as a share of ‖u⁻‖∞

    While each contact stays open (λ = 0), closed (C u⁺ = 0), stuck (T u⁺ = 0) or sliding
    (τ = ±μλ), these equations and M(u⁺ − u⁻) + Cᵀλ + Tᵀτ = 0 define u⁺, λ, τ as smooth
    functions. One solution of their transpose gives all derivatives.

    Only islands of carrying contacts that have a weight count. Raises NoGradientError naming the
    contact that is within the margin of another state, or where percussions of the island are not
    unique: such contacts open by any change. ValueError for an answer that is not of this kind."""
    state = _State(instance(solution, Percussions, "solution"), number(margin, "margin", "A number"))
    n, k = len(state.disks), len(solution.contacts)
    of_u = np.zeros((n, 3))
    of_u[:, :2] = 0.0 if velocity is None else read_only(velocity, (n, 2), "velocity")
    of_u[:, 2] = 0.0 if spin is None else read_only(spin, (n,), "spin")
    of_p = np.zeros((k, 2)) if impulse is None else read_only(impulse, (k, 2), "impulse")
    return state.gradient(of_u, of_p, walls or NO_WALLS)


class _State:
    """An answer by the states of its contacts."""

    def __init__(self, solution: Percussions, margin: float) -> None:
        self.disks, self.contacts = solution.snapshot, solution.contacts
        self.disks.need_disks("gradient")
        self.margin, contacts = margin, self.contacts
        if not solution.residual < 0.1 * margin:
            raise ValueError(
                f"solution: residual {solution.residual:.1e}, where less than {0.1 * margin:.1e} is "
                "needed: give solve a smaller tolerance"
            )
        friction_part = solution.friction
        self.normal, self.across = contacts.normal, contacts.tangent
        self.along = solution.reaction
        self.sideways = friction_part.tangential if friction_part else np.zeros(len(contacts))
        self.friction = friction_part.coefficient if friction_part else np.zeros(len(contacts))
        own = self.along[:, None] * self.normal + self.sideways[:, None] * self.across
        size = float(np.abs(solution.impulse).max(initial=0.0))
        if np.abs(own - solution.impulse).max(initial=0.0) > 1e-9 * size:
            raise ValueError("solution: its contacts dissipate. Gradients are of inelastic ones")
        self.u = np.column_stack([solution.right_velocity, solution.right_spin])
        mass, inertia = self.disks.mass, self.disks.inertia
        self.mass = np.column_stack([mass, mass, inertia])
        zero, n = np.zeros(len(contacts)), len(self.disks)
        first = self.disks.radius[contacts.first]
        other = self.disks.radius[np.where(contacts.is_wall, 0, contacts.second)]
        self.rows_n, self.rows_t = (
            contacts.rows(np.c_[way, one], np.c_[-way, two], n)
            for way, one, two in ((self.normal, zero, zero), (self.across, first, other))
        )  # C and T (k,3n)
        impulses = self.rows_n.T @ self.along + self.rows_t.T @ self.sideways
        left = self.u + impulses.reshape(-1, 3) / self.mass
        self.scale = float(np.abs(left[:, :2]).max(initial=0.0)) or 1.0

    def _islands(self, of_u: Floats, of_p: Floats) -> Mask:
        """The disks (n,) of islands that have a weight; all contacts that carry join disks."""
        carrying = self.along > 0
        label = self.contacts.select(carrying).islands(len(self.disks))
        wanted: Mask = np.array(of_u.any(1))
        wanted[self.contacts.first[of_p.any(1) & carrying]] = True
        return np.isin(label, label[wanted])

    def _check(self, mine: Mask) -> tuple[Mask, Mask]:
        """Which contacts (k,) of some are closed, and which of these stick. Raise NoGradientError
        for one within the margin."""
        w = self.contacts.inverse_mass(self.disks.mass) / self.scale
        speed, sliding = (rows @ self.u.ravel() / self.scale for rows in (self.rows_n, self.rows_t))
        closed, frictional = self.along * w > self.margin, self.friction > 0
        slack = (self.friction * self.along - np.abs(self.sideways)) * w
        stuck = closed & frictional & (slack > self.margin)
        opens = ~closed & (speed < -self.margin)
        slides = closed & frictional & ~stuck & (np.abs(sliding) > self.margin)
        valid = opens | stuck | slides | (closed & ~frictional)
        for bad, what in (
            (~closed & ~opens, "open and closed"),
            (closed & ~valid, "sticking and sliding"),
        ):
            if (bad := bad & mine).any():
                raise NoGradientError(f"{self._named(int(np.argmax(bad)))} is between {what}")
        return closed & mine, stuck & mine

    def _named(self, contact: int) -> str:
        contacts, ids = self.contacts, self.disks.ids
        one, other = ids[contacts.first[contact]], contacts.second[contact]
        wall = f"wall {other + 1}" if contacts.is_wall[contact] else ""
        return f"contact {contact}, of {one} and {wall or ids[other]},"

    def gradient(self, of_u: Floats, of_p: Floats, walls: Walls) -> Gradient:
        """See `gradient`."""
        contacts, inside = self.contacts, self._islands(of_u, of_p)
        pair = np.where(contacts.is_wall, contacts.first, contacts.second)
        mine = inside[contacts.first] | inside[pair]
        closed, stuck = self._check(mine)
        slides = closed & ~stuck & (self.friction > 0)
        ratio = np.where(slides, np.sign(self.sideways) * self.friction, 0.0)
        y, y_n, y_t = self._adjoint(inside, closed, stuck, ratio, of_u, of_p)
        # g's change is −y·(change of the equations), and what weights of p see of normals
        closing, moving = map(contacts.deformation_velocity, (y, self.u))
        of_n = self.along[:, None] * (of_p - closing[:, :2]) - y_n[:, None] * moving[:, :2]
        of_t = self.sideways[:, None] * (of_p - closing[:, :2]) - y_t[:, None] * moving[:, :2]
        of_n += np.column_stack([of_t[:, 1], -of_t[:, 0]])
        position, start, end = self._of_places(of_n, closed, walls)
        turns = np.column_stack([self.sideways, y_t]) * closed[:, None]
        spin = contacts.sum_at_disks(turns, len(self.disks))  # Σ τ and Σ y_t at each disk
        # I = m r²/2 and I (ω⁺ − ω⁻) = −r Σ τ: the change of I adds 2 Σ τ
        radius = y[:, 2] * spin[:, 0] - self.u[:, 2] * spin[:, 1]
        left = self.mass * y
        return Gradient(
            position=position, radius=radius, left_velocity=left[:, :2], left_spin=left[:, 2],
            wall_start=start, wall_end=end,
        )  # fmt: skip

    def _adjoint(
        self, inside: Mask, closed: Mask, stuck: Mask, ratio: Floats, of_u: Floats, of_p: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Solve Kᵀ y = weights of (u, λ, τ) for y (n,3), (k,), (k,), 0 outside.

        In the unknowns √M u the first equations are u + G z = …, B u = 0, with rows of length 1."""
        from scipy.sparse import diags_array, vstack

        root = 1 / np.sqrt(self.mass.ravel())
        size = 1 / np.sqrt(self.contacts.inverse_mass(self.disks.mass))
        rows_n, rows_t = (
            diags_array(size) @ rows @ diags_array(root * np.repeat(inside, 3))
            for rows in (self.rows_n, self.rows_t)
        )
        constraints = vstack([rows_n[closed], rows_t[stuck]]).tocsr()
        impulses = vstack([(rows_n + diags_array(ratio) @ rows_t)[closed], rows_t[stuck]]).tocsr()
        of_n, of_t = (size * (of_p * way).sum(1) for way in (self.normal, self.across))
        of_z = np.concatenate([(of_n + ratio * of_t)[closed], of_t[stuck]])
        right = np.where(np.repeat(inside, 3), root * of_u.ravel(), 0.0)
        y_z = self._solved((impulses @ constraints.T).tocsc(), impulses @ right - of_z)
        y_n, y_t = np.zeros((2, len(self.contacts)))
        y_n[closed], y_t[stuck] = np.split(y_z, [int(closed.sum())])
        y = root * (right - constraints.T @ y_z)
        return y.reshape(-1, 3), size * y_n, size * y_t

    @staticmethod
    def _solved(matrix: Any, right: Floats) -> Floats:
        """Solve, where the equations are not singular."""
        from scipy.sparse.linalg import LinearOperator, onenormest, splu

        if not len(right):
            return right
        try:
            factor = splu(matrix)
            inverse = LinearOperator(
                matrix.shape, factor.solve, lambda v: factor.solve(v, "T"), dtype=np.float64
            )
            condition = onenormest(matrix) * onenormest(inverse)
        except RuntimeError:
            condition = np.inf
        if not condition < WORST:
            raise NoGradientError("the percussions are not unique: contacts are redundant")
        return np.asarray(factor.solve(right))

    def _of_places(
        self, of_n: Floats, closed: Mask, walls: Walls
    ) -> tuple[Floats, Floats, Floats]:
        """Turn derivatives by normals (k,2) into those by positions and ends of walls."""
        contacts, radius = self.contacts, self.disks.radius
        start, end = np.zeros((2, len(walls), 2))
        away = contacts.gap + radius[contacts.first]
        away += np.where(contacts.is_wall, 0.0, radius[contacts.second * ~contacts.is_wall])
        turning = of_n - (of_n * self.normal).sum(1)[:, None] * self.normal
        turning /= away[:, None]
        pairs = (closed & ~contacts.is_wall)[:, None] * turning
        position = contacts.momentum_change(pairs, len(self.disks))
        for c in np.flatnonzero(closed & contacts.is_wall):
            wall, disk, normal = contacts.second[c], contacts.first[c], self.normal[c]
            if wall >= len(walls):
                raise ValueError("walls: those of the contacts are needed")
            along = walls.end[wall] - walls.start[wall]
            length = float(np.hypot(*along))
            along = along / length
            point = self.disks.position[disk] + away[c] * normal
            at = float(walls.shortest((point - walls.start[wall])[None])[0] @ along)
            near = self.margin * radius[disk]
            if abs(normal @ along) * away[c] > near:  # the nearest point is an end
                position[disk] -= turning[c]
                (start if at < 0.5 * length else end)[wall] += turning[c]
            elif not near < at < length - near:
                raise NoGradientError(f"{self._named(int(c))} is at the end of the wall")
            else:
                tilt = -(of_n[c] @ along) / length * normal
                end[wall] += tilt
                start[wall] -= tilt
        return position, start, end
