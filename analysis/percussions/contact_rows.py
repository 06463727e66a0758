"""Percussions as rows: one per contact, the same in CSV, Parquet and data frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.percussions.setting import Setting
from analysis.support.columns import Columns
from analysis.support.extras import load
from analysis.support.files import whole_file
from nscd import _core
from nscd.arrays import Floats, Indices, Mask
from nscd.contacts import Contacts
from nscd.solve_frames import FrameSolutions

Column = Sequence[Any] | NDArray[Any]


# Own forces of contacts that came with a dump.
OWN = ("own_x_N", "own_y_N")
# What is said of reactions that the mechanics may leave open.
Indeterminacy = Literal["none", "determined", "ranges", "ensemble"]
# Every column that a row can have, in order.
COLUMNS = Columns("solve")


def table_columns(
    cells: Mapping[str, Column],
    setting: Setting,
    contacts: Contacts | FrameSolutions,
    when: tuple[ArrayLike | None, ArrayLike | None],
    certificate: tuple[str, ArrayLike, ArrayLike],
) -> dict[str, Column]:
    """Give the columns of k contacts in order: the cells, the names of walls, and of each contact (k,),
    or of all:

    when: time (s), or where that is None the step of the simulation, if it is known
    certificate: status, residual and velocity error (m/s) of its answer"""
    k, (time, step), (status, residual, error) = len(contacts.first), when, certificate
    found = {**cells, "status": [status] * k}
    for name, values in (("residual", residual), ("velocity_error_m_per_s", error)):
        found[name] = with_nulls(np.full(k, values))
    if time is not None:
        found["time_s"] = np.full(k, time)
    elif step is not None:
        found["step"] = np.full(k, step)
    if setting.wall_names:
        names = ("", *setting.wall_names)
        number = np.where(contacts.is_wall, contacts.second + 1, 0)
        found["wall"] = [names[n] for n in number.tolist()]
    return {name: found[name] for name in COLUMNS if name in found}


def with_nulls(values: Floats | Indices, where: Mask | None = None) -> Column:
    """Give numbers as a column, None in place of those that are not known: not finite, or not
    `where` (k,)."""
    sure = np.isfinite(values) if where is None else where
    if sure.all():
        return values
    return [value if one else None for value, one in zip(values.tolist(), sure, strict=True)]


# Columns that are not of float64.
WHOLE = frozenset({"step", "first", "second", "is_wall", "determined"})
WORDS = frozenset({"state", "wall", "status", "sampling"})
# Rows that are written at once; in Parquet they are a group, packed and read together.
GROUP = 1 << 17

# Rows of one frame: lines of CSV, or a batch of Arrow.
Rows = Any


def is_parquet(out: Path) -> bool:
    """Tell whether a table of this name is a Parquet file."""
    return out.suffix.lower() == ".parquet"


def rows_of(cells: Mapping[str, Column], parquet: bool = False) -> Rows:
    """Return columns of equal length, each of numbers or of texts, as what `table_file` writes: a batch of
    Arrow, or lines of CSV in UTF-8.

    Numbers in CSV are as short as they can be and still the same when read; None, NaN and infinities are
    empty. Raises ValueError for columns of different lengths, and a text with a null character."""
    if parquet:
        return load("pyarrow").RecordBatch.from_pydict(dict(cells), schema=schema_of(cells))
    inputs: list[Any] = []
    for cell in cells.values():
        kind = getattr(cell, "dtype", None)
        own = np.float64 if kind is not None and kind.kind == "f" else np.int64
        inputs.append(list(cell) if kind is None else np.ascontiguousarray(cell, own))
    if len(lengths := {len(one) for one in inputs}) > 1:
        raise ValueError(f"columns of {sorted(lengths)} rows. One length is needed")
    return _core.table(inputs, csv=True)


@contextlib.contextmanager
def table_file(
    out: Path, about: Callable[[], Mapping[bytes, str]] = dict
) -> Iterator[Callable[[Iterable[str], Rows], None]]:
    """Open a table that takes its name only if the block ends well; call what is yielded with the
    columns and the rows of each frame.

    about: gives the metadata of a Parquet file once all rows are there"""
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(whole_file(out, "wb"))
        head: list[str] = []
        waiting: list[Any] = []
        writer: Any = None

        def write() -> None:
            writer.write_table(load("pyarrow").Table.from_batches(waiting))
            waiting.clear()

        def add(columns: Iterable[str], rows: Rows) -> None:
            nonlocal writer
            if not head:
                head.extend(columns)
                if is_parquet(out):
                    make, schema = load("pyarrow.parquet").ParquetWriter, schema_of(head)
                    writer = stack.enter_context(make(file, schema, write_page_checksum=True))
                else:
                    file.write((",".join(head) + "\n").encode())
            assert list(columns) == head, "every frame has the same columns"
            if writer is None:
                file.write(rows)
                return
            waiting.append(rows)
            if sum(map(len, waiting)) >= GROUP:
                write()

        yield add
        if waiting:
            write()
        if writer is not None:
            writer.add_key_value_metadata(about())


def schema_of(columns: Iterable[str]) -> Any:
    """Return the Arrow schema of these columns."""
    arrow = load("pyarrow")
    kinds = {**dict.fromkeys(WHOLE, arrow.int64()), **dict.fromkeys(WORDS, arrow.string())}
    return arrow.schema([(name, kinds.get(name, arrow.float64())) for name in columns])
