"""Walls in every direction, their ends included, against the distance to a segment: 1,600 disks
laid over 12 walls. People with a door of their own: every engine drives them to it, and in the
same way."""

import numpy as np
import pytest

from analysis.dumps import index_contacts, index_dump
from analysis.engines.lammps import scene_deck
from analysis.scene.drive import Goal
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision.soft import SoftModel
from tests.crowds import disks_at, scene_at
from tests.engines.at_hand import ROOT, lammps, require, yade

STIFFNESS = 1e6


@pytest.fixture(scope="module")
def laid_over():
    """Disks at rest that overlap walls, which no scene file may have; so the commands run it, not
    the adapters."""
    rng = np.random.default_rng(0)
    grid = np.arange(-20.0, 20.0)
    position = np.column_stack([x.ravel() for x in np.meshgrid(grid, grid)])
    disks = disks_at(position + rng.uniform(-0.2, 0.2, (1600, 2)))
    contact = {"stiffness_N_per_m": STIFFNESS, "restitution": 0.1}
    ends, run = rng.uniform(-18, 18, (12, 2, 2)), {"duration_s": 1e-6, "frames": 1}
    return scene_at(disks, ends, contact=contact, run=run, name="laid")


def in_contact(scene):
    """(disk's id, wall's number) → overlap and normal, by the nearest point of each segment."""
    walls, position = scene.wall_segments(), scene.snapshot.position
    found = {}
    for wall in range(len(walls)):
        way = walls.nearest_point(position, np.full(len(position), wall)) - position
        distance = np.hypot(*way.T)
        for disk in np.flatnonzero(distance < 0.25):
            found[disk + 1, wall + 1] = (0.25 - distance[disk], *(way[disk] / distance[disk]))
    return found


def assert_those(found, scene):
    expected = in_contact(scene)
    assert len(expected) > 80
    assert set(found) == set(expected)
    for key, (overlap, nx, ny, force) in found.items():
        np.testing.assert_allclose((overlap, nx, ny), expected[key], rtol=0, atol=1e-11)
        assert force == pytest.approx(STIFFNESS * expected[key][0], rel=1e-9, abs=1e-6)


def test_lammps(laid_over, command, tmp_path):
    require("lammps")
    laid_over.write(tmp_path)
    (tmp_path / "laid.in").write_text(scene_deck(laid_over))
    words = lammps(deck=tmp_path / "laid.in", data=tmp_path / "laid.data", out=tmp_path)
    done = command(words, ROOT)
    assert done.returncode == 0, done.stdout[-2000:]
    found = {}
    for number in range(1, 13):
        table = index_dump(tmp_path / f"wall_wall{number - 1}.dump").table(0)
        for disk, x, y, radius, fx, fy, at_x, at_y in table:
            distance = np.hypot(at_x - x, at_y - y)
            nx, ny = (at_x - x) / distance, (at_y - y) / distance
            found[int(disk), number] = radius - distance, nx, ny, -(fx * nx + fy * ny)
    assert_those(found, laid_over)


def test_yade(laid_over, command, tmp_path):
    require("yade")
    words = yade(laid_over.write(tmp_path), f"out={tmp_path}")
    done = command(words, ROOT, PYTHONPATH="yade_scripts", PYTHONDONTWRITEBYTECODE="1")
    assert done.returncode == 0, done.stderr[-2000:]
    table, found = index_contacts(tmp_path / "contacts.dump").table(0), {}
    for disk, wall, is_wall, nx, ny, overlap, fx, fy in table:
        if is_wall:
            found[int(disk), int(wall)] = (overlap, nx, ny, fx * nx + fy * ny)
    assert_those(found, laid_over)


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
            fraction = (position[row] - start) @ (end - start) / ((end - start) @ (end - start))
            aim = start + min(max(fraction, 0.0), 1.0) * (end - start)
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
        position, speed, push = (np.column_stack([run[name][frame] for name in names])
                              for names in (("x", "y"), ("vx", "vy"), PUSHED))  # fmt: skip
        # LAMMPS and YADE have evaluated it some steps before the frame
        near = 10.0 if engine != "rigid" and frame else 1e-9
        assert np.abs(push - wanted(scene, position, speed)).max() < near


def test_the_reference_integrator_drives_the_same(scene):
    velocity, got = np.full((40, 2), 0.3), np.empty((40, 2))
    position = 2.0 * scene.snapshot.position  # nobody touches anybody
    SoftModel(scene.model_copy(update={"walls": ()}), 1e-9).accelerate(got, position, velocity)
    got *= scene.snapshot.mass[:, None]
    assert np.abs(got - wanted(scene, position, velocity)).max() < 1e-9
