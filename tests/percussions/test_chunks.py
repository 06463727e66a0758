"""Percussions as a folder of parts: the rows of one table, kept when the work is interrupted."""

import dataclasses
import os

import pandas as pd
import pytest

from analysis.cli.options import with_options
from analysis.cli.runs import solve
from analysis.percussions.setting import Setting
from analysis.percussions.solve_dump import JOB, DumpToSolve, solve_dump, solve_in_chunks
from analysis.support.write_frames import write_frame

FRAMES, PART, ROW = 50, 4, 40


@pytest.fixture
def dump(tmp_path):
    """A row of people that is pushed, ever more of them touching; nobody in the first frames."""
    path = tmp_path / "row.dump"
    with path.open("w") as file:
        for step in range(FRAMES):
            cycle = [0.5 if i < step - PART else 0.6 for i in range(ROW)]
            x = [sum(cycle[:i]) for i in range(ROW)]
            columns = {"id": range(1, ROW + 1), "x": x, "y": [0.0] * ROW, "radius": [0.25] * ROW}
            columns |= {"mass": [75.0] * ROW, "vx": [2.0 - 0.1 * i for i in range(ROW)]}
            columns["vy"] = [0.0] * ROW
            write_frame(file, "ATOMS", step, list(columns), list(columns.values()))
    return DumpToSolve(path=path, setting=Setting(left_velocity="dump"), indeterminacy="none")


def table(path):
    return pd.read_parquet(path)


def test_the_rows_are_those_of_one_table(dump, tmp_path):
    complete = solve_dump(dump, tmp_path / "one.parquet")
    parts = solve_in_chunks(dump, tmp_path / "parts.parquet", PART)
    assert (parts.frames, parts.contacts, parts.when) == (FRAMES, complete.contacts, complete.when)
    assert len(list((tmp_path / "parts.parquet").glob("frames_*.parquet"))) == 13
    pd.testing.assert_frame_equal(
        table(tmp_path / "parts.parquet"), table(tmp_path / "one.parquet"), rtol=1e-9, atol=1e-9
    )


def test_what_is_finished_is_kept(dump, tmp_path):
    folder = tmp_path / "parts.parquet"
    before = solve_in_chunks(dump, folder, PART)
    first = table(folder)
    names = sorted(folder.glob("frames_*"))
    names[3].unlink()
    names[5].write_bytes(names[5].read_bytes()[:-7])
    (folder / ".frames_00000012_00000015.parquet.99.part").write_text("of a worker that was lost")
    times = {name: name.stat().st_mtime_ns for name in names if name.exists()}
    observed = []
    again = solve_in_chunks(dump, folder, PART, progress=lambda _, fraction: observed.append(fraction))
    assert again == before
    assert observed == [12 / 13, 1.0]
    pd.testing.assert_frame_equal(table(folder), first)
    changed = {name for name in times if name.stat().st_mtime_ns != times[name]}
    assert changed == {names[5]}
    assert sorted(folder.iterdir()) == sorted([folder / JOB, *names])


def test_other_parts_are_refused(dump, tmp_path):
    folder = tmp_path / "parts.parquet"
    solve_in_chunks(dump, folder, PART)
    with pytest.raises(ValueError, match=r"another frames per part \(4 where this is 5\)"):
        solve_in_chunks(dump, folder, 5)
    os.utime(dump.path, ns=(1, 1))
    with pytest.raises(ValueError, match=r"--out: .*parts.parquet: its parts are of another dump"):
        solve_in_chunks(dump, folder, PART)
    with pytest.raises(ValueError, match=r"it is there, and no folder of parts"):
        solve_in_chunks(dump, tmp_path, PART)
    (folder / JOB).write_text("[")
    with pytest.raises(ValueError, match=r"_job.json: not what is written there"):
        solve_in_chunks(dump, folder, PART)


def test_foreign_parts_are_refused_and_damaged_ones_are_made_again(dump, tmp_path):
    """A part of another dump under a right name, any other table, and a page that is damaged."""
    folder, other = tmp_path / "parts.parquet", tmp_path / "other.parquet"
    before = solve_in_chunks(dump, folder, 25)
    complete = table(folder)
    loose = dataclasses.replace(dump, tolerance=1e-6)
    solve_in_chunks(loose, other, 25)
    first, second = sorted(folder.glob("frames_*"))
    own = first.read_bytes()
    first.write_bytes((other / first.name).read_bytes())
    with pytest.raises(ValueError, match=f"{first.name}: no part of this dump and these settings"):
        solve_in_chunks(dump, folder, 25)
    first.write_bytes(second.read_bytes())
    with pytest.raises(ValueError, match=f"{first.name}: no part of this dump"):
        solve_in_chunks(dump, folder, 25)
    pd.DataFrame({"x": [1.0]}).to_parquet(first)
    with pytest.raises(ValueError, match=f"{first.name}: no part of this dump"):
        solve_in_chunks(dump, folder, 25)
    damaged = bytearray(own)
    damaged[len(own) // 3] ^= 0x41
    first.write_bytes(damaged)
    (folder / "frames_7.parquet").write_bytes(own)
    with pytest.raises(ValueError, match=r"frames_7\.parquet: no part of this dump. Remove it"):
        solve_in_chunks(dump, folder, 25)
    (folder / "frames_7.parquet").unlink()
    assert solve_in_chunks(dump, folder, 25) == before
    pd.testing.assert_frame_equal(table(folder), complete, rtol=1e-9, atol=1e-9)


def test_the_command(dump, tmp_path, capsys):
    out = tmp_path / "contacts.parquet"
    command = with_options(solve)
    command([dump.path], left_velocity="dump", part_frames=20, out=out)
    assert len(list(out.glob("frames_*.parquet"))) == 3
    assert str(out) in capsys.readouterr().out
    with pytest.raises(ValueError, match=r"--part-frames: contacts.csv: parts are Parquet"):
        command([dump.path], left_velocity="dump", part_frames=20)


@pytest.mark.long
def test_a_worker_is_lost(dump, tmp_path, cluster):
    """One of two workers is killed when the first part is finished; the other does the rest."""
    address, (one, other) = cluster
    lost = []

    def kill(_, fraction):
        if not lost:
            one.kill()
            one.wait()
            lost.append(fraction)

    found = solve_in_chunks(
        dump, tmp_path / "parts.parquet", PART, scheduler=address, progress=kill
    )
    assert lost == [1 / 13]
    assert other.poll() is None
    assert found.frames == FRAMES
    solve_dump(dump, tmp_path / "one.parquet")
    pd.testing.assert_frame_equal(
        table(tmp_path / "parts.parquet"), table(tmp_path / "one.parquet"), rtol=1e-9, atol=1e-9
    )
