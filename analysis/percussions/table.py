"""Percussions as rows: one per contact, the same in CSV, Parquet and data frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.percussions.setting import Setting, Solved
from analysis.support.extras import load
from analysis.support.files import whole_file
from nscd import _core
from nscd.arrays import Floats, Indices
from nscd.indeterminacy.admissible import Admissible, ProgramError
from nscd.indeterminacy.determinacy import determinacy_of
from nscd.indeterminacy.intervals import Intervals, weights_of_contacts
from nscd.percussions import Status
from nscd.show import Touching, arrays, as_frame

if TYPE_CHECKING:
    import pandas as pd

Column = Sequence[Any] | NDArray[Any]


def csv_lines(columns: Iterable[Column]) -> bytes:
    """Return columns of equal length, each of numbers or of texts, as lines of CSV in UTF-8.

    Numbers are as short as they can be and still the same when read; None, NaN and infinities are
    empty. Raises ValueError for columns of different lengths, and a text with a null character."""
    given = [_plain(column) for column in columns]
    lengths = {len(column) for column in given}
    if len(lengths) > 1:
        raise ValueError(f"columns of {sorted(lengths)} rows; one length is needed")
    return _core.table(given, csv=True)


def _plain(column: Column) -> Any:
    """An array of float64 or int64, or a list."""
    if not isinstance(column, np.ndarray):
        return list(column)
    return np.ascontiguousarray(column, np.float64 if column.dtype.kind == "f" else np.int64)


# What is said of reactions that the mechanics may leave open.
Openness = Literal["none", "determined", "ranges"]
# Every column that a row can have, in order.
COLUMNS = (
    "time_s", "step", "first", "second", "is_wall", "nx", "ny", "gap_m",
    "reaction_Ns", "friction_Ns", "state", "impulse_x_Ns", "impulse_y_Ns", "force_x_N", "force_y_N",
    "force_N",
    "wall", "determined", "lower_Ns", "upper_Ns", "friction_lower_Ns", "friction_upper_Ns",
    "status", "residual", "velocity_error_m_per_s",
)  # fmt: skip
Cells = dict[str, list[Any]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Open:
    """What the mechanics leaves open of k reactions.

    determined: (k,) 1 where every admissible percussion has the same reaction (and friction), else
        0
    lower, upper: (k,) N·s, least and largest reaction of all admissible percussions; None where
        there is no end, or none was proven
    friction_lower, friction_upper: (k,) N·s, the same of τ; None without friction"""

    determined: list[int | None]
    lower: list[float | None]
    upper: list[float | None]
    friction_lower: list[float | None] | None = None
    friction_upper: list[float | None] | None = None


def openness_of(found: Solved, ranges: bool) -> Open:
    """Find what the balance and reactions that only push leave open; `ranges`: and how far.

    Everything is None where the answer is not solved, or no linear program proves it."""
    k = len(found.contacts)
    nothing = Open(determined=[None] * k, lower=[None] * k, upper=[None] * k)
    if found.answer.status != Status.SOLVED or not k:
        return nothing
    rough = found.answer.friction is not None
    try:
        held = (Admissible.with_friction if rough else Admissible.of)(found.contacts, found.answer)
        determined = determinacy_of(held).determined
        lower: list[float | None] = found.answer.reaction.tolist()
        upper = list(lower)
        sides: dict[str, list[float | None]] = {"friction_lower": [], "friction_upper": []}
        if ranges and (rough or not determined.all()):
            intervals = Intervals(held)
            for row in range(k) if rough else np.flatnonzero(~determined).tolist():
                weights = weights_of_contacts(found.contacts, row)
                span = intervals.of(weights)
                lower[row], upper[row] = _finite(span.lower), _finite(span.upper)
                if rough:
                    span = intervals.of(weights, tangential=True)
                    sides["friction_lower"].append(_finite(span.lower))
                    sides["friction_upper"].append(_finite(span.upper))
    except (ProgramError, ValueError):
        return nothing
    return Open(
        determined=determined.astype(int).tolist(),
        lower=lower,
        upper=upper,
        **(sides if rough else {}),
    )


def columns_of(
    found: Solved,
    openness: Openness = "none",
    *,
    time: float | None = None,
    step: int | None = None,
) -> dict[str, Column]:
    """Name the columns of k rows: arrays, or lists of words or of what may be None. Those that have
    nothing to say are left out."""
    contacts, answer = found.contacts, found.answer
    k = len(contacts)
    cells = when(
        None if time is None else np.full(k, time), None if step is None else np.full(k, step)
    )
    cells |= arrays(found.snapshot, contacts, answer.reaction, answer.impulse, found.window)
    if answer.friction is not None:
        cells |= answer.friction.columns()
    cells |= walls_of(found.setting, contacts)
    if openness != "none":
        known = openness_of(found, openness == "ranges")
        cells["determined"] = list(known.determined)
        if openness == "ranges":
            cells |= {"lower_Ns": list(known.lower), "upper_Ns": list(known.upper)}
            if answer.friction is not None:
                ends = known.friction_lower or [None] * k, known.friction_upper or [None] * k
                cells |= {"friction_lower_Ns": list(ends[0]), "friction_upper_Ns": list(ends[1])}
    residual, error = np.full(k, answer.residual), np.full(k, answer.velocity_error)
    return cells | certificate(str(answer.status), residual, error)


def when(time: Floats | None, step: Indices | None) -> dict[str, Column]:
    """Name the column of when k contacts were: times (k,) s, or steps (k,) where these are not
    known."""
    if time is not None:
        return {"time_s": time}
    return {} if step is None else {"step": step}


def walls_of(setting: Setting, contacts: Touching) -> dict[str, Column]:
    """Name the column of the walls that k contacts are with, where walls have names."""
    if not setting.wall_names:
        return {}
    names = ("", *setting.wall_names)
    number = np.where(contacts.is_wall, contacts.second + 1, 0)
    return {"wall": [names[n] for n in number.tolist()]}


def certificate(status: str, residual: Floats, error: Floats) -> dict[str, Column]:
    """Name the columns of what the answers of k contacts say of themselves; (k,), (k,) m/s."""
    cells: dict[str, Column] = {"status": [status] * len(residual)}
    return cells | {
        "residual": _none_where_nan(residual),
        "velocity_error_m_per_s": _none_where_nan(error),
    }


def cells_of(
    found: Solved,
    openness: Openness = "none",
    *,
    time: float | None = None,
    step: int | None = None,
) -> Cells:
    """Name the cells of each column, a list of k. Columns that have nothing to say are left out."""
    columns = columns_of(found, openness, time=time, step=step)
    return {
        name: column.tolist() if isinstance(column, np.ndarray) else list(column)
        for name, column in columns.items()
    }


def dataframe(
    found: Solved, time: float | None = None, openness: Openness = "determined"
) -> pd.DataFrame:
    """Return the rows as a data frame."""
    frame = as_frame(columns_of(found, openness, time=time))
    return frame if openness == "none" else frame.astype({"determined": "Int64"})


def _none_where_nan(values: Floats) -> Column:
    """Numbers; None for those that are not finite."""
    return values if np.isfinite(values).all() else [_finite(value) for value in values]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


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
