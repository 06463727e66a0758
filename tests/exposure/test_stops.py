"""From a run to those who stop: a limit of the sum of forces for its time, by hand."""

import numpy as np
import pytest

from analysis.scene.scene import read_scene
from analysis.studies.exposure.limits import LimitError, known_limits
from analysis.studies.exposure.loads import RunLoads, stops_of, write_stops

HIGH, LOW = 7000.0, 10.0


def run_of(rows, scene="two_way", ids=(5, 9)):
    """Rows of loads (N) of two persons in windows of 5 s."""
    loads, time = np.array(rows), 5.0 * np.arange(1, len(rows) + 1)
    return RunLoads(
        scene=read_scene(scene), ids=ids, time=time, duration=np.full(len(rows), 5.0),
        loads={"contact_sum": loads}, values={},
    )  # fmt: skip


def limit(name):
    return next(one for one in known_limits() if one.name == name)


def test_who_is_above_without_a_break_for_its_time_stops_then(tmp_path):
    rows = [[HIGH, HIGH], [HIGH, HIGH], [LOW, HIGH], [HIGH, LOW], [HIGH, LOW], [HIGH, LOW]]
    run, seconds = run_of(rows), limit("asphyxia_seconds")
    assert seconds.duration_s == 15.0
    found = [(stop.people, stop.time_s) for stop in stops_of(run, seconds)]
    assert found == [((9, 9), 15.0), ((5, 5), 30.0)]
    at_once = [(stop.people, stop.time_s) for stop in stops_of(run, limit("fall_most"))]
    assert at_once == []
    assert [stop.time_s for stop in stops_of(run, limit("fall_least"))] == [5.0, 5.0]
    # the scene that is written has them, and written again no others
    count, path = write_stops(run, seconds, tmp_path)
    again = read_scene(path)
    assert (again.name, count, again.drive.stops) == ("two_way_stops", 2, stops_of(run, seconds))
    assert write_stops(run_of(rows[:4], path), seconds, tmp_path)[1] == path
    assert [stop.people for stop in read_scene(path).drive.stops] == [(9, 9)]
    # a person of three disks stops with all of them
    _, path = write_stops(run_of(rows, "shoulders", [4, 7]), seconds, tmp_path)
    assert [stop.people for stop in read_scene(path).drive.stops] == [(7, 9), (4, 6)]


def test_what_makes_nobody_stop_is_said(tmp_path):
    with pytest.raises(LimitError, match=r"--stops barrier_2_m: a limit of a force \(N\)"):
        stops_of(run_of([[HIGH, HIGH]]), limit("barrier_2_m"))
    with pytest.raises(LimitError, match="--stops: nobody is driven"):
        write_stops(run_of([[HIGH, HIGH]], "terrace"), limit("fall_least"), tmp_path)
