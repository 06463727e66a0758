"""What every solver takes and gives: a Task and an Answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Flags, Floats
from nscd.compiling.team import Team
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.factor import Factor, serve, shared
from nscd.solvers.system import System, system_of


class Answer(NamedTuple):
    """Give what a solver found, in the order of the problem.

    reaction: (k,) N·s, λ
    velocity: (n,d) m/s, u⁺, spins in rad/s
    iterations: sweeps, rounds, factorisations
    least: whether λ is known to be the one of least energy (which a unique λ is)
    settled: True if the solver has checked that this is the answer, False if the next rung is to
        start from it, None if the ladder is to measure it
    distance: √kg m/s, a bound of √(Σ m |u − u⁺|²), u⁺ the exact velocities, see `velocity_bound`
    solver, why: the rung of the ladder that gave it

    The last three are filled in by the ladder."""

    reaction: Floats
    velocity: Floats
    iterations: int
    least: bool
    settled: bool | None = None
    distance: float = np.inf
    solver: str = ""
    why: str = ""


class Held(NamedTuple):
    """Name what a factor of Â + CᵀΘC is of. Empty where that is not known.

    theta: (k,) kg
    closed: (k,) the contacts that it holds closed"""

    theta: Floats
    closed: Flags


UNKNOWN = Held(np.empty(0), np.empty(0, dtype=np.bool_))


class Workspace:
    """Make the problem in elimination order and storage for its factors when first asked for.

    held: what the factor in storage is of
    branches: of contacts that form trees, where the solver found them
    team: the threads, for whom `leave` is to be called in the end"""

    def __init__(self, problem: ContactProblem, threads: int) -> None:
        self._problem = problem
        self.team = Team(threads)
        self.held = UNKNOWN
        self.branches: Any = None

    @cached_property
    def both(self) -> tuple[System, Factor]:
        """Make the problem in elimination order, and storage for its factors."""
        system, factor = system_of(self._problem, self.team)
        if shared(factor):
            self.team.call(factor.fronts.shared.control, serve, system, factor)
        return system, factor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """State one problem, and what is asked of its answer.

    problem: k ≥ 1 contacts between n disks
    tolerance: dimensionless, of the residual and the momentum error
    canonical: whether λ is to be the one of least energy where it is not unique
    guess: (k,) N·s, the reactions of a similar problem
    start: where an unsettled rung ended
    forest: whether the contacts are known to form trees
    threads: how many work on one large crowd"""

    problem: ContactProblem
    tolerance: float
    canonical: bool = True
    guess: Floats | None = None
    start: Answer | None = None
    forest: bool = False
    threads: int = 1
    workspace: Workspace = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "workspace", Workspace(self.problem, self.threads))

    @property
    def system(self) -> System:
        """Give the problem as the compiled kernels take it, in elimination order."""
        return self.workspace.both[0]

    @property
    def factor(self) -> Factor:
        """Give the order of elimination, and storage for the factors."""
        return self.workspace.both[1]

    @property
    def team(self) -> Team:
        """Give the threads that work on it."""
        return self.workspace.team

    def part(self, contacts: Flags, disks: Flags, *, forest: bool) -> Task:
        """Restrict the task to some contacts (k,) and the disks (n,) that they are between."""
        whole, start = bool(contacts.all() and disks.all()), self.start
        return replace(
            self,
            problem=self.problem if whole else self.problem.restricted(contacts, disks),
            guess=None if self.guess is None else self.guess[contacts],
            start=None
            if start is None
            else start._replace(reaction=start.reaction[contacts], velocity=start.velocity[disks]),
            forest=forest,
        )

    def after(self, answer: Answer) -> Task:
        """Hand an unsettled answer on: the same task, to be started from there."""
        task = replace(self, start=answer)
        object.__setattr__(task, "workspace", self.workspace)
        return task

    def answer(
        self, reaction: Floats, velocity: Floats, iterations: int, *, least: bool = False
    ) -> Answer:
        """Put reactions (k,) and velocities (n,d) from elimination order into that of the
        problem."""
        unordered, right = np.empty_like(reaction), np.empty_like(velocity)
        unordered[self.factor.contact], right[self.factor.order] = reaction, velocity
        return Answer(unordered, right, iterations, least)

    def refuse_dissipation(self, name: str) -> None:
        """Raise ValueError, naming the solver, where contacts dissipate."""
        if self.problem.dissipative:
            raise ValueError(f"solver: {name} is for contacts without dissipation")

    def error(self, answer: Answer) -> float:
        """Measure an answer: the larger of its residual and its momentum error, dimensionless."""
        residual = self.problem.residual(answer.reaction, answer.velocity)
        return max(residual, self.problem.balance_error(answer.reaction, answer.velocity))


Solver = Callable[[Task], Answer]
