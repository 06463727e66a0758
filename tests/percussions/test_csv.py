"""Lines of CSV: what is read back is what was written."""

import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.percussions.table import csv_lines

WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=8)


@given(st.lists(st.tuples(st.floats(), st.integers(-(2**63), 2**63 - 1), WORDS)))
def test_rows_come_back(rows):
    columns = list(zip(*rows, strict=True)) or [(), (), ()]
    read = list(csv.reader(io.StringIO(csv_lines(columns).decode(), newline="")))
    assert len(read) == len(rows)
    for (number, whole, word), cells in zip(rows, read, strict=True):
        assert cells[1:] == [str(whole), word]
        if math.isfinite(number):
            assert float(cells[0]).hex() == number.hex()
        else:
            assert cells[0] == ""


def test_what_is_not_known_is_empty():
    assert csv_lines([[1, 2], [None, 0.5], ["a", ""]]) == b"1,,a\n2,0.5,\n"


@given(st.lists(st.tuples(st.floats(), st.integers(-(2**63), 2**63 - 1)), min_size=1))
def test_arrays_are_written_as_lists_are(rows):
    numbers, whole = zip(*rows, strict=True)
    arrays = [np.array(numbers), np.array(whole)]
    assert csv_lines(arrays) == csv_lines([numbers, whole])
    assert csv_lines([np.array([*rows])[:, 0]]) == csv_lines([numbers])  # not contiguous


def test_no_lines():
    assert csv_lines([[], []]) == b""
    with pytest.raises(ValueError, match=r"columns of \[1, 2\] rows"):
        csv_lines([[1], [1, 2]])
    with pytest.raises(ValueError, match="null character"):
        csv_lines([["a\0"]])
