"""People with a door of their own: every engine drives them to it, and in the same way."""

import numpy as np
import pytest

from analysis.scene.schema import Goal
from analysis.scene.shipped_scenes import make
from analysis.work_precision.soft import SoftModel

PUSHED = ("drive_x", "drive_y")


@pytest.fixture(scope="module", params=["nearest", "centre"])
def scene(request):
    """Forty people before one door, of whom two ranges go to others."""
    crowd = make("arch", 40).with_run(duration_s=0.1, frames=2)
    drive = crowd.drive
    aside = {"door_start_m": (0.0, 6.0), "door_end_m": (-1.0, 7.0), "outward": (0.0, 1.0)}
    back = {"door_start_m": (-9.0, -2.0), "door_end_m": (-9.0, 1.0), "outward": (-1.0, 0.0)}
    goals = (Goal(people=(11, 20), **aside), Goal(people=(31, 33), **back))
    aimed = drive.model_copy(update={"goals": goals, "aim": request.param})
    return crowd.model_copy(update={"drive": aimed})


def wanted(scene, position, velocity):
    """m(u_d − u)/τ (n,2) N, person by person."""
    drive, force = scene.drive, np.empty_like(position)
    for row, person in enumerate(scene.snapshot.ids):
        exit_ = next((g for g in drive.goals if g.people[0] <= person <= g.people[1]), drive)
        start, end = (np.array(point) for point in (exit_.door_start_m, exit_.door_end_m))
        if drive.aim == "centre":
            aim = 0.5 * (start + end)
        else:
            share = (position[row] - start) @ (end - start) / ((end - start) @ (end - start))
            aim = start + min(max(share, 0.0), 1.0) * (end - start)
        way = aim - position[row]
        if (position[row] - start) @ np.array(exit_.outward) >= 0:
            way = np.array(exit_.outward)
        speed = drive.speed_m_per_s * way / np.hypot(*way)
        mass = scene.snapshot.mass[row]
        force[row] = mass * (speed - velocity[row]) / drive.relaxation_time_s
    return force


@pytest.mark.parametrize("engine", ["lammps", "yade", "rigid"])
def test_the_push_of_each_is_to_the_own_door(simulate, scene, engine):
    run = simulate(engine, scene)
    for frame in range(len(run["x"])):
        place, speed, push = (
            np.column_stack([run[name][frame] for name in names])
            for names in (("x", "y"), ("vx", "vy"), PUSHED)
        )
        if engine != "rigid" and frame:
            # evaluated some steps before the frame
            assert np.abs(push - wanted(scene, place, speed)).max() < 10.0
        else:
            assert np.abs(push - wanted(scene, place, speed)).max() < 1e-9


def test_the_reference_integrator_drives_the_same(scene):
    velocity, got = np.full((40, 2), 0.3), np.empty((40, 2))
    place = 2.0 * scene.snapshot.position  # nobody touches anybody
    SoftModel(scene.model_copy(update={"walls": ()}), 1e-9).accelerate(got, place, velocity)
    got *= scene.snapshot.mass[:, None]
    assert np.abs(got - wanted(scene, place, velocity)).max() < 1e-9
