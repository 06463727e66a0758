"""Impulses that the engines sum between frames: they are the change of everybody's momentum.
Impulses of contacts, summed over the steps of an engine: as a dictionary sums them. The stress
of an engine's contact forces balances what its disks gain."""

import dataclasses
import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.compare.comparison import compare_run
from analysis.dumps import index_dump, open_bodies, snapshot_of
from analysis.engines import EngineError
from analysis.engines.run import simulate
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from nscd import _core
from nscd.stress import Kernel, coarse_grain, stress_field
from tests.engines.at_hand import require

ROUGH, ARMS = {"friction": 0.4}, {"arm_reach_m": 0.15, "arm_force_N": 300.0}


def colliding(**contact):
    """40 people in a room who run in all directions, without drive."""
    scene = make("arch", disks=40).with_contact(**contact)
    scene = scene.with_run(duration_s=0.15, frames=3, impulses=True)
    velocity = np.random.default_rng(1).normal(0.0, 3.0, (40, 2))
    snapshot = dataclasses.replace(scene.snapshot, velocity=velocity)
    return scene.model_copy(update={"drive": None, "snapshot": snapshot})


@pytest.mark.parametrize(
    ("name", "contact", "error"),
    [
        ("lammps", {}, 1e-9), ("lammps", ROUGH, 1e-9), ("lammps", ARMS, 1e-9),
        ("yade", {}, 1e-9), ("yade", ROUGH | ARMS, 1e-9), ("rigid", {}, 1e-4), ("rigid", ARMS, 1e-4),
    ],
)  # fmt: skip
def test_impulses_of_a_window_are_the_change_of_momentum(tmp_path, name, contact, error):
    """Without drive, m (u_end − u_start) of everybody is what the contacts of the window give."""
    require(name)
    scene = colliding(**contact)
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
        before, after = states[number - 1 : number + 1]
        change = scene.snapshot.mass[:, None] * (after.velocity - before.velocity)
        assert np.abs(change).max() > 10
        assert got == pytest.approx(change, abs=error)


@pytest.mark.parametrize("by", ["lammps hooke", "yade hooke", "yade body"])
def test_disks_that_touch_at_the_start_begin_without_an_impulse(tmp_path, by):
    """What one of two disks gains, in steps so long that half a one of a dashpot is 1 % of it."""
    name, law = by.split()
    require(name)
    soft = {"law": law, "stiffness_N_per_m": None if law == "body" else 5e3, "restitution": 0.5}
    scene = make("pair").with_contact(**soft)
    scene = scene.with_run(duration_s=1.0, frames=2, impulses=True, time_step_s=None)
    simulate(scene, name, tmp_path / "run")
    index = index_dump(tmp_path / "run" / "impulses.dump", "ENTRIES")
    passed = sum(row[3] for number in range(3) for row in index.table(number))
    last = snapshot_of(open_bodies(tmp_path / "run" / "bodies.dump").trajectory[-1])
    assert passed == pytest.approx(75.0 * last.velocity[1, 0], rel=1e-9)


def test_lammps_without_its_python_module_says_how_to_install_it(tmp_path, monkeypatch):
    require("lammps")
    found = importlib.util.find_spec
    without = lambda name: None if name == "lammps" else found(name)  # noqa: E731
    monkeypatch.setattr(importlib.util, "find_spec", without)
    with pytest.raises(EngineError, match=r"run.impulses: .*percussions\[engines\]"):
        simulate(colliding(), "lammps", tmp_path / "run")


class Plain:
    """The same in plain Python."""

    def __init__(self):
        self.sums = {}

    def add(self, key, x, y):
        had = self.sums.get(key, (0.0, 0.0))
        self.sums[key] = had[0] + x, had[1] + y

    def add_pairs(self, ids, forces, times):
        for (one, other), (x, y, more_x, more_y) in zip(ids.tolist(), forces.tolist(), strict=True):
            x, y = x + more_x, y + more_y
            if x or y:
                sign = times if one <= other else -times
                self.add((0, *sorted((int(one), int(other)))), sign * x, sign * y)

    def add_wall(self, wall, ids, rows, times):
        for one, (touches, x, y) in zip(ids.tolist(), rows.tolist(), strict=True):
            if touches:
                self.add((1, one, wall), times * x, times * y)

    def close(self):
        rows = [(*key[1:], key[0], *sums) for key, sums in sorted(self.sums.items())]
        self.sums = {}
        return SimpleNamespace(**dict(zip(NAMES, np.array(rows).T, strict=True)))


NAMES = ("first", "second", "is_wall", "x", "y")


def columns(sums):
    """The impulses that some sums are closed with, (rows, 5)."""
    found = sums.close()
    return np.column_stack([getattr(found, name) for name in NAMES])


def summed(sums):
    """The frames of some sums, each (rows, 5): first, second, is_wall, x, y."""
    frames, draw = [], np.random.default_rng(3)
    for step in range(12):
        ids = draw.integers(1, 90, (1500, 2)).astype(float)
        forces = draw.normal(size=(1500, 4)) * (draw.random((1500, 1)) < 0.7)
        sums.add_pairs(ids, forces, -0.5e-3)
        rows = np.column_stack([draw.random(39) < 0.3, draw.normal(size=(39, 2))])
        sums.add_wall(2, np.arange(1, 40, dtype=np.int32), rows, 1e-3)
        if step in (4, 9, 11):
            frames.append(columns(sums))
    return frames


def test_the_same_sums_as_a_dictionary_has():
    """To the last digit, of more pairs than the table has room for at first."""
    found = summed(_core.EngineSums())
    assert sum(map(len, found)) > 7000
    for one, other in zip(found, summed(Plain()), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_pair_and_a_wall_by_hand():
    sums = _core.EngineSums()
    sums.add_pairs(np.array([[5.0, 2.0]]), np.array([[1.0, 2.0, 3.0, 4.0]]), 0.5)
    sums.add_wall(1, np.array([7], np.int32), np.array([[1.0, 8.0, -2.0]]), 0.25)
    assert columns(sums).tolist() == [[2, 5, 0, -2, -3], [7, 1, 1, 2, -0.5]]


KERNEL = Kernel(width=0.4, cutoff=9.0)


@pytest.mark.parametrize("name", ["lammps", "yade"])
def test_a_driven_crowd(name, tmp_path):
    """Σ(ma − F_drive)φ = div Σ + t with the engine's own forces, in N/m²; without the walls'
    traction it fails."""
    scene = make("arch", 60).with_run(duration_s=1.0, frames=2)
    require(name)
    folder = tmp_path / name
    simulate(scene, name, folder)
    found = compare_run(folder, time=1.0)
    assert found.unit == "N"
    index = index_dump(folder / "bodies.dump")
    column = dict(zip(index.columns, index.table(len(index.steps) - 1).T, strict=True))
    order = np.argsort(column["id"])
    gained = np.column_stack([column[f"f{k}"] - column[f"drive_{k}"] for k in "xy"])[order]
    position = found.snapshot.position
    at = position[::3] + 0.1
    match = found.match
    penalty = stress_field(found.snapshot, match.contacts, match.penalty, KERNEL, at)
    expected, _ = coarse_grain(position, gained, KERNEL, at)
    size = np.abs(expected).max()
    assert size > 10
    np.testing.assert_allclose(penalty.divergence + penalty.traction, expected, atol=1e-6 * size)
    assert np.abs(penalty.divergence - expected).max() > 0.05 * size


def test_an_impact_has_stress_of_the_same_unit(tmp_path):
    """Four disks in line, strongly damped: ∫f dt and p, both N·s/m, carry nearly the same; the
    whole is −Σ p ⊗ ℓ."""
    scene = read_scene("four_disks").with_contact(stiffness_N_per_m=1e6, restitution=0.0)
    scene = scene.with_run(frames=2500)
    require("lammps")
    simulate(scene, "lammps", tmp_path / "run")
    found = compare_run(tmp_path / "run")
    assert found.unit == "N·s"
    axis = np.arange(-6, 8, 0.2)
    at = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2) + found.snapshot.position.mean(0)
    match = found.match
    penalty, rigid = (stress_field(found.snapshot, match.contacts, force, KERNEL, at)
                      for force in (match.penalty, match.rigid))  # fmt: skip
    spacing = np.diff(np.sort(found.snapshot.position[:, 0]))[0]
    full = -spacing * found.match.rigid[:, 0].sum()
    assert rigid.stress.sum(0)[0, 0] * 0.2**2 == pytest.approx(full, rel=1e-6)
    assert np.linalg.norm(penalty.stress - rigid.stress) < 0.05 * np.linalg.norm(rigid.stress)
