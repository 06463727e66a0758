"""Rows of contacts on their way into a file: CSV, or Parquet where its name ends so."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from analysis.percussions.csv_lines import Column, csv_lines
from analysis.percussions.table import COLUMNS
from analysis.support.files import whole_file
from analysis.support.parts import load

# Columns that are not of float64.
WHOLE = frozenset({"step", "first", "second", "is_wall", "determined"})
WORDS = frozenset({"state", "wall", "status"})
# Rows that are written at once; in Parquet they are a group, packed and read together.
GROUP = 1 << 17

# Rows of one frame: lines of CSV, or a batch of Arrow.
Rows = Any


def is_parquet(out: Path) -> bool:
    """Tell whether a table of this name is a Parquet file."""
    return out.suffix.lower() == ".parquet"


def rows_of(cells: Mapping[str, Column], parquet: bool) -> Rows:
    """Return the columns of a frame as what `table_file` writes."""
    names = [name for name in COLUMNS if name in cells]
    if not parquet:
        return csv_lines(cells[name] for name in names)
    arrow = load("pyarrow")
    return arrow.RecordBatch.from_pydict(
        {name: cells[name] for name in names}, schema=schema_of(names)
    )


@contextlib.contextmanager
def table_file(out: Path) -> Iterator[Callable[[Sequence[str], Rows], None]]:
    """Open a table that takes its name only if the block ends well; call what is yielded with the
    columns and the rows of each frame."""
    if is_parquet(out):
        with _parquet_file(out) as add:
            yield add
        return
    with whole_file(out, "wb") as file:
        head: list[str] = []

        def add(columns: Sequence[str], rows: Rows) -> None:
            if not head:
                head.extend(columns)
                file.write((",".join(head) + "\n").encode())
            assert list(columns) == head, "every frame has the same columns"
            file.write(rows)

        yield add


@contextlib.contextmanager
def _parquet_file(out: Path) -> Iterator[Callable[[Sequence[str], Rows], None]]:
    arrow, parquet = load("pyarrow"), load("pyarrow.parquet")
    waiting: list[Any] = []
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(whole_file(out, "wb"))
        writers: list[Any] = []

        def write() -> None:
            writers[0].write_table(arrow.Table.from_batches(waiting))
            waiting.clear()

        def add(columns: Sequence[str], rows: Rows) -> None:
            if not writers:
                schema = schema_of(columns)
                writers.append(stack.enter_context(parquet.ParquetWriter(file, schema)))
            waiting.append(rows)
            if sum(map(len, waiting)) >= GROUP:
                write()

        yield add
        if waiting:
            write()


def schema_of(columns: Sequence[str]) -> Any:
    """Return the Arrow schema of these columns."""
    arrow = load("pyarrow")
    kinds = {**dict.fromkeys(WHOLE, arrow.int64()), **dict.fromkeys(WORDS, arrow.string())}
    return arrow.schema([(name, kinds.get(name, arrow.float64())) for name in columns])
