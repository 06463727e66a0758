"""`percussions advise` and `run --error`: the main job, refusals, bad input."""

import json
import re
from contextlib import suppress

import numpy as np
import pytest
from typer.testing import CliRunner

from analysis.cli.commands import app
from analysis.compare.comparison import compare_run
from analysis.engines import LAMMPS
from analysis.engines.penalty import penalty_of
from analysis.engines.record import RunRecord
from analysis.scene.shipped_scenes import make
from analysis.studies.advice import choice
from analysis.studies.advice.library import stored_library
from analysis.studies.work_precision.point import write_points

no_lammps = pytest.mark.skipif(LAMMPS.version() is None, reason="no LAMMPS")


def test_advise(percussions, tmp_path):
    made = percussions("advise", "corridor", "--error", "5%", "--quantity", "wall-load")
    assert made.returncode == 0, made.stderr
    for words in ("advised: ", "next better", "the curve, from cheap to accurate", "measured on"):
        assert words in made.stdout
    assert "left out" in made.stdout
    assert "spin" in made.stdout
    content = json.loads((tmp_path / "advice/advice.json").read_text())
    assert content["choice"]["promised_error"] <= content["asked_error"] == 0.05
    assert content["read"]
    assert content["measured"]


@pytest.mark.long
def test_refusal_names_the_best_and_fails(percussions, tmp_path):
    made = percussions("advise", "chain", "--error", "0.1%", "--method", "lammps")
    assert made.returncode == 1
    assert "nothing reaches 0.1 %" in made.stdout
    assert "The best, LAMMPS" in made.stdout
    content = json.loads((tmp_path / "advice/advice.json").read_text())
    assert content["choice"] is None
    assert content["best"]["promised_error"] > 0.001


def test_bad_input_is_one_line(refused):
    assert "error: '0'" in refused("advise", "chain", "--error", "0")
    assert "nothing reaches 0.01 %" in refused("run", "chain", "--error", "0.01%")


def test_what_cannot_be_asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_points(tmp_path / "a_chart", stored_library().entries[0].points)
    for words, says in (
        (("advise", "chain", "--error", "5%", "--quantity", "noise"), "quantity: unknown 'noise'"),
        (("advise", "chain", "--error", "5%", "--method", "magic"), "method: unknown 'magic'"),
        (("advise", "chain", "--error", "5%", "--chart", "nowhere"), "nowhere/points.json: no such file"),
        (("advise", "chain", "--error", "5%", "--chart", "a_chart"), "chart: no points of scene chain"),
        (("run", "chain", "--error", "5%", "--stiffness", "1e7"), "Leave out"),
        (("run", "chain", "--error", "5%", "--engine", "rigid"), "rigid has no stiffness"),
    ):  # fmt: skip
        made = CliRunner().invoke(app, words)
        assert isinstance(made.exception, ValueError), words
        assert says in str(made.exception)
    assert not (tmp_path / "advice").exists()


@no_lammps
def test_run_within_an_error(percussions, tmp_path):
    """A pair has a closed form: 75 N·s in the inelastic limit."""
    made = percussions("run", "pair", "--error", "5%", "--engine", "lammps")
    assert made.returncode == 0, made.stderr
    assert "advised: LAMMPS" in made.stdout
    (folder,) = (tmp_path / "out/pair").iterdir()
    comparison = compare_run(folder)
    assert np.hypot(*comparison.match.penalty[0]) == pytest.approx(75.0, rel=0.05)
    (announced,) = re.findall(r"Δt = (\S+) s", made.stdout)
    assert RunRecord.read(folder).time_step_s == pytest.approx(float(announced), rel=5e-3)


@pytest.mark.long
def test_an_advised_impact_ends_on_a_frame():
    scene, _, _ = choice.scene_within(make("pair"), "5%", "lammps")
    penalty = penalty_of(scene)
    assert penalty.steps * penalty.time_step == pytest.approx(scene.run.duration_s)
    assert penalty.time_step <= 4.0 * penalty.safe_time_step * (1 + 1e-9)
    # harder contacts let go sooner
    stiffer = scene.contact.stiffness_N_per_m / 1e6
    assert scene.run.duration_s == pytest.approx(0.3 / stiffer**0.5)


@pytest.mark.long
@no_lammps
@pytest.mark.parametrize("name", ["pair", "four_disks", "chain_masses", "arch"])
def test_the_time_step_that_is_announced_is_the_one_that_runs(name, monkeypatch):
    found, tried, reached = [], choice.tried, []  # tried once for all errors
    monkeypatch.setattr(choice, "tried", lambda *of: found or found.extend(tried(*of)) or found)
    for error in ("2%", "5%", "20%", "40%"):
        with suppress(ValueError):  # nothing reaches this error
            reached.append(choice.scene_within(make(name), error, "lammps"))
    announced = [float(re.findall(r"Δt = (\S+) s", words)[0]) for *_, words in reached]
    assert announced == pytest.approx([penalty_of(one).time_step for one, *_ in reached], rel=5e-3)
    assert announced
