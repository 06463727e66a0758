"""Columns as lines of CSV: numbers as short as they can be and still the same when read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscd import _core

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
