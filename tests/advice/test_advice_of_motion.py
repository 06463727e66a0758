"""Advice for whole runs: only what was measured is promised."""

import dataclasses

import pytest

from analysis.advice.motion import advise_motion, motion_lines, stored_whole_runs
from analysis.scene.shipped_scenes import make
from analysis.work_precision.whole_runs import write_whole_runs

METHODS = ("rigid", "lammps", "yade")


@pytest.fixture(scope="module")
def arch():
    return make("arch")


def test_the_choice_is_the_cheapest_within_the_error(arch):
    advice = advise_motion(arch, 0.05, "arrest-load", METHODS)
    assert advice.choice in advice.found
    cheaper = [one for one in advice.found if one.cpu_seconds < advice.choice.cpu_seconds]
    assert all(one.error > 0.05 >= advice.choice.error for one in cheaper)
    # an engine ten times too soft is 20 % low: both with springs were measured so
    soft = [one for one in advice.found if one.setting.stiffness_N_per_m == 1e6]
    assert {one.setting.engine for one in soft} == {"lammps", "yade"}
    assert all(-0.25 < one.bias < -0.15 and one.error > 0.15 for one in soft)
    assert f"advised: {advice.choice.setting.title}" in "\n".join(motion_lines(advice))


def test_what_was_not_measured_is_not_promised(arch):
    nothing = advise_motion(arch, 1e-4, "arrest-load", METHODS)
    assert nothing.choice is None
    assert "nothing that was measured reaches 0.01 %; the best" in motion_lines(nothing)[1]
    for scene, why in (
        (make("corridor"), "is an impact"),
        (make("arch", disks=75), "not like arch"),
        (arch.with_run(duration_s=0.5), "a crowd that has just met"),
        (arch.model_copy(update={"drive": arch.drive.model_copy(update={"speed_m_per_s": 4.0})}),
         "2 times as hard"),
    ):  # fmt: skip
        advice = advise_motion(scene, 0.5, "arrest-load", METHODS)
        assert (advice.choice, list(advice.found)) == (None, [])
        assert why in advice.why_not
    with pytest.raises(ValueError, match="friction"):
        advise_motion(arch.with_contact(friction=0.4), 0.5, "arrest-load", METHODS)


def test_a_chart_of_the_very_scene_is_read_instead(arch, tmp_path):
    scene = make("arch", disks=75)
    points = [dataclasses.replace(one, scene="arch") for one in stored_whole_runs()]
    write_whole_runs(tmp_path, points)
    own = tmp_path / "whole_runs.json"
    assert advise_motion(scene, 0.5, "arrest-load", METHODS, own).choice
    with pytest.raises(ValueError, match="whole runs of arch, not of jam"):
        advise_motion(make("jam"), 0.5, "arrest-load", METHODS, own)
    with pytest.raises(ValueError, match="no such file"):
        advise_motion(scene, 0.5, "arrest-load", METHODS, tmp_path / "none.json")
