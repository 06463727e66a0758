"""Errors of whole runs over crowds: their statistics by hand, and real runs of a small crowd."""

import numpy as np
import pytest

from analysis.scene.shipped_scenes import make
from analysis.work_precision.whole_runs import (
    Measured,
    Precision,
    Setting,
    crowds_of,
    measure_whole_runs,
    points_of,
    read_whole_runs,
    runs_of,
    statistics_of,
    whole_run_settings,
    whole_runs_rows,
    whole_runs_section,
    write_whole_runs,
)

SOFT = Setting(engine="lammps", stiffness_N_per_m=1e6)
RIGID = Setting(engine="rigid", step_s=0.005)


def of_walls(setting, crowds, loads):
    return Measured(
        setting=setting,
        crowds=crowds,
        values={"walls": np.array(loads, dtype=float)},
        cpu_seconds=1.0,
        with_impulses=2.0,
    )


def test_an_error_is_that_of_the_crowds_that_both_have():
    reference = of_walls(RIGID, [0, 1, 2, 3], [100.0, 110.0, 90.0, 500.0])
    # crowd by crowd 1, 2 and 3 above: 2 in the mean of 100, standard error 1/√3, t of two degrees
    # of freedom 2.920
    found = of_walls(SOFT, [2, 1, 0], [91.0, 112.0, 103.0]).bias(reference, "walls")
    assert found.share == pytest.approx(0.02)
    assert found.error == pytest.approx(0.01 / np.sqrt(3))
    assert [found.low, found.high] == pytest.approx([0.02 - 0.016859, 0.02 + 0.016859], abs=1e-6)
    assert found.within == found.high
    assert reference.bias(reference, "walls").share == 0
    alone = of_walls(SOFT, [3], [600.0]).bias(reference, "walls")
    assert alone.share == pytest.approx(0.2)
    assert np.isnan(alone.low)  # one crowd has no interval


def test_crowds_that_all_differ_alike_have_no_interval():
    reference = of_walls(RIGID, [0, 1, 2], [2.0, 2.0, 2.0])
    soft = of_walls(SOFT, [0, 1, 2], [2.5, 2.5, 2.5])
    found = soft.bias(reference, "walls")
    assert found.share == pytest.approx(0.25)
    assert np.isnan([found.error, found.low, found.high]).all()
    scene = make("arch", disks=30)
    rows = whole_runs_rows(Precision(scene=scene, crowds=3, every=[reference, soft], failures=[]))
    alike = [f"{value} in each of 3 replicates" for value in ("2", "+25 %")]
    assert [row[-1] for row in rows] == alike


def test_the_settings_of_a_scene_begin_with_the_shortest_rigid_step(tmp_path):
    scene = make("arch").with_run(duration_s=4.0, frames=40)
    every = whole_run_settings(scene, ["lammps", "yade", "rigid"])
    assert [one.step_s for one in every if one.engine == "rigid"] == pytest.approx(
        [0.001, 0.005, 0.02, 0.005, 0.005]
    )
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
    ready = [*runs[0].every, runs[1].crowds[0], runs[1].alone]
    for run in ready:
        run.record()  # here, which is quicker than in other processes
    found = measure_whole_runs(scene, runs, read_only=True)
    rigid, soft = found.every
    assert (list(rigid.crowds), list(soft.crowds)) == ([0, 1], [0])
    assert 0 < soft.cpu_seconds < soft.with_impulses
    section = whole_runs_section(found)
    assert "the reference, rigid model, 5 ms, crowd with crowd" in section.introduction[0]
    assert [row[0] for row in section.tables[0].rows] == ["rigid model, 5 ms", "LAMMPS, 10⁶ N/m"]
    assert len(section.tables[0].head) == len(section.tables[0].rows[0])
    points = list(points_of(found))
    write_whole_runs(tmp_path, points)
    assert read_whole_runs((tmp_path / "whole_runs.json").read_text(), "a file") == points
    assert {point.setting for point in points} == {RIGID, SOFT}
    assert all(point.error is None for point in points)  # one crowd in common has no interval
    with pytest.raises(ValueError, match=r"here: not the whole runs of a chart: format"):
        read_whole_runs('{"format": 0}', "here")


def test_an_impact_is_compared_by_impulses(tmp_path):
    """Two disks of 75 kg that meet at 2 m/s at e = 0.5 pass on 112.5 N·s at their contact."""
    scene = make("pair").with_contact(restitution=0.5)
    ((run,),) = (one.crowds.values() for one in runs_of([RIGID], crowds_of(scene, 1), tmp_path))
    found = statistics_of(run, run.record())
    assert found["contact_sum"] == pytest.approx(112.5, rel=1e-6)
    assert found["walls"] == 0
    kept = Precision(
        scene=scene,
        crowds=1,
        every=[of_walls(RIGID, [0], [0.0])],
        failures=[],
    )
    assert kept.statistics == {}  # nobody touches a wall
