"""People who want to go nowhere from a time on, in three engines and by hand."""

import numpy as np
import pytest

from analysis.scene.scene import Drive, SceneError, read_scene
from tests.crowds import disks_at, drive_to, scene_at

ENGINES = ["lammps", "yade", "rigid"]
RUN = {"duration_s": 0.6, "frames": 6, "time_step_s": 5e-4, "rigid_step_s": 5e-4}


@pytest.mark.long
@pytest.mark.parametrize("disks", [1, 2])
@pytest.mark.parametrize("name", ENGINES)
def test_who_stops_slows_down_exponentially(simulate, name, disks):
    """u = U exp(−(t − t₀)/τ) from t₀ on; the other goes on at U; as one disk each, or two."""
    people = disks_at([[0.0, y + 0.4 * k] for y in (0, 3) for k in range(disks)], [1.0, 0.0])
    people = people.joined([1, 1, 2, 2]) if disks == 2 else people
    drive = drive_to((50.0, -9.0), (50.0, 9.0), speed=1.0).model_dump()
    stop = {"people": (disks + 1, 2 * disks), "time_s": 0.2}
    drive, run = Drive.model_validate(drive | {"stops": [stop]}), RUN | {"drive_interval_steps": 1}
    scene = scene_at(
        people, name="stop", time=0.6, drive=drive, run=run,
        contact={"stiffness_N_per_m": 1e5, "restitution": 0.1},
    )  # fmt: skip
    found, time = simulate(name, scene), np.linspace(0, 0.6, 7)
    by_hand = np.exp(-np.maximum(time - 0.2, 0) / 0.5)
    np.testing.assert_allclose(found["vx"][:, -1], by_hand, rtol=5e-4)
    np.testing.assert_allclose(found["vx"][:, 0], 1.0, rtol=1e-9)
    drives = found["drive_x"][-1, [0, -1]]
    np.testing.assert_allclose(drives, [0.0, -150.0 * by_hand[-1]], rtol=5e-3, atol=1e-6)


def test_a_wall_carries_less_by_the_push_of_who_stops(simulate):
    mass = np.array([60.0, 75.0, 90.0])
    row = disks_at([[-0.25, 0.0], [-0.75, 0.0], [-1.25, 0.0]], mass=mass)
    drive = drive_to((0.1, -1.0), (0.1, 1.0), speed=1.0).model_dump()
    drive = Drive.model_validate(drive | {"stops": [{"people": (3, 3), "time_s": 0.3}]})
    scene = scene_at(
        row, [((0.0, -1.0), (0.0, 1.0))], name="row", time=0.6, drive=drive,
        contact={"stiffness_N_per_m": 1e5, "restitution": 0.1},
        run={"duration_s": 0.6, "frames": 6, "rigid_step_s": 0.01},
    )  # fmt: skip
    contacts = simulate("rigid", scene).contacts
    carried = [now.force[now.is_wall, 0].sum() for now in contacts[1:]]
    pushes = 2 * mass
    np.testing.assert_allclose(carried[:3], pushes.sum(), rtol=1e-6)
    np.testing.assert_allclose(carried[3:], pushes[:2].sum(), rtol=1e-6)


def test_at_rest_the_walls_of_faint_carry_what_the_drive_gives(simulate):
    """Before and after a third of the crowd stops; by then it has lost over 30 %."""
    found = simulate("rigid", read_scene("faint"))
    carried = [now.force[now.is_wall, 0].sum() for now in (found.contacts[19], found.contacts[40])]
    inputs = found["drive_x"][[19, 40]].sum(axis=1)
    np.testing.assert_allclose(carried, inputs, rtol=1e-4)
    assert carried[1] < 0.7 * carried[0]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("people = [1, 3]\ntime_s = 0.0", "drive.stops.0.time_s: "),
        ("people = [900, 901]\ntime_s = 1.0", "drive.stops: number 1: nobody has an id from 900"),
        ("people = [3, 1]\ntime_s = 1.0", "drive.stops.0.people: 3 to 1. The first comes first"),
        (
            "people = [1, 3]\ntime_s = 1.0\n\n[[drive.stops]]\npeople = [3, 4]\ntime_s = 2.0",
            "drive: stops: person 3 has two",
        ),
    ],
)
def test_a_stop_that_is_none_is_refused_by_its_key(tmp_path, lines, message):
    path = read_scene("two_way").write(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("[contact]", f"[[drive.stops]]\n{lines}\n\n[contact]"))
    with pytest.raises(SceneError) as refused:
        read_scene(path)
    assert str(refused.value).startswith(f"{path}: {message}")
