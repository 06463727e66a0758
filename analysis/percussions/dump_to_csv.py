"""Percussions of a dump file, written as a table."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from analysis.dumps import DumpError
from analysis.percussions.rows import is_parquet, table_file
from analysis.percussions.solving import DumpToSolve, SolvedDump, SolvedRows, frames_in
from analysis.support.parallel import workers as processes
from analysis.support.progress import Progress

__all__ = [
    "DumpToSolve",
    "SolvedDump",
    "executor_for",
    "frames_in",
    "solve_dump",
]
# Blocks under way for each worker: the answers need not fit in memory.
AHEAD = 2


@contextlib.contextmanager
def executor_for(
    dump: DumpToSolve, workers: int = 1, scheduler: str | None = None
) -> Iterator[Executor | None]:
    """An executor for `solve_dump`: threads where these serve, else processes, or that of a Dask
    cluster; None for one worker."""
    if scheduler is None and workers <= 1:
        yield None
    elif scheduler is None and dump.at_once:
        with ThreadPoolExecutor(workers) as threads:
            yield threads
    else:
        with processes(workers, scheduler) as others:
            yield others


def solve_dump(
    dump: DumpToSolve,
    out: Path,
    *,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    expected: Callable[[float], None] | None = None,
) -> SolvedDump:
    """Solve every frame and write `out`, one row per contact (columns: docs/columns.md): CSV, or
    Parquet where its name ends in .parquet.

    executor: of `executor_for`, with so many workers; this thread where left out
    expected: called with the seconds that all this will take, once they are known

    Neither the dump nor the answers need to fit in memory. Raises DumpError for a damaged dump and
    one without any contact; then `out` stays as it was."""
    dump = dataclasses.replace(dump, parquet=is_parquet(out))
    frames = frames_in(dump)
    whole = SolvedDump(unsolved=[])
    with table_file(out) as add:
        for some in _rows(dump, frames, executor, workers, expected):
            if some.said.contacts:
                add(some.columns, some.rows)
            whole.join(some.said)
            if progress:
                progress(f"percussions of {dump.path}", whole.frames / frames)
        if not whole.contacts:
            raise DumpError(
                f"{dump.path}: no contact in any frame (gap ≤ "
                f"{dump.setting.contact_tolerance:g} m); nothing was written"
            )
    return whole


def _rows(
    dump: DumpToSolve,
    frames: int,
    executor: Executor | None,
    workers: int,
    expected: Callable[[float], None] | None,
) -> Iterator[SolvedRows]:
    """All frames in order. The first one loads what is compiled; the second says how long one
    takes."""
    first = min(2, frames)
    seconds = 0.0
    for number in range(first):
        began = time.perf_counter()
        yield from dump.solve(range(number, number + 1))
        seconds = time.perf_counter() - began
    if expected:
        expected(seconds * (frames - first) / workers)
    blocks = dump.blocks(range(first, frames))
    if executor is None:
        for block in blocks:
            yield from dump.solve(block)
        return
    # of threads one reads, forwards; others read what they solve
    threads = isinstance(executor, ThreadPoolExecutor)
    under_way: deque[Any] = deque()
    try:
        for block in blocks:
            text = dump.read(block) if threads else None
            under_way.append(executor.submit(dump.solve, block, text))
            if len(under_way) >= AHEAD * workers:
                yield from under_way.popleft().result()
        while under_way:
            yield from under_way.popleft().result()
    finally:
        for left in under_way:
            left.cancel()
