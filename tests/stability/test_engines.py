"""Failures of the engines, provoked at small size and recognised from the dumps, whatever the exit
status."""

import pytest

from analysis.scene.scene import Run
from analysis.stability.case import By, Outcome
from analysis.stability.cases.penalty import (
    Collision,
    Packed,
    Renewal,
    damping,
    drift,
    initial_overlap,
    mass_ratio_engines,
    narrow_door,
    restart,
    skin,
    small_speeds,
    stiffness,
    time_step,
    tunnelling,
)
from analysis.stability.crowds import FRAMES, disks, line, scene_of
from analysis.stability.trial import Edit, guard_says, try_engine
from tests.engines.at_hand import require


@pytest.fixture(autouse=True)
def _lammps():
    require("lammps")


def around(case, row, folder, share):
    """The cells at theory · (1 − share) and theory · (1 + share)."""
    edge = case.theory(row)
    return [case.attempt(edge * factor, row, folder) for factor in (1 - share, 1 + share)]


@pytest.mark.parametrize("packing", [(1, False), (4, True)])
def test_time_step_becomes_unstable_at_two_over_the_largest_frequency(packing, tmp_path):
    below, above = around(time_step, Packed(*packing, "lammps"), tmp_path, 0.005)
    assert below.outcome is Outcome.STABLE
    assert above.outcome is Outcome.ENERGY_GAIN
    assert above.said == "0"
    assert above.silent


def test_damped_time_step_becomes_unstable_where_the_scheme_does(tmp_path):
    below, above = around(damping, 0.1, tmp_path, 0.01)
    assert below.outcome is Outcome.STABLE
    assert above.outcome is Outcome.ENERGY_GAIN


def test_yade_fails_at_the_same_time_step(tmp_path):
    require("yade")
    below, above = around(time_step, Packed(4, True, "yade"), tmp_path, 0.005)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.ENERGY_GAIN)
    assert above.said == "0"


def test_stiffness_has_a_window(tmp_path):
    assert stiffness.attempt(100.0, 0.003, tmp_path).outcome is Outcome.INACCURATE
    below, above = around(stiffness, 0.003, tmp_path, 0.02)
    assert below.outcome is Outcome.STABLE
    assert above.outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


def test_light_disks_are_damped_more_than_asked(tmp_path):
    below, above = around(mass_ratio_engines, Collision("lammps", 0.5), tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.INACCURATE)
    assert (
        mass_ratio_engines.attempt(1e4, Collision("lammps", 1.0), tmp_path).outcome
        is Outcome.STABLE
    )
    hot = mass_ratio_engines.attempt(1e6, Collision("lammps", 1.0, True), tmp_path)
    assert hot.outcome is Outcome.ENERGY_GAIN
    assert hot.said == "0"


def test_overlap_is_a_loaded_spring(tmp_path):
    row = By("lammps", "k", 1e6)
    below, above = around(initial_overlap, row, tmp_path, 0.02)
    assert (below.outcome, above.outcome) == (Outcome.INACCURATE, Outcome.ENERGY_GAIN)
    assert initial_overlap.attempt(1e-3, row, tmp_path).outcome is Outcome.STABLE


def test_coinciding_centres_give_no_numbers_and_exit_status_0(tmp_path):
    require("yade")
    cell = initial_overlap.attempt(2.0, By("yade", "k", 1e6), tmp_path)
    assert cell.outcome is Outcome.LOST
    assert "finite" in cell.reason
    assert cell.said == "0"
    assert cell.guard == "finite"


def test_contacts_are_lost_by_a_skin_too_small_and_not_by_the_products_deck(tmp_path):
    below, above = around(skin, Renewal("lammps", 30), tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.ENERGY_GAIN, Outcome.STABLE)
    assert below.silent
    assert skin.attempt(0.005, Renewal("lammps"), tmp_path).outcome is Outcome.STABLE
    passed = skin.attempt(0.005, Renewal("lammps", 400), tmp_path)
    assert passed.outcome is not Outcome.STABLE


def test_fast_disks_pass_a_wall(tmp_path):
    below, above = around(tunnelling, By("lammps", "Δt", 0.01), tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.LOST)
    assert above.silent


def test_soft_disks_are_squeezed_through_a_narrow_door(tmp_path):
    below, above = around(narrow_door, By("lammps", "F/(k·r)", 0.1), tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.LOST)
    assert above.silent


def test_drift_over_many_steps(tmp_path):
    assert drift.attempt(0.02, "lammps", tmp_path).outcome is Outcome.STABLE
    assert drift.attempt(0.5, "lammps", tmp_path).outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


def test_speeds_below_the_rounding_of_positions_do_not_collide(tmp_path):
    row = By("lammps", "Δt", 0.01)
    above, below = (
        small_speeds.attempt(small_speeds.theory(row) * factor, row, tmp_path)
        for factor in (1.05, 0.95)
    )
    assert (above.outcome, below.outcome) == (Outcome.STABLE, Outcome.INACCURATE)
    assert below.silent
    assert small_speeds.attempt(0.0, row, tmp_path).outcome is Outcome.STABLE


def test_a_run_split_in_two_forgets_its_tangential_springs(tmp_path):
    smooth, rough = (restart.attempt(friction, "lammps", tmp_path) for friction in (0.0, 0.5))
    assert smooth.outcome is Outcome.STABLE
    assert rough.outcome is Outcome.INACCURATE
    assert rough.numbers[0] > 10 * smooth.numbers[0]


def test_a_trial_is_taken_again_until_something_changes(tmp_path):
    scene = scene_of(disks(line(2), [[1.0, 0.0], [0.0, 0.0]]), Run(duration_s=0.02, frames=FRAMES))
    first = try_engine(scene, "lammps", tmp_path / "t")
    again = try_engine(scene, "lammps", tmp_path / "t")
    assert (first.reused, again.reused) == (False, True)
    assert again.status == first.status == "0"
    assert guard_says(again) == "nothing"
    other = try_engine(scene.with_contact(stiffness_N_per_m=2e6), "lammps", tmp_path / "t")
    assert not other.reused
    with pytest.raises(ValueError, match="nowhere"):
        try_engine(scene, "lammps", tmp_path / "u", [Edit(file="crowd.in", old="nowhere", new="")])
