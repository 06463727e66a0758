"""A rigid crowd in motion: one Moreau–Jean step after another, each an exact contact problem, and the
impulses of contacts over windows of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nscd import _core
from nscd.arrays import Flags, Floats, Indices
from nscd.bodies import Bodies, Snapshot, Walls
from nscd.contacts import NO_WALLS, Contacts, connected
from nscd.projection import project
from nscd.solve import CHOICES
from nscd.stepping.arms import Arms, Neighbours, neighbours, sum_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Say what moves disks besides their contacts.

    desired: u_d(q) (n,2) m/s of disks at q (n,2) m
    relaxation_time: s, τ, in which a disk alone comes to it
    acceleration: (x, y) m/s², of all
    arms: a soft layer, as a force that is that of the step's start

    Raises ValueError for what is out of range."""

    desired: Callable[[Floats], Floats] | None = None
    relaxation_time: float = np.inf
    acceleration: tuple[float, float] = (0.0, 0.0)
    arms: Arms | None = None

    def __post_init__(self) -> None:
        tau = self.relaxation_time
        if self.desired is not None and not (np.isfinite(tau) and tau > 0):
            raise ValueError(f"relaxation_time: {tau} s. A time > 0 is needed")
        if not np.isfinite(self.acceleration).all():
            raise ValueError(
                f"acceleration: {self.acceleration} m/s². Two finite numbers are needed"
            )


def segments_of(walls: Walls | None) -> _core.Walls:
    """Give walls as the core takes them."""
    return connected(walls or NO_WALLS)


class StepError(RuntimeError):
    """Say that a step has no answer within the tolerance, at what time, with what residual."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepReport:
    """Say what a step did.

    neighbours: the k candidates for contact; of both halves of a step that was made in halves
    reaction: (k,) N·s, their percussions along the normal
    friction: (k,) N·s, along t = (−n_y, n_x)
    residual: dimensionless, recomputed
    iterations: of the solver
    repeats: how often contacts were missed
    solver: its name
    arms: who reached whom, and the percussions (N·s) of that along the normal; none without"""

    neighbours: Neighbours
    reaction: Floats
    friction: Floats
    residual: float
    iterations: int
    repeats: int
    solver: str
    arms: tuple[Neighbours, Floats] | None = None


def both(one: StepReport, other: StepReport) -> StepReport:
    """Two steps as one: all their contacts, the worse of their residuals."""

    def joined(first: Neighbours, second: Neighbours) -> Neighbours:
        pairs: Any = zip(first, second, strict=True)
        return Neighbours(*(np.concatenate(pair) for pair in pairs))

    arms = None
    if one.arms and other.arms:
        pushes = np.concatenate([one.arms[1], other.arms[1]])
        arms = joined(one.arms[0], other.arms[0]), pushes
    return StepReport(
        neighbours=joined(one.neighbours, other.neighbours),
        reaction=np.concatenate([one.reaction, other.reaction]),
        friction=np.concatenate([one.friction, other.friction]),
        residual=max(one.residual, other.residual),
        iterations=one.iterations + other.iterations,
        repeats=one.repeats + other.repeats,
        solver=other.solver,
        arms=arms,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindowImpulses:
    """Hold the impulses of one window, of all that were pressed in it; f = impulse/duration.

    first: (m,) disk
    second: (m,) disk, or wall where is_wall (m,)
    normal, gap: (m,2) unit vector and (m,) m, of the last step in which the contact was pressed
    impulse: (m,2) N·s, of the first on the second
    steps: (m,) in how many steps it was pressed
    duration, end: s"""

    first: Indices
    second: Indices
    is_wall: Flags
    normal: Floats
    gap: Floats
    impulse: Floats
    steps: Indices
    duration: float
    end: float


class WindowSums:
    """Sum the percussions of steps contact by contact until the window is closed."""

    def __init__(self, n: int, start: float = 0.0) -> None:
        self._n = n
        self._start = start
        self._sums = _core.WindowSums(n)

    def add(self, near: Neighbours, reaction: Floats, friction: Floats | None = None) -> None:
        """Add the reactions, and frictions along (−n_y, n_x), (k,) N·s of one step at its
        neighbours."""
        self._sums.add(*near, reaction, friction)

    def close(self, end: float) -> WindowImpulses:
        """Give the impulses since the last window was closed (or the start); the next window
        begins."""
        first, second, normal, gap, impulse, steps = self._sums.close()
        is_wall = second >= self._n
        window = WindowImpulses(
            first=first,
            second=np.where(is_wall, second - self._n, second),
            is_wall=is_wall,
            normal=normal,
            gap=gap,
            impulse=impulse,
            steps=steps,
            duration=end - self._start,
            end=end,
        )
        self._start = end
        return window


# An answer whose recomputed error is this many times what was asked is not used.
STALLED = 10.0
# Bodies that overlap at the start are pushed apart together with all within this many radii.
REACH = 0.3
PUSHES = 20
# A step with friction that has no answer is made in halves, and those again: to 1/2^HALVINGS of it.
HALVINGS = 4
# Overlaps below this share of the mean radius are rounding.
TOUCHING = 1e-12


class Motion:
    """Step rigid disks with a desired-velocity drive, by Moreau–Jean's scheme with the gap in the
    constraint.

    With a = h/τ and a constant acceleration g: u_free = (u + a u_d(q) + h g)/(1 + a), then
    min ½|u⁺ − u_free|² in the masses (1 + a) m, subject to C(q) u⁺ ≤ gap/h, and q ← q + h u⁺.
    The multiplier λ (N·s) is the percussion of the step. Since |x| is convex the linearised gap
    underestimates the true one: disks that do not overlap never do, at any h. With a body force g
    and no drive, q ← q + h (u + u⁺)/2 for all disks whose contacts this suits: free flight and
    sliding are then exact under a constant force. With restitution e a
    contact that closes within the step with v⁻ > 0 has C u⁺ ≤ −e v⁻ instead (Moreau's law), unless
    v⁻ is no more than what the drive gives in a step: that contact rests. With friction μ the
    contacts obey Coulomb's law besides, and disks spin, with the moment of inertia m r²/2. Arms add
    h F(q)/m to u, with their force at the step's start: of first order in h, stable below
    h = 2/ω of the fastest oscillation ω.

    Bodies of several disks turn whatever the friction. The drive acts on their centres, where u_d is
    taken, and not on their spins. A contact of a turning body may overlap by (h ω)²/2 times its
    lever, which the next step takes back; their centres move with u⁺ under a body force too.

    With a period (`Walls.period_x`) positions are those within it.

    position, velocity (n,2) m, m/s; spin (n,) rad/s; time s: the state, changed by each step.

    Sources: Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235; the drive is implicit in u.
    Raises ValueError for a step, relaxation time, tolerance, restitution or friction out of range.
    """

    def __init__(
        self,
        snapshot: Snapshot,
        walls: Walls | None = None,
        *,
        step: float,
        push: Push | None = None,
        restitution: float = 0.0,
        friction: float = 0.0,
        tolerance: float = 1e-8,
    ) -> None:
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"step: {step} s. A time > 0 is needed")
        if not 0 <= restitution <= 1:
            raise ValueError(f"restitution: {restitution}. 0 ≤ e ≤ 1 is needed")
        if not 0 <= friction < np.inf:
            raise ValueError(f"friction: {friction}. A coefficient ≥ 0 is needed")
        if not 1e-14 <= tolerance < 1:
            raise ValueError(f"tolerance: {tolerance}. Between 1e-14 and 1 is needed")
        self.position, self.velocity = np.array(snapshot.position), np.array(snapshot.velocity)
        self.spin = np.array(snapshot.spin)
        self.time, self.step = snapshot.time, step
        self.radius, self.mass = np.array(snapshot.radius), np.array(snapshot.mass)
        self._walls, self._round = segments_of(walls), walls or NO_WALLS
        push = push or Push()
        self._desired = push.desired
        self._share = step / push.relaxation_time if push.desired else 0.0
        self._restitution, self._tolerance, self._friction = restitution, tolerance, friction
        self._gain = step * np.array(push.acceleration)
        self._arms = push.arms
        self._inertia = 0.5 * self.mass * self.radius**2
        self._wide: Bodies | None = None
        self.forget()
        if snapshot.wide is not None:
            self._begin(snapshot)
        if push.arms and self._wide is not None:
            raise ValueError("arms: bodies of several disks have none")
        if self._round.period_x and self._wide is not None:
            raise ValueError("period_x: bodies of several disks have none")
        self.position = self._round.within(self.position)

    def __repr__(self) -> str:
        return f"<Motion: {len(self.radius)} disks at {self.time:g} s, steps of {self.step:g} s>"

    def forget(self) -> None:
        """Begin the next step without the percussions of this one, as a new motion from this state
        does: with friction they are where the search for the next ones begins."""
        self._known: tuple[Any, Any] = np.empty(0, np.int64), np.empty((2, 0))
        if (wide := self._wide) is not None:  # they begin anew where their disks are
            self._begin(self.snapshot().joined(wide.ids[wide.number], inertia=wide.inertia))

    def _begin(self, state: Snapshot) -> None:
        """Take over the bodies of several disks of a state."""
        assert state.bodies is not None
        self._wide, self.velocity = state.bodies, np.array(state.velocity)
        self._moving = self._wide.motion(state, state.velocity)
        self._off = self.position - self._wide.centre[self._wide.number]

    def _turn(self, way: Floats) -> None:
        """Move bodies, and their disks, by the way (b,3) m, m, rad of each."""
        assert self._wide is not None
        number, centre = self._wide.number, self._wide.centre + way[:, :2]
        c, s = np.cos(way[number, 2]), np.sin(way[number, 2])
        x, y = self._off.T
        self._off = np.column_stack([c * x - s * y, s * x + c * y])
        self._wide = replace(self._wide, centre=centre)
        self.position = centre[number] + self._off
        self.velocity = self._wide.of_disks(self._moving, self.position)
        self.spin = self._moving[number, 2]

    @property
    def overlap(self) -> float:
        """Find the deepest overlap (m) of two disks, or of disk and wall; 0 where none overlap."""
        return max(0.0, -float(self._near(0.0).gap.min(initial=0.0)))

    def _near(self, margin: float) -> Neighbours:
        near = neighbours(self.position, self.radius, self._walls, margin)
        if self._wide is None:
            return near
        body = self._wide.number
        apart = (near.second < 0) | (body[near.first] != body[np.maximum(near.second, 0)])
        return Neighbours(*(part[apart] for part in near))

    def separate(self) -> float:
        """Push overlapping disks apart, as little as possible (in the masses); return how far the
        one moved most was moved (m). Velocities stay.

        min ½|x|²_M subject to C x ≤ gap, again until nothing overlaps: a full gap in the first step
        would instead throw them apart. Raises StepError if that does not end."""
        start = self.position.copy()
        reach = REACH * float(self.radius.mean())
        for _ in range(PUSHES):
            near = self._near(reach)
            if near.gap.min(initial=0.0) >= -TOUCHING * self.radius.mean():
                way = self._round.shortest(self.position - start)
                return float(np.hypot(*way.T).max(initial=0.0))
            contacts = Contacts(
                first=near.first.astype(np.int64), second=np.where(near.second < 0, near.wall, near.second),
                is_wall=near.second < 0, normal=near.normal, gap=near.gap,
                point=np.zeros_like(near.normal),
            )  # fmt: skip
            still = np.zeros_like(start if self._wide is None else self._moving)
            moved, error = project(
                self.snapshot(), contacts, still, near.gap,
                scale=-float(near.gap.min()), tolerance=1e-12,
            )  # fmt: skip
            if not error <= 1e-8:
                break
            if self._wide is None:
                self.position = self._round.within(self.position + moved)
            else:
                self._turn(moved)
        raise StepError("the disks cannot be pushed apart: they do not fit between the walls")

    def snapshot(self) -> Snapshot:
        """Give the state as a snapshot, with ids from 1 on."""
        return Snapshot(
            position=self.position, velocity=self.velocity, radius=self.radius, mass=self.mass,
            spin=self.spin, bodies=self._wide,
        )  # fmt: skip

    def advance(self) -> StepReport:
        """Make one step; repeat it with a larger margin where a disk went faster than the margin
        allows for. With friction a step that no solver solves is made in two halves, and those
        again, down to 1/16: another step is another problem. Raises StepError where no solver
        reaches the tolerance; the state then stays."""
        return self._in_halves(HALVINGS if self._friction else 0)

    def _in_halves(self, halvings: int) -> StepReport:
        """One step, or both halves of it as one."""
        names = ("position", "velocity", "spin", "time", "_known", "_wide", "_moving", "_off")
        state = {name: getattr(self, name, None) for name in names}
        whole = self.step, self._share, self._gain
        try:
            return self._advance()
        except StepError:
            if not halvings:
                raise
        self.step, self._share = 0.5 * self.step, 0.5 * self._share
        self._gain = 0.5 * self._gain
        try:
            return both(self._in_halves(halvings - 1), self._in_halves(halvings - 1))
        except StepError:
            for name, value in state.items():
                setattr(self, name, value)
            raise
        finally:
            self.step, self._share, self._gain = whole

    def _advance(self) -> StepReport:
        h, a = self.step, self._share
        place = self.position if self._wide is None else self._wide.centre[self._wide.number]
        desired = self._desired(place) if self._desired else np.empty((0, 2))
        kicked, arms = self.velocity, None
        if self._arms:
            reached, force = self._arms.reached(self.position, self.radius, self._walls)
            arms = reached, h * force
            kicked = kicked + sum_of(*arms, len(self.mass)) / self.mass[:, None]
        free, gained = _core.freed(kicked, desired, a, *self._gain)
        gained += float(np.abs(kicked - self.velocity).max(initial=0.0)) if arms else 0.0
        wide = self._of_bodies(desired) if self._wide is not None else {}
        near, reaction, friction, velocity, spin, keys, error, iterations, rung, repeats = _core.step(
            self.position, self.velocity, free, self.radius, (1 + a) * self.mass, self._walls, h,
            self._restitution, gained, self._tolerance, self._friction, self.spin, self._inertia,
            *self._known, **wide,
        )  # fmt: skip
        if not error <= STALLED * self._tolerance:
            raise StepError(
                f"t = {self.time:.6g} s: the contacts are not solved: residual {error:.1e} "
                f"where {self._tolerance:.1e} was asked"
            )
        done = StepReport(
            neighbours=Neighbours(*near),
            reaction=reaction,
            friction=friction,
            residual=error,
            iterations=iterations,
            repeats=repeats,
            solver="projected_gradient" if rung == _core.GRADIENT else CHOICES[rung][0],
            arms=arms,
        )
        self._known = keys, np.stack([reaction, friction])[:, : len(keys)]
        if wide:
            self._moving = velocity
            self._turn(h * velocity)
            self.time += h
            return done
        before, self.velocity, self.spin = self.velocity, velocity, spin
        self.position = self._round.within(self.position + h * self._drift(before, done))
        self.time += h
        return done

    def _of_bodies(self, desired: Floats) -> dict[str, Any]:
        """What a step is told of bodies of several disks, driven as their first disk is."""
        wide, a = self._wide, self._share
        assert wide is not None
        own = np.empty((0, 2))
        if len(desired):
            own = np.empty((len(wide), 2))
            own[wide.number[::-1]] = desired[::-1]
        centre = np.ascontiguousarray(self._moving[:, :2])
        free = _core.freed(centre, own, a, *self._gain)[0]
        bodies = wide.number, wide.centre, (1 + a) * wide.mass, wide.inertia, self._moving
        return {"bodies": bodies, "unheld": np.column_stack([free, self._moving[:, 2]])}

    def _drift(self, before: Floats, done: StepReport) -> Floats:
        """The velocities (n,2) m/s of the way through a step, from those before it."""
        if self._desired or not self._gain.any():
            return self.velocity
        first, second, _, normal, gap = done.neighbours
        slack = self._tolerance * max(fastest(before), fastest(self.velocity))
        return _core.drifts(
            before, self.velocity, first, second, normal, gap, done.reaction, self.step, slack
        )


def fastest(velocity: Floats) -> float:
    """Find the largest speed (m/s) of velocities (n,2)."""
    return float(np.hypot(*velocity.T).max(initial=0.0))
