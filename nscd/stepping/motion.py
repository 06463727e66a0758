"""A rigid crowd in motion: one Moreau–Jean step after another, each an exact contact problem, and the
impulses of contacts over windows of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nscd import _core
from nscd.arrays import Floats, Indices, Mask, count, instance, number, read_only
from nscd.bodies import Snapshot, Walls
from nscd.contacts import NO_WALLS, connected
from nscd.solve import CHOICES
from nscd.stepping.arms import Arms, Neighbours, neighbours


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
        tau, need = self.relaxation_time, "A time > 0 s"
        if self.desired is not None and not number(tau, "relaxation_time", need) > 0:
            raise ValueError(f"relaxation_time: {tau} s. A time > 0 is needed")
        read_only(self.acceleration, (2,), "acceleration")
        for name, value in self.arms._asdict().items() if self.arms else ():
            if not number(value, f"arms: {name}", "A number > 0") > 0:
                raise ValueError(f"arms: {name}: {value}. A number > 0 is needed")


def segments_of(walls: Walls | None) -> _core.Walls:
    """Give walls as the core takes them."""
    return connected(walls or NO_WALLS)


class StepError(RuntimeError):
    """Say that a step has no answer within the tolerance, at what time, with what residual."""


class StepEnergy(NamedTuple):
    """Hold the energies (J) of a step.

    For any percussions p, ½ u⁺·Mu⁺ − ½ u⁻·Mu⁻ = ½(u⁺ + u⁻)·M(u⁺ − u⁻), so that each part of the
    momentum has its work in the mean velocity, and the parts sum to what is gained.

    gained: of the kinetic energy, spins included
    drive, weight, arms: work of the drive, of a body force, of the pushes through arms
    impact, friction: (k,) lost in each contact, along the normal and across; negative where a
        contact gives"""

    gained: float
    drive: float
    weight: float
    arms: float
    impact: Floats
    friction: Floats

    @property
    def error(self) -> float:
        """Compute what is gained and lost beyond the works: rounding."""
        lost = float(self.impact.sum() + self.friction.sum())
        return self.gained + lost - self.drive - self.weight - self.arms


@dataclass(frozen=True, slots=True, eq=False)
class StepReport:
    """Say what a step did.

    neighbours: the k candidates for contact; of both halves of a step that was made in halves
    reaction: (k,) N·s, their percussions along the normal
    friction: (k,) N·s, along t = (−n_y, n_x)
    residual: dimensionless, recomputed
    iterations: of the solver
    repeats: how often contacts were missed
    solver: its name
    arms: who reached whom, and the percussions (N·s) of that along the normal; none without
    energy: J, where the kinetic energy went"""

    neighbours: Neighbours
    reaction: Floats
    friction: Floats
    residual: float
    iterations: int
    repeats: int
    solver: str
    energy: StepEnergy
    arms: tuple[Neighbours, Floats] | None = None


@dataclass(frozen=True, slots=True, eq=False)
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
    is_wall: Mask
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

    def add(self, neighbours: Neighbours, reaction: Floats, friction: Floats | None = None) -> None:
        """Add the reactions, and frictions along (−n_y, n_x), (k,) N·s of one step at its
        neighbours."""
        self._sums.add(*neighbours, reaction, friction)

    def close(self, end: float) -> WindowImpulses:
        """Give the impulses since the last window was closed (or the start); the next window
        begins."""
        sums = self._sums.close()
        is_wall = sums.second >= self._n
        other = np.where(is_wall, sums.second - self._n, sums.second)
        since, self._start = end - self._start, end
        of = sums.normal, sums.gap, sums.impulse, sums.steps
        return WindowImpulses(sums.first, other, is_wall, *of, since, end)


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
    threads: how many cores work on a step, 1 at first; from 10,000 disks on they serve, and change no
    bit.

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
        if not number(step, "step", "A time > 0 s") > 0:
            raise ValueError(f"step: {step} s. A time > 0 is needed")
        if not 0 <= number(restitution, "restitution", "0 ≤ e ≤ 1") <= 1:
            raise ValueError(f"restitution: {restitution}. 0 ≤ e ≤ 1 is needed")
        if number(friction, "friction", "A coefficient ≥ 0") < 0:
            raise ValueError(f"friction: {friction}. A coefficient ≥ 0 is needed")
        if not 1e-14 <= number(tolerance, "tolerance", "Between 1e-14 and 1") < 1:
            raise ValueError(f"tolerance: {tolerance}. Between 1e-14 and 1 is needed")
        instance(snapshot, Snapshot, "snapshot")
        self.position, self.velocity = np.array(snapshot.position), np.array(snapshot.velocity)
        self.spin, self.step = np.array(snapshot.spin), step
        self.radius, self.mass = snapshot.radius, snapshot.mass
        self._walls, push, self.threads = segments_of(walls), push or Push(), 1
        self._desired, self._compound = push.desired, snapshot.compound
        for name, value in (("arms", push.arms), ("period_x", (walls or NO_WALLS).period_x)):
            if value and self._compound is not None:
                raise ValueError(f"{name}: bodies of several disks have none")
        self._law = _core.Law(
            step, push.relaxation_time, *push.acceleration, restitution, friction, tolerance,
            *(push.arms or ()),
        )  # fmt: skip
        self._begin(snapshot, snapshot.time)
        self.position = (walls or NO_WALLS).within(self.position)

    def __repr__(self) -> str:
        return f"<Motion: {len(self.radius)} disks at {self.time:g} s, steps of {self.step:g} s>"

    @property
    def time(self) -> float:
        """Give the time (s) of the state."""
        return self._core.time

    def forget(self) -> None:
        """Begin the next step without the percussions of this one, as a new motion from this state
        does: with friction they are where the search for the next ones begins."""
        self._core.forget()
        if (width := self._compound) is not None:  # they begin anew where their disks are
            state = self.snapshot().joined(width.ids[width.number], inertia=width.inertia)
            self._begin(state, self.time)

    def _begin(self, state: Snapshot, time: float) -> None:
        """Make the core's motion, and take over the bodies of several disks of a state."""
        of = self._compound = state.bodies if self._compound else None
        bodies = (of.as_core_arguments(of.mass), of.motion(state, state.velocity)) if of else ()
        self.velocity = np.array(state.velocity)
        self._core = _core.Motion(self.radius, self.mass, self._walls, self._law, time, *bodies)

    @property
    def overlap(self) -> float:
        """Find the deepest overlap (m) of two disks, or of disk and wall; 0 where none overlap."""
        body = None if self._compound is None else self._compound.number
        gap = neighbours(self.position, self.radius, self._walls, 0.0, body).gap
        return max(0.0, -float(gap.min(initial=0.0)))

    def separate(self) -> float:
        """Push overlapping disks apart, as little as possible (in the masses); return how far the
        one moved most was moved (m). Velocities stay.

        min ½|x|²_M subject to C x ≤ gap, again until nothing overlaps: a full gap in the first step
        would instead throw them apart. Raises StepError if that does not end."""
        self._core.take(self.position, self.velocity, self.spin)
        if (maximum := self._core.separate()) < 0:
            raise StepError("the disks cannot be pushed apart: they do not fit between the walls")
        self._see()
        return maximum

    def _see(self) -> None:
        """Take over the state of the core."""
        of = self._core
        self.position, self.velocity, self.spin = of.position, of.velocity, of.spin

    def snapshot(self) -> Snapshot:
        """Give the state as a snapshot, with ids from 1 on."""
        of = self._compound
        return Snapshot(
            position=self.position, velocity=self.velocity, radius=self.radius, mass=self.mass,
            spin=self.spin, bodies=of and replace(of, centre=self._core.centre),
        )  # fmt: skip

    def advance(self) -> StepReport:
        """Make one step; repeat it with a larger margin where a disk went faster than the margin
        allows for. With friction a step that no solver solves is made in two halves, and those
        again, down to 1/16: another step is another problem. Who is wedged, as at a passage of the own
        width, gets through with radii less 10⁻⁸ of them. Raises StepError where no solver reaches the
        tolerance; the state then stays."""
        self._core.take(self.position, self.velocity, self.spin)
        self._core.threads = count(self.threads, "threads")
        found = self._core.advance(self._desired)
        if not found.solved:
            raise StepError(
                f"t = {found.time:.6g} s: the contacts are not solved: residual "
                f"{found.residual:.1e} where {self._law.tolerance:.1e} was asked"
            )
        self._see()
        works = found.gained, found.drive, found.weight, found.arms, found.impact, found.friction_loss
        names = "reaction", "friction", "residual", "iterations", "repeats"
        return StepReport(
            neighbours=Neighbours.of(found.neighbours),
            **{name: getattr(found, name) for name in names},
            solver=CHOICES[found.method][0],
            energy=StepEnergy(*works),
            arms=(Neighbours.of(found.reached), found.push) if self._law.reach else None,
        )
