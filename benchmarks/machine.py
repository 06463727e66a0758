"""What every script shares: the machine in words, options, tables, times, processes of their own."""

import argparse
import multiprocessing
import os
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import numpy as np

from analysis.support.machine import machine

PACKAGES = ("numpy", "scipy", "piqp", "clarabel", "osqp", "qoco", "cvxopt", "qpalm", "proxsuite")
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# How often a call is repeated for its least time, if it takes less than so many seconds.
REPEATS = {0.05: 20, 0.5: 4, 10.0: 1}


def describe() -> str:
    """Processor, cores, memory, system and versions, in two lines."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1024**3
    there = {one.name: one.version for one in distributions()}
    found = [f"{name} {there[name]}" for name in PACKAGES if name in there]
    return (
        f"{machine()}, {memory:.0f} GiB, {platform.machine()}.\n"
        f"Python {platform.python_version()}, {', '.join(found)}."
    )


def options(words: str | None, *positions: str, **defaults: Any) -> argparse.Namespace:
    """Read the options of a script; words: its docstring, which says what they mean.

    positions: names of paths that must be given, "…" after the name of several.
    defaults: an option of the type of its default: a tuple takes several values, a dict some of its
        keys (all by default), False is a switch, True one that is set, a type has no default."""
    kind = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=words, formatter_class=kind)
    for name in positions:
        several = {"nargs": "*"} if name.endswith("…") else {}
        parser.add_argument(name.rstrip("…"), type=Path, **several)
    for name, value in defaults.items():
        arguments: dict[str, Any] = {"default": value, "type": type(value)}
        if isinstance(value, bool):
            arguments = {"action": argparse.BooleanOptionalAction, "default": value}
        elif isinstance(value, type):
            arguments = {"type": value}
        elif isinstance(value, dict):
            arguments = {"default": list(value), "nargs": "*", "choices": list(value)}
        elif isinstance(value, tuple):
            arguments |= {"nargs": "*", "type": type(value[0]) if value else str}
        parser.add_argument(f"--{name.replace('_', '-')}", **arguments)
    return parser.parse_args()


def line(cells: Iterable[object]) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(map(str, cells))} |"


def head(*names: str) -> str:
    """The head of a table in Markdown."""
    return f"{line(names)}\n{line(['---'] * len(names))}"


def table(names: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown."""
    return "\n".join([head(*names), *map(line, rows)])


def show(names: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Print the machine and a table in Markdown, row by row as they come."""
    print(describe(), head(*names), sep="\n\n", flush=True)
    for row in rows:
        print(line(row), flush=True)


def ranges(rows: Any) -> list[str]:
    """Median and range of each column of rows, in words: 350 (110 – 400)."""
    ends = np.quantile(np.array(rows), [0.5, 0.0, 1.0], axis=0).T
    return ["{:.3g} ({:.3g} – {:.3g})".format(*one) for one in ends]


def power(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The power of the size that seconds grow with, by least squares; NaN for less than two."""
    if len(sizes) < 2:
        return float("nan")
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of one call, and what it gave."""
    started = time.process_time()
    found = call()
    return time.process_time() - started, found


def shortest_time(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of the fastest of several calls, the more the shorter they are, and what the first
    one gave."""
    seconds, found = timed(call)
    return min([seconds, *(timed(call)[0] for _ in range(repeats(seconds)))]), found


def repeats(seconds: float) -> int:
    """How often to time once more what took so many seconds."""
    return next((count for limit, count in REPEATS.items() if seconds < limit), 0)


def in_turn(calls: Mapping[Any, Callable[[], Any]], turns: int) -> dict[Any, list[Any]]:
    """What each of several calls gave, turn by turn: so all meet the same load of the machine."""
    found: dict[Any, list[Any]] = {name: [] for name in calls}
    for _ in range(turns):
        for name, call in calls.items():
            found[name].append(call())
    return found


def in_process(call: Callable[..., Any], *value: Any) -> Any:
    """What a function gives in a process of its own with one BLAS thread.

    Raises BrokenProcessPool if the process is ended, as for want of memory."""
    os.environ.update(ONE_THREAD)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as alone:
        return alone.submit(call, *value).result()
