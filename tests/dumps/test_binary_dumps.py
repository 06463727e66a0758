"""LAMMPS' binary dumps: the frames of the text, bit for bit, and one message for what is none."""

import struct
import subprocess

import numpy as np
import pytest

from analysis.dumps import DumpError, index_dump, open_bodies, snapshot_of
from analysis.engines.lammps import find

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


def binary(frames, names=NAMES, **given):
    """The bytes of frames (step, rows) as LAMMPS' dump custom writes them on two processes."""
    parts = {"order": "<", "magic": b"DUMPCUSTOM", "revision": 2, "triclinic": 0, "edges": (1,) * 6}
    parts |= {"units": b"", "time": None} | given
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
    words = [str(find()), "-in", "deck", "-log", "none", "-screen", "none"]
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
    whole, first = binary(TWO), len(binary(TWO[:1]))
    assert len(index_dump(written(tmp_path, whole)).frames) == 2
    for length in range(8, len(whole)):
        path = written(tmp_path, whole[:length])
        if length == first:
            assert len(index_dump(path).frames) == 1
            continue
        with pytest.raises(DumpError, match=r"some\.dump: (truncated|not a LAMMPS dump)"):
            index_dump(path)


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"magic": b"DUMPATOM"}, "not a LAMMPS dump of atoms with named columns"),
        ({"order": ">"}, "not a LAMMPS dump of atoms with named columns"),
        ({"revision": 1}, "a binary dump of revision 1"),
        ({"triclinic": 1}, "step 10: a triclinic box"),
        ({"edges": (1, 1, 0, 0, 1, 1)}, "step 10: the box is periodic in y"),
        ({"units": b"lj"}, "step 10: units lj; only si"),
        ({"time": 1e300}, "step 10: time: 1e\\+301"),
        ({"names": ("id", *NAMES[:-1])}, "step 10: a column occurs twice"),
    ],
)
def test_what_is_not_read_is_said(tmp_path, given, what):
    with pytest.raises(DumpError, match=what):
        index_dump(written(tmp_path, binary(TWO, **given)))


@pytest.mark.parametrize(
    ("frames", "what"),
    [
        (TWO[::-1], "step 10: it follows step 30"),
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
        ((0.003, 0.001), "step 30: its time, 0.03 s, follows 0.03 s; times must grow"),
        ((0.004, 0.001), "step 30: its time, 0.03 s, follows 0.04 s; times must grow"),
    ],
)
def test_frames_that_a_table_could_not_tell_apart(tmp_path, times, what):
    """In a text dump and in a binary one."""
    frames = [binary([frame], time=time) for frame, time in zip(TWO, times, strict=True)]
    text = ""
    for (step, _), time in zip(TWO, times, strict=True):
        said = "" if time is None else f"ITEM: TIME\n{time * step}\n"
        text += (
            f"ITEM: TIMESTEP\n{step}\n{said}ITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff pp\n"
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
