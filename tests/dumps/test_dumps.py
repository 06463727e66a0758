"""Dumps: what is written is what is read; damaged, reordered and foreign ones. LAMMPS' binary
dumps: the frames of the text, bit for bit, and one message for what is none."""

import bz2
import gzip
import lzma
import os
import struct
import subprocess

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
from analysis.engines import LAMMPS
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

        def decompress(self, *inputs):
            if self.broken:
                raise ValueError("Decompressor is unusable after a previous error")
            self.broken = True
            found = self.real.decompress(*inputs)
            self.broken = False
            return found

    monkeypatch.setattr(bz2, "BZ2Decompressor", OnceOnly)
    path = tmp_path / "packed"
    full = bytearray(bz2.compress("".join(frame(n, rows()) for n in range(3)).encode()))
    path.write_bytes(full)
    index = index_dump(path)
    full[len(full) // 2] ^= 255
    path.write_bytes(full)
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


def test_columns_that_are_used_have_finite_numbers_and_others_need_not(tmp_path):
    path = tmp_path / "some.dump"
    for name in ("omegaz", "drive_x drive_y"):
        row = [1, 0, 0, 0.1, 75, *["-inf"] * len(name.split())]
        path.write_text(frame(7, [row], f"{FEW} {name}"))
        says = f"line 10: {name.split()[0]}: -inf: a finite number is needed"
        with pytest.raises(DumpError, match=says):
            open_bodies(path)
    for name in ("c_stress", "type"):
        path.write_text(frame(7, [[1, 0, 0, 0.1, 75, "nan"]], f"{FEW} {name}"))
        assert np.isnan(open_bodies(path).trajectory.ts.data[name]).all()


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


NAMES = ("id", "type", "x", "y", "z", "radius", "mass", "vx", "vy", "vz")
DECK = """
units si
dimension 2
boundary f s p
atom_style sphere
newton off
comm_modify vel yes
lattice sq 0.5
region box block -2 5 -2 5 -0.5 0.5
region inner block 0 3 0 3 -0.5 0.5
create_box 1 box
create_atoms 1 region inner
displace_atoms all random 0.01 0.013 0 7
set group all diameter 0.4901
set group all density 812.3
velocity all create 3e22 12 loop geom
pair_style granular
pair_coeff * * hooke 1e4 50 tangential linear_nohistory 0 0
fix move all nve/sphere disc
fix flat all enforce2d
timestep 1e-3
dump text all custom 7 text.dump {columns}
dump bits all custom 7 bits.bin {columns}
dump_modify text sort id format float %.17g {more}
dump_modify bits sort id {more}
run 50
"""


def binary(frames, names=NAMES, **arguments):
    """The bytes of frames (step, rows) as LAMMPS' dump custom writes them on two processes."""
    parts = {"order": "<", "magic": b"DUMPCUSTOM", "revision": 2, "triclinic": 0, "edges": (1,) * 6}
    parts |= {"units": b"", "time": None} | arguments
    order, columns, found = parts["order"], " ".join(names).encode(), []
    for step, rows in frames:
        magic, rows = parts["magic"], np.asarray(rows, dtype=float).reshape(-1, len(names))
        box = (-9.0, 9.5, -8.0, 8.5, -0.5, 0.5)
        found += [struct.pack(f"{order}q", -len(magic)), magic]
        found += [struct.pack(f"{order}ii", 1, parts["revision"])]
        found += [struct.pack(f"{order}qqi6i6di", step, len(rows), parts["triclinic"],
                              *parts["edges"], *box, len(names))]  # fmt: skip
        found += [struct.pack(f"{order}i", len(parts["units"])), parts["units"]]
        time = parts["time"]
        found += [b"\0" if time is None else struct.pack(f"{order}bd", 1, time * step)]
        found += [struct.pack(f"{order}i", len(columns)), columns, struct.pack(f"{order}i", 2)]
        for some in (rows[:1], rows[1:]):
            found += [struct.pack(f"{order}i", some.size), some.astype(f"{order}f8").tobytes()]
    return b"".join(found)


PAIR = [[2, 1, 0.5, 0.1, 0, 0.25, 75, -1, 0, 0], [1, 1, 0, 0, 0, 0.27, 75, 2, 1e-300, 0]]
TWO = [(10, PAIR), (30, [[1, 1, 0.3, 1 / 3, 0, 0.25, 75, 0, 0, 0]])]


def written(tmp_path, content, name="some.dump"):
    path = tmp_path / name
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("more", ["", "units yes time yes"])
def test_a_dump_of_lammps_has_the_bits_of_its_text(tmp_path, more):
    (tmp_path / "deck").write_text(DECK.format(columns=" ".join(NAMES), more=more))
    words = [str(LAMMPS.find()), "-in", "deck", "-log", "none", "-screen", "none"]
    subprocess.run(words, cwd=tmp_path, check=True, timeout=60, env={"OMP_NUM_THREADS": "1"})
    text, bits = (
        open_bodies(tmp_path / name, 1e-3).trajectory for name in ("text.dump", "bits.bin")
    )
    assert len(text) == len(bits) == 8
    for one, other in zip(text, bits, strict=True):
        assert one.data["step"] == other.data["step"]
        assert one.time == other.time
        for name in NAMES:
            assert one.data[name].tobytes() == other.data[name].tobytes(), name
    frames = [index_dump(tmp_path / name).frames for name in ("text.dump", "bits.bin")]
    assert len(frames[0][0].low) == 2
    for one, other in zip(*frames, strict=True):
        assert (one.step, one.time, one.low, one.high) == (
            other.step,
            other.time,
            other.low,
            other.high,
        )


def test_times_in_the_dump_count(tmp_path):
    path = written(tmp_path, binary(TWO, time=0.25, units=b"si"))
    assert [ts.time for ts in open_bodies(path).trajectory] == [2.5, 7.5]
    assert snapshot_of(open_bodies(path).trajectory[0]).ids.tolist() == [1, 2]


def test_a_file_that_is_cut_off_is_refused_wherever_it_is_cut(tmp_path):
    full, first = binary(TWO), len(binary(TWO[:1]))
    assert len(index_dump(written(tmp_path, full)).frames) == 2
    for length in range(8, len(full)):
        path = written(tmp_path, full[:length])
        if length == first:
            assert len(index_dump(path).frames) == 1
            continue
        with pytest.raises(DumpError, match=r"some\.dump: (truncated|not a LAMMPS dump)"):
            index_dump(path)


@pytest.mark.parametrize(
    ("inputs", "what"),
    [
        ({"magic": b"DUMPATOM"}, "not a LAMMPS dump of atoms with named columns"),
        ({"order": ">"}, "not a LAMMPS dump of atoms with named columns"),
        ({"revision": 1}, "a binary dump of revision 1"),
        ({"triclinic": 1}, "step 10: a triclinic box"),
        ({"edges": (1, 1, 0, 0, 1, 1)}, "step 10: the box is periodic in y"),
        ({"units": b"lj"}, "step 10: units lj. Only si"),
        ({"time": 1e300}, "step 10: time: 1e\\+301"),
        ({"names": ("id", *NAMES[:-1])}, "step 10: column id occurs twice"),
    ],
)
def test_what_is_not_read_is_said(tmp_path, inputs, what):
    with pytest.raises(DumpError, match=what):
        index_dump(written(tmp_path, binary(TWO, **inputs)))


@pytest.mark.parametrize(
    ("frames", "what"),
    [
        (TWO[::-1], "step 10 follows step 30"),
        ([(5, [[1, 1, np.nan, 0, 0, 0.25, 75, 0, 0, 0]])], "step 5, row 1: x: nan m"),
        ([(5, PAIR), (6, [PAIR[0], [2, *PAIR[1][1:]]])], "step 6, row 2: id 2 occurs twice"),
        ([(5, [[1.5, *PAIR[0][1:]]])], "step 5, row 1: id: 1.5 where a whole number"),
    ],
)
def test_what_is_wrong_is_said_with_its_row(tmp_path, frames, what):
    path = written(tmp_path, binary(frames))
    with pytest.raises(DumpError, match=what):
        list(open_bodies(path).trajectory)


@pytest.mark.parametrize(
    ("times", "what"),
    [
        ((0.001, None), "step 30: a time is in some frames and not in others"),
        ((None, 0.001), "step 30: a time is in some frames and not in others"),
        ((0.003, 0.001), "step 30: its time, 0.03 s, follows 0.03 s. Times must grow"),
        ((0.004, 0.001), "step 30: its time, 0.03 s, follows 0.04 s. Times must grow"),
    ],
)
def test_frames_that_a_table_could_not_tell_apart(tmp_path, times, what):
    """In a text dump and in a binary one."""
    frames = [binary([frame], time=time) for frame, time in zip(TWO, times, strict=True)]
    text = ""
    for (step, _), time in zip(TWO, times, strict=True):
        message = "" if time is None else f"ITEM: TIME\n{time * step}\n"
        text += (
            f"ITEM: TIMESTEP\n{step}\n{message}ITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff pp\n"
        )
        text += "-9 9\n-9 9\n-9 9\nITEM: ATOMS id x y radius mass vx vy\n1 0 0 0.2 75 0 0\n"
    for content in (b"".join(frames), text.encode()):
        with pytest.raises(DumpError, match=what):
            index_dump(written(tmp_path, content))


def test_numbers_that_are_not_there_are_missed(tmp_path):
    content = bytearray(binary(TWO[:1]))
    at = len(content) - 8 * 10 - 4
    content[at : at + 4] = struct.pack("<i", 7)
    with pytest.raises(DumpError, match="step 10: damaged: 17 numbers where 20"):
        index_dump(written(tmp_path, bytes(content)))
