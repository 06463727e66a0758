"""Threads that work on one problem together.

They are made for a problem and end with it. What they do does not depend on how many they are: the
work is cut into the same parts for any number of them, and sums of parts are made in one order."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from nscd.compiling.atomics import add_one, look, put, rest
from nscd.compiling.decorators import inner

# Where the numbers of a team are: how many threads, the job, its kind, the next task of it, how many
# have left it, whether it failed, how often threads met, and whether one has ended by an error. Each
# in a line of the cache of its own.
THREADS, JOB, KIND, NEXT, LEFT, FAILED, MET, BROKEN = range(0, 64, 8)
# More threads have nothing to do: crowds are cut into so many parts at most.
MOST = 16
# The kind of the last job: to go home.
HOME = 0


class BrokenOffError(RuntimeError):
    """Another thread of the team ended by an error."""


def control_of(threads: int) -> Any:
    """Make the numbers of a team."""
    control = np.zeros(64, dtype=np.int64)
    control[THREADS] = threads
    return control


@inner
def alone() -> Any:
    """Make the numbers of a team of one."""
    control = np.zeros(64, np.int64)
    control[THREADS] = 1
    return control


@inner
def wait_for(control: Any, values: Any, at: int, least: int) -> None:
    """Wait until values[at] is at least that."""
    looks = 0
    while look(values, at) < least:
        if look(control, BROKEN) != 0:
            raise BrokenOffError
        looks += 1
        rest(looks)


@inner
def meet(control: Any, times: int) -> None:
    """Wait for all threads to have come here so many times."""
    if control[THREADS] > 1:
        add_one(control, MET)
        wait_for(control, control, MET, times * control[THREADS])


@inner
def begin_job(control: Any, kind: int) -> None:
    """Call the others to a job, whose tasks are to be taken by `add_one(control, NEXT)`."""
    control[KIND], control[NEXT], control[LEFT], control[FAILED] = kind, 0, 0, 0
    put(control, JOB, control[JOB] + 1)


@inner
def end_job(control: Any) -> None:
    """Wait for the others to have left a job."""
    wait_for(control, control, LEFT, control[THREADS] - 1)


class Team:
    """Threads for one problem; their number includes the one that asks them.

    called: whether they have been called to jobs"""

    def __init__(self, threads: int) -> None:
        self.threads = min(threads, MOST)
        threads = self.threads
        # some wait for jobs while others meet
        self._pool = ThreadPoolExecutor(2 * (threads - 1)) if threads > 1 else None
        self.called = False
        self._control: Any = None
        self._serving: list[Future[Any]] = []

    def together(self, kernel: Callable[..., Any], *given: Any) -> Any:
        """Call kernel(control, number of the thread, *given) in all threads; what this one got."""
        control = control_of(self.threads)
        if self._pool is None:
            return kernel(control, 0, *given)
        others = [
            self._pool.submit(_guarded, control, kernel, control, me, *given)
            for me in range(1, self.threads)
        ]
        this: Future[Any] = Future()
        try:
            this.set_result(_guarded(control, kernel, control, 0, *given))
        except BaseException as error:
            this.set_exception(error)
        return _result([this, *others])

    def each(self, kernel: Callable[..., Any], given: list[Any]) -> list[Any]:
        """Give kernel(*one) for each of what is given, the threads taking one after the other."""
        if self._pool is None:
            return [kernel(*one) for one in given]
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda one: kernel(*one), given))

    def call(self, control: Any, kernel: Callable[..., Any], *given: Any) -> None:
        """Let the others wait for jobs in kernel(number of the thread, *given), until `leave`."""
        self._control, self.called = control, True
        if self._pool is not None:
            self._serving = [
                self._pool.submit(_guarded, control, kernel, me, *given)
                for me in range(1, self.threads)
            ]

    def leave(self, *, failed: bool) -> None:
        """Send the others home. Raises what ended one of them."""
        serving, self._serving = self._serving, []
        if serving:
            self._control[BROKEN] = self._control[BROKEN] or failed
            self._control[KIND] = HOME
            self._control[JOB] += 1
        if self._pool is not None:
            self._pool.shutdown()
        if serving:
            _raise_of(serving)


ALONE = Team(1)


def _guarded(control: Any, call: Callable[..., Any], *given: Any) -> Any:
    """Call it; the others learn of an error."""
    try:
        return call(*given)
    except BaseException:
        control[BROKEN] = 1
        raise


def _result(threads: list[Future[Any]]) -> Any:
    """The result of the first, or the error that broke off the others."""
    _raise_of(threads)
    return threads[0].result()


def _raise_of(threads: list[Future[Any]]) -> None:
    for one in threads:
        error = one.exception()
        if error is not None and not isinstance(error, BrokenOffError):
            raise error
