"""SQLite and HDF5 files of others: read in a process that ends, tables and datasets of the file
itself only, each value of its kind, and memory that goes with rows. Crowds of LEMONS: five
disks a person, of which one is made only where that is asked for."""

import gzip
import re
import resource
import shutil
import sqlite3
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from analysis.scene import read_scene
from analysis.scene.floor_files import read_floor
from analysis.scene.real.lemons import read_lemons
from analysis.scene.real.trajectory import Recording, TrajectoryError, read_heads
from analysis.scene.scene import SceneError
from analysis.support import foreign, reading
from analysis.support.reading import UnreadableError
from tests.crowds import room_text, turn
from tests.forked import as_program, in_fork
from tests.walkers import KINDS, archive, base_of, walkers

ROOT = Path(__file__).resolve().parents[2]
FREE = ROOT / "tests/data/rooms/free.toml"


def test_memory_goes_with_rows_not_with_frame_numbers(tmp_path):
    """One row of frame 10⁹: `import` took 8.9 GB for it."""
    far = [*walkers(), (1, 10**9, 0.0, 0.0)]
    text = "# framerate: 10\n# in m\n" + "".join(" ".join(map(str, row)) + "\n" for row in far)
    (tmp_path / "far.txt").write_text(text)
    base_of(tmp_path / "far.sqlite", far)
    archive(tmp_path / "far.h5", far)

    def program():
        found = [0]
        for name in ("far.txt", "far.sqlite", "far.h5"):
            words = ["import", name, "--frame", "2", "--room", str(FREE), "--out", name + ".d"]
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            # addresses, not memory: libraries reserve some when they are first used
            maximum = pages * resource.getpagesize() + (1 << 32)
            resource.setrlimit(resource.RLIMIT_AS, (maximum, resource.RLIM_INFINITY))
            found.append(as_program(words, tmp_path))
        return max(found)

    status, message, _ = in_fork(program, 60)
    assert status == 0, message
    first = (tmp_path / "far.txt.d/free.data").read_bytes()
    for name in ("far.sqlite", "far.h5"):
        assert (tmp_path / f"{name}.d/free.data").read_bytes() == first


def test_few_steps_of_vadere_that_are_many_frames_are_refused(tmp_path):
    rows = ["pedestrianId simTime endTime startX startY endX endY"]
    rows += [f"{p} {t} {t + 1} {p} {t} {p} {t + 1}" for p in (1, 2) for t in (0, 2_000_000)]
    (tmp_path / "long.traj").write_text("\n".join(rows))
    with pytest.raises(TrajectoryError, match=r"long\.traj: 4e\+07 frames of 4 rows"):
        Recording.read(tmp_path / "long.traj", frame_rate=10)


def test_a_file_whose_library_finds_no_end_is_left(tmp_path, monkeypatch):
    """The process is ended in the middle of its work."""
    file = archive(tmp_path / "walkers.h5")
    monkeypatch.setattr(foreign, "LEAST_CPU_S", 0.01)  # too little to import h5py
    began = time.monotonic()
    with pytest.raises(UnreadableError, match=r"walkers\.h5: .* found no end within 0 s"):
        foreign.read_foreign(file, "hdf5", ["trajectory"])
    assert time.monotonic() - began < 30
    monkeypatch.undo()
    assert len(read_heads(file, 2).ids) == 3


def text_of_links(path):
    (path.parent / "secret").write_bytes(np.arange(60.0).tobytes())
    with h5py.File(path, "w") as file:
        where = [(str(path.parent / "secret"), 0, 480)]
        file.create_dataset("trajectory", shape=(15,), dtype=KINDS, external=where)


def other_file(path):
    archive(path.parent / "other.h5")
    with h5py.File(path, "w") as file:
        file["trajectory"] = h5py.ExternalLink("other.h5", "/trajectory")


def packed(path):
    with h5py.File(path, "w") as file:
        many = {"shape": (10**10,), "dtype": KINDS, "chunks": (1000,), "compression": "gzip"}
        file.create_dataset("trajectory", **many).attrs["fps"] = 10.0


def a_view(path):
    base_of(path, [], table="create table trajectory_data (a, b, c, d)")
    endless = "with recursive n(i) as (select 1 union all select i + 1 from n) select i from n"
    base = sqlite3.connect(path)
    with base:
        base.execute("drop table trajectory_data")
        base.execute(f"create view trajectory_data as {endless}")
    base.close()


def unfinished(path):
    base_of(path, walkers())
    path.with_name(path.name + "-wal").write_bytes(b"x")


@pytest.mark.parametrize(
    ("name", "make", "message"),
    [
        ("a.h5", text_of_links, "its numbers in other files"),
        ("a.h5", other_file, "a link to somewhere else"),
        ("a.h5", packed, "more than a file of this size can have"),
        ("a.h5", lambda p: archive(p, kinds=[*KINDS[:3], ("y", "S8")]), "y: numbers are needed"),
        ("a.h5", lambda p: archive(p, fps="often"), "fps: often. A number is needed"),
        ("a.h5", lambda p: archive(p, [(0.5, 0, 0, 0)], [("id", "f8"), *KINDS[1:]]), "id: 0.5"),
        ("a.h5", lambda p: p.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600)), "damaged"),
        ("a.sqlite", a_view, "trajectory_data is a view"),
        ("a.sqlite", unfinished, "a.sqlite-wal lies beside it"),
        ("a.sqlite", lambda p: base_of(p, [(1, 0, "far", 0)]), "row 1: pos_x: 'far' is no number"),
        ("a.sqlite", lambda p: base_of(p, [(1, 2.5, 0, 0)]), "row 1: frame: '2.5' is no integer"),
        ("a.sqlite", lambda p: base_of(p, walkers(), fps="x"), "fps: x. A number is needed"),
        ("a.sqlite", lambda p: base_of(p, []), "no rows: was the writer closed?"),
        ("a.sqlite", lambda p: p.write_bytes(b"SQLite format 3\0" + bytes(600)), "damaged"),
    ],
)
def test_what_is_no_table_of_numbers_is_refused(name, make, message, tmp_path):
    make(tmp_path / name)
    with pytest.raises(TrajectoryError, match=rf"a\.\w+: .*{re.escape(message)}"):
        Recording.read(tmp_path / name)


def test_a_reader_changes_nothing_beside_the_file(tmp_path):
    base_of(tmp_path / "walkers.sqlite", walkers())
    (tmp_path / "walkers.sqlite").chmod(0o444)
    before = (tmp_path / "walkers.sqlite").read_bytes()
    read_heads(tmp_path / "walkers.sqlite", 2)
    assert [path.name for path in tmp_path.iterdir()] == ["walkers.sqlite"]
    assert (tmp_path / "walkers.sqlite").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "row", "message"),
    [
        ("crowdit.csv", "3,nan,1,0.5", r"line 17: time: nan. Up to 1e\+09 s are needed"),
        ("crowdit.csv", "4,1e17,1,0.5", r"line 17: time: 1e\+17. Up to"),
    ],
)
def test_no_row_is_dropped_or_bent_in_silence(name, row, message, tmp_path):
    content = (ROOT / "tests/data/trajectories" / name).read_text()
    (tmp_path / name).write_text(content + row + "\n")
    with pytest.raises(TrajectoryError, match=message):
        Recording.read(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text", "rate"),
    [
        ("exponent.csv", "name,id,t,x,y\n,,s,m,m\np,1,0,1,2\np,1,5e-1,1,3\n", 2),
        ("marked.csv", "\ufeffid;frame;time;x;y\n1;0;0;1;2\n1;1;0.5;1;3\n", 2),
        ("quoted.csv", 'who,id,frame,x,y\n"a, b",1,0,1,2\n"a, b",1,1,1,3\n', 4),
        (
            "steps.traj",
            "pedestrianId simTime endTime startX startY endX endY\n1 0 1 1 2 1 6\n1 1 2 1 6 1 10\n",
            4,
        ),
    ],
)
def test_what_other_programs_write_is_read(tmp_path, name, text, rate):
    (tmp_path / name).write_text(text)
    stated = "time" in text or name == "exponent.csv"
    arguments = {} if stated and rate == 2 else {"frame_rate": 4.0}
    found = Recording.read(tmp_path / name, unit="m", **arguments)
    assert found.frame_rate == rate
    assert found.data[["id", "frame", "x", "y"]].to_numpy()[:2].tolist() == [
        [1, 0, 1, 2],
        [1, 1, 1, 3],
    ]


def test_floors_of_jupedsim(tmp_path):
    halves = ["POLYGON ((0 0, 2 0, 2 3, 0 3, 0 0))", "POLYGON ((2 0, 4 0, 4 3, 2 3, 2 0))"]
    assert read_floor(base_of(tmp_path / "two.sqlite", [], geometry=halves)).polygon.area == 12
    with pytest.raises(SceneError, match=r"none\.sqlite: no geometry of JuPedSim"):
        read_floor(base_of(tmp_path / "none.sqlite", []))
    stays = base_of(tmp_path / "stays.sqlite", [], geometry=halves, floors=[1, 1])
    assert read_floor(stays).polygon.bounds == (2, 0, 4, 3)  # of its two floors it uses one
    with pytest.raises(
        SceneError, match=r"grows\.sqlite: frame_data: a floor that changes is not r"
    ):
        read_floor(base_of(tmp_path / "grows.sqlite", [], geometry=halves, floors=[0, 0, 1]))
    with pytest.raises(SceneError, match=r"bad\.sqlite: geometry: ParseException"):
        read_floor(base_of(tmp_path / "bad.sqlite", [], geometry=["POLYGON (("]))


ALL = "create table trajectory_data (frame int, id int, pos_x real, pos_y real, ori_x real, ori_y real)"
HIGH = [*KINDS, ("z", "f8"), ("angle", "f4")]


@pytest.mark.parametrize(
    ("name", "make", "unused"),
    [
        ("a.sqlite", lambda p: base_of(p, [(f, i, x, y, 0, 1) for i, f, x, y in walkers()], table=ALL),
         ["ori_x", "ori_y"]),
        ("a.h5", lambda p: archive(p, [(*row, 1.7, 0) for row in walkers()], HIGH), ["angle"]),
        ("b.h5", lambda p: archive(p, [(i, f, 100 * x, 100 * y) for i, f, x, y in walkers()],
                                   x="pedestrian x-coordinate (centimeter [cm])"), []),
        ("a.csv", lambda p: p.write_bytes(gzip.compress(b"id,t,x,y\n" + b"".join(
            b"%d,%.1f,%.3f,%.3f\n" % (i, f / 10, x, y) for i, f, x, y in walkers()))), []),
    ],
)  # fmt: skip
def test_all_that_a_format_knows_is_used_or_named(name, make, unused, tmp_path, monkeypatch):
    named = []
    monkeypatch.setattr(reading, "note_unused", lambda file, what, names: named.extend(names))
    make(tmp_path / name)
    found = Recording.read(tmp_path / name)
    rows = found.data[["id", "frame", "x", "y"]].sort_values(["id", "frame"]).to_numpy()
    assert rows == pytest.approx(np.array(walkers()))
    assert (found.frame_rate, named) == (10, unused)


@pytest.mark.parametrize(
    ("name", "make", "message"),
    [
        ("a.h5", lambda p: archive(p, [(*row, 3.0 * (row[1] % 2), 0) for row in walkers()], HIGH), "above each other"),
        ("a.h5", lambda p: archive(p, x="in m", y="in cm"), "One of m and cm is read"),
        ("a.h5", lambda p: archive(p, [*walkers(), (1, 4, 9.0, 9.0)]), "frame 4: person 1 occurs twice"),
        ("a.csv", lambda p: p.write_text("id,t,x,y\n1,0,0,0\n", "utf-16"), "UTF-16. Save it as UTF-8"),
    ],
)  # fmt: skip
def test_what_would_change_the_answer_is_refused(name, make, message, tmp_path):
    make(tmp_path / name)
    with pytest.raises(TrajectoryError, match=message):
        Recording.read(tmp_path / name)


EVACUATION = ROOT.parent / "shared/data/lemons_evacuation"
ROOM = room_text(kind="impact")
DYNAMICS = """<Agents>
<Agent Id="0"><Kinematics Position="1.0,1.0" Velocity="0.5,0.0" Theta="0.0" Omega="0.2"/>
<Dynamics Fp="100.0,0.0" Mp="0.0"/></Agent>
<Agent Id="4"><Kinematics Position="1.4,1.0" Velocity="-0.5,0.0" Theta="1.0" Omega="0.0"/></Agent>
</Agents>
"""
BODIES = """<Agents>
<Agent Type="pedestrian" Id="0" Mass="80.0" MomentOfInertia="1.5">
<Shape Type="disk" Radius="0.1" Position="0.0,0.1"/>
<Shape Type="disk" Radius="0.1" Position="0.0,-0.1"/>
</Agent>
<Agent Type="pedestrian" Id="4" Mass="70.0" MomentOfInertia="1.4">
<Shape Type="disk" Radius="0.2" Position="0.0,0.0"/></Agent>
</Agents>
"""
GEOMETRY = """<Geometry><Wall Id="0">
<Corner Coordinates="0.0,0.0"/><Corner Coordinates="3.0,0.0"/>
<Corner Coordinates="3.0,2.0"/><Corner Coordinates="0.0,2.0"/><Corner Coordinates="0.0,0.0"/>
</Wall></Geometry>
"""
FILES = {"AgentDynamics.xml": DYNAMICS, "Agents.xml": BODIES, "Geometry.xml": GEOMETRY}
WORDS = ("import", "AgentDynamics.xml", "--room", "room.toml", "--name", "mine")


@pytest.fixture
def folder(tmp_path):
    for name, text in {**FILES, "room.toml": ROOM}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_person_of_several_disks_is_a_rigid_body(percussions, folder):
    made = percussions(*WORDS)
    assert made.returncode == 0, made.stderr
    crowd = read_scene(folder / "mine.toml").snapshot
    bodies = crowd.bodies
    assert [bodies.ids.tolist(), bodies.mass.tolist()] == [[1, 5], [80.0, 70.0]]
    assert bodies.inertia.tolist() == [1.5, 1.4]
    assert crowd.position == pytest.approx(np.array([[1.0, 1.1], [1.0, 0.9], [1.4, 1.0]]))
    assert bodies.motion(crowd, crowd.velocity)[0] == pytest.approx([0.5, 0.0, 0.2])
    assert percussions("run", "mine.toml", "--engine", "rigid").returncode == 0


def test_one_disk_each_where_it_is_asked_for(percussions, folder):
    made = percussions(*WORDS, "--one-disk")
    assert made.returncode == 0, made.stderr
    assert "are not taken" in made.stdout
    scene = read_scene(folder / "mine.toml")
    disks = scene.snapshot
    assert disks.ids.tolist() == [1, 5]
    # two disks that do not overlap: twice the area of one
    assert disks.radius == pytest.approx([0.1 * np.sqrt(2), 0.2], abs=2e-6)
    assert disks.mass.tolist() == [80.0, 70.0]
    assert disks.velocity.tolist() == [[0.5, 0.0], [-0.5, 0.0]]
    assert disks.spin.tolist() == [0.2, 0.0]
    assert disks.position == pytest.approx(np.array([[1.0, 1.0], [1.4, 1.0]]))
    assert [wall.start_m for wall in scene.walls] == [(0, 0), (3, 0), (3, 2), (0, 2)]
    assert percussions("run", "mine.toml", "--engine", "rigid").returncode == 0


def covered(shapes, step=5e-4):
    """The area (m²) that disks cover together, counted on a grid."""
    x, y = np.meshgrid(*[np.arange(-0.4, 0.4, step)] * 2)
    inside = np.zeros_like(x, dtype=bool)
    for (px, py), radius in shapes:
        inside |= (x - px) ** 2 + (y - py) ** 2 <= radius**2
    return inside.sum() * step**2


@pytest.mark.skipif(not EVACUATION.exists(), reason="LEMONS' own example is not here")
def test_the_evacuation_of_lemons(percussions, tmp_path):
    crowd = read_lemons(EVACUATION / "AgentDynamics.xml", one_disk=True)
    assert (len(crowd.snapshot), len(crowd.walls), crowd.shapes) == (8, 12, 5)
    first = [((-0.017, 0.164), 0.098), ((0.010, 0.072), 0.134), ((0.015, 0.0), 0.141)]
    first += [((x, -y), radius) for (x, y), radius in first[:2]]
    assert np.pi * crowd.snapshot.radius[0] ** 2 == pytest.approx(covered(first), rel=2e-3)
    assert crowd.snapshot.mass[3] == 115.67
    exact = read_lemons(EVACUATION / "AgentDynamics.xml", one_disk=False).snapshot
    assert exact.bodies.mass == pytest.approx(crowd.snapshot.mass, rel=1e-12)
    assert exact.bodies.centre == pytest.approx(crowd.snapshot.position, abs=1e-12)
    assert exact.bodies.inertia[:4].tolist() == [2.05, 1.18, 1.39, 2.97]
    by_hand = [turn(-0.29) @ position + [1.115, 0.362] for position, _ in first[:1]]
    assert exact.position[:1] == pytest.approx(np.array(by_hand), abs=1e-12)
    shutil.copytree(EVACUATION, tmp_path / "evacuation")
    (tmp_path / "room.toml").write_text(ROOM)
    words = ("evacuation/AgentDynamics.xml", "--room", "room.toml", "--name", "mine", "--one-disk")
    made = percussions("import", *words)
    assert made.returncode == 0, made.stderr
    assert "each with 5 disks there" in made.stdout


BAD_BODIES = {
    "centre": ('"0.0,-0.1"', '"0.0,0.1"', "agent 0: its disks are not about its centre of mass"),
    "inertia": (' MomentOfInertia="1.5"', "", "agent 0: MomentOfInertia: None where 1 finite"),
    "apart": ('"0.0,-0.1"', '"0.0,-0.2"', "body 1: its disks do not hang together"),
}


@pytest.mark.parametrize("bad", BAD_BODIES)
def test_bodies_that_are_none_are_refused_in_one_line(refused, folder, bad):
    old, new, says = BAD_BODIES[bad]
    (folder / "Agents.xml").write_text(BODIES.replace(old, new))
    assert says in refused(*WORDS)


BAD = {
    "xml": ("AgentDynamics.xml", "<Agents>", "<Agents", "AgentDynamics.xml: no XML: "),
    "missing": ("Agents.xml", 'Id="4"', 'Id="5"', "AgentDynamics.xml: agent 4 is not both here and"),
    "twice": ("Agents.xml", 'Id="4"', 'Id="0"', "Agents.xml: agent '0': one whole number each"),
    "nan": ("AgentDynamics.xml", "0.5,0.0", "nan,0", "AgentDynamics.xml: agent 0: Velocity: 'nan,0'"),
    "one": ("AgentDynamics.xml", "1.4,1.0", "1.4", "AgentDynamics.xml: agent 4: Position: '1.4' where 2 fin"),
    "radius": ("Agents.xml", '"0.2"', '"-1"', "Agents.xml: agent 4: Radius: -1. A number above 0"),
    "square": ("Agents.xml", '"disk"', '"box"', "Agents.xml: agent 0: Shape: 'box'. Only disks"),
    "heavy": ("Agents.xml", '"70.0"', '"1e20"', "Agents.xml: agent 4: Mass: 1e+20 kg. Between 0 and 1000"),
    "mass": ("Agents.xml", '"70.0"', '"0"', "Agents.xml: agent 4: Mass: 0 kg. Between 0 and 1000"),
    "history": ("AgentDynamics.xml", "Agents>", "Interactions>", "AgentDynamics.xml: <Interactions> whe"),
    "bomb": ("Agents.xml", "<Agents>", "<!DOCTYPE x><Agents>", "Agents.xml: a document type is not"),
    "outside": ("AgentDynamics.xml", "1.4,1.0", "9,9", "AgentDynamics.xml: disk 5 at (9, 9) m is"),
    "one_point": ("AgentDynamics.xml", "1.4,1.0", "1.0,1.0", "AgentDynamics.xml: position: disk 1 and disk 5 coi"),
    "corner": ("Geometry.xml", "3.0,0.0", "3.0", "Geometry.xml: wall 0: Coordinates: '3.0' where 2 finite"),
}  # fmt: skip


@pytest.mark.parametrize("bad", BAD)
def test_bad_input_is_one_line(refused, folder, bad):
    name, old, new, says = BAD[bad]
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))
    assert refused(*WORDS, "--one-disk").startswith(f"percussions: {says}")


def test_options_of_trajectories_and_missing_files(refused, folder):
    options = {"frame": 3, "people": "ANSUR II", "radius": 0.2, "mass": 75, "radius-spread": 0.1}
    options |= {"seed": 1, "unit": "cm", "frame-rate": 25, "window": 0.4, "others": 4, "apart": 1}
    for name, value in options.items():
        assert refused(*WORDS, "--one-disk", f"--{name}", value) == (
            f"percussions: --{name}: of XML only for <fcd-export> of SUMO. Files of LEMONS say it"
        )
    message = refused("import", "heads.txt", "--room", "room.toml")
    assert message.startswith("percussions: --frame: of a trajectory it is needed")
    (folder / "Geometry.xml").unlink()
    assert refused(*WORDS, "--one-disk") == "percussions: Geometry.xml: no such file"
