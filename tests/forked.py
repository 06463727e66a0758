"""The command in a fork of this process, which has imported everything already: its exit status and
output are those that a shell would see, a second or two sooner."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import pytest

from analysis.cli import app, main

ROOT = Path(__file__).resolve().parents[1]
INTERNAL = 70
PROGRAM = "from analysis.cli import main; main()"
# as Python prints it: file, line, kind
WARNING = re.compile(r"^.*:\d+: \w*Warning: .*(?:\n.*)?", re.M)


class TooLongError(BaseException):
    """A command beyond its time."""


def python(code, *words, cwd=None, timeout=600, **environment):
    """Run code in a Python of its own with this very tree: the finished process."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, words)], cwd=cwd, timeout=timeout, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment}, capture_output=True,
        stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip


def in_fork(program, longest_s):
    """Call `program`, which returns an exit status, in a fork: its status, stderr and stdout."""
    with tempfile.TemporaryFile() as printed, tempfile.TemporaryFile() as message:
        child = os.fork()
        if not child:
            status = INTERNAL
            try:
                os.dup2(printed.fileno(), 1)
                os.dup2(message.fileno(), 2)
                sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
                sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
                status = program()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(status)
        status = os.waitstatus_to_exitcode(_waited(child, longest_s))
        texts = []
        for file in (message, printed):
            file.seek(0)
            texts.append(file.read().decode("utf-8"))
    return status, *without_warnings(*texts)


def without_warnings(*texts):
    """What a command printed (text, bytes or None). Fails the test for a Python warning in it."""
    for text in texts:
        plain = text.decode("utf-8", "replace") if isinstance(text, bytes) else text or ""
        if found := WARNING.search(plain):
            pytest.fail(f"the command printed a warning: {found[0]}")
    return texts


def as_program(words, here, program=main):
    """Run `percussions …`, or another program, in a folder: its exit status."""
    os.chdir(here)
    # this very tree, whichever is installed, for the processes that it starts
    os.environ["PYTHONPATH"] = str(ROOT)
    sys.argv = ["percussions", *words]
    # a line every few seconds: how many would hang on how busy the machine is
    app._Lines.beat = lambda _, ended: None
    warnings.resetwarnings()
    warnings.simplefilter("default")
    try:
        program()
    except SystemExit as end:
        if isinstance(end.code, str):
            sys.stderr.write(f"{end.code}\n")
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def _waited(child, longest_s):
    """The status that a child ended with; it is ended after the longest time."""
    ends = time.monotonic() + longest_s
    while time.monotonic() < ends:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return status
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    raise TooLongError(f"waits for more than {longest_s:g} s")
