"""The command as a user calls it."""

import os
import subprocess
import sys

import pytest

# what the commands import when they are called, so that forks have it
import analysis.advice.choice
import analysis.compare.study
import analysis.film.page
import analysis.motion.report
import analysis.paper.page
import analysis.percussions.solving
import analysis.scene.real.import_crowd
import analysis.stability.page
import analysis.work_precision.page
import analysis.work_precision.whole_runs  # noqa: F401
from tests.forked import PROGRAM, ROOT, as_program, in_fork


@pytest.fixture
def percussions(tmp_path):
    """Run `percussions …` in an empty folder, in a fork; returns the finished process."""

    def call(*words, timeout=600):
        words = [str(word) for word in words]
        status, said, printed = in_fork(lambda: as_program(words, tmp_path), timeout)
        return subprocess.CompletedProcess(["percussions", *words], status, printed, said)

    return call


@pytest.fixture
def alone(tmp_path):
    """The same in a Python of its own."""

    def call(*words, timeout=600):
        return subprocess.run(
            [sys.executable, "-c", PROGRAM, *map(str, words)],
            cwd=tmp_path,
            # this very tree, whichever is installed
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )

    return call
