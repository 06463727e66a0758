"""The engines on one way: the same directions, and LAMMPS and YADE the same walk."""

import numpy as np
import pytest

from analysis.scene.scene import read_scene
from analysis.scene.schema import Run
from nscd import Snapshot


@pytest.fixture(scope="module")
def spread():
    """The two streams of `ell`, moved about their corridors so that everybody stands alone."""
    scene = read_scene("ell")
    x, y = np.meshgrid(np.arange(-5.7, 2.4, 0.63), np.arange(-5.7, 2.4, 0.63))
    place = np.column_stack([x.ravel(), y.ravel()]) + 0.03
    corridor = (place.min(1) > 0.3) | (place[:, 1] > 0.3) | (place[:, 0] > 0.3)
    pillar = (place > 0.6).all(1) & (place < 1.7).all(1)
    place = np.random.default_rng(1).permutation(place[corridor & ~pillar & (place.max(1) < 2.2)])
    place = place[: len(scene.snapshot)]
    crowd = Snapshot(
        position=place,
        velocity=np.zeros_like(place),
        radius=scene.snapshot.radius,
        mass=scene.snapshot.mass,
    )
    run = Run(duration_s=0.9, frames=3)
    return scene.model_copy(update={"snapshot": crowd, "run": run}).rerouted()


def test_all_engines_walk_the_same_way(simulate, spread):
    scene = spread
    place, ids = scene.snapshot.position, scene.snapshot.ids
    drive = scene.drive
    wanted = (
        drive.push(scene.snapshot.mass)[:, None]
        * drive.desired_velocity(place, ids)
        / drive.speed_m_per_s
    )
    runs = {name: simulate(name, scene) for name in ("rigid", "lammps", "yade")}
    for run in runs.values():
        force = np.column_stack([run["drive_x"][0], run["drive_y"][0]])
        np.testing.assert_allclose(force, wanted, rtol=0, atol=1e-9 * drive.push(75.0))
    for column in ("x", "y", "vx", "vy"):
        one, other = (runs[name][column] for name in ("lammps", "yade"))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)
    moved = np.hypot(*(runs["lammps"][c][-1] - runs["lammps"][c][0] for c in "xy"))
    assert np.median(moved) > 3 * drive.way.cell
