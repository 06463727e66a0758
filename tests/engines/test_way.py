"""The engines on one way: the same directions, and LAMMPS and YADE the same walk."""

import dataclasses

import numpy as np
import pytest
import shapely

from analysis.engines.run import finished_run
from analysis.engines.run import simulate as made
from analysis.scene import way as search
from analysis.scene.scene import Drive, read_scene
from analysis.scene.schema import Run
from tests.crowds import disks_at


@pytest.fixture(scope="module")
def spread():
    """The two streams of `ell`, moved about their corridors so that everybody stands alone."""
    scene = read_scene("ell")
    way = scene.drive.way
    # people of either door, one for each corner as far as there is room, the last corner first
    random, mine = np.random.default_rng(1), ([], [])
    floor = shapely.box(-6, 0, 2.5, 2.5) | shapely.box(0, -6, 2.5, 2.5)
    floor -= shapely.box(0.9, 0.9, 1.4, 1.4)
    lines = shapely.MultiLineString([(wall.start_m, wall.end_m) for wall in scene.walls])
    for corner in [*range(len(way.corners) - 1, -1, -1), *[0] * 60]:
        for door, people in enumerate(mine):
            own = way.origin + way.cell * (np.argwhere(way.next[door] == corner)[:, ::-1] + 0.5)
            free = shapely.distance(shapely.points(own), lines) > 0.23
            free &= shapely.contains_xy(floor, own)
            others = np.array([*mine[0], *mine[1]]).reshape(-1, 2)
            free &= (np.hypot(*(own[:, None] - others).T) > 0.45).all(0)
            if free.any() and len(people) < 30:
                people.append(random.choice(own[free]))
    position = np.array([*mine[0], *mine[1]])
    assert [len(people) for people in mine] == [30, 30]
    crowd = disks_at(position, radius=scene.snapshot.radius, mass=scene.snapshot.mass)
    run = Run(duration_s=0.9, frames=3)
    scene = scene.model_copy(update={"snapshot": crowd, "run": run}).rerouted()
    # the same way with its corners in another order, so that somebody goes to the last one
    way, last = scene.drive.way, len(scene.drive.way.corners) - 1
    used = int(way.at(position[:1], 0, way.next)[0])
    swapped = np.where(way.next == used, last, np.where(way.next == last, used, way.next))
    corners = way.corners.copy()
    corners[[used, last]] = corners[[last, used]]
    scene.drive._way = dataclasses.replace(way, next=swapped, corners=corners)
    return scene


def test_all_engines_walk_the_same_way(simulate, spread):
    scene = spread
    position, ids = scene.snapshot.position, scene.snapshot.ids
    drive = scene.drive
    way = drive.desired_velocity(position, ids) / drive.speed_m_per_s
    wanted = drive.push(scene.snapshot.mass)[:, None] * way
    runs = {name: simulate(name, scene) for name in ("rigid", "lammps", "yade")}
    for run in runs.values():
        force = np.column_stack([run["drive_x"][0], run["drive_y"][0]])
        np.testing.assert_allclose(force, wanted, rtol=0, atol=1e-9 * drive.push(75.0))
    for column in ("x", "y", "vx", "vy"):
        one, other = (runs[name][column] for name in ("lammps", "yade"))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)
    moved = np.hypot(*(runs["lammps"][c][-1] - runs["lammps"][c][0] for c in "xy"))
    assert np.median(moved) > 3 * drive.way.cell


NOISY = {"heading_sd_rad": 0.3, "heading_hold_s": 0.003, "jostling_m_per_s": 0.1}
LAW = {"time_gap_s": 0.8, "push_share": 0.1, "pushing_people": 0.8, **NOISY, "seed": 3}


@pytest.fixture(scope="module")
def difference(spread):
    """The same streams of people who keep their distance; some stop, and some push."""
    drive = spread.drive.model_dump(exclude_none=True) | LAW
    drive |= {"stops": [{"people": (5, 20), "time_s": 0.004}]}
    drive |= {"pushers": [{"people": (30, 40), "push_share": 0.6}]}
    run = Run(duration_s=0.01, frames=50, time_step_s=2e-4, rigid_step_s=2e-4, drive_interval_steps=1)
    changed = spread.model_copy(update={"drive": Drive.model_validate(drive), "run": run})
    return changed.with_contact(arm_reach_m=0.1, arm_force_N=50.0, friction=0.0).rerouted()


@pytest.mark.parametrize("name", ["rigid", "lammps", "yade"])
def test_who_keep_their_distance_want_the_same_in_all_engines(simulate, difference, name):
    """With goals, a way, stops, pushers, noise and arms: u_d from the drive and velocities of dumps."""
    run, people, drive = simulate(name, difference), difference.snapshot, difference.drive
    position, moves, force = (
        np.stack([run[axis] for axis in axes], axis=-1)
        for axes in (("x", "y"), ("vx", "vy"), ("drive_x", "drive_y"))
    )
    # engines with springs dump the drive that acted: after the first frame that of the step before
    acted = force[[0, *range(2, 51)]] if name != "rigid" else force[:50]
    wanted = [
        drive.desired_velocity(position[k], people.ids, k * 2e-4, people.radius) for k in range(50)
    ]
    found = acted * drive.relaxation_time_s / people.mass[:, None] + moves[:50]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12)
    still = drive.desired_velocity(position[0], people.ids, 0.0, people.radius)
    assert (np.hypot(*still.T) < 0.9 * drive.speed_m_per_s).mean() > 0.2  # many wait
    constrained = simulate(name, difference.with_drive(stops=()).with_run(drive_interval_steps=25))
    assert np.ptp(constrained["drive_x"], axis=0).max() > 1.0
    assert constrained.record.exit_state == run.record.exit_state


def test_a_run_on_a_way_that_is_found_otherwise_now_is_rerun(tmp_path, monkeypatch):
    scene = read_scene("turns").with_run(duration_s=0.01, frames=1)
    record = made(scene, "rigid", tmp_path / "run")
    assert finished_run(scene, "rigid", tmp_path / "run") == record
    monkeypatch.setattr(search, "RING", search.RING[::2])
    search._found.cache_clear()
    other = scene.rerouted()
    search._found.cache_clear()
    assert finished_run(other, "rigid", tmp_path / "run") is None
