"""Percussions as Parquet: the rows of the CSV file, number for number."""

import pandas as pd
import pytest

from analysis.dumps import DumpError
from analysis.percussions import table
from analysis.percussions.setting import Setting
from analysis.percussions.solving import DumpToSolve, solve_dump
from tests.crowds import frame


def dump_of(folder, *places):
    path, one = folder / "some.dump", [1, 0, 0, 0.25, 75, 2, 0]
    frames = (frame(n, [one, [2, x, 0, 0.25, 75, 0, 0]]) for n, x in enumerate(places))
    path.write_text("".join(frames))
    return DumpToSolve(path=path, setting=Setting(left_velocity="dump"), openness="ranges")


@pytest.mark.parametrize("group", [1, table.GROUP])
def test_the_same_rows(tmp_path, monkeypatch, group):
    monkeypatch.setattr(table, "GROUP", group)
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
