"""What commands print: no Python warning (the test that started them fails), and characters that
the terminal lacks as a question mark."""

import subprocess
import sys

import pytest

from tests.forked import PROGRAM, in_fork, python

WARNS = "import warnings; warnings.warn('divide by zero', RuntimeWarning)"


def warning_in_a_fork():
    print("file.py:3: DeprecationWarning: old", file=sys.stderr)  # noqa: T201
    return 0


def test_printed_warning_fails_the_test_that_started_the_command():
    for text in (True, False):
        with pytest.raises(pytest.fail.Exception, match="RuntimeWarning: divide by zero"):
            subprocess.run([sys.executable, "-c", WARNS], capture_output=True, text=text)
    with pytest.raises(pytest.fail.Exception, match="DeprecationWarning: old"):
        in_fork(warning_in_a_fork, 10)


def test_characters_that_the_terminal_lacks_do_not_end_a_command():
    done = python(PROGRAM, "scenes", PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "?f dt against p" in done.stdout
