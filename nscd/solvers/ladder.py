"""The ladder of solvers: which there are, when each serves, and the climb to an answer.

A new solver is one file with a function Task → Answer and one line here: see
docs/how_to/solver.md."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from nscd.solvers import at_once
from nscd.solvers.active_set import active_set, correct_guess, descend_and_close
from nscd.solvers.canonical import canonical as least_energy
from nscd.solvers.closed_form import closed_form
from nscd.solvers.closing import maintained
from nscd.solvers.dissipation import balanced
from nscd.solvers.gauss_seidel import gauss_seidel
from nscd.solvers.interior.interior_point import interior_point
from nscd.solvers.projected_gradient import projected_gradient
from nscd.solvers.system import even
from nscd.solvers.task import Answer, Solver, Task
from nscd.solvers.tree import tree
from nscd.solvers.velocity_error import rounding_bound, velocity_bound


class Rung(NamedTuple):
    """Hold a line of the ladder.

    name: of the solver
    serves: on which tasks it is tried
    solve: the solver
    why: what its answer says of the choice, {n} being the number of disks"""

    name: str
    serves: Callable[[Task], bool]
    solve: Solver
    why: str


def _asked(task: Task) -> bool:
    return True


def _trees(task: Task) -> bool:
    return task.forest and not task.problem.dissipative


def _guessed(task: Task) -> bool:
    return task.guess is not None


def _dissipative(task: Task) -> bool:
    return task.problem.dissipative


def _uneven(task: Task) -> bool:
    return not task.problem.dissipative and not even(task.problem.inverse_mass)


def _even(task: Task) -> bool:
    return not task.problem.dissipative and even(task.problem.inverse_mass)


def _even_so_far(task: Task) -> bool:
    return task.start is None and _even(task)


TREES = Rung("tree", _trees, tree, "the contacts of {n} disks form trees: linear time")
UNEVEN = Rung("interior_point", _uneven, interior_point, "{n} disks, masses far apart")
DESCENT = Rung(
    "active_set",
    _even_so_far,
    descend_and_close,
    "{n} disks of even masses: descent found the closed contacts",
)
MARGINAL = Rung(
    "interior_point",
    _even,
    interior_point,
    "{n} disks: descent does not find the closed contacts exactly",
)
# What nobody presses and single contacts are answered before: see `closed_form`. Of the rungs that
# serve, the first whose answer is within the tolerance has it; the last one's is given in any case.
RUNGS = [
    TREES,
    Rung("active_set", _guessed, correct_guess, "corrects the guess"),
    Rung("interior_point", _dissipative, interior_point, "{n} disks, dissipative contacts"),
    UNEVEN,
    DESCENT,
    MARGINAL,
]
# The rungs that the compiled call of `solve_small` stands for, and what it is not asked for; whether
# it stands for the climb, no rung being added before the last of them.
AT_ONCE = {
    at_once.TREES: TREES,
    at_once.UNEVEN: UNEVEN,
    at_once.DESCENT: DESCENT,
    at_once.MARGINAL: MARGINAL,
}
ELSEWHERE = (_guessed, _dissipative)
COMPILED = all(
    rung in AT_ONCE.values() or rung.serves in ELSEWHERE for rung in RUNGS[: RUNGS.index(MARGINAL)]
)
# Solvers that can be asked for by name.
BY_NAME: dict[str, Solver] = {
    "interior_point": interior_point,
    "active_set": active_set,
    "projected_gradient": projected_gradient,
    "gauss_seidel": gauss_seidel,
}
SOLVERS = ("auto", *BY_NAME)


def choose(task: Task, solver: str = "auto") -> list[Rung]:
    """List the rungs that serve a task, the cheapest first; the one asked for by name alone."""
    if task.problem.maintained:
        return [Rung("maintained", _asked, maintained, "every contact stays closed")]
    if solver != "auto":
        return [Rung(solver, _asked, BY_NAME[solver], "asked for")]
    return [rung for rung in RUNGS if rung.serves(task)]


def climb(task: Task, solver: str = "auto") -> Answer:
    """Solve a task by the named solver, or by the cheapest rung that serves.

    Islands that nothing presses and single contacts are answered at once, the others together.
    Raises ValueError where the named solver is not for such contacts."""
    if not len(task.problem.first):
        free = task.problem.free
        none = np.empty(0)
        return Answer(none, free, 0, True, None, 0.0, "none", "no contacts")
    if solver != "auto" or task.problem.maintained:
        return _climb(task, choose(task, solver))
    answer, rest = closed_form(task)
    if not rest.contacts.any():
        return answer._replace(distance=rounding_bound(task.problem, answer))
    part = task.part(rest.contacts, rest.disks, forest=rest.forest)
    whole = part.problem is task.problem
    beside = 0.0 if whole else rounding_bound(task.problem, answer)
    found = _climb(part, choose(part))
    reaction, velocity = answer.reaction, answer.velocity
    reaction[rest.contacts], velocity[rest.disks] = found.reaction, found.velocity
    distance = float(np.hypot(found.distance, beside))
    return found._replace(reaction=reaction, velocity=velocity, distance=distance)


def _climb(task: Task, rungs: list[Rung]) -> Answer:
    try:
        answer = _tried(task, rungs)
    except BaseException:
        task.team.leave(failed=True)
        raise
    task.team.leave(failed=False)
    return answer


def _tried(task: Task, rungs: list[Rung]) -> Answer:
    for rung in rungs:
        answer, last = rung.solve(task), rung is rungs[-1]
        if answer.settled is False and not last:
            task = task.after(answer)
            continue
        answer = answer._replace(distance=velocity_bound(task, answer))
        answer = balanced(task, answer)
        if task.canonical:
            answer = least_energy(task, answer)
        if last or answer.settled or task.error(answer) <= task.tolerance:
            break
    why = rung.why.format(n=len(task.problem.mass))
    if task.team.called:
        why += f"; {task.team.threads} threads"
    return answer._replace(solver=rung.name, why=why)
