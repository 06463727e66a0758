"""Dumps: what is written is what is read; damaged, reordered and foreign ones."""

import bz2
import gzip
import lzma
import os

import numpy as np
import pytest

from analysis.dumps import (
    DumpError,
    index_contacts,
    index_dump,
    open_bodies,
    read_contacts,
    snapshot_of,
)
from tests import crowds

COLUMNS = "id type x y z radius mass vx vy vz omegaz fx fy"


def frame(step, rows, columns=COLUMNS, kind="ATOMS"):
    return crowds.frame(step, rows, columns, kind)


def rows(n=4, seed=0):
    rng = np.random.default_rng(seed)

    def two():
        return rng.normal(size=2).tolist()

    return [[i + 1, 1, *two(), 0, 0.2, 75.0 + i, *two(), 0, 0.5, 1, 2] for i in range(n)]


def test_float64_and_id_order(tmp_path):
    path = tmp_path / "bodies.dump"
    table = rows()
    path.write_text(frame(0, table) + frame(10, table[::-1]))
    universe = open_bodies(path, 1e-3)
    assert universe.trajectory.n_frames == 2
    for ts, time in zip(universe.trajectory, (0.0, 0.01), strict=True):
        snapshot = snapshot_of(ts)
        assert snapshot.time == pytest.approx(time)
        np.testing.assert_array_equal(snapshot.ids, [1, 2, 3, 4])
        np.testing.assert_array_equal(snapshot.position, [row[2:4] for row in table])
        np.testing.assert_array_equal(snapshot.mass, [75, 76, 77, 78])


LEAST = "id x y diameter density vx vy"


def test_foreign_dump_with_the_least_columns(tmp_path):
    path = tmp_path / "foreign.lammpstrj"
    path.write_text(frame(5, [[2, 0.5, 0, 0.5, 1000.0, 1, 2], [1, 0, 0, 0.5, 1000.0, 3, 4]], LEAST))
    snapshot = snapshot_of(open_bodies(path).trajectory.ts)
    np.testing.assert_allclose(snapshot.mass, 1000 * 4 / 3 * np.pi * 0.25**3)
    np.testing.assert_array_equal(snapshot.radius, 0.25)
    np.testing.assert_array_equal(snapshot.velocity, [[3, 4], [1, 2]])


@pytest.mark.parametrize("names", ["xu yu", "xs ys", "xsu ysu"])
def test_other_names_of_a_place(tmp_path, names):
    """The box is from −10 to 10 m: 0.55 of it is 1 m."""
    path = tmp_path / "scaled.dump"
    x = 1.0 if names == "xu yu" else 0.55
    path.write_text(frame(0, [[1, x, x, 0.2, 75]], f"id {names} radius mass"))
    snapshot = snapshot_of(open_bodies(path).trajectory.ts, needs_velocity=False)
    np.testing.assert_allclose(snapshot.position, [[1, 1]], atol=1e-15)


def test_columns_of_words_and_items_of_newer_versions(tmp_path):
    path = tmp_path / "named.dump"
    head = "ITEM: UNITS\nsi\nITEM: TIME\n0.25\n"
    path.write_text(head + frame(5, [[1, "He", 0, 0, 0.2, 75]], "id element x y radius mass"))
    ts = open_bodies(path, 1e-3).trajectory.ts
    assert ts.time == 0.25
    assert snapshot_of(ts, needs_velocity=False).radius[0] == 0.2
    path.write_text(head.replace("si", "lj") + frame(5, rows()))
    with pytest.raises(DumpError, match=r"named.dump, line 2: units lj"):
        open_bodies(path)


def test_people_come_and_go(tmp_path):
    path = tmp_path / "leaving.dump"
    path.write_text(frame(0, rows()) + frame(1, rows(3)[1:]) + frame(2, []) + frame(3, rows(1)))
    trajectory = open_bodies(path).trajectory
    assert trajectory.n_atoms == 4
    ids = [snapshot_of(ts).ids.tolist() for ts in trajectory]
    assert ids == [[1, 2, 3, 4], [2, 3], [], [1]]
    assert np.isfinite(trajectory[1].positions).all(1).sum() == 2


@pytest.mark.parametrize("pack", [gzip.compress, bz2.compress, lzma.compress])
def test_compressed_dumps_are_the_same(tmp_path, pack):
    path = tmp_path / "packed"
    content = "".join(frame(step, rows(seed=step)) for step in range(5)).encode()
    path.write_bytes(pack(content))
    trajectory = open_bodies(path, 1.0).trajectory
    for number in (3, 0, 4):
        expected = [row[2:4] for row in rows(seed=number)]
        np.testing.assert_array_equal(snapshot_of(trajectory[number]).position, expected)
    path.write_bytes(pack(content)[:-20])
    with pytest.raises(DumpError, match=r"packed(, line \d+)?: damaged|packed: truncated"):
        open_bodies(path)


def test_damaged_bz2_where_its_decompressor_ends_with_the_first_error(tmp_path, monkeypatch):
    """As that of Python 3.11.2 in Debian 12 does."""
    real = bz2.BZ2Decompressor

    class OnceOnly:
        def __init__(self):
            self.real, self.broken = real(), False

        def __getattr__(self, name):
            return getattr(self.real, name)

        def decompress(self, *given):
            if self.broken:
                raise ValueError("Decompressor is unusable after a previous error")
            self.broken = True
            found = self.real.decompress(*given)
            self.broken = False
            return found

    monkeypatch.setattr(bz2, "BZ2Decompressor", OnceOnly)
    path = tmp_path / "packed"
    whole = bytearray(bz2.compress("".join(frame(n, rows()) for n in range(3)).encode()))
    path.write_bytes(whole)
    index = index_dump(path)
    whole[len(whole) // 2] ^= 255
    path.write_bytes(whole)
    with pytest.raises(DumpError, match="packed: damaged: Invalid data stream"):
        index_dump(path)
    for _ in range(2):
        with pytest.raises(DumpError, match="packed, step 0: damaged: Invalid data stream"):
            index.table(0)


FEW = "id x y radius mass"
DAMAGED = [
    ("", "empty"),
    ("not a dump\n" * 12, "line 1: not the head of a frame"),
    (frame(0, rows())[:-60], "truncated"),
    (frame(0, rows()) + frame(10, rows())[:70], "truncated"),
    (frame(10, rows()) + frame(10, rows()), "line 15: step 10 follows step 10"),
    (frame(0, rows()) + frame(1, [[1, 0, 0, 1, 1]], FEW), "line 22: the columns change at step 1"),
    (frame(0, [row[:-1] for row in rows()], COLUMNS.replace(" mass", "")), "missing columns: mass"),
    (frame(0, [[1, 0.0, 0.0]], "id x y"), "missing columns: radius, mass"),
    (frame(0, [[1, 0.0, "abc", 0.1, 1.0]], FEW), "line 10: y: 'abc' is not a number"),
    (frame(0, [[1, 0.0, "1_0", 0.1, 1.0]], FEW), "line 10: y: '1_0' is not a number"),
    (frame(0, [[1, 0.0, "1e400", 0.1, 1.0]], FEW), "line 10: y: '1e400' is too large"),
    (frame(0, [[1, 0.0, 0.0, 0.1, 1.0]] * 2, FEW), "line 11: id 1 occurs twice at step 0"),
    (frame(0, [[2.7, 0, 0, 0.1, 1]], FEW), r"line 10: id: 2.7 where a whole number"),
    (frame(0, [["nan", 0, 0, 0.1, 1]], FEW), r"line 10: id: nan where a whole number"),
    (frame(0, [["1e19", 0, 0, 0.1, 1]], FEW), r"line 10: id: 1e\+19 where a whole number"),
    (frame(0, [[0, 0, 0, 0.1, 1]], FEW), r"line 10: id: 0 where a whole number"),
    # a word moved from one row to the next
    (frame(0, [[1, 0, 0, 0.1], [75, 2, 5, 0, 0.1, 75]], FEW), "truncated|line 10: 4 words where 5"),
    (frame(0, [[1, 0, 0, 0.1], [75, 2, 5, 0, 0.1, 75], [3, 9, 0, 0.1, 75]], FEW), "line 10: 4 words"),
    (frame(0, [[1, 0, 0, 0.1, 1, 5]], FEW + " x"), "line 9: column x occurs twice"),
    (frame(0, [[1, 0, 0, 0.1, 1, 5]], FEW + " vx"), "missing columns: vy"),
    (frame(0, [[1, 0, 0, 0.1, 1, 5]], FEW + " −1"), "line 9: column '−1' is not of ASCII letters"),
    (frame(0, rows()).replace("ff ff pp", "pp ff pp"), r"line 5: the box is periodic in x"),
    (frame(0, rows()).replace("ff ff pp", "ff fp pp"), r"line 5: the box is periodic in y"),
    (frame(0, rows()).replace("ff ff pp", "ff xf pp"), "line 5: BOX BOUNDS: 'xf' is not a boundary"),
    (frame(0, rows()).replace("-0.5 0.5", "−0.5 0.5"), "line 8: box: '−0.5' is not a number"),
    (frame(0, rows()).replace("ff ff pp", "xy xz yz ff ff pp"), "line 5: a triclinic box"),
    (frame(0, [[*row[:4], 0.1 * row[0], *row[5:]] for row in rows()]), r"line 13: z from 0.1 to 0.4"),
    (frame(0, rows()).replace("\n4\n", "\n400000000\n"), "truncated"),
    (frame(0, rows()).replace("\n4\n", "\n99999999999\n"), "line 4: rows: '99999999999' where"),
    (frame(0, rows()).replace("\n4\n", "\n4.5\n"), "line 4: rows: '4.5' where a whole number"),
    (frame(0, rows()).replace("\n0\n", "\n-3\n", 1), "line 2: step: '-3' where a whole number"),
    (frame(0, []), "no disk in any frame"),
    ("ITEM: TIMESTEP\n\0\0", "line 2: binary"),
    ("x" * 99999, "line 1: longer than 65536 characters"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "message"), DAMAGED, ids=[case[1] for case in DAMAGED])
def test_damaged(tmp_path, content, message):
    path = tmp_path / "bad.dump"
    path.write_text(content)
    with pytest.raises(DumpError, match=message) as error:
        open_bodies(path)
    assert "bad.dump" in str(error.value)
    assert "\n" not in str(error.value)


def test_what_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in [
        (tmp_path, "not a regular file"),
        ("/dev/zero", "not a regular file"),
        (tmp_path / "pipe", "not a regular file"),
        (tmp_path / "absent", "no such file"),
    ]:
        with pytest.raises(DumpError, match=f"{path}: {message}"):
            open_bodies(path)


def test_zero_radius_and_nan_are_named_with_their_step(tmp_path):
    path = tmp_path / "bad.dump"
    for row, message in [
        ([1, 0.0, 0.0, 0.0, 1.0], r"step 7: radius: 0 in row 0"),
        ([1, "nan", 0.0, 0.1, 1.0], r"line 10: x: nan m: a finite place is needed"),
        ([1, "1e99", 0.0, 0.1, 1.0], r"line 10: x: 1e\+99 m: a finite place is needed"),
        ([1, 0.0, 0.0, 0.1, "nan"], r"line 10: mass: nan: a finite number is needed"),
    ]:
        path.write_text(frame(7, [row], FEW))
        with pytest.raises(DumpError, match=message):
            snapshot_of(open_bodies(path).trajectory.ts, path, needs_velocity=False)


def test_columns_of_lammps_have_finite_numbers_and_those_of_a_user_need_not(tmp_path):
    path = tmp_path / "some.dump"
    for name in ("type", "omegaz", "fx fy"):
        row = [1, 0, 0, 0.1, 75, *["-inf"] * len(name.split())]
        path.write_text(frame(7, [row], f"{FEW} {name}"))
        says = f"line 10: {name.split()[0]}: -inf: a finite number is needed"
        with pytest.raises(DumpError, match=says):
            open_bodies(path)
    path.write_text(frame(7, [[1, 0, 0, 0.1, 75, "nan"]], f"{FEW} c_stress"))
    assert np.isnan(open_bodies(path).trajectory.ts.data["c_stress"]).all()


def test_shares_of_a_box_too_far_are_named_without_a_warning(tmp_path):
    path = tmp_path / "far.dump"
    text = frame(7, [[1, "1e300", 0, 0.1, 75]], FEW.replace("x y", "xs ys"))
    path.write_text(text.replace("-10 10", "-1e20 1e20"))
    with pytest.raises(DumpError, match=r"line 10: x: inf m: a finite place is needed"):
        open_bodies(path)


def test_the_time_step_is_that_of_the_run(tmp_path):
    path = tmp_path / "bodies.dump"
    path.write_text(frame(0, rows()) + frame(100, rows()))
    assert np.isnan(open_bodies(path).trajectory[1].time)
    assert open_bodies(path, 1e-3).trajectory[1].time == pytest.approx(0.1)
    record = tmp_path / "run.json"
    record.write_text('{"time_step_s": 2e-3}')
    assert open_bodies(path).trajectory[1].time == pytest.approx(0.2)
    for content in ("", "[]", "{}", '{"time_step_s": "1"}', '{"time_step_s": true}',
                    '{"time_step_s": NaN}', '{"time_step_s": -1}', "[" * 100_000):  # fmt: skip
        record.write_text(content)
        with pytest.raises(DumpError, match=r"run.json: time_step_s"):
            open_bodies(path)
    for time_step in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DumpError, match=r"time_step: "):
            open_bodies(path, time_step)


def test_contacts(tmp_path):
    path = tmp_path / "contacts.dump"
    names = "first second is_wall nx ny overlap fx fy"
    table = [[1, 2, 0, 1.0, 0.0, 1e-3, 1000.0, 0.0], [1, 3, 1, 0.0, -1.0, 2e-3, 0.0, -2000.0]]
    path.write_text(frame(0, [], names, "ENTRIES") + frame(5, table, names, "ENTRIES"))
    empty, full = read_contacts(path)
    assert len(empty) == 0
    np.testing.assert_array_equal(full.is_wall, [False, True])
    np.testing.assert_array_equal(full.force, [[1000, 0], [0, -2000]])
    path.write_text(frame(0, [[1, 2]], "first second", "ENTRIES"))
    with pytest.raises(DumpError, match="missing columns: is_wall"):
        index_contacts(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({0: 1.5}, "line 10: first: 1.5 where a whole number"),
        ({1: "nan"}, "line 10: second: nan where a whole number"),
        ({2: 0.5}, "line 10: is_wall: 0 or 1"),
        ({3: 0.5}, "line 10: nx, ny: not a unit vector"),
        ({5: "inf"}, "line 10: not a finite number"),
        ({1: 1}, "line 10: first: the smaller id"),
        ({0: 1, 1: 3, 2: 1}, "line 11: this contact is listed twice"),
    ],
)
def test_contacts_that_cannot_be(tmp_path, changes, message):
    path = tmp_path / "contacts.dump"
    table = [[1, 2, 0, 1.0, 0.0, 1e-3, 1000.0, 0.0], [1, 3, 1, 0.0, -1.0, 2e-3, 0.0, -2000.0]]
    for column, value in changes.items():
        table[0][column] = value
    path.write_text(frame(0, table, "first second is_wall nx ny overlap fx fy", "ENTRIES"))
    with pytest.raises(DumpError, match=f"contacts.dump, {message}"):
        list(read_contacts(path))
