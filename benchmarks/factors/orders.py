"""Orders of elimination: the entries of the factor and its arithmetic, by the product's dissection,
by minimum degree and by METIS (where pymetis is installed).

    python -m benchmarks.factors.orders CASE ...

Cases are files that `benchmarks/percussions.py --cases FOLDER` left. An entry is a block of one
disk and another; arithmetic is Σ c² over the columns of the factor, c its entries."""

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import read_case
from benchmarks.machine import describe, head, line, options
from nscd import _core

TIMES = 3
# Parts of up to so many disks are not cut further: see nscd/core/factor.hpp.
LEAF = 8
HEADING = head("crowd", "disks", "order", "found in", "entries", "longest column", "arithmetic")


def rows(path: Path) -> Iterator[str]:
    """Give the lines of the table for a case, one for each order."""
    case = read_case(path)
    position, contacts = case.snapshot.position, case.contacts
    n = len(position)
    first = contacts.first.astype(np.int32)
    second = np.where(contacts.is_wall, -1, contacts.second).astype(np.int32)
    start, neighbour = _graph(n, first[second >= 0], second[second >= 0])
    mass, none = np.ones((n, 2)), np.zeros(len(first))
    given = first, second, contacts.normal, np.zeros((len(first), 2)), position, mass, none, none
    orders: dict[str, Callable[[], Any]] = {
        "dissection": lambda: _core.dissect(position, first, second, LEAF)[0],
        "minimum degree, with structure": lambda: _core.Factor(*given, False).order,
    }
    try:
        import pymetis
    except ImportError:
        print("METIS is left out: pip install pymetis", file=sys.stderr)
    else:
        graph = pymetis.CSRAdjacency(start, neighbour)
        orders["METIS"] = lambda: pymetis.nested_dissection(graph)[0]
    for name, find in orders.items():
        seconds = []
        for _ in range(TIMES):
            begin = time.process_time()
            order = find()
            seconds.append(time.process_time() - begin)
        column = _columns(np.asarray(order), start, neighbour)
        found = f"{float(f'{1e3 * min(seconds):.2g}'):,g} ms", f"{column.sum():,}", column.max()
        arithmetic = f"{np.sum(column.astype(float) ** 2):.2g}"
        yield line([path.name.partition("_")[0], f"{n:,}", name, *found, arithmetic])


def _graph(n: int, first: Any, second: Any) -> tuple[Any, Any]:
    """The neighbours of each disk a: neighbour[start[a] : start[a + 1]]."""
    ends, other = np.concatenate([first, second]), np.concatenate([second, first])
    start = np.concatenate([[0], np.cumsum(np.bincount(ends, minlength=n))])
    return start, other[np.argsort(ends, kind="stable")]


def _columns(order: Any, start: Any, neighbour: Any) -> Any:
    """The entries (n,) of each column of the factor: what a disk touches when it is eliminated, all
    of which touch each other from then on."""
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    later: list[set[int]] = [set() for _ in range(n)]
    count = np.ones(n, dtype=np.int64)
    for k in range(n):
        disk = order[k]
        reach = later[k]
        reach.update(int(p) for p in place[neighbour[start[disk] : start[disk + 1]]] if p > k)
        count[k] += len(reach)
        if reach:
            parent = min(reach)
            later[parent] |= reach - {parent}
        later[k] = set()
    return count


def main() -> None:
    """Print the table as Markdown."""
    given = options(__doc__, "cases…")
    for path in given.cases:
        if not path.is_file():
            sys.exit(f"{path}: no such file")
    print(f"{describe()}\n\n{HEADING}")
    for path in given.cases:
        print("\n".join(rows(path)), flush=True)


if __name__ == "__main__":
    main()
