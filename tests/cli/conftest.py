"""The command as a user calls it: in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = "from analysis.cli import main; main()"


@pytest.fixture
def percussions(tmp_path):
    """Run `percussions …` in an empty folder; returns the finished process."""

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
