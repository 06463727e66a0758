"""The command line: main job, bad input, interruption."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from analysis.engines import yade
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
    assert re.search(r"penalty mean +│ +\S+ N ", rows)
    assert re.search(r"contact correlation +│ +[\d.–]+ +│", rows)
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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "nowhere"), "unknown scene 'nowhere'"),
        (("run", "pair", "--engine", "magic"), "unknown engine 'magic'"),
        (("solve", "absent.dump"), "absent.dump"),
        (("compare", "absent"), "absent"),
        (("report", "nowhere"), "unknown scene"),
        (("report", "pair", "--engine", "magic"), "unknown engine"),
        (("scenes", "--make", "arch", "--disks", "1"), "needs at least 2"),
        (("scenes", "--make", "pair", "--disks", "5"), "fixed number"),
        (("scenes", "--make", "arc"), "unknown scene"),
        (("import", "absent.txt", "--frame", "3", "--room", "absent.toml"), "absent"),
    ],
)
def test_bad_words(refused, words, message):
    assert message in refused(*words)


def test_empty_contact_set(percussions, tmp_path):
    (tmp_path / "far.dump").write_text(two_people(apart=5))
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
        pytest.param("yade", marks=pytest.mark.skipif(yade.find() is None, reason="YADE is not installed")),
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
