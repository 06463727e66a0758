"""Impulses that the engines sum between frames: they are the change of everybody's momentum."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from analysis.dumps import index_dump, open_bodies, snapshot_of
from analysis.engines import EngineError
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from tests.engines.at_hand import require


def colliding(**contact):
    """40 people in a room who run in all directions, without drive."""
    scene = make("arch", disks=40).with_contact(**contact)
    scene = scene.with_run(duration_s=0.15, frames=3, impulses=True)
    velocity = np.random.default_rng(1).normal(0.0, 3.0, (40, 2))
    snapshot = dataclasses.replace(scene.snapshot, velocity=velocity)
    return scene.model_copy(update={"drive": None, "snapshot": snapshot})


@pytest.mark.parametrize("name", ["lammps", "yade"])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_impulses_of_a_window_are_the_change_of_momentum(tmp_path, name, friction):
    require(name)
    scene = colliding(friction=friction)
    simulate(scene, name, tmp_path / "run")
    index = index_dump(tmp_path / "run" / "impulses.dump", "ENTRIES")
    trajectory = open_bodies(tmp_path / "run" / "bodies.dump").trajectory
    states = [snapshot_of(trajectory[number]) for number in range(len(trajectory))]
    assert len(index.table(0)) == 0
    for number in range(1, len(states)):
        got = np.zeros((40, 2))
        for first, second, is_wall, *impulse in index.table(number):
            got[int(first) - 1] -= impulse
            if not is_wall:
                got[int(second) - 1] += impulse
        change = scene.snapshot.mass[:, None] * (
            states[number].velocity - states[number - 1].velocity
        )
        assert np.abs(change).max() > 10
        assert got == pytest.approx(change, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "law"), [("lammps", "hooke"), ("yade", "hooke"), ("yade", "body")]
)
def test_disks_that_touch_at_the_start_begin_without_an_impulse(tmp_path, name, law):
    """What one of two disks gains, in steps so long that half a one of a dashpot is 1 % of it."""
    require(name)
    soft = {"law": law, "stiffness_N_per_m": None if law == "body" else 5e3, "restitution": 0.5}
    scene = make("pair").with_contact(**soft)
    simulate(
        scene.with_run(duration_s=1.0, frames=2, impulses=True, time_step_s=None),
        name,
        tmp_path / "run",
    )
    index = index_dump(tmp_path / "run" / "impulses.dump", "ENTRIES")
    passed = sum(row[3] for number in range(3) for row in index.table(number))
    last = snapshot_of(open_bodies(tmp_path / "run" / "bodies.dump").trajectory[-1])
    assert passed == pytest.approx(75.0 * last.velocity[1, 0], rel=1e-9)


def test_lammps_without_its_python_module_says_how_to_install_it(tmp_path, monkeypatch):
    require("lammps")
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "lammps" else found(name)
    )
    with pytest.raises(EngineError, match=r"run.impulses: .*percussions\[engines\]"):
        simulate(colliding(), "lammps", tmp_path / "run")
