"""Solvers on a case, each in a process of its own with a limit: attempts in, the attempt that
counts out."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

TARGET, NEAR = 1e-10, 1e-8
PROCESSES = Path(__file__).parents[1] / "processes"
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
# `auto` with the choice among the reactions of redundant contacts that `solve` makes by default and
# peers do not make
CANONICAL = "auto, canonical"
NOT_INSTALLED, TOO_LONG = 3, 124


class Attempt(NamedTuple):
    """One solve that was asked for a tolerance, or for a number of iterations (≥ 1): CPU seconds,
    recomputed residual, whether the solver's own u was used, iterations (0: not said), memory
    beyond what the process had before (MB), u⁺ (2n,) m/s and λ (k,) N·s."""

    variant: str
    asked: float
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


class MissingError(Exception):
    """The solver is not installed."""


def compete(
    case: Path,
    solver: str,
    folder: Path,
    limit: float,
    *,
    target: float = TARGET,
    asked: Sequence[float] = (),
    variant: str | None = None,
) -> Outcome:
    """Let a solver try on the case file until its recomputed residual is `target` or `limit`
    seconds have passed.

    Raises MissingError if the solver is not installed."""
    words = [sys.executable, str(PROCESSES / "attempts.py"), str(case), solver, str(folder)]
    words += ["--target", str(target)]
    if asked:
        words += ["--asked", *map(str, asked)]
    if variant is not None:
        words += ["--variant", variant]
    said, code, errors = run_limited(words, limit, folder)
    if code == NOT_INSTALLED:
        raise MissingError(solver)
    attempts, ended = [], _reason(code, errors, limit)
    for line in said:
        if not (line.startswith("{") and line.endswith("}")):
            continue  # what the solver prints
        told = json.loads(line)
        if "error" in told:
            ended = ended or told["error"].splitlines()[0][:80]
            continue
        number = told["velocity"]
        told["velocity"] = np.load(folder / f"{number}.npy")
        told["reaction"] = np.load(folder / f"{number}_reaction.npy")
        attempts.append(Attempt(**told))
    return Outcome(solver, attempts, ended)


def run_limited(words: Sequence[str], limit: float, folder: Path) -> tuple[list[str], int, str]:
    """Output lines, exit status and error text of a process that is killed, with its children,
    `limit` seconds after it has said that it is ready (TOO_LONG is then its status).

    A limit of the system's (RLIMIT_CPU) would make the process's own CPU clock as coarse as the
    scheduler's ticks."""
    said: list[str] = []
    late = threading.Event()
    with (folder / "errors.txt").open("w+", encoding="utf-8") as errors:
        process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=errors, text=True, env=os.environ | ONE_THREAD,
            start_new_session=True,
        )  # fmt: skip

        def end() -> None:
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(limit, end)
        assert process.stdout is not None
        try:
            for line in process.stdout:
                said.append(line.rstrip("\n"))
                if said[-1] == "ready":
                    timer.start()
            code = process.wait()
        finally:
            timer.cancel()
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        errors.seek(0)
        return said, TOO_LONG if late.is_set() else code, errors.read()


def first_solve(case: Path) -> dict[str, float]:
    """Seconds of a new process that imports nscd and solves the case once; `process_wall_s` with
    the interpreter."""
    best: dict[str, float] = {}
    for _ in range(3):
        started = time.perf_counter()
        words, alone = [sys.executable, PROCESSES / "first_solve.py", case], os.environ | ONE_THREAD
        said = subprocess.run(words, capture_output=True, text=True, check=True, env=alone).stdout
        found = json.loads(said) | {"process_wall_s": time.perf_counter() - started}
        if not best or found["process_wall_s"] < best["process_wall_s"]:
            best = found
    return best


def _reason(code: int, errors: str, limit: float) -> str:
    if code == 0:
        return ""
    if code == TOO_LONG:
        return f"stopped after {limit:g} s"
    if code == -signal.SIGKILL:
        return "killed (memory?)"
    if code < 0:
        return f"crashed ({signal.Signals(-code).name})"
    return (errors.strip().splitlines() or [f"ended with {code}"])[-1][:80]
