"""Shared: hypothesis without deadlines (compiled kernels make the first example slow), Ctrl-C,
which some tests send, where a shell in the background has switched it off, commands that print no
warning, and a cluster."""

import signal
import subprocess
import sys

import pytest
from hypothesis import settings

from tests.forked import without_warnings

signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("crowd", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("crowd")

_communicate = subprocess.Popen.communicate


def communicate(self, *args, **options):
    """What a process printed. The test fails if a Python warning is in it: nothing here may show
    one to a user."""
    return without_warnings(*_communicate(self, *args, **options))


subprocess.Popen.communicate = communicate


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
