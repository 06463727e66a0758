"""One crowd on several threads: the same bits for any number of them, errors that come out, and no
thread that stays."""

import threading

import numpy as np
import pytest

from analysis.library.families import FAMILIES
from nscd import ContactLaw, Snapshot, find_contacts, solve
from nscd.compiling import kernel
from nscd.compiling.team import BrokenOffError, Team, control_of, meet, wait_for
from nscd.problem import impact_problem
from nscd.solvers.cholesky import dissection, parts, tasks
from nscd.solvers.cholesky.factor import factor_of, factorise, solve_factorised
from nscd.solvers.system import system_of

DISKS = 2100
SOLVERS = {"heap": "active_set", "masses": "interior_point"}


@pytest.fixture
def few_are_shared(monkeypatch):
    """Crowds of 500 disks are cut as those of 10,000 are."""
    for module in (dissection, parts, tasks):
        monkeypatch.setattr(module, "SHARED", 500)


@pytest.mark.parametrize("name", SOLVERS)
def test_any_number_of_threads_gives_the_same_bits(name, few_are_shared):
    case = FAMILIES[name](DISKS)
    before = threading.active_count()
    found = [
        solve(case.snapshot, case.contacts, tolerance=1e-10, threads=threads)
        for threads in (1, 2, 3)
    ]
    assert threading.active_count() == before
    alone, *together = found
    assert alone.status == "solved"
    assert alone.solver == SOLVERS[name]
    assert "threads" not in alone.choice
    for answer, threads in zip(together, (2, 3), strict=True):
        assert answer.choice == f"{alone.choice}; {threads} threads"
        for field in ("reaction", "right_velocity", "impulse"):
            np.testing.assert_array_equal(getattr(answer, field), getattr(alone, field))
        assert answer.residual == alone.residual
        assert answer.velocity_error == alone.velocity_error


def test_no_more_threads_are_made_than_there_are_parts():
    assert Team(10**9).threads == parts.PARTS


def test_threads_solve_dissipative_contacts_too(few_are_shared):
    case = FAMILIES["heap"](DISKS)
    law = ContactLaw(dissipation=30.0, tangential_dissipation=10.0)
    found = [solve(case.snapshot, case.contacts, law=law, threads=threads) for threads in (1, 2)]
    assert found[0].status == "solved"
    np.testing.assert_array_equal(found[1].impulse, found[0].impulse)


def test_what_threads_share_is_the_answer_of_one_task(few_are_shared, monkeypatch):
    case = FAMILIES["masses"](DISKS)
    problem = impact_problem(case.snapshot, case.contacts, case.left_velocity, ContactLaw())
    cut, factor = system_of(problem)
    assert len(factor.fronts.tasks.end) > tasks.SUBTREES
    monkeypatch.setattr(tasks, "SHARED", 10**9)
    whole, in_one = system_of(problem)
    assert len(in_one.fronts.tasks.end) == 1
    np.testing.assert_array_equal(in_one.order, factor.order)
    draw = np.random.default_rng(1)
    theta = 10.0 ** draw.uniform(-2, 4, len(problem.first))
    right = draw.normal(size=problem.mass.shape)
    found = []
    for system, some in ((cut, factor), (whole, in_one)):
        assert factorise(system, some, theta)
        x = right.copy()
        solve_factorised(some, x)
        found.append(x)
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-13 * np.abs(found[1]).max())


def test_parts_hold_each_contact_once(few_are_shared):
    case = FAMILIES["heap"](DISKS)
    problem = impact_problem(case.snapshot, case.contacts, case.left_velocity, ContactLaw())
    factor = factor_of(problem)
    part, first = factor.parts, factor.place[problem.first[factor.contact]]
    second = problem.second[factor.contact]
    second = np.where(second >= 0, factor.place[second], first)
    np.testing.assert_array_equal(np.sort(factor.contact), np.arange(len(first)))
    assert len(part.disk) == parts.PARTS + 1
    assert (part.disk[0], part.disk[-1]) == (0, DISKS)
    of = [np.searchsorted(part.disk, place, side="right") - 1 for place in (first, second)]
    for p in range(parts.PARTS):
        within = slice(part.contact[p], part.contact[p + 1])
        assert (of[0][within] == p).all()
        assert (of[1][within] == p).all()
    between = slice(part.contact[-1], None)
    assert (of[0][between] != of[1][between]).all()


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2", None])
def test_a_number_of_threads_that_is_none_is_refused(threads):
    pair = Snapshot(
        position=[[0, 0], [1, 0]], velocity=np.zeros((2, 2)), radius=[0.5, 0.5], mass=[1, 1]
    )
    contacts = find_contacts(pair, tolerance=1e-9)
    with pytest.raises(ValueError, match=r"^threads: .*; 1 or more are needed$"):
        solve(pair, contacts, threads=threads)


@kernel(nogil=True)
def _meet_once(control, me):
    meet(control, 1)
    return me


def _fail_or_meet(who):
    def call(control, me):
        if me == who:
            raise OSError("thread without memory")
        return _meet_once(control, me)

    return call


@pytest.mark.parametrize("who", [0, 1, 2])
def test_an_error_in_a_thread_ends_all_and_comes_out(who):
    team = Team(3)
    assert team.together(_meet_once) == 0
    with pytest.raises(OSError, match="thread without memory"):
        team.together(_fail_or_meet(who))
    team.leave(failed=False)


@kernel(nogil=True)
def _wait_for_ever(control):
    wait_for(control, control, 1, 1)


def test_an_error_of_a_helper_ends_who_waits_for_it_and_comes_out():
    def helper(me):
        raise OSError("thread without memory")

    team, control = Team(2), control_of(2)
    team.call(control, helper)
    with pytest.raises(BrokenOffError):
        _wait_for_ever(control)
    with pytest.raises(OSError, match="thread without memory"):
        team.leave(failed=True)
