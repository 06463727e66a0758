"""The paper's four disks and corridor with the real engines, against an integration of the springs,
long waves and limits."""

import io
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analysis.compare.comparison import exponent, statistics
from analysis.engines import LAMMPS, YADE
from analysis.engines.run import EngineRun
from analysis.pages.section import Verdict
from analysis.scene.scene import read_scene
from analysis.studies.paper.discrete import fig1_four_disks
from analysis.studies.paper.discrete import fig2_corridor as corridor
from analysis.studies.paper.discrete.engine_runs import end_of
from analysis.studies.paper.discrete.fig2_corridor import Push, long_wave_speed, push_scene
from analysis.studies.paper.discrete.line_of_disks import cradle_scene
from nscd import find_contacts
from tests.engines.at_hand import require
from tests.pages.browser import says_little


def springs(disks, mass, stiffness, speed, power):
    """Velocities after a line of disks with contact forces k δ^power has come apart, by an adaptive
    integrator."""

    def slope(_, state):
        x, v = state[:disks], state[disks:]
        force = stiffness * np.maximum(x[:-1] - x[1:], 0.0) ** power
        total = np.zeros(disks)
        total[:-1] -= force
        total[1:] += force
        return np.concatenate([v, total / mass])

    start = np.zeros(2 * disks)
    start[disks] = speed
    end = 12 * np.sqrt(mass / stiffness)
    return solve_ivp(slope, (0, end), start, rtol=1e-9, atol=1e-12, method="DOP853").y[disks:, -1]


@pytest.mark.parametrize("disks", [3, 4])
@pytest.mark.parametrize("engine", ["lammps", "yade"])
def test_the_cradle_of_soft_disks(engine, disks, tmp_path):
    require(engine)
    run = EngineRun.of(cradle_scene(read_scene("four_disks"), disks), engine, tmp_path)
    found = end_of(run).velocity[:, 0]
    np.testing.assert_allclose(found, springs(disks, 75.0, 1e6, 2.0, 1.0), atol=2e-4)
    assert found[-1] > 1.9


@pytest.fixture(scope="module")
def first_figure(tmp_path_factory):
    require("lammps")
    require("yade")
    runs = tmp_path_factory.mktemp("figure 1")
    observed = []
    return fig1_four_disks.build(runs, lambda label, fraction: observed.append((label, fraction))), runs, observed


def test_figure_1_holds_every_law_and_judges_the_claims(first_figure):
    section, _, observed = first_figure
    assert not section.warnings
    assert observed
    laws = {row[0]: np.array(row[2:6], dtype=float) for row in section.tables[0].rows}
    assert len(laws) == 12
    np.testing.assert_allclose(laws["percussions, k = 0"], 0.5, atol=1e-9)
    np.testing.assert_allclose(laws["percussions, k = 10 kg"], 0.5, atol=1e-9)
    hard = laws["percussions, k = 10⁶ m (k → ∞)"]
    np.testing.assert_allclose(hard, laws["Newton, e = 1"], atol=1e-5)
    np.testing.assert_allclose(laws["LAMMPS, e = 1, hooke"], laws["YADE, e = 1, hooke"], atol=1e-9)
    assert abs(laws["LAMMPS, e = 1, hooke"] - laws["Newton, e = 1"]).max() > 0.5
    # momentum, whoever computes it
    for velocity in laws.values():
        assert velocity.sum() == pytest.approx(2.0, abs=1e-6)
    verdicts = {claim.where: claim.verdict for claim in section.claims}
    assert verdicts["Fig. 1c"] is Verdict.FAILS
    assert verdicts["text after (1)"] is Verdict.PARTLY
    assert verdicts["text after (3)"] is Verdict.HOLDS
    energy = section.tables[4].rows
    assert energy[-1][3] > energy[-1][2]
    assert "energy grew" in energy[-1][5]
    assert "energy grew" not in energy[0][5]
    for picture in section.pictures:
        picture.figure.savefig(io.BytesIO(), format="png")


def test_a_second_build_of_figure_1_runs_no_engine(first_figure):
    section, runs, _ = first_figure
    before = {path: path.stat().st_mtime_ns for path in runs.rglob("run.json")}
    assert len(before) == 10
    again = fig1_four_disks.build(runs)
    assert {path: path.stat().st_mtime_ns for path in runs.rglob("run.json")} == before
    assert again.tables[0].rows == section.tables[0].rows


def test_figures_without_engines_warn_and_go_on(monkeypatch, tmp_path):
    for module in (LAMMPS, YADE):
        monkeypatch.setattr(module, "find", lambda: None)
        monkeypatch.setattr(module, "version", lambda: None)
    monkeypatch.setattr(corridor, "TIME_S", 0.02)
    for module, runs in ((fig1_four_disks, 10), (corridor, 17)):
        section = module.build(tmp_path)
        assert len(section.warnings) == runs
        assert section.claims
        says_little(replace(section, warnings=()), tmp_path)
        for picture in section.pictures:
            picture.figure.savefig(io.BytesIO(), format="png")


@pytest.fixture(scope="module")
def pushes(tmp_path_factory):
    require("lammps")
    runs = tmp_path_factory.mktemp("pushes")
    scene = read_scene("corridor")
    every = (1e5, 1.0, 14, 420), (1e7, 1.0, 14, 420), (1e6, 0.1353, 24, 400), (1e6, 0.01, 24, 1200)
    return {one[:2]: Push(EngineRun.of(push_scene(scene, *one), "lammps", runs)) for one in every}


@pytest.mark.long
def test_the_front_runs_as_the_root_of_the_stiffness(pushes):
    elastic = [pushes[k, 1.0] for k in (1e5, 1e7)]
    power = exponent(np.array([p.stiffness for p in elastic]), np.array([p.speed for p in elastic]))
    assert power == pytest.approx(0.5, abs=0.02)
    scene = elastic[1].comparison.scene
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=1e-6)
    assert elastic[1].speed == pytest.approx(long_wave_speed(scene, contacts), rel=0.06)


def test_the_front_reaches_the_columns_in_order(pushes):
    for push in pushes.values():
        assert push.first[0] == 0
        assert (np.diff(push.first) > 0).all()


def test_damping_leads_to_the_percussions(pushes):
    soft, damped = (statistics(pushes[1e6, e].comparison) for e in (0.1353, 0.01))
    assert damped["contact_relative_difference"] < 0.5 * soft["contact_relative_difference"]
    assert damped["contact_correlation"] > 0.99
    assert pushes[1e6, 0.01].comparison.unit == "N·s"
