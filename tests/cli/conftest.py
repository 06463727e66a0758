"""The command as a user calls it: in a process of its own."""

import subprocess
import sys

import pytest


@pytest.fixture
def percussions(tmp_path):
    """Run `percussions …` in an empty folder; returns the finished process."""

    def call(*words, timeout=120):
        command = [sys.executable, "-c", "from analysis.cli import main; main()", *map(str, words)]
        return subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=timeout, check=False
        )

    return call
