"""Work done in other processes, on the cores that there are or on a Dask cluster, and its progress."""

import contextlib
import logging
import math
import multiprocessing
import multiprocessing.connection
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any

from analysis.support.extras import load
from analysis.support.machine import cores

# How often expected progress is reported, and the share that it stays below.
BEAT_S, SURE = 2.0, 0.95
# Whether this is a process of `workers`: its only thread at work runs one task.
is_worker = False
# Called with a label and the share that is done, 0 to 1.
Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """A call to make elsewhere, and how much work it is (any unit, for the order and the
    progress)."""

    call: Callable[..., Any]
    arguments: tuple[Any, ...]
    work: float


@contextlib.contextmanager
def workers(processes: int | None = None, scheduler: str | None = None) -> Iterator[Executor]:
    """An executor with so many processes (at most, and by default, as many as there are cores), or that of the
    Dask cluster whose scheduler is at that address.

    The workers of a cluster must see the same folders, and each measures CPU time of one run at a
    time. Whoever runs the scheduler or a worker can run code here and there: trust them entirely.

    Raises ValueError for a number below 1, where nothing answers at the address and where
    processes can share no memory, MissingExtraError where `distributed` is not installed."""
    if processes is not None and processes < 1:
        raise ValueError(f"jobs: {processes}. A number ≥ 1 is needed")
    if scheduler is not None:
        dask = load("distributed")
        try:
            _check_address(scheduler, dask)
            client = dask.Client(scheduler, timeout=10)
        except (OSError, ValueError, TypeError, RuntimeError, ImportError) as error:
            raise ValueError(f"scheduler: nothing answers at {scheduler}: {error}") from None
        with client:
            yield client.get_executor(pure=False)
        return
    # spawned, since a forked process would inherit threads of numerical libraries
    try:
        pool = ProcessPoolExecutor(
            min(processes or cores(), cores()),
            multiprocessing.get_context("spawn"),
            initializer=end_with_parent,
        )
    except OSError as error:  # as in a container without /dev/shm
        why = error.strerror or error
        raise ValueError(
            f"jobs: no processes can share work here: {why}. Is /dev/shm there, and writable?"
        ) from None
    try:
        yield pool
    finally:
        # an interrupted build ends with what is under way; what is finished is kept
        pool.shutdown(cancel_futures=True)


def _check_address(scheduler: str, dask: Any) -> None:
    """Raise ValueError for an address that a client would fail at, half opened."""
    scheme, position = dask.comm.parse_address(scheduler)
    dask.comm.registry.get_backend(scheme)
    if scheme not in ("tcp", "tls"):
        raise ValueError("tcp:// or tls:// is needed")
    dask.comm.addressing.parse_host_port(position)
    secured = dask.Security().get_connection_args("client").get("ssl_context")
    if scheme == "tls" and secured is None:
        raise ValueError("certificates are needed for tls: distributed.comm.tls of Dask's settings")


def end_with_parent() -> None:
    """Have this worker end as soon as the process that started it is gone, whatever ended that, compute
    on one thread, and keep the notes of MDAnalysis for itself."""
    global is_worker
    is_worker = True
    os.environ["OMP_NUM_THREADS"] = "1"  # numpy is loaded after this
    logging.getLogger("MDAnalysis").setLevel(logging.ERROR)

    def watch(sentinel: int) -> None:
        multiprocessing.connection.wait([sentinel])
        os._exit(1)

    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=watch, args=(parent.sentinel,), daemon=True).start()


def do_all(
    tasks: Sequence[Task],
    executor: Executor | None,
    label: str,
    progress: Progress | None = None,
    timed: bool = False,
) -> list[Any]:
    """The results of all tasks, in their order; the most work is begun first, or, without an
    executor, what comes first.

    timed: work is in CPU seconds, so that progress moves between the ends of tasks too, slower and slower
    where they take longer than that"""
    total, done = sum(task.work for task in tasks) or 1.0, 0.0
    started, ended = time.monotonic(), threading.Event()

    def report() -> None:
        passed = cores() * (time.monotonic() - started) / total if timed else 0.0
        if progress:
            progress(label, max(done / total, SURE * -math.expm1(-passed)))

    def beat() -> None:
        while not ended.wait(BEAT_S):
            report()

    if progress and tasks:
        progress(label, 0.0)
    if timed:
        threading.Thread(target=beat, daemon=True).start()
    results: list[Any] = [None] * len(tasks)
    try:
        for number, result in finished(tasks, executor):
            results[number] = result
            done += tasks[number].work
            report()
    finally:
        ended.set()
    return results


def finished(tasks: Sequence[Task], executor: Executor | None) -> Iterator[tuple[int, Any]]:
    """Give the numbers and results of tasks as they end; what is pending is cancelled when one
    fails."""
    if executor is None:
        for number, task in enumerate(tasks):
            yield number, task.call(*task.arguments)
        return
    order = sorted(range(len(tasks)), key=lambda number: -tasks[number].work)
    pending = {executor.submit(_call, tasks[number]): number for number in order}
    try:
        for future in as_completed(pending):
            yield pending[future], future.result()
    finally:
        for future in pending:
            future.cancel()


def _call(task: Task) -> Any:
    try:
        return task.call(*task.arguments)
    except KeyboardInterrupt:
        # the pool would give this process the next task: its engine has been stopped, so no more of
        # them
        os._exit(1)
