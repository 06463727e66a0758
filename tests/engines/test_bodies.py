"""Rigid bodies of several disks in the engines, against closed forms."""

import dataclasses

import numpy as np
import pytest

from analysis.engines import EngineError, engine
from analysis.scene.shipped_scenes import make
from tests.crowds import disks_at, drive_to, scene_at, spaced

HALF, TILT, SPEED, INERTIA, MASS = 0.18, 0.5, 1.0, 2.0, 60.0
ALONG = HALF * np.array([np.cos(TILT), np.sin(TILT)])
CONTACT = {"stiffness_N_per_m": 1e8, "restitution": 1.0}


def dumbbell(centre, velocity, along=ALONG, **arguments):
    """Two disks of 30 kg and radius 0.2 m that are one body."""
    crowd = disks_at([centre - along, centre + along], velocity, 0.2, MASS / 2, **arguments)
    return crowd.joined([7, 7], inertia=[INERTIA])


@pytest.mark.parametrize("name", ["lammps", "yade", "rigid"])
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


def two_that_meet(friction=0.0, many=4, **run):
    """A dumbbell, or of three disks a body of one, that hits a dumbbell off its centre."""
    disks = disks_at(
        [[-0.54, 0.0], [-0.2, 0.0], [0.2, 0.13], [0.2, 0.47]][-many:],
        ([[1.5, 0.3]] * 2 + [[0.0, 0.0]] * 2)[-many:], 0.2, 30.0, ids=[3, 4, 8, 9][-many:],
    ).joined([2, 2, 5, 5][-many:], inertia=[1.5, 2.5])  # fmt: skip
    contact = {"stiffness_N_per_m": 1e5, "restitution": 0.3, "friction": friction}
    run = {"duration_s": 0.03, "frames": 30} | run
    return scene_at(disks, name="meet", contact=contact, run=run)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize(("name", "many"), [("lammps", 4), ("yade", 4), ("yade", 3)])
def test_contacts_of_bodies_are_the_forces_that_engines_applied(simulate, name, many, friction):
    found = simulate(name, two_that_meet(friction, many))
    ids, touched = found["id"][0], 0
    for frame, contacts in enumerate(found.contacts):
        values = np.zeros((many, 2))
        np.add.at(values, np.searchsorted(ids, contacts.second), contacts.force)
        np.add.at(values, np.searchsorted(ids, contacts.first), -contacts.force)
        applied = np.column_stack([found["fx"][frame], found["fy"][frame]])
        near = 1e-8 * np.abs(applied).max(initial=1)
        np.testing.assert_allclose(values, applied, rtol=0, atol=near)
        touched += len(contacts.first)
    assert touched > 5
    mass = found["mass"][0]
    about = mass * (found["x"] * found["vy"] - found["y"] * found["vx"])
    # per disk the point mass turns; beside it stands what the inertia has more
    more = np.array([1.5 - 60 * 0.17**2 * (many == 4), 2.5 - 60 * 0.17**2])
    angular = about.sum(1) + found["omegaz"][:, [0, -1]] @ more
    np.testing.assert_allclose(angular, angular[0], rtol=1e-9)


def test_yade_moves_bodies_as_lammps_does(simulate):
    """They press, three disks to a person, heavier on one side; rigid has the same drive."""
    crowd = make("shoulders", 12).with_run(duration_s=0.6, frames=4)
    disks = crowd.snapshot
    uneven = dataclasses.replace(disks, bodies=None, mass=disks.mass * np.tile([1.3, 1.0, 0.7], 12))
    crowd = crowd.model_copy(update={"snapshot": uneven.joined(disks.bodies.number + 1)})
    one, other, rigid = (simulate(name, crowd) for name in ("lammps", "yade", "rigid"))
    np.testing.assert_allclose(one["drive_x"][0], rigid["drive_x"][0], rtol=0, atol=1e-9)
    for name in ("x", "y", "vx", "vy", "omegaz", "mol", "body_inertia", "drive_x", "fx", "fy"):
        close = 1e-6 * np.abs(one[name]).max()
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=close, err_msg=name)
    assert np.abs(one["fx"] - one["drive_x"]).max() > 500
    for these, those in zip(one.contacts, other.contacts, strict=True):
        for name in ("first", "second", "is_wall"):
            np.testing.assert_array_equal(getattr(these, name), getattr(those, name))


@pytest.mark.parametrize("name", ["lammps", "yade"])
def test_a_drive_moves_a_body_as_one_disk_and_does_not_turn_it(simulate, name):
    run = {"duration_s": 0.5, "frames": 1, "time_step_s": 1e-3}
    found = []
    for crowd in (
        dumbbell(np.zeros(2), (0.3, 0.2), spin=[2.0, 2.0]),
        disks_at([[0.0, 0.0]], (0.3, 0.2), 0.2, MASS),
    ):
        drive = drive_to((4.0, 1.0), (4.0, 3.0))
        scene = scene_at(crowd, name="driven", contact=CONTACT, run=run, drive=drive, time=0.5)
        end = simulate(name, scene)
        found.append([end[one][-1].mean() for one in ("x", "y", "vx", "vy")])
        spin = end["omegaz"][-1]
        np.testing.assert_allclose(spin, 2.0 if len(spin) > 1 else 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(*found, rtol=0, atol=1e-9)


def test_bodies_keep_their_distance_as_disks_of_their_widest(simulate):
    """Each as one person at its centre, in rigid steps; the others refuse."""
    scene = spaced(make("shoulders"), jostling_m_per_s=0.1, heading_sd_rad=0.2)
    scene, people = scene.with_run(duration_s=0.3, frames=3), scene.snapshot
    found, of = simulate("rigid", scene), people.bodies
    first = np.unique(of.number, return_index=True)[1]
    widest = np.array([people.radius[of.number == one].max() for one in range(len(of.ids))])
    wanted = scene.drive.desired_velocity(of.centre, people.ids[first], 0.0, widest)
    force = np.column_stack([found["drive_x"][0], found["drive_y"][0]])
    moves = of.mean(people.velocity, people.mass)
    expected = (wanted - moves)[of.number] * people.mass[:, None] / scene.drive.relaxation_time_s
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-9)
    for name in ("lammps", "yade"):
        with pytest.raises(EngineError, match=r"time_gap_s: bodies .* with rigid only"):
            engine(name).check(scene)


def test_what_lammps_cannot_turn_is_refused_by_name():
    says = r"disks\.bodies: body 2 is one disk.*: use yade or rigid"
    with pytest.raises(EngineError, match=says):
        engine("lammps").check(two_that_meet(many=3))
