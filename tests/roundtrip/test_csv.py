"""Lines of CSV: what is read back is what was written."""

import csv
import io
import math

from hypothesis import given
from hypothesis import strategies as st

from analysis.support.files import csv_lines

WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=8)


@given(st.lists(st.tuples(st.floats(), st.integers(-(2**63), 2**63 - 1), WORDS)))
def test_rows_come_back(rows):
    columns = list(zip(*rows, strict=True)) or [(), (), ()]
    read = list(csv.reader(io.StringIO(csv_lines(columns), newline="")))
    assert len(read) == len(rows)
    for (number, whole, word), cells in zip(rows, read, strict=True):
        assert cells[1:] == [str(whole), word]
        if math.isfinite(number):
            assert float(cells[0]).hex() == number.hex()
        else:
            assert cells[0] == ""


def test_what_is_not_known_is_empty():
    assert csv_lines([[1, 2], [None, 0.5], ["a", ""]]) == "1,,a\n2,0.5,\n"
