"""Times until people are out, and runs as PedPy measures them."""

import numpy as np
import pytest

from analysis.engines import EngineError
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from analysis.studies.exposure import pedestrians
from analysis.studies.exposure.loads import read_exposure, times_out
from analysis.studies.exposure.times import flow_after_arrival, leaving
from analysis.studies.report import sections
from analysis.support.extras import MissingExtraError
from tests.crowds import disks_at, drive_to, scene_at


def test_a_person_is_out_where_the_straight_line_between_two_frames_meets_the_door():
    """One walks at 1 m/s from 0.25 m before the door, one goes back after 2 s, one never comes, and one is
    out from the start; the last is there from 2 s on only."""
    x = np.array([[-0.25, -0.5, -2.0, 1.0], [0.75, 0.5, -2.0, 1.2], [1.75, -0.5, -2.0, 1.4], [2.75, 1.5, -2.0, -1.0]])
    frames = [disks_at(np.column_stack([row, np.zeros(4)]), radius=0.1, time=1.0 * n) for n, row in enumerate(x)]
    scene = scene_at(frames[0], drive=drive_to((0.0, -1.0), (0.0, 1.0)), time=0.1, run={"duration_s": 1.0, "frames": 1},
                     contact={"stiffness_N_per_m": 1e6, "restitution": 0.1})  # fmt: skip
    np.testing.assert_allclose(times_out(scene, frames, [1, 2, 3, 4]), [0.25, 2.25, np.inf, np.nan])


@pytest.fixture(scope="module")
def emptied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("emptied") / "run"
    scene = make("arch", disks=30).with_run(duration_s=3.0, frames=60)
    simulate(scene, "rigid", folder)
    return scene, folder


def test_what_pedpy_counts_before_the_door_is_what_exposure_counts(emptied):
    scene, folder = emptied
    every, run = pedestrians.trajectory(folder), read_exposure(folder)
    assert every.frame_rate == pytest.approx(20.0)
    assert len(every.data) == 61 * 30
    found = pedestrians.before_door(folder, scene)
    assert list(found) == ["time_s", "density_per_m2", "speed_m_per_s", "classic_density_per_m2"]
    at = np.searchsorted(run.time, found["time_s"] - 1e-6)
    both = np.isclose(run.time[at.clip(max=len(run.time) - 1)], found["time_s"])
    assert both.sum() > 10
    classic = found["classic_density_per_m2"][both]
    np.testing.assert_allclose(classic, run.loads["density"][at[both], 0], rtol=1e-3)
    assert (found["speed_m_per_s"][both] > 0).sum() > 5


def test_times_out_are_those_of_the_flow(emptied):
    run = read_exposure(emptied[1])
    out = leaving(run)
    done = np.count_nonzero(np.isfinite(out))
    assert done > 5
    for end, people in zip(run.time, np.cumsum(run.values["flow"] * run.duration), strict=True):
        assert (out <= end).sum() == round(people)
    flow = flow_after_arrival(run)
    assert flow.people == done - 1
    assert flow.seconds == pytest.approx((out[-1] if done == 30 else 3.0) - out[0])


def test_without_pedpy_a_report_says_so_and_has_the_rest(emptied, monkeypatch):
    def missing(library):
        raise MissingExtraError(f"{library} is not installed")

    from analysis.engines.run import EngineRun
    from analysis.studies.motion.study import Model, MotionStudy

    scene, folder = emptied
    runs = [EngineRun(scene=scene, engine="rigid", folder=folder)]
    model = Model(title="rigid", label="rigid", runs=runs, series=[read_exposure(folder)], last_s=1.0)
    motion = MotionStudy(scene, [model], 1, 1.0, [], [])
    made, warnings = sections.more_sections(motion)
    assert [len(one.tables) for one in made] == [1, 2, 1]
    assert warnings == []
    monkeypatch.setattr(pedestrians, "load", missing)
    made, warnings = sections.more_sections(motion)
    assert (len(made), warnings) == (2, ["pedpy is not installed"])
    walls, (_, out) = made[0].tables[0].rows, made[1].tables
    assert [row[0] for row in walls[:3]] == ["largest metre anywhere", "left of the door", "right of the door"]
    assert [row[0] for row in out.rows][-1] == "people per second after the first"
    monkeypatch.undo()
    with pytest.raises(EngineError, match="no run"):
        pedestrians.trajectory(folder.parent)
