"""The energy of a run by what its engine wrote: losses against closed forms, and an error that is
rounding in rigid steps and of second order with springs."""

import dataclasses

import numpy as np
import pytest

from analysis.dumps import index_dump
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
from tests.crowds import spaced
from tests.engines.at_hand import require

SPACES = {"spaces": True}
ROUGH, ARMS = {"friction": 0.4}, {"arm_reach_m": 0.15, "arm_force_N": 300.0}


def colliding(spaces=False, **contact):
    """12 people before a door who run in all directions, and may then keep their distance."""
    scene = make("arch", disks=12).with_contact(stiffness_N_per_m=1e5, **contact)
    scene = spaced(scene, jostling_m_per_s=0.5, heading_sd_rad=0.3) if spaces else scene
    velocity = np.random.default_rng(1).normal(0.0, 3.0, (12, 2))
    snapshot = dataclasses.replace(scene.snapshot, velocity=velocity)
    return scene.model_copy(update={"snapshot": snapshot})


def table(scene, name, folder, steps):
    """energy.csv of a run in which each step is a frame."""
    length = {"rigid_step_s" if name == "rigid" else "time_step_s": scene.run.duration_s / steps}
    simulate(scene.with_run(frames=steps, drive_interval_steps=1, **length), name, folder)
    return np.genfromtxt(folder / "energy.csv", delimiter=",", names=True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "contact", "minimum"),
    [
        ("rigid", {}, 0.0), ("rigid", ROUGH, 0.0), ("rigid", ARMS, 1.8), ("rigid", SPACES, 0.0),
        ("lammps", SPACES, 3.0), ("yade", SPACES | ROUGH, 3.0),
        ("lammps", ROUGH, 3.0), ("lammps", ARMS, 3.0), ("lammps", {"law": "hertz"}, 3.0),
        ("yade", ROUGH, 3.0), ("yade", {"law": "hertz"}, 3.0),
    ],
)  # fmt: skip
def test_works_and_losses_sum_to_what_is_gained(tmp_path, name, contact, minimum):
    """The error is rounding, or falls `minimum` times or more with half the step."""
    require(name)
    scene, errors = colliding(**contact).with_run(duration_s=0.1), []
    for steps in (200, 400):
        rows = table(scene, name, folder := tmp_path / str(steps), steps)
        energy = rows["kinetic_J"] + rows["stored_J"]
        lost = rows["impact_J"] + rows["friction_J"]
        error = energy[-1] - energy[0] + lost.sum() - rows["drive_J"].sum()
        assert rows["error_J"].sum() == pytest.approx(error, abs=1e-9)
        index = index_dump(folder / "energy.dump", "ENTRIES")
        parts = np.array([index.table(frame)[:, 3:].sum() for frame in range(len(rows))])
        assert parts == pytest.approx(lost, abs=1e-9)
        assert lost.sum() > 300
        assert ("friction" in contact) == (rows["friction_J"].sum() > 10)
        errors.append(abs(error) / lost.sum())
    assert errors[1] < (0.02 if minimum else 1e-12)
    assert not minimum or errors[0] > minimum * errors[1]


@pytest.mark.parametrize("name", ["rigid", "lammps", "yade"])
def test_an_impact_loses_what_restitution_takes(tmp_path, name):
    """Of two equal people ¼ m v² (1 − e²)."""
    require(name)
    scene = make("pair").with_contact(restitution=0.5, stiffness_N_per_m=1e4)
    rows = table(scene.with_run(duration_s=0.3), name, tmp_path / "run", 600)
    assert rows["impact_J"].sum() == pytest.approx(
        0.25 * 75 * 4 * 0.75, rel=1e-9 if name == "rigid" else 2e-3
    )
    assert rows["stored_J"][-1] == 0


def test_frames_that_skip_steps_give_no_energy_of_springs(tmp_path):
    require("lammps")
    simulate(colliding().with_run(duration_s=0.05, frames=5), "lammps", tmp_path / "run")
    assert not (tmp_path / "run" / "energy.csv").exists()
