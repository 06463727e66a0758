"""Read SQLite and HDF5 files of somebody else in a process of its own, which `foreign.py` starts.

On stdin it gets a request in JSON: kind (sqlite or hdf5), path, names of tables or groups, and limits:
cpu_s, memory_bytes, most_bytes. It answers with an .npz of arrays `0`, `1`, … and `parts`, a JSON list
of [name, number of the array or null, attributes], or says why it cannot read the file and exits with
status 3. Beyond its CPU time it is ended by a signal. It imports nothing of the product, and nothing
that it does not need."""

import io
import json
import os
import resource
import signal
import sqlite3
import sys
import urllib.parse
from collections.abc import Iterator
from typing import Any

import numpy as np

# Of each table that is read: columns, the type of each as SQLite has it, and its condition.
TABLES = {
    "trajectory_data": {"id": "integer", "frame": "integer", "pos_x": "number", "pos_y": "number"},
    "metadata": {"key": "text", "value": "any"},
    "geometry": {"wkt": "text", "hash": "integer"},
    "frame_data": {"frame": "integer", "geometry_hash": "integer"},
}
OPTIONAL = ("hash",)  # of version 2
REFUSED = 3
# A row takes at least so many bytes of a file.
ROW_BYTES = 4
DEEPEST = 8


class RefusedError(Exception):
    """What cannot be read, and why."""


def parts_of_sqlite(path: str, maximum: int, names: list[str]) -> Iterator[tuple[str, Any, Any]]:
    """Each column of the tables of these names that are there: numbers, or texts."""
    quoted = urllib.parse.quote(os.fsencode(path))
    base = sqlite3.connect(f"file:{quoted}?mode=ro&immutable=1", uri=True)
    for pragma in ("trusted_schema=OFF", "cell_size_check=ON", "mmap_size=0"):
        base.execute(f"PRAGMA {pragma}")
    for name in names:
        kind = base.execute("SELECT type, sql FROM sqlite_master WHERE name = ?", (name,))
        found = kind.fetchone()
        if found is None:
            continue
        if found[0] != "table" or "VIRTUAL" in str(found[1]).upper().split()[:2]:
            raise RefusedError(f"{name} is a {found[0]} that computes its rows. A table is needed")
        hidden = {row[1]: row[6] for row in base.execute(f"PRAGMA table_xinfo({name})")}
        columns = {
            column: kind
            for column, kind in TABLES[name].items()
            if column in hidden or column not in OPTIONAL
        }
        for column in columns:
            if hidden.get(column, 1):
                raise RefusedError(f"{name} has no column {column}")
        yield name, None, {"others": " ".join(sorted(hidden.keys() - columns.keys()))}
        rows = base.execute(f"SELECT {', '.join(columns)} FROM {name}")
        yield from _columns(name, columns, rows, maximum)


def _columns(name: str, columns: dict[str, str], rows: Any, maximum: int) -> Iterator[Any]:
    """The columns of rows, each value of its type."""
    values: list[list[Any]] = [[] for _ in columns]
    for number, row in enumerate(rows, start=1):
        if number * ROW_BYTES > maximum:
            raise RefusedError(f"{name} has more rows than the file has room for")
        for (column, kind), position, value in zip(columns.items(), values, row, strict=True):
            valid = {"integer": (int,), "number": (int, float), "text": (str,)}.get(kind, (object,))
            if not isinstance(value, valid):
                raise RefusedError(
                    f"{name}, row {number}: {column}: {str(value)[:40]!r} is no {kind}"
                )
            position.append(value)
    types = {"integer": np.int64, "number": np.float64}
    for (column, kind), position in zip(columns.items(), values, strict=True):
        made = types.get(kind)
        array = np.array(json.dumps(position, default=str)) if made is None else np.array(position, made)
        yield f"{name}/{column}", array, {}


def parts_of_hdf5(path: str, maximum: int, names: list[str]) -> Iterator[tuple[str, Any, Any]]:
    """Each group and dataset at or below these names, and the attributes of each; of the name `.`
    the attributes of the file alone."""
    import h5py

    left = maximum
    with h5py.File(path, "r") as file:
        if "." in names:
            yield ".", None, {key: _plain(value) for key, value in file.attrs.items()}
        todo = [name for name in names if name != "." and name in file]
        while todo:
            name = todo.pop()
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise RefusedError(f"/{name} is a link to somewhere else")
            found = file[name]
            attributes = {key: _plain(value) for key, value in found.attrs.items()}
            if isinstance(found, h5py.Group):
                if name.count("/") > DEEPEST or len(todo) + len(found) > maximum // 100:
                    raise RefusedError(f"/{name}: groups without end")
                todo += [f"{name}/{key}" for key in found]
                yield name, None, attributes
            elif isinstance(found, h5py.Dataset):
                if found.is_virtual or found.external:
                    raise RefusedError(f"/{name} has its numbers in other files")
                if found.shape is None or found.dtype.hasobject:
                    yield name, np.array(f"{found.dtype}"), attributes
                    continue
                left -= found.size * found.dtype.itemsize
                if left < 0:
                    raise RefusedError(
                        f"/{name}, shape {found.shape}: more than a file of this size can have"
                    )
                yield name, found[()], attributes


def _plain(value: Any) -> Any:
    """An attribute as JSON has it; None for what is neither a text nor one number."""
    if isinstance(value, bytes | np.bytes_):
        return bytes(value).decode("utf-8", "replace")
    if isinstance(value, np.generic | np.ndarray) and np.size(value) == 1:
        value = np.ravel(value)[0].item()
    return value if isinstance(value, str | int | float) else None


def reply(request: dict[str, Any]) -> Any:
    """Read what is asked for, as .npz."""
    arrays: dict[str, Any] = {}
    parts = []
    reader = parts_of_sqlite if request["kind"] == "sqlite" else parts_of_hdf5
    for name, array, attributes in reader(request["path"], request["most_bytes"], request["names"]):
        parts.append([name, None if array is None else len(arrays), attributes])
        if array is not None:
            arrays[str(len(arrays))] = array
    content = io.BytesIO()
    np.savez(content, parts=np.array(json.dumps(parts)), **arrays)
    return content.getbuffer()


def main() -> int:
    """Answer the request within its limits; return the exit status."""
    request = json.load(sys.stdin)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.setitimer(signal.ITIMER_PROF, request["cpu_s"])
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    maximum = request["memory_bytes"]
    minimum = maximum if hard == resource.RLIM_INFINITY else min(maximum, hard)
    resource.setrlimit(resource.RLIMIT_AS, (minimum, hard))
    try:
        sys.stdout.buffer.write(reply(request))
        return 0
    except MemoryError:
        why = "it needs more memory than a file of its size should"
    except RefusedError as error:
        why = str(error)
    except Exception as error:  # whatever the libraries raise for a damaged file
        why = f"damaged: {(str(error).splitlines() or [type(error).__name__])[0]}"
    sys.stdout.buffer.write(why.encode())
    return REFUSED


if __name__ == "__main__":
    sys.exit(main())
