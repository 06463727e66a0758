"""LAMMPS and YADE on the same scenes: the same numbers."""

import numpy as np
import pytest

from analysis.scene.shipped_scenes import make

IMPACTS = ["pair_oblique", "chain_wall", "chain_masses", "corridor"]


def by_both(simulate, scene):
    lammps, yade = simulate("lammps", scene), simulate("yade", scene)
    assert list(lammps.columns) == list(yade.columns)
    assert lammps.record.steps == yade.record.steps
    return lammps, yade


def assert_close(lammps, yade, columns, tolerance):
    for column in columns:
        size = max(np.abs(lammps[column]).max(), 1e-300)
        assert np.abs(lammps[column] - yade[column]).max() <= tolerance * size, column


def assert_same_contacts(lammps, yade, force_tolerance):
    largest = max(np.abs(contacts.force).max(initial=0) for contacts in lammps.contacts)
    for one, other in zip(lammps.contacts, yade.contacts, strict=True):
        for field in ("first", "second", "is_wall"):
            assert np.array_equal(getattr(one, field), getattr(other, field)), field
        np.testing.assert_allclose(one.normal, other.normal, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.overlap, other.overlap, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.force, other.force, rtol=0, atol=force_tolerance * largest)


@pytest.mark.parametrize("name", IMPACTS)
def test_impacts_agree_to_rounding(simulate, impact, name):
    """Measured: positions 1e-15 m, forces 1e-11 of the largest."""
    lammps, yade = by_both(simulate, impact(name))
    assert_close(lammps, yade, ["x", "y"], 1e-12)
    assert_close(lammps, yade, ["vx", "fx"], 1e-10)
    assert_same_contacts(lammps, yade, 1e-10)
    for column in ("fx", "fy"):
        assert np.abs(lammps[column]).max() == pytest.approx(np.abs(yade[column]).max(), rel=1e-10)


def test_a_driven_crowd_agrees(simulate):
    scene = make("arch_masses", 100).with_run(duration_s=0.5, frames=5)
    lammps, yade = by_both(simulate, scene)
    assert_close(lammps, yade, ["x", "y"], 1e-11)
    assert_close(lammps, yade, ["vx", "vy", "fx", "fy", "drive_x", "drive_y"], 1e-8)
    assert_same_contacts(lammps, yade, 1e-8)
    assert len(lammps.contacts[-1]) > 20


def test_friction_differs_by_the_overlap_and_less_in_stiffer_contacts(simulate, impact):
    """LAMMPS takes the slip at the radius, YADE at the contact point: they differ by overlap/(2
    radius)."""
    spins = []
    for stiffness, time_step in ((1e6, 1e-5), (1e8, 1e-6)):
        scene = impact("pair_oblique", time_step, 0.02, friction=0.5, stiffness_N_per_m=stiffness)
        lammps, yade = by_both(simulate, scene)
        overlap = max(contacts.overlap.max(initial=0) for contacts in lammps.contacts) / 0.25
        assert_close(lammps, yade, ["omegaz"], overlap)
        assert_close(lammps, yade, ["x", "y"], 1e-7)
        spins.append(
            np.abs(lammps["omegaz"] - yade["omegaz"]).max() / np.abs(lammps["omegaz"]).max()
        )
    assert spins[0] < 2e-5
    assert spins[1] < 0.2 * spins[0]


def test_the_drive_is_looked_at_twenty_times_in_a_relaxation_time(simulate):
    """However long the step of soft bodies: from rest a lone walker comes to U (1 − exp(−t/τ)), here
    to 1 %; ten steps between looks would give 7 % more."""
    scene = make("arch", 2).with_contact(stiffness_N_per_m=2e3)
    scene = scene.with_run(duration_s=0.2, frames=1)
    tau, speed = scene.drive.relaxation_time_s, scene.drive.speed_m_per_s
    for run in by_both(simulate, scene):
        assert 10 * run.record.time_step_s > 0.05 * tau
        found = np.hypot(run["vx"][-1], run["vy"][-1])
        assert found.min() == pytest.approx(speed * (1 - np.exp(-0.2 / tau)), rel=1.5e-2)
