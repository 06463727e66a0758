"""Solvers on a case, each in a process of its own with a limit: attempts in, the attempt that counts
out."""

import contextlib
import multiprocessing
import os
import resource
import signal
import time
from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

from benchmarks.cases import Solver, accuracy, scaled
from benchmarks.contest.peers import EVERYONE, MISSING, Peer
from benchmarks.machine import ONE_THREAD, repeats, timed
from benchmarks.problems.families import Case

TARGET, NEAR = 1e-10, 1e-8


class Attempt(NamedTuple):
    """One solve that was asked for a tolerance, or for a number of iterations (≥ 1): CPU seconds,
    recomputed residual, whether the solver's own u was used, iterations (0: not said), memory
    beyond what the process had before (MB), u⁺ (2n,) m/s and λ (k,) N·s."""

    variant: str
    requested: float
    seconds: float
    residual: float
    own: bool
    iterations: int
    peak_MB: float  # noqa: N815  (megabyte)
    velocity: Any
    reaction: Any


class Outcome(NamedTuple):
    """A solver's attempts on a case, and why there are no more of them, if there is a reason."""

    solver: str
    attempts: list[Attempt]
    ended: str

    @property
    def best(self) -> Attempt | None:
        """The fastest attempt at 1e-10; else the fastest at 1e-8; else the most exact."""
        for enough in (TARGET, NEAR):
            good = [attempt for attempt in self.attempts if attempt.residual <= enough]
            if good:
                return min(good, key=lambda attempt: attempt.seconds)
        return min(self.attempts, key=lambda attempt: attempt.residual, default=None)


class Request(NamedTuple):
    """What a solver is asked for on a case: the residual at which to stop (0: try all), tolerances or
    iterations if not its own, and one variant if not all."""

    target: float = TARGET
    ladder: tuple[float, ...] = ()
    variant: str | None = None

    def attempts(self, case: Case, peer: Peer, prepared: dict[str, Solver]) -> Iterator[Any]:
        """Attempt after attempt, from loose to tight; in place of one that failed what it said."""
        base = _peak(resource.RUSAGE_SELF)
        for variant, solver in prepared.items():
            before = None
            for requested in self.ladder or peer.requested:
                run = partial(solver, requested)
                try:
                    seconds, solution = timed(run)
                except Exception as error:  # whatever a foreign solver raises is its result
                    yield str(error)
                    break
                found = accuracy(case, solution.reaction, solution.velocity)
                if found.residual == before and requested >= 1:
                    break  # more iterations are not made
                before, seconds = found.residual, solution.seconds or seconds
                if found.residual <= NEAR:
                    for _ in range(repeats(seconds)):
                        more, again = timed(run)
                        seconds = min(seconds, again.seconds or more)
                peak = max(_peak(resource.RUSAGE_SELF) - base, _peak(resource.RUSAGE_CHILDREN))
                yield Attempt(
                    variant, requested, seconds, found.residual, found.own, solution.iterations,
                    peak / 1024, found.velocity, solution.reaction,
                )  # fmt: skip
                if found.residual <= self.target:
                    break

    def prepare(self, case: Case, peer: Peer) -> dict[str, Solver]:
        """The variants that are asked for, each with the problem in its own matrices. Raises
        ImportError where the solver is missing, MemoryError where it is not asked so much."""
        problem = scaled(case)
        variants = peer.variants.items()
        return {name: make(problem) for name, make in variants if self.variant in (None, name)}


def compete(case: Case, solver: str, limit: float, target: Request = Request()) -> Outcome:  # noqa: B008
    """Let a solver try on the case until its recomputed residual is low enough or `limit` seconds
    have passed since it had read the case; one that is missing says how to get it.

    A limit of the system's (RLIMIT_CPU) would make the process's own CPU clock as coarse as the
    scheduler's ticks."""
    os.environ.update(ONE_THREAD)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_contestant, args=(there, case, solver, target))
    process.start()
    there.close()
    attempts: list[Attempt] = []
    ended, ends = "", None
    try:
        while here.poll(None if ends is None else max(0.0, ends - time.monotonic())):
            output = here.recv()
            if isinstance(output, Attempt):
                attempts.append(output)
            elif output is None:
                ends = time.monotonic() + limit
            else:
                ended = ended or (output.splitlines() or ["failed"])[0][:80]
        ended = f"stopped after {limit:g} s"
    except EOFError:
        process.join()
        if code := process.exitcode:
            name = signal.Signals(-code).name if code < 0 else f"status {code}"
            ended = "killed (memory?)" if code == -signal.SIGKILL else f"crashed ({name})"
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # with its children
        process.kill()
        process.join()
    return Outcome(solver, attempts, ended)


def _contestant(there: Any, case: Case, solver: str, target: Request) -> None:
    """Send None when ready, then the attempts, and in words what goes wrong."""
    os.setsid()
    for stream in (1, 2):  # what solvers print
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    peer = EVERYONE[solver]
    try:
        prepared = target.prepare(case, peer)
    except (ImportError, MemoryError) as error:
        missing = f"{MISSING}: {peer.install}"
        there.send(missing if isinstance(error, ImportError) else str(error))
        return
    there.send(None)
    for attempt in target.attempts(case, peer, prepared):
        there.send(attempt)


def _peak(who: int) -> int:
    """The largest memory so far (kB)."""
    return resource.getrusage(who).ru_maxrss
