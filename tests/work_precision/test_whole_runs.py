"""Errors of whole runs over crowds: their statistics by hand, and real runs of a small crowd."""

import pytest

from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision import whole_runs
from analysis.studies.work_precision.point import read_points, write_points
from analysis.studies.work_precision.whole_runs import (
    RunResult,
    RunSetting,
    WholeRunPoint,
    WholeRuns,
    bias_of,
)

from analysis.studies.work_precision.whole_runs import crowds_of, points_of, runs_of  # isort: skip

SOFT = RunSetting(engine="lammps", stiffness_N_per_m=1e6)
RIGID = RunSetting(engine="rigid", step_s=0.005)


def points_with(**walls):
    """The points of settings whose crowds have these loads on walls."""
    settings = {"rigid": RIGID, "soft": SOFT}
    results = {
        settings[name]: RunResult({i: {"walls": load} for i, load in enumerate(loads)}, [2.0], 1.0)
        for name, loads in walls.items()
    }
    return list(points_of(make("corridor"), results))


def test_an_error_is_that_of_the_crowds_that_both_have():
    reference = {0: 100.0, 1: 110.0, 2: 90.0, 3: 500.0}
    # crowd by crowd 1, 2 and 3 above: 2 in the mean of 100, standard error 1/√3, t of two degrees
    # of freedom 2.920
    found = bias_of({2: 91.0, 1: 112.0, 0: 103.0}, reference)
    assert found == pytest.approx((0.02, 0.02 - 0.016859, 0.02 + 0.016859), abs=1e-6)
    fraction, *ends = bias_of({3: 600.0}, reference)
    assert fraction == pytest.approx(0.2)
    assert ends == [None, None]  # one crowd has no interval
    assert bias_of({3: 600.0, 4: 1.0}, reference)[0] is None
    point = points_with(rigid=[100.0, 110.0, 90.0], soft=[103.0, 112.0, 91.0])[1]
    assert point.error == point.bias_high


def test_crowds_that_all_differ_alike_have_no_interval():
    points = points_with(rigid=[2.0] * 3, soft=[2.5] * 3)
    assert [point.bias for point in points] == [0.0, pytest.approx(0.25)]
    assert {(p.standard_error, p.bias_low, p.bias_high) for p in points} == {(None, None, None)}
    runs = WholeRuns(scene=make("arch", disks=30), crowds=3, points=points, failures=[])
    rows = whole_runs.whole_runs_rows(runs)
    alike = [f"{value} in each of 3 replicates" for value in ("2", "+25 %")]
    assert [row[-1] for row in rows] == alike


def test_the_settings_of_a_scene_begin_with_the_shortest_rigid_step(tmp_path):
    scene = make("arch").with_run(duration_s=4.0, frames=40)
    every = whole_runs.whole_run_settings(scene, ["lammps", "yade", "rigid"])
    steps = [one.step_s for one in every if one.engine == "rigid"]
    assert steps == pytest.approx([0.001, 0.005, 0.02, 0.005, 0.005])
    (yade,) = (one for one in every if one.engine == "yade")
    assert yade.title == "YADE, 10⁶ N/m"
    longer = next(one for one in every if one.longer == 4)
    step = longer.of(scene).run.time_step_s
    assert 0.1 / step == pytest.approx(round(0.1 / step))  # frames fall on steps
    assert len({one.run(scene, tmp_path).folder for one in every}) == len(every)


def test_whole_runs_of_a_small_crowd(tmp_path):
    """30 people for 0.2 s, two crowds by the rigid engine and one by LAMMPS: read again without
    running, on a page, and as points."""
    scene = make("arch", disks=30).with_run(duration_s=0.2, frames=2)
    runs = runs_of([RIGID, SOFT], crowds_of(scene, 2), tmp_path / "runs")
    for setting, crowd, run in runs:
        if (setting, crowd) != (SOFT, 1):
            run.record()  # here, which is quicker than in other processes
    found = whole_runs.measure_whole_runs(scene, runs, read_only=True)
    points = found.points
    of_one = found.of(points[0].quantity)
    assert [(p.setting, p.crowds) for p in of_one] == [(RIGID, 2), (SOFT, 1)]
    assert 0 < points[-1].cpu_seconds < points[-1].with_impulses_s
    section = whole_runs.whole_runs_section(found)
    assert "Errors are from rigid model, 5 ms, replicate by replicate" in section.introduction[0]
    assert [row[0] for row in section.tables[0].rows] == ["rigid model, 5 ms", "LAMMPS, 10⁶ N/m"]
    assert len(section.tables[0].head) == len(section.tables[0].rows[0])
    write_points(tmp_path, points, "whole_runs", WholeRunPoint)
    file = tmp_path / "whole_runs.json"
    assert read_points(file, WholeRunPoint) == points
    assert all(point.error is None for point in points)  # one crowd in common has no interval
    file.write_text('{"format": 0}')
    with pytest.raises(ValueError, match=r"whole_runs.json: not the whole runs of a chart: format"):
        read_points(file, WholeRunPoint)


def test_an_impact_is_compared_by_impulses(tmp_path):
    """Two disks of 75 kg that meet at 2 m/s at e = 0.5 pass on 112.5 N·s at their contact."""
    scene = make("pair").with_contact(restitution=0.5)
    (planned,) = runs_of([RIGID], crowds_of(scene, 1), tmp_path)
    found = whole_runs.statistics_of(planned.run, planned.run.record())
    assert found["contact_sum"] == pytest.approx(112.5, rel=1e-6)
    assert found["walls"] == 0
    assert points_with(rigid=[0.0]) == []  # nobody touches a wall
