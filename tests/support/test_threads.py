"""One crowd on several threads: the same bits for any number of them, and no thread that stays."""

import functools
import os

import numpy as np
import pytest

from benchmarks.problems.families import FAMILIES
from nscd import ContactLaw, _core, find_contacts, solve
from tests.crowds import disks_at

DISKS = 2100
SOLVERS = {"heap": "active_set", "masses": "interior_point"}


@pytest.fixture
def few_are_shared(monkeypatch):
    """Crowds of 500 disks are cut as those of 10,000 are."""
    shared = functools.partial(_core.solve_impact, shared=500)
    monkeypatch.setattr(_core, "solve_impact", shared)


@pytest.mark.parametrize("name", SOLVERS)
def test_any_number_of_threads_gives_the_same_bits(name, few_are_shared):
    case = FAMILIES[name](DISKS)
    before = len(os.listdir("/proc/self/task"))
    found = [
        solve(case.snapshot, case.contacts, tolerance=1e-10, threads=threads)
        for threads in (1, 2, 3)
    ]
    assert len(os.listdir("/proc/self/task")) == before
    alone, *combined = found
    assert alone.status == "solved"
    assert alone.solver == SOLVERS[name]
    assert "threads" not in alone.choice
    for solution, threads in zip(combined, (2, 3), strict=True):
        assert solution.choice == f"{alone.choice}, {threads} threads"
        for field in ("reaction", "right_velocity", "impulse"):
            np.testing.assert_array_equal(getattr(solution, field), getattr(alone, field))
        assert solution.residual == alone.residual
        assert solution.velocity_error == alone.velocity_error


def test_threads_solve_dissipative_contacts_too(few_are_shared):
    case = FAMILIES["heap"](DISKS)
    law = ContactLaw(dissipation=30.0, tangential_dissipation=10.0)
    found = [solve(case.snapshot, case.contacts, law=law, threads=threads) for threads in (1, 2)]
    assert found[0].status == "solved"
    np.testing.assert_array_equal(found[1].impulse, found[0].impulse)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2", None])
def test_a_number_of_threads_that_is_none_is_refused(threads):
    pair = disks_at([[0, 0], [1, 0]], radius=0.5, mass=1)
    contacts = find_contacts(pair, tolerance=1e-9)
    with pytest.raises(ValueError, match=r"^threads: .*\. 1 or more are needed$"):
        solve(pair, contacts, threads=threads)
