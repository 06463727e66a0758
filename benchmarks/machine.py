"""What every script shares: the machine in words and its memory bandwidth, options, tables."""

import argparse
import os
import platform
import time
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from analysis.support.machine import machine

PACKAGES = ("numpy", "scipy", "piqp", "clarabel", "osqp", "qoco", "cvxopt", "qpalm", "proxsuite")


def describe() -> str:
    """Processor, cores, memory, system and versions, in two lines."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1024**3
    found = [f"{name} {number}" for name in PACKAGES if (number := _version(name))]
    return (
        f"{machine()}, {memory:.0f} GiB, {platform.machine()}.\n"
        f"Python {platform.python_version()}, {', '.join(found)}."
    )


def bandwidth() -> float:
    """Bytes per second that one core moves in a += b over arrays beyond any cache, best of five."""
    size = 1 << 25
    a, b = np.zeros(size), np.ones(size)
    best = np.inf
    for _ in range(5):
        started = time.perf_counter()
        a += b
        best = min(best, time.perf_counter() - started)
    return 3 * 8 * size / best


def options(words: str | None, *places: str, **defaults: Any) -> argparse.Namespace:
    """Read the options of a script; words: its docstring, which says what they mean.

    places: names of paths that must be given, "…" after the name of several.
    defaults: an option of the type of its default: a tuple takes several values, a dict some of its
        keys (all by default), False is a switch, a type has no default."""
    kind = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=words, formatter_class=kind)
    for name in places:
        several = {"nargs": "*"} if name.endswith("…") else {}
        parser.add_argument(name.rstrip("…"), type=Path, **several)
    for name, value in defaults.items():
        given: dict[str, Any] = {"default": value, "type": type(value)}
        if value is False:
            given = {"action": "store_true"}
        elif isinstance(value, type):
            given = {"type": value}
        elif isinstance(value, dict):
            given = {"default": list(value), "nargs": "*", "choices": list(value)}
        elif isinstance(value, tuple):
            given |= {"nargs": "*", "type": type(value[0]) if value else str}
        parser.add_argument(f"--{name.replace('_', '-')}", **given)
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


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
