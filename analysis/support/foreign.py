"""SQLite and HDF5 files of somebody else, read in a process with a limit of time and memory: a
damaged one can loop inside its library, where nothing but a signal ends it."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.support.reading import UnreadableError, open_file

CHILD = Path(__file__).with_name("foreign_child.py")
# Its exit status where it says why it does not read a file.
REFUSED = 3
# CPU time of a read: to begin, and for each byte.
LEAST_CPU_S, BYTES_PER_S = 10.0, 10e6
# Numbers in memory: so many bytes, and so many more for each byte of the file, which may be packed.
LEAST_BYTES, PACKED = 64 << 20, 100
# What Python and the libraries take themselves.
OWN_BYTES = 2 << 30
# An interrupted writer leaves one of these beside an SQLite file: without it the file is incomplete.
JOURNALS = ("-wal", "-journal")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Node:
    """Hold a table, a group or a dataset of a file.

    attributes: texts and single numbers; None for other kinds"""

    attributes: dict[str, Any] = field(default_factory=dict)
    below: dict[str, Node] = field(default_factory=dict)  # what is in a group or table
    values: NDArray[Any] | None = None  # of a column or dataset; None for a group

    def texts(self, column: str) -> list[str]:
        """Read a column of texts."""
        return [str(text) for text in json.loads(str(self.below[column].values))]


def read_foreign(path: Path, kind: Literal["sqlite", "hdf5"], names: Sequence[str]) -> Node:
    """Read the tables or groups of these names, those that are there.

    Raises UnreadableError naming the file: it is damaged, a view or a virtual table, a link to
    another file, or it needs more time or memory than a file of its size should."""
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
    for end in JOURNALS if kind == "sqlite" else ():
        journal = path.with_name(path.name + end)
        if journal.exists() and journal.stat().st_size:
            raise UnreadableError(
                f"{path}: {journal.name} lies beside it: who writes it has not finished"
            )
    seconds, max_bytes = LEAST_CPU_S + size / BYTES_PER_S, LEAST_BYTES + PACKED * size
    request = {
        "kind": kind,
        "path": str(path.absolute()),
        "names": list(names),
        "cpu_s": seconds,
        "memory_bytes": OWN_BYTES + 4 * max_bytes,
        "most_bytes": max_bytes,
    }
    ended = subprocess.run(
        [sys.executable, "-P", str(CHILD)],
        input=json.dumps(request).encode(),
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        check=False,
    )
    if ended.returncode == REFUSED:
        raise UnreadableError(f"{path}: {ended.stdout.decode()}")
    if ended.returncode:
        raise UnreadableError(
            f"{path}: damaged: its library crashed, or found no end within {seconds:.0f} s"
        )
    root = Node()
    with np.load(io.BytesIO(ended.stdout), allow_pickle=False) as arrays:
        for name, number, attributes in json.loads(str(arrays["parts"])):
            values = None if number is None else arrays[str(number)]
            *above, last = name.split("/")
            node = root
            for step in above:
                node = node.below[step]
            node.below[last] = Node(attributes=attributes, values=values)
    return root
