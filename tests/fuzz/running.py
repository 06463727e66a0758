"""Run a command of a case: in this process, in a fork of it, or in a Python of its own."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import NamedTuple

from analysis.cli import main
from analysis.engines import run as engine_runs
from analysis.engines.penalty import penalty_of
from analysis.engines.record import EngineError
from tests.forked import PROGRAM, TooLongError, as_program, in_fork, python

# CPU time of a case; of the clock it may take as much longer as the machine is busy, unless it
# waits for ever.
LONGEST_CPU_S, LONGEST_S = 90.0, 1800.0
# Disks times steps of a run that is worth an engine's time here.
DEAR = 1e6


class Outcome(NamedTuple):
    """How a case ended: exit status, what it said, seconds."""

    status: int
    message: str
    printed: str
    seconds: float


def started(words, here, spare):
    """Run a command in a Python of its own."""
    before = _cpu_of_children()
    try:
        ended = python(PROGRAM, *words, cwd=here, timeout=LONGEST_S, TMPDIR=str(spare))
    except subprocess.TimeoutExpired:
        raise TooLongError(f"waits for more than {LONGEST_S:g} s") from None
    return Outcome(ended.returncode, ended.stderr, ended.stdout, _cpu_of_children() - before)


def forked(words, here, spare):
    """Run a command in a fork of this process, which has imported everything."""
    before = _cpu_of_children()

    def program():
        tempfile.tempdir = str(spare)
        with _cheap_engines():
            return as_program(words, here)

    status, message, printed = in_fork(program, LONGEST_S)
    return Outcome(status, message, printed, _cpu_of_children() - before)


def _cpu_of_children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def call(words, here, spare):
    """Run a command in this process."""
    message, printed = io.StringIO(), io.StringIO()
    before, argv, home = Path.cwd(), sys.argv, tempfile.tempdir
    began, status = time.process_time(), 0
    old = signal.signal(signal.SIGALRM, _too_long)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
    try:
        os.chdir(here)
        sys.argv, tempfile.tempdir = ["percussions", *words], str(spare)
        with (
            contextlib.redirect_stderr(message),
            contextlib.redirect_stdout(printed),
            warnings.catch_warnings(),
            _cheap_engines(),
        ):
            warnings.simplefilter("always")
            main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
        os.chdir(before)
        sys.argv, tempfile.tempdir = argv, home
    return Outcome(status, message.getvalue(), printed.getvalue(), time.process_time() - began)


def _too_long(*_):
    raise TooLongError


@contextlib.contextmanager
def _cheap_engines():
    """Runs that would last are refused: they are not what is tested here."""
    real = engine_runs.run_engine

    def cheap(scene, name, folder, *others):
        if penalty_of(scene).steps * len(scene.snapshot) > DEAR:
            raise EngineError(f"{folder}: too dear for this test")
        return real(scene, name, folder, *others)

    engine_runs.run_engine = cheap
    try:
        yield
    finally:
        engine_runs.run_engine = real
