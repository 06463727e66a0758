"""Charts from real runs: convergence, failure, what is kept, the page, and a cluster."""

import dataclasses
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from analysis.cli.commands import app
from analysis.engines import LAMMPS
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision import soft
from analysis.studies.work_precision.chart import measure
from analysis.studies.work_precision.page import write_chart
from analysis.studies.work_precision.point import Method, PointStatus, read_points
from analysis.studies.work_precision.soft import run_soft, settings_of
from analysis.studies.work_precision.whole_runs import WholeRunPoint, whole_runs_of
from analysis.studies.work_precision.window import DISK_IMPULSE, driven_window, impact_window
from analysis.support.parallel import workers
from nscd import ContactLaw, find_contacts, solve
from tests.pages.browser import answers_first

pytestmark = pytest.mark.skipif(LAMMPS.version() is None, reason="no LAMMPS")


def setting(fraction, law="hooke", stiffness=1e6):
    return Method(method="lammps", law=law, stiffness_N_per_m=stiffness, time_step_share=fraction)


@pytest.fixture(scope="module")
def window():
    return impact_window(make("four_disks"))


@pytest.fixture(scope="module")
def measured(window, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    chosen = [*map(setting, (0.25, 1.0, 32.0)), setting(0.25, "hertz"), setting(1.0, "hertz")]
    with workers(1) as executor:
        return measure(window, "four_disks", chosen, folder, executor)


def errors(measured, law):
    return {p.time_step_share: p.numerical_error for p in impulses(measured, law)}


def impulses(measured, law):
    points = measured.points
    return [p for p in points if p.law == law and p.quantity == "contact_impulse"]


# Hertz's dashpot grows with overlap^¼, with an infinite slope at touch: the order comes out a
# little below one
@pytest.mark.long
@pytest.mark.parametrize(("law", "minimum"), [("hooke", 3.8), ("hertz", 3.0)])
def test_numerical_error_is_of_first_order_in_the_time_step(measured, law, minimum):
    found = errors(measured, law)
    assert minimum < found[1.0] / found[0.25] < 4.2


def test_model_error_is_none_of_the_time_step(measured):
    (model,) = {p.model_error for p in impulses(measured, "hooke")}
    # penalty impulses at an asked restitution of 0.01 against rigid ones
    assert model == pytest.approx(0.028, abs=0.001)
    for point in measured.points:
        if point.status == PointStatus.OK and point.numerical_error is not None:
            assert point.total_error <= point.numerical_error + point.model_error + 1e-12


def test_a_time_step_far_too_long_is_flagged_with_a_reason(measured):
    points = [p for p in measured.points if p.time_step_share == 32.0]
    assert points
    for point in points:
        assert point.status in (PointStatus.FAILED, PointStatus.INACCURATE)
        assert point.reason


def test_what_is_there_is_not_run_again(window, tmp_path, monkeypatch):
    first, broken = (run_soft(window, setting(fraction), tmp_path) for fraction in (4.0, 64.0))

    def never(*_):
        raise AssertionError("run again")

    monkeypatch.setattr(soft, "run_engine", never)
    again = run_soft(window, setting(4.0), tmp_path)
    assert (again.values[DISK_IMPULSE] == first.values[DISK_IMPULSE]).all()
    assert (again.cpu_seconds, again.date) == (first.cpu_seconds, first.date)
    # a failure is a result too
    assert run_soft(window, setting(64.0), tmp_path).status == broken.status
    # another time step is another run
    with pytest.raises(AssertionError, match="run again"):
        run_soft(window, setting(2.0), tmp_path)


def test_page_and_tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = CliRunner().invoke(app, ["chart", "pair", "--quick", "--jobs", "1"])
    assert made.exit_code == 0, made.output
    assert made.stdout.strip().endswith("chart/index.html")
    points = read_points(tmp_path / "chart/points.json")
    assert {p.method for p in points} >= {"lammps", "rigid", "first_order"}
    assert all(p.machine and p.date for p in points)
    page = (tmp_path / "chart/index.html").read_text()
    assert points[0].machine in page
    assert "quick chart" in page
    assert "collide, with e = 0.01" in page
    assert "No continuum on this chart: it is for a crowd that a drive presses" in page
    assert "http" not in page.split("<section")[1]
    assert json.loads((tmp_path / "chart/pareto.json").read_text())["points"]
    assert (tmp_path / "chart/contact_impulse.png").stat().st_size > 10_000


@pytest.mark.long
def test_seeds_put_whole_runs_on_the_page(measured, tmp_path, monkeypatch):
    """One crowd by LAMMPS at the scene's stiffness; the chart of one instant is at hand."""
    scene = make("four_disks").with_run(duration_s=0.02, frames=20, time_step_s=None)
    at_hand = dataclasses.replace(measured, scene=scene)
    monkeypatch.setattr("analysis.studies.work_precision.chart.build_chart", lambda *_, **__: at_hand)
    for name, value in (("ENGINES", (LAMMPS,)), ("STIFFER", (1.0,)), ("LONGER_AT", 0)):
        monkeypatch.setattr(f"analysis.studies.work_precision.whole_runs.{name}", value)
    scene.write(tmp_path)
    monkeypatch.chdir(tmp_path)
    for planned in whole_runs_of(read_scene("four_disks.toml"), 1, Path("out")):
        planned.run.record()  # here, which is quicker than in other processes
    words = ["chart", "four_disks.toml", "--quick", "--seeds", "1", "--jobs", "1"]
    made = CliRunner().invoke(app, words)
    assert made.exit_code == 0, made.output
    points = read_points(tmp_path / "chart/whole_runs.json", WholeRunPoint)
    found = {p.quantity: p.mean for p in points}
    assert found.keys() == {"contact_sum", "contact_95"}  # there is no wall
    contacts = find_contacts(scene.snapshot, tolerance=1e-9)
    rigid = solve(scene.snapshot, contacts, law=ContactLaw(restitution=0.01))
    impulses = np.hypot(*rigid.impulse.T).sum()
    assert found["contact_sum"] == pytest.approx(impulses, rel=0.05)
    assert all(p.cpu_seconds < p.with_impulses_s for p in points)
    page = (tmp_path / "chart/index.html").read_text()
    assert "LAMMPS, 10⁶ N/m" in page.split('id="whole_runs"')[1]
    assert (tmp_path / "chart/whole_runs.csv").read_text().count("\n") == 1 + len(points)


@pytest.mark.long
def test_a_driven_crowd_has_the_continuum_on_its_page(tmp_path):
    scene = read_scene("gate")
    window = driven_window(scene, scene.snapshot.position)
    with ThreadPoolExecutor(1) as executor:
        measured = measure(window, "gate", [], tmp_path, executor, mesh_sides=(4.0,))
    found = [p for p in measured.points if p.method == "continuum"]
    assert {p.quantity for p in found} == {"disk_force", "wall_force", "displacement"}
    first, *rest = (p for p in found if p.quantity == "wall_force")
    unsure = dataclasses.replace(first, status=PointStatus.INACCURATE, reason="residual 2 above 1")
    walls = tuple(q for q in measured.quantities if q.name == "wall_force")
    changes = {"points": (unsure, *rest), "quantities": walls, "warnings": ()}
    shown = dataclasses.replace(measured, scene=scene, **changes)
    written = write_chart(shown, tmp_path / "chart", "a command")
    answers_first(written.absolute().as_uri())
    page = written.read_text()
    assert read_points(tmp_path / "chart/points.json") == [unsure, *rest]
    assert "<strong>Continuum</strong>" in page
    assert "No continuum" not in page
    wrong = page.split('id="unfinished"')[1]
    for words in ("continuum (11), deformable", "triangles of 0.720\xa0m", "residual 2 above 1"):
        assert words in wrong


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("chart", "pair.toml"), "contact.friction"),
        (("chart", "four_disks", "--jobs", "0"), "--jobs"),
        (("chart", "nowhere"), "unknown scene"),
        (("chart", "apart.toml"), "nobody presses anybody"),
        (("advise", "apart.toml", "--error", "5%"), "nobody presses anybody"),
    ],
)
def test_bad_input_is_one_line(words, says, tmp_path, refused):
    pair = make("pair")
    pair.with_contact(friction=0.3).write(tmp_path)
    away = dataclasses.replace(pair.snapshot, velocity=-pair.snapshot.velocity)
    pair.model_copy(update={"snapshot": away, "name": "apart"}).write(tmp_path)
    assert says in refused(*words)


def test_too_long_runs_are_left_out(window):
    chosen = list(settings_of(window, ("lammps",)))
    assert {s.law for s in chosen} == {"hooke", "hertz"}
    large = impact_window(make("chain", 4000))
    assert len(list(settings_of(large, ("lammps",)))) < len(chosen)
