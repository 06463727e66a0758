"""Shared: hypothesis without deadlines, Ctrl-C, which some tests send, where a shell in the
background has switched it off, the command as a user calls it, without warnings, and a cluster."""

import importlib
import signal
import subprocess
import sys
from functools import partial

import pytest
from hypothesis import settings

from analysis.cli import main
from tests.forked import PROGRAM, as_program, in_fork, python, without_warnings

signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("crowd", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("crowd")

pytest_plugins = ["crowd_percussions.pytest_plugin"]

_communicate = subprocess.Popen.communicate


def communicate(self, *args, **options):
    """What a process printed. The test fails if a Python warning is in it: nothing here may show
    one to a user."""
    return without_warnings(*_communicate(self, *args, **options))


subprocess.Popen.communicate = communicate


# what the commands import when they are called, so that forks have it
IMPORTED = (
    "compare.study", "percussions.solve_dump", "scene.real.import_crowd", "studies.advice.choice",
    "studies.audit", "studies.film.page", "studies.paper.page", "studies.report.page",
    "studies.stability.page", "studies.work_precision.page", "studies.work_precision.whole_runs",
)  # fmt: skip


@pytest.fixture
def percussions(tmp_path):
    """Run `percussions …` in an empty folder, in a fork; returns the finished process."""
    for name in IMPORTED:
        importlib.import_module(f"analysis.{name}")

    def call(*words, timeout=600):
        words = [str(word) for word in words]
        status, message, printed = in_fork(lambda: as_program(words, tmp_path), timeout)
        return subprocess.CompletedProcess(["percussions", *words], status, printed, message)

    return call


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """refused(words) → the one line with which `percussions words` ends, which writes nothing."""

    def line(*words):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("sys.argv", ["percussions", *map(str, words)])
        before = sorted(tmp_path.rglob("*"))
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code in (1, 2)
        every = capsys.readouterr().err.strip().splitlines()
        (sentences,) = [one for one in every if not one.startswith("note: ")]
        assert sorted(tmp_path.rglob("*")) == before
        return sentences

    return line


@pytest.fixture
def alone(tmp_path):
    """The same in a Python of its own, this very tree, whichever is installed."""

    return partial(python, PROGRAM, cwd=tmp_path)


@pytest.fixture
def cluster():
    """A Dask scheduler, and the processes of its two workers."""
    distributed = pytest.importorskip(
        "distributed", reason="no Dask (pip install 'crowd-percussions[cluster]')"
    )
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as local:
        address = local.scheduler_address
        call = [sys.executable, "-m", "distributed.cli.dask_worker", address]
        call += ["--no-nanny", "--nthreads", "1", "--no-dashboard"]
        processes = [
            subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for _ in range(2)
        ]
        try:
            with distributed.Client(address) as client:
                client.wait_for_workers(2, timeout=60)
                yield address, processes
        finally:
            for process in processes:
                process.kill()
                process.wait()
