"""percussions compare by windows: what it prints, writes and refuses. Stiffer springs on a crowd at
rest: begun anew from one configuration."""

import csv
import json
import re
import shutil

import numpy as np
import pytest

from analysis.compare.study import study
from analysis.engines.record import RunRecord
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from analysis.studies.report.contacts import moved_between
from tests.engines.at_hand import require


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """A rigid run of 20 people before a door."""
    folder = tmp_path_factory.mktemp("runs") / "rigid"
    simulate(make("arch", disks=20).with_run(duration_s=1.0, frames=10), "rigid", folder)
    return folder


def test_the_command_writes_what_it_says(percussions, rigid, tmp_path):
    other = shutil.copytree(rigid, tmp_path / "again")
    made = percussions("compare", rigid, other, "--window", 0.2, "--last", 0.4)
    assert made.returncode == 0, made.stderr
    assert "windows of 0.2 s, 2 from 0.6 to 1 s" in re.sub(r"\s+", " ", made.stdout)
    numbers = json.loads((other / "windows.json").read_text())
    assert (numbers["windows"], numbers["window_s"]) == (2, pytest.approx(0.2))
    with (other / "windows.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert numbers["measures"]["walls"]["first"] == pytest.approx(
        np.mean([float(row["first_walls_N"]) for row in rows])
    )
    assert "h = 5 ms" in made.stdout
    with (other / "window_contacts.csv").open() as file:
        contacts = [row for row in csv.DictReader(file) if row["is_wall"] == "1"]
    last = [row for row in contacts if float(row["end_s"]) > 0.99]
    load = sum(np.hypot(float(r["first_run_x_Ns"]), float(r["first_run_y_Ns"])) for r in last) / 0.2
    assert load == pytest.approx(float(rows[-1]["first_walls_N"]))


def test_a_run_without_impulses_says_how_to_get_them(percussions, rigid, tmp_path):
    other = tmp_path / "none"
    shutil.copytree(rigid, other)
    (other / "impulses.dump").unlink()
    record = json.loads((other / "run.json").read_text())
    del record["dump_digests"]["impulses.dump"]
    (other / "run.json").write_text(json.dumps(record))
    RunRecord.read(other).finished(other).write(other)
    made = percussions("compare", rigid, other, "--window", 0.1)
    assert made.returncode != 0
    assert made.stderr.strip().count("\n") == 0
    assert "Run the scene again with --impulses" in made.stderr


def test_one_pair_of_runs_has_no_verdict(percussions, rigid, tmp_path):
    """Whatever its windows are: they are those of one crowd."""
    other = shutil.copytree(rigid, tmp_path / "again")
    made = percussions("compare", rigid, other, "--window", 0.1)
    assert made.returncode == 0
    message = re.sub(r"\s+", " ", made.stdout)
    assert "one pair of runs: no verdict" in message
    assert "differ " not in message
    assert "90 %" not in message
    walls = json.loads((other / "windows.json").read_text())["measures"]["walls"]
    assert set(walls) == {
        "unit", "first", "second", "second_above_first", "autocorrelation", "independent_windows",
    }  # fmt: skip


def test_a_rigid_run_alone_has_neither_stiffness_nor_penalty(percussions, rigid):
    made = percussions("compare", rigid)
    assert "rigid model, h = 5 ms" in re.sub(r"\s+", " ", made.stdout)
    assert not re.search("penalty|k = ", made.stdout)


def test_runs_of_other_crowds_are_refused_before_anything_is_written(refused, rigid, tmp_path):
    other = tmp_path / "fewer"
    simulate(make("arch", disks=19).with_run(duration_s=0.1, frames=1), "rigid", other)
    assert "20 people, not 19" in refused("compare", other, rigid, other)
    assert "19 people, not 20" in refused("compare", rigid, other)


STIFFNESSES = [3e5, 1e5, 1e6, 3e6]


@pytest.fixture(scope="module")
def jam(tmp_path_factory):
    """Twelve disks too large for the door, in LAMMPS."""
    require("lammps")
    scene = make("jam", 12).with_run(duration_s=4.0, frames=4)
    scene = scene.model_copy(update={"analysis": scene.analysis.model_copy(update={"time_s": 4.0})})
    folder = tmp_path_factory.mktemp("runs")
    return scene, folder, study(scene, ["lammps"], STIFFNESSES, folder)


def test_stiffer_runs_begin_where_the_softest_rests(jam):
    scene, folder, made = jam
    assert not made.failures
    assert made.anew == {"lammps"}
    runs = made.comparisons
    assert [run.scene.contact.stiffness_N_per_m for run in runs] == sorted(STIFFNESSES)
    soft, *stiffer = runs
    assert np.array_equal(soft.scene.snapshot.position, scene.snapshot.position)
    for run in stiffer:
        first = run.scene.snapshot
        # overlaps of the soft run are gone, nobody has gone far, and nobody moves
        distance = np.hypot(*(first.position[:, None] - first.position[None]).T)
        np.fill_diagonal(distance, np.inf)
        assert (distance - np.add.outer(first.radius, first.radius)).min() > -1e-9
        assert not first.velocity.any()
        assert run.balance.unbalanced < 0.01
    # a disk that rests sinks by F/k: from one stiffness to the next by centimetres at most
    assert 0 < moved_between(made, "lammps") < 0.1
    anew = [path.name.endswith("_anew") for path in (folder / "jam").iterdir()]
    assert sorted(anew) == [False, True, True, True]


def test_three_stiffnesses_or_a_moving_crowd_begin_as_the_scene_does(jam):
    scene, folder, _ = jam
    assert not study(scene, ["lammps"], STIFFNESSES[:3], folder).anew
    start = scene.with_run(duration_s=0.1, frames=1)
    start = start.model_copy(update={"analysis": start.analysis.model_copy(update={"time_s": 0.1})})
    assert not study(start, ["lammps"], STIFFNESSES, folder / "moving").anew
