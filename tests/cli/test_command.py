"""The command line: main job, bad input, interruption. What the command refuses, and how it ends:
one line that names the option, nothing written."""

import csv
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from analysis.engines import YADE
from analysis.scene.shipped_scenes import make
from tests.crowds import two_people
from tests.docs.documented import columns
from tests.engines.at_hand import require
from tests.forked import PROGRAM


def failed(result, *words):
    """One line on stderr that has the words, no traceback, a status other than 0."""
    assert result.returncode != 0
    assert "Traceback" not in result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


def test_scenes_and_make(percussions, tmp_path):
    listed = percussions("scenes")
    assert listed.returncode == 0
    for name in ("pair", "four_disks", "chain", "corridor", "arch", "arch_masses", "jam", "gate"):
        assert name in listed.stdout
    one, two = (
        percussions("scenes", "--make", "arch", "--disks", 700, "--seed", 3, "--out", folder)
        for folder in "ab"
    )
    assert one.returncode == two.returncode == 0
    assert (tmp_path / "a/arch.data").read_bytes() == (tmp_path / "b/arch.data").read_bytes()


def test_run_solve_compare(percussions, tmp_path):
    make("jam", 40).with_run(duration_s=3.0, frames=6).write(tmp_path)
    run = percussions("run", "jam.toml", "--engine", "lammps")
    assert run.returncode == 0, run.stderr
    folder = tmp_path / "out/jam/lammps_hooke_k1e+06"
    solved = percussions(
        "solve", folder / "bodies.dump", "--left-velocity", "desired", "--out", "contacts.csv"
    )
    assert solved.returncode == 0, solved.stderr
    with (tmp_path / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert set(rows[0]) <= columns()
    assert {"time_s", "first", "second", "is_wall", "reaction_Ns", "force_N", "wall"} <= set(
        rows[0]
    )
    last = [row for row in rows if float(row["time_s"]) == float(rows[-1]["time_s"])]
    wall = sum(float(row["impulse_x_Ns"]) for row in last if row["is_wall"] == "1")
    compared = percussions("compare", folder)
    assert compared.returncode == 0, compared.stderr
    # words that a terminal can show, the scene by its name, each unit at what has it
    head, rows = compared.stdout.split("┡")
    assert "jam: LAMMPS, k = 10⁶ N/m" in head
    assert "(N)" not in head + rows
    assert re.search(r"springs mean of contacts +│ +\S+ N ", rows)
    assert re.search(r"contact forces, correlation +│ +[\d.–]+ +│", rows)
    numbers = json.loads((folder / "comparison.json").read_text())
    assert numbers["unit"] == "N"
    assert numbers["status"] == "solved"
    # at rest the walls carry the whole drive, in both models: p/τ of the CSV against the engine
    with (folder / "comparison.csv").open() as file:
        engine = sum(
            float(row["penalty_x_N"]) for row in csv.DictReader(file) if row["is_wall"] == "1"
        )
    assert wall / 0.5 == pytest.approx(engine, rel=1e-3)


@pytest.mark.parametrize(
    ("words", "across"),
    [((), 0), (("--friction", 0.1), 7.5), (("--friction", 0.1, "--restitution", 0.5), 11.25)],
)
def test_friction_and_restitution_are_of_the_law_that_is_solved(
    percussions, tmp_path, words, across
):
    """Two disks of 75 kg, 2 m/s along and 1 m/s across: p = m_eff (1 + e) v, and μp across."""
    (tmp_path / "oblique.dump").write_text(two_people((2, 1)))
    result = percussions("solve", "oblique.dump", "--time-step", 1, *words)
    assert result.returncode == 0, result.stderr
    with (tmp_path / "contacts.csv").open() as file:
        (row,) = csv.DictReader(file)
    along = 112.5 if "--restitution" in words else 75.0
    assert float(row["impulse_x_Ns"]) == pytest.approx(along)
    assert float(row["impulse_y_Ns"]) == pytest.approx(across)


def test_empty_contact_set(percussions, tmp_path):
    (tmp_path / "far.dump").write_text(two_people(difference=5))
    (tmp_path / "contacts.csv").write_text("earlier\n")
    failed(
        percussions("solve", "far.dump", "--time-step", 1), "far.dump", "no contact in any frame"
    )
    assert (tmp_path / "contacts.csv").read_text() == "earlier\n"
    failed(
        percussions("solve", "far.dump", "--time-step", 1, "--left-velocity", "desired"),
        "needs a scene with a [drive]",
    )


@pytest.mark.parametrize(
    "engine",
    [
        "lammps",
        pytest.param("yade", marks=pytest.mark.skipif(YADE.find() is None, reason="YADE is not installed")),
    ],
)  # fmt: skip
def test_interruption_leaves_nothing_half_written(tmp_path, engine):
    require(engine)
    make("arch", 2000).with_run(duration_s=60.0).write(tmp_path)
    command = [sys.executable, "-c", PROGRAM, "run", "arch.toml", "--engine", engine]
    process = subprocess.Popen(
        command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.time() + 60
    while (
        time.time() < deadline
        and not any(tmp_path.glob("out/**/bodies.dump"))
        and not any(tmp_path.glob("out/**/.*/bodies.dump"))
    ):
        time.sleep(0.1)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    assert not any(path.is_file() for path in (tmp_path / "out").rglob("*"))


IMPORT = "import a.txt --frame 1 --room a.toml"
POSITIVE = ["-1", "0", "nan", "inf", "-inf", "much"], "a finite number above 0 is needed"
SHARE = ["-0.1", "1.1", "nan"], "a number from 0 to 1 is needed"
COUNT = ["0", "-3", "2.5", "many"], "a whole number above 0 is needed"


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        *((f"run pair {name}", POSITIVE) for name in ("--time-step", "--duration", "--stiffness")),
        *((f"solve a.dump {name}", POSITIVE) for name in ("--time-step", "--window")),
        *((f"solve a.dump {name}", POSITIVE) for name in ("--tolerance", "--contact-tolerance")),
        ("report pair --stiffness", POSITIVE),
        *((f"{IMPORT} {name}", POSITIVE) for name in ("--frame-rate", "--radius", "--mass", "--window")),
        ("run pair --restitution", SHARE),
        *((words, COUNT) for words in ("solve a.dump --workers", "chart pair --jobs")),
        *((words, COUNT) for words in ("stability --jobs", "scenes --make arch --disks")),
    ],
)  # fmt: skip
def test_numbers_that_an_option_does_not_take(refused, words, kind):
    values, needed = kind
    for value in values:
        message = refused(*words.split(), value)
        assert message == f"percussions: {words.split()[-1]}: {value}: {needed}"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("run nowhere", "unknown scene 'nowhere'"),
        ("run pair --engine magic", "unknown engine 'magic'"),
        ("solve absent.dump", "absent.dump"),
        ("compare absent", "absent"),
        ("report nowhere", "unknown scene"),
        ("report pair --engine magic", "unknown engine"),
        ("scenes --make arch --disks 1", "needs at least 2"),
        ("scenes --make pair --disks 5", "fixed number"),
        ("scenes --make arc", "unknown scene"),
        ("import absent.txt --frame 3 --room absent.toml", "absent"),
        ("run", "scene"),
        ("run pair --speed 3", "--speed"),
        ("nonsense", "nonsense"),
        ("run pair pair", "pair"),
        ("scenes --make arch --disks 1e18", "--disks 1000000000000000000: at most"),
        ("run arch --stiffness 1e20", "arch: 5.74e+10 steps of 3.48e-11 s for 594 disks"),
        ("run arch --stiffness 1e300", "arch: contact.stiffness_N_per_m: Input should be less than or equal to 1e+30"),
        ("run arch --duration 1e29 --stiffness 1e29", "would not end within a month"),
        ("run arch --duration 1e12", "would not end within a month"),
        ("run pair --time-step 1e-300", "run.time_step_s: 1e-300 is nearer to 0"),
        ("run pair --time-step 1e-99", "would not end within a month"),
        ("solve pair.dump --wall-friction 0.3 --out a.csv", "wall_friction: 0.3. There are no walls"),
        ("export pair --wall-friction 0.3 --fclib a.hdf5", "wall_friction: 0.3. There are no walls"),
        ("solve a.dump --out ''", "--out: empty. A value is needed"),
        ("solve a.dump --out=", "--out: empty. A value is needed"),
        ("run pair --out '' --stiffness 1e5", "--out: empty. A value is needed"),
        ("compare ''", "argument: empty. A value is needed"),
        ("solve a.dump --out --out", "--out: --out: a path is needed"),
        ("run pair --out --out", "--out: --out: a path is needed"),
    ],
)  # fmt: skip
def test_words_that_are_refused(refused, tmp_path, words, says):
    (tmp_path / "pair.dump").write_text(two_people())
    assert says in refused(*shlex.split(words)).removeprefix("percussions: ")


def test_friction_of_one_wall_is_no_key_of_a_scene(refused, tmp_path):
    path = make("corridor").write(tmp_path)
    text = path.read_text()
    path.write_text(text.replace("[[walls]]", "[[walls]]\nfriction = 0.3", 1))
    assert "friction" in refused("run", path)
    path.write_text(text.replace("[contact]", "[contact]\nwall_friction = 0.3", 1))
    assert "contact.wall_friction" in refused("run", path)


def test_more_than_fits_on_the_disk(refused, tmp_path):
    path = make("arch", 100).with_run(frames=10**9, time_step_s=1.0).write(tmp_path)
    message = refused("run", path)
    assert "run.frames: 1000000000 frames of 100 disks need about 5e+04 GB" in message


def test_a_table_does_not_replace_its_dump(refused, tmp_path):
    dump = tmp_path / "a.dump"
    dump.write_text("anything")
    message = refused("solve", "a.dump", "--out", tmp_path / "." / "a.dump")
    assert "a.dump: the table would replace what it is made of" in message
    assert dump.read_text() == "anything"


def test_a_scene_does_not_replace_its_room(refused, tmp_path):
    data = Path(__file__).resolve().parents[1] / "data"
    room = shutil.copy(data / "rooms/free.toml", tmp_path / "free.toml")
    words = ("import", data / "trajectories/metres.txt", "--frame", 2, "--room", room)
    assert "free.toml: the scene would replace its room. Give --name or --out" in refused(*words)
