"""SQLite and HDF5 files of somebody else, read in a process with a limit of time and memory: a
damaged one can loop inside its library, where nothing but a signal ends it."""

from __future__ import annotations

import atexit
import contextlib
import io
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.support.reading import UnreadableError, open_file

CHILD = Path(__file__).with_name("foreign_child.py")
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
    seconds, most = LEAST_CPU_S + size / BYTES_PER_S, LEAST_BYTES + PACKED * size
    request = {
        "kind": kind,
        "path": str(path.absolute()),
        "names": list(names),
        "cpu_s": seconds,
        "memory_bytes": OWN_BYTES + 4 * most,
        "most_bytes": most,
    }
    try:
        content = _READER.ask(request)
    except EOFError:
        raise UnreadableError(
            f"{path}: damaged: its library crashed, or found no end within {seconds:.0f} s"
        ) from None
    except ValueError as error:
        raise UnreadableError(f"{path}: {error}") from None
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return _tree(arrays)


class _Reader:
    """The process that reads, started where there is none."""

    def __init__(self) -> None:
        # by who started it: a fork must not share it
        self._of: dict[int, subprocess.Popen[bytes]] = {}
        self._lock = threading.Lock()

    def ask(self, request: dict[str, Any]) -> bytes:
        """Return what it answers. Raises EOFError where it died, ValueError for a refusal."""
        with self._lock, self._ended_with_an_error():
            process = self._started()
            assert process.stdin is not None
            assert process.stdout is not None
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(json.dumps(request).encode() + b"\n")
                process.stdin.flush()
            line = process.stdout.readline()
            said: dict[str, Any] = (
                json.loads(line) if line.endswith(b"\n") else {"why": "", "bytes": 1}
            )
            content = process.stdout.read(said["bytes"])
            if len(content) < said["bytes"]:
                raise EOFError
        if said["why"]:
            raise ValueError(said["why"])
        return content

    @contextlib.contextmanager
    def _ended_with_an_error(self) -> Iterator[None]:
        """An answer that was not read to its end, as after an interrupt, is nobody's."""
        try:
            yield
        except BaseException:
            self.end()
            raise

    def _started(self) -> subprocess.Popen[bytes]:
        if os.getpid() not in self._of:
            process = subprocess.Popen(
                [sys.executable, "-P", str(CHILD)],
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
            self._of[os.getpid()] = process
            atexit.register(self.end)
            assert process.stdout is not None
            if process.stdout.readline() != b"ready\n":
                raise ValueError("no process can be started to read it. Is there memory left?")
        return self._of[os.getpid()]

    def end(self) -> None:
        """End the process, where there is one."""
        if process := self._of.pop(os.getpid(), None):
            process.kill()
            process.communicate()


_READER = _Reader()


def _tree(arrays: Any) -> Node:
    whole = Node()
    for name, number, attributes in json.loads(str(arrays["parts"])):
        values = None if number is None else arrays[str(number)]
        *path, last = name.split("/")
        place = whole
        for step in path:
            place = place.below[step]
        place.below[last] = Node(attributes=attributes, values=values)
    return whole
