"""Rigid bodies of several disks in the engines, against closed forms."""

import numpy as np
import pytest

from analysis.engines import EngineError, engine
from analysis.exposure.loads import loads_of
from analysis.scene.shipped_scenes import make
from tests.crowds import disks_at, drive_to, scene_at

HALF, TILT, SPEED, INERTIA, MASS = 0.18, 0.5, 1.0, 2.0, 60.0
ALONG = HALF * np.array([np.cos(TILT), np.sin(TILT)])
CONTACT = {"stiffness_N_per_m": 1e8, "restitution": 1.0}


def dumbbell(centre, velocity, along=ALONG, **given):
    """Two disks of 30 kg and radius 0.2 m that are one body."""
    crowd = disks_at([centre - along, centre + along], velocity, 0.2, MASS / 2, **given)
    return crowd.joined([7, 7], inertia=[INERTIA])


@pytest.mark.parametrize("name", ["lammps", "rigid"])
def test_an_off_centre_blow_turns_a_dumbbell_as_by_hand(simulate, name):
    """It falls on a floor, one end first: p = (1+e) v/(1/M + l²/I); the spring takes 1 ms."""
    crowd = dumbbell(np.array([0.0, 0.2 + ALONG[1] + 1e-4]), (0.0, -SPEED))
    run = {"duration_s": 0.02, "frames": 2, "rigid_step_s": 0.001}
    scene = scene_at(crowd, [[(-3, 0), (3, 0)]], name="blow", contact=CONTACT, run=run)
    found, lever = simulate(name, scene), ALONG[0]
    blow = 2 * SPEED / (1 / MASS + lever**2 / INERTIA)
    centre, spin = found["vy"][-1].mean(), found["omegaz"][-1]
    np.testing.assert_allclose(spin, -lever * blow / INERTIA, rtol=5e-3)
    assert centre == pytest.approx(blow / MASS - SPEED, rel=5e-3)
    energy = 0.5 * MASS * centre**2 + 0.5 * INERTIA * spin[0] ** 2
    assert energy == pytest.approx(0.5 * MASS * SPEED**2, rel=2e-3)


def two_that_meet(friction=0.0, **run):
    """A dumbbell that hits another off its centre."""
    disks = disks_at(
        [[-0.54, 0.0], [-0.2, 0.0], [0.2, 0.13], [0.2, 0.47]],
        [[1.5, 0.3]] * 2 + [[0.0, 0.0]] * 2, 0.2, 30.0, ids=[3, 4, 8, 9],
    ).joined([2, 2, 5, 5], inertia=[1.5, 2.5])  # fmt: skip
    contact = {"stiffness_N_per_m": 1e5, "restitution": 0.3, "friction": friction}
    run = {"duration_s": 0.03, "frames": 30} | run
    return scene_at(disks, name="meet", contact=contact, run=run)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_contacts_of_bodies_are_the_forces_that_lammps_applied(simulate, friction):
    found = simulate("lammps", two_that_meet(friction))
    ids, touched = found["id"][0], 0
    for frame, contacts in enumerate(found.contacts):
        given = np.zeros((4, 2))
        np.add.at(given, np.searchsorted(ids, contacts.second), contacts.force)
        np.add.at(given, np.searchsorted(ids, contacts.first), -contacts.force)
        applied = np.column_stack([found["fx"][frame], found["fy"][frame]])
        np.testing.assert_allclose(
            given, applied, rtol=0, atol=1e-8 * np.abs(applied).max(initial=1)
        )
        touched += len(contacts.first)
    assert touched > 5
    mass = found["mass"][0]
    about = mass * (found["x"] * found["vy"] - found["y"] * found["vx"])
    # per disk the point mass turns; beside it stands what the inertia has more
    more = np.array([1.5 - 60 * 0.17**2, 2.5 - 60 * 0.17**2])
    angular = about.sum(1) + found["omegaz"][:, [0, 2]] @ more
    np.testing.assert_allclose(angular, angular[0], rtol=1e-9)


def test_a_drive_moves_a_body_as_one_disk_and_does_not_turn_it(simulate):
    run = {"duration_s": 0.5, "frames": 1, "time_step_s": 1e-3}
    found = []
    for crowd in (
        dumbbell(np.zeros(2), (0.3, 0.2), spin=[2.0, 2.0]),
        disks_at([[0.0, 0.0]], (0.3, 0.2), 0.2, MASS),
    ):
        drive = drive_to((4.0, 1.0), (4.0, 3.0))
        scene = scene_at(crowd, name="driven", contact=CONTACT, run=run, drive=drive, time=0.5)
        end = simulate("lammps", scene)
        found.append([end[name][-1].mean() for name in ("x", "y", "vx", "vy")])
        spin = end["omegaz"][-1]
        np.testing.assert_allclose(spin, 2.0 if len(spin) > 1 else 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(*found, rtol=0, atol=1e-9)


def test_what_engines_cannot_turn_is_refused_by_name(refused):
    scene = two_that_meet()
    alone = scene.snapshot.joined([1, 2, 5, 5])
    with pytest.raises(EngineError, match=r"disks\.bodies: body 1 is one disk.*: use rigid"):
        engine("lammps").check(scene.model_copy(update={"snapshot": alone}))
    with pytest.raises(EngineError, match=r"disks\.bodies: YADE .*: use lammps or rigid"):
        engine("yade").check(scene)
    with pytest.raises(ValueError, match=r"shoulders: disks\.bodies: loads of people are for"):
        loads_of(make("shoulders", 4), None)
    assert "shoulders: disks.bodies: loads of people need" in refused("report", "shoulders")
