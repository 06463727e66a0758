"""A rigid crowd in motion: one Moreau–Jean step after another, each an exact contact problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nscd.arrays import Floats
from nscd.bodies import Snapshot, Walls
from nscd.problem import ContactProblem
from nscd.solvers.ladder import AT_ONCE, COMPILED, climb
from nscd.solvers.task import Answer, Task
from nscd.solvers.thresholds import AT
from nscd.stepping.compiled import LOOSE, REPEATS, Bodies, fastest, freed, missed, stepped
from nscd.stepping.push import Push
from nscd.stepping.report import StepError, StepReport, both
from nscd.stepping.search import Neighbours, neighbours, segments_of

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
    underestimates the true one: disks that do not overlap never do, at any h. With restitution e a
    contact that closes within the step with v⁻ > 0 has C u⁺ ≤ −e v⁻ instead (Moreau's law), unless
    v⁻ is no more than what the drive gives in a step: that contact rests. With friction μ the
    contacts obey Coulomb's law besides, and disks spin, with the moment of inertia m r²/2.

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
            raise ValueError(f"step: {step} s; a time > 0 is needed")
        if not 0 <= restitution <= 1:
            raise ValueError(f"restitution: {restitution}; 0 ≤ e ≤ 1 is needed")
        if not 0 <= friction < np.inf:
            raise ValueError(f"friction: {friction}; a coefficient ≥ 0 is needed")
        if not 1e-14 <= tolerance < 1:
            raise ValueError(f"tolerance: {tolerance}; between 1e-14 and 1 is needed")
        self.position, self.velocity = np.array(snapshot.position), np.array(snapshot.velocity)
        self.spin = np.array(snapshot.spin)
        self.time, self.step = snapshot.time, step
        self.radius, self.mass = np.array(snapshot.radius), np.array(snapshot.mass)
        self._walls = segments_of(walls)
        push = push or Push()
        self._desired = push.desired
        self._share = step / push.relaxation_time if push.desired else 0.0
        self._restitution, self._tolerance, self._friction = restitution, tolerance, friction
        self._gain = step * np.array(push.acceleration)
        self._inertia = 0.5 * self.mass * self.radius**2
        self.forget()

    def __repr__(self) -> str:
        return f"<Motion: {len(self.radius)} disks at {self.time:g} s, steps of {self.step:g} s>"

    def forget(self) -> None:
        """Begin the next step without the percussions of this one, as a new motion from this state
        does: with friction they are where the search for the next ones begins."""
        self._known: tuple[Any, Any] = np.empty(0, np.int64), np.empty((2, 0))

    @property
    def overlap(self) -> float:
        """Find the deepest overlap (m) of two disks, or of disk and wall; 0 where none overlap."""
        near = neighbours(self.position, self.radius, self._walls, 0.0)
        return max(0.0, -float(near.gap.min(initial=0.0)))

    def separate(self) -> float:
        """Push overlapping disks apart, as little as possible (in the masses); return how far the
        one moved most was moved (m). Velocities stay.

        min ½|x|²_M subject to C x ≤ gap, again until nothing overlaps: a full gap in the first step
        would instead throw them apart. Raises StepError if that does not end.
        """
        start = self.position.copy()
        reach = REACH * float(self.radius.mean())
        for _ in range(PUSHES):
            near = neighbours(self.position, self.radius, self._walls, reach)
            if near.gap.min(initial=0.0) >= -TOUCHING * self.radius.mean():
                return float(np.hypot(*(self.position - start).T).max(initial=0.0))
            deepest = -float(near.gap.min())
            problem = _problem(
                near, self.mass, np.zeros_like(start), self.position, near.gap, deepest
            )
            answer, error = _solve(problem, 1e-12)
            if not error <= 1e-8:
                break
            self.position = self.position + answer.velocity
        raise StepError("the disks cannot be pushed apart: they do not fit between the walls")

    def advance(self) -> StepReport:
        """Make one step; repeat it with a larger margin where a disk went faster than the margin
        allows for. With friction a step that no solver solves is made in two halves, and those
        again, down to 1/16: another step is another problem. Raises StepError where no solver
        reaches the tolerance; the state then stays."""
        return self._in_halves(HALVINGS if self._friction else 0)

    def _in_halves(self, halvings: int) -> StepReport:
        """One step, or both halves of it as one."""
        state = self.position, self.velocity, self.spin, self.time, self._known
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
            self.position, self.velocity, self.spin, self.time, self._known = state
            raise
        finally:
            self.step, self._share, self._gain = whole

    def _advance(self) -> StepReport:
        h, a = self.step, self._share
        desired = self._desired(self.position) if self._desired else np.empty((0, 2))
        free, gained = freed(self.velocity, desired, a, self._gain)
        done, velocity = self._at_once(free, gained) or self._by_ladder(free, gained)
        self.velocity = np.ascontiguousarray(velocity[:, :2])
        if self._friction:
            self.spin = np.ascontiguousarray(velocity[:, 2])
            self._known = self._keys(done.neighbours), np.stack([done.reaction, done.friction])
        self.position = self.position + h * self.velocity
        self.time += h
        return done

    def _at_once(self, free: Floats, gained: float) -> tuple[StepReport, Floats] | None:
        """The step by one compiled call; None where that is not for it, or does not solve it."""
        loose, many = self._tolerance >= LOOSE, len(self.mass) >= AT.large
        if self._friction or not len(self.mass) or (not loose and (many or not COMPILED)):
            return None
        bodies = self._bodies(free)
        done = stepped(bodies, self.step, self._restitution, gained, self._tolerance)
        if not done.error <= STALLED * self._tolerance:
            return None
        by = "projected_gradient" if loose else "closed_form"
        if done.rung in AT_ONCE:
            by = AT_ONCE[done.rung].name
        report = StepReport(
            neighbours=done.neighbours,
            reaction=done.reaction,
            friction=np.zeros(len(done.reaction)),
            residual=done.error,
            iterations=done.iterations,
            repeats=done.repeats,
            solver=by,
        )
        return report, done.velocity

    def _by_ladder(self, free: Floats, gained: float) -> tuple[StepReport, Floats]:
        h, bodies = self.step, self._bodies(free)
        margin = 2 * h * max(fastest(free), fastest(self.velocity))
        repeats = -1
        while True:
            repeats += 1
            near = neighbours(self.position, self.radius, self._walls, margin)
            problem = _problem(near, bodies.mass, free, self.position, near.gap / h)
            problem = self._rebounding(problem, near, gained)
            answer, tangential, error = (
                self._rubbing(problem, near) if self._friction else self._smooth(problem)
            )
            if not error <= STALLED * self._tolerance:
                raise StepError(
                    f"t = {self.time:.6g} s: the contacts are not solved: residual {error:.1e} "
                    f"where {self._tolerance:.1e} was asked"
                )
            if repeats == REPEATS or not missed(bodies, answer.velocity, h, margin):
                break
            margin = 2 * h * fastest(answer.velocity)
        report = StepReport(
            neighbours=near,
            reaction=answer.reaction,
            friction=tangential,
            residual=error,
            iterations=answer.iterations,
            repeats=repeats,
            solver=answer.solver,
        )
        return report, answer.velocity

    def _bodies(self, free: Floats) -> Bodies:
        mass = (1 + self._share) * self.mass
        return Bodies(self.position, self.velocity, free, self.radius, mass, self._walls)

    def _smooth(self, problem: ContactProblem) -> tuple[Answer, Floats, float]:
        answer, error = _solve(problem, self._tolerance)
        return answer, np.zeros(len(answer.reaction)), error

    def _rubbing(self, problem: ContactProblem, near: Neighbours) -> tuple[Answer, Floats, float]:
        """The answer with Coulomb's law, velocities with spins (n,3), and its friction (k,) N·s."""
        # slow to import, and most crowds have none
        from nscd.friction import carried_over, problem_of, solve_step

        rubbing = problem_of(
            pairs=(near.first, near.second),
            normal=near.normal,
            friction=np.full(len(near.gap), self._friction),
            radius=self.radius,
            mass=np.column_stack([problem.mass, self._inertia]),
            left=np.column_stack([problem.free, self.spin]),
        )._replace(offset=problem.offset)
        guess = carried_over(*self._known, self._keys(near))
        found = solve_step(rubbing, self.position, guess, self._tolerance)
        answer = Answer(
            found.reaction, found.velocity, found.pairs, least=False, solver=found.solver
        )
        return answer, found.friction, found.error

    def _keys(self, near: Neighbours) -> Any:
        """A number (k,) of each pair, or of each disk and wall."""
        n = len(self.mass)
        other = np.where(near.wall >= 0, n + near.wall.astype(np.int64), near.second)
        return near.first.astype(np.int64) * (n + len(self._walls.start)) + other

    def _rebounding(
        self, problem: ContactProblem, near: Neighbours, gained: float
    ) -> ContactProblem:
        if not self._restitution:
            return problem
        before = problem.approach(self.velocity)
        closing = self.step * problem.approach(problem.free) >= near.gap
        bouncing = closing & (before > 2 * gained) & (before > 0)
        rebound = np.minimum(problem.offset, -self._restitution * before)
        return replace(problem, offset=np.where(bouncing, rebound, problem.offset))


def _problem(
    near: Neighbours,
    mass: Floats,
    free: Floats,
    position: Floats,
    offset: Floats,
    scale: float = 0.0,
) -> ContactProblem:
    """min ½|u − free|² in the masses (n,), subject to C u ≤ offset (k,) m/s."""
    inverse = 1.0 / mass
    weight = inverse[near.first] + np.where(near.second >= 0, inverse[near.second], 0.0)
    none = np.zeros(len(weight))
    tangent = np.column_stack([-near.normal[:, 1], near.normal[:, 0]])
    return ContactProblem(
        first=near.first,
        second=near.second,
        normal_first=near.normal,
        normal_second=-near.normal,
        tangent_first=tangent,
        tangent_second=-tangent,
        normal_weight=none,
        tangent_weight=none,
        mass=np.repeat(mass[:, None], 2, axis=1),
        left=free,
        free=free,
        offset=offset,
        inverse_mass=weight,
        position=position,
        maintained=False,
        least_scale=scale,
    )


def _solve(problem: ContactProblem, tolerance: float) -> tuple[Answer, float]:
    """The answer, any reactions, and its recomputed error."""
    if not len(problem.first):
        return Answer(np.empty(0), problem.free, 0, least=True, solver="none"), 0.0
    task = Task(problem=problem, tolerance=tolerance, canonical=False)
    answer = climb(task, "projected_gradient" if tolerance >= LOOSE else "auto")
    return answer, max(
        problem.residual(answer.reaction, answer.velocity),
        problem.balance_error(answer.reaction, answer.velocity),
    )
