"""Percussions as CSV and as Parquet: what is read back is what was written, number for number."""

import csv
import io
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dumps import DumpError
from analysis.percussions import contact_rows
from analysis.percussions.setting import Setting
from analysis.percussions.solve_dump import DumpToSolve, solve_dump
from tests.crowds import frame

WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=8)


def csv_lines(columns):
    return contact_rows.rows_of(dict(enumerate(columns)))


@given(st.lists(st.tuples(st.floats(), st.integers(-(2**63), 2**63 - 1), WORDS)))
def test_rows_come_back(rows):
    columns = list(zip(*rows, strict=True)) or [(), (), ()]
    read = list(csv.reader(io.StringIO(csv_lines(columns).decode(), newline="")))
    assert len(read) == len(rows)
    for (number, full, word), cells in zip(rows, read, strict=True):
        assert cells[1:] == [str(full), word]
        if math.isfinite(number):
            assert float(cells[0]).hex() == (number + 0.0).hex()  # 0 has no sign
        else:
            assert cells[0] == ""


def test_what_is_not_known_is_empty():
    assert csv_lines([[1, 2], [None, -0.0], ["a", ""]]) == b"1,,a\n2,0.0,\n"


@given(st.lists(st.tuples(st.floats(), st.integers(-(2**63), 2**63 - 1)), min_size=1))
def test_arrays_are_written_as_lists_are(rows):
    numbers, full = zip(*rows, strict=True)
    arrays = [np.array(numbers), np.array(full)]
    assert csv_lines(arrays) == csv_lines([numbers, full])
    assert csv_lines([np.array([*rows])[:, 0]]) == csv_lines([numbers])  # not contiguous


def test_no_lines():
    assert csv_lines([[], []]) == b""
    with pytest.raises(ValueError, match=r"columns of \[1, 2\] rows"):
        csv_lines([[1], [1, 2]])
    with pytest.raises(ValueError, match="null character"):
        csv_lines([["a\0"]])


def dump_of(folder, *arguments):
    path, one = folder / "some.dump", [1, 0, 0, 0.25, 75, 2, 0]
    frames = (frame(n, [one, [2, x, 0, 0.25, 75, 0, 0]]) for n, x in enumerate(arguments))
    path.write_text("".join(frames))
    return DumpToSolve(path=path, setting=Setting(left_velocity="dump"), indeterminacy="ranges")


@pytest.mark.parametrize("group", [1, contact_rows.GROUP])
def test_the_same_rows(tmp_path, monkeypatch, group):
    monkeypatch.setattr(contact_rows, "GROUP", group)
    dump = dump_of(tmp_path, 0.5, 2.0, 0.49, 0.5)
    for name in ("a.csv", "a.parquet"):
        assert solve_dump(dump, tmp_path / name).contacts == 3
    wanted = pd.read_csv(tmp_path / "a.csv")
    found = pd.read_parquet(tmp_path / "a.parquet")
    assert len(found) == 3
    pd.testing.assert_frame_equal(found, wanted, check_dtype=False, check_exact=True)


def test_what_was_there_stays_where_there_is_no_contact(tmp_path):
    out = tmp_path / "a.parquet"
    out.write_text("before")
    with pytest.raises(DumpError, match="no contact"):
        solve_dump(dump_of(tmp_path, 2.0), out)
    assert out.read_text() == "before"
    assert len(list(tmp_path.iterdir())) == 2
