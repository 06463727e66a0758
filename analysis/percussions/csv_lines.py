"""Columns as lines of CSV: numbers as short as they can be, put into rows by compiled code."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from nscd.compiling import kernel
from nscd.compiling.bits import eight, put_eight, zeros_below

Column = Sequence[Any] | NDArray[Any]
# Behind each word of a column: no number has a null, and no table of text should.
BEHIND = b"\0"
COMMA, LINE, UNKNOWN = (ord(sign) for sign in ",\nn")
# Eight times the same byte.
ONES, TOPS = np.uint64(0x0101010101010101), np.uint64(0x8080808080808080)
COMMAS, BRACKETS = (np.uint64(ord(sign)) * ONES for sign in ",]")


def csv_lines(columns: Iterable[Column]) -> bytes:
    """Return columns of equal length, each of numbers or of texts, as lines of CSV in UTF-8.

    Numbers are as short as they can be and still the same when read; None, NaN and infinities are
    empty. Raises ValueError for columns of different lengths."""
    given = list(columns)
    lengths = {len(column) for column in given}
    if len(lengths) > 1:
        raise ValueError(f"columns of {sorted(lengths)} rows; one length is needed")
    if not any(lengths):
        return b""
    texts = np.array([isinstance(column[0], str) for column in given])
    parts = [
        _of_texts(column) if text else _of_numbers(column)
        for column, text in zip(given, texts, strict=True)
    ]
    sizes = np.array([len(part) for part in parts])
    place = np.cumsum(sizes) - sizes
    words = np.frombuffer(b"".join([*parts, bytes(8)]), np.uint8)
    out = np.empty(int(sizes.sum()) + 8, np.uint8)
    size = _by_rows(words, place, texts, len(given[0]), out)
    return out[:size].tobytes()


def _of_numbers(column: Column) -> bytes:
    """The numbers as [1,2,null]."""
    if isinstance(column, np.ndarray):
        return orjson.dumps(np.ascontiguousarray(column), option=orjson.OPT_SERIALIZE_NUMPY)
    return orjson.dumps(column)


def _of_texts(column: Column) -> bytes:
    """The words, each with what stands behind it."""
    words = set(column)
    if any("\0" in word for word in words):
        raise ValueError("a text with a null character; CSV has none")
    if len(words) == 1:
        return (_quoted(column[0]) + BEHIND) * len(column)
    quoted = {word: _quoted(word) for word in words}
    return BEHIND.join([quoted[word] for word in column]) + BEHIND


def _quoted(word: str) -> bytes:
    needed = set(word) & set(',"\r\n')
    return ('"' + word.replace('"', '""') + '"' if needed else word).encode()


@kernel(nogil=True)
def _by_rows(words: Any, place: Any, texts: Any, rows: int, out: Any) -> Any:
    """Put the words of each column, which begin at its place, into rows; return their size. Words
    and rows have eight bytes more behind them."""
    size: Any = 0
    # the bracket in front of numbers
    for c in range(len(place)):
        place[c] += 0 if texts[c] else 1
    for _ in range(rows):
        for c in range(len(place)):
            at: Any = place[c]
            unknown = not texts[c] and words[at] == UNKNOWN
            at += len("null") if unknown else 0
            while not unknown:
                signs = eight(words, at)
                put_eight(out, size, signs)
                ends = (
                    _nulls(signs) if texts[c] else _nulls(signs ^ COMMAS) | _nulls(signs ^ BRACKETS)
                )
                count = np.int64(zeros_below(ends) >> np.uint64(3)) if ends else 8
                at += count
                size += count
                if ends:
                    break
            place[c] = at + 1
            out[size] = COMMA if c + 1 < len(place) else LINE
            size += 1
    return size


@kernel
def _nulls(signs: Any) -> Any:
    """The top bit of the lowest byte that is 0, and of some above it; 0 where none is."""
    return (signs - ONES) & ~signs & TOPS
