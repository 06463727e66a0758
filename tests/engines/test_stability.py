"""Failures of the engines, provoked at small size and recognised from the dumps, whatever the exit
status."""

import pytest
from at_hand import require

from analysis.stability.case import Outcome
from analysis.stability.cases.contact_search import CHECKED, skin_attempt, skin_theory
from analysis.stability.cases.energy import drift_attempt
from analysis.stability.cases.initial_overlap import overlap_attempt, overlap_theory
from analysis.stability.cases.limits import (
    restart_attempt,
    speed_attempt,
    speed_theory,
    stiffness_attempt,
    stiffness_theory,
)
from analysis.stability.cases.masses import pair_attempt, pair_theory
from analysis.stability.cases.passing import door_attempt, door_theory, wall_attempt, wall_theory
from analysis.stability.cases.time_steps import (
    damped_attempt,
    damped_theory,
    undamped_attempt,
    undamped_theory,
)
from analysis.stability.crowds import line, scene_of
from analysis.stability.trial import Edit, guard_says, try_engine


@pytest.fixture(autouse=True)
def _lammps():
    require("lammps")


def around(attempt, theory, row, folder, share):
    """The cells at theory · (1 − share) and theory · (1 + share)."""
    edge = theory(row)
    return attempt(edge * (1 - share), row, folder), attempt(edge * (1 + share), row, folder)


@pytest.mark.parametrize("packing", ["1 disk", "4 × 4"])
def test_time_step_becomes_unstable_at_two_over_the_largest_frequency(packing, tmp_path):
    below, above = around(undamped_attempt, undamped_theory, f"{packing}, lammps", tmp_path, 0.005)
    assert below.outcome is Outcome.STABLE
    assert above.outcome is Outcome.ENERGY_GAIN
    assert above.said == "0"
    assert above.silent


def test_damped_time_step_becomes_unstable_where_the_scheme_does(tmp_path):
    below, above = around(damped_attempt, damped_theory, 0.1, tmp_path, 0.01)
    assert below.outcome is Outcome.STABLE
    assert above.outcome is Outcome.ENERGY_GAIN


def test_yade_fails_at_the_same_time_step(tmp_path):
    require("yade")
    below, above = around(undamped_attempt, undamped_theory, "4 × 4, yade", tmp_path, 0.005)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.ENERGY_GAIN)
    assert above.said == "0"


def test_stiffness_has_a_window(tmp_path):
    row = "Δt = 0.003 s"
    assert stiffness_attempt(100.0, row, tmp_path).outcome is Outcome.INACCURATE
    below, above = around(stiffness_attempt, stiffness_theory, row, tmp_path, 0.02)
    assert below.outcome is Outcome.STABLE
    assert above.outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


def test_light_disks_are_damped_more_than_asked(tmp_path):
    row = "lammps, e = 0.5"
    below, above = around(pair_attempt, pair_theory, row, tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.INACCURATE)
    assert pair_attempt(1e4, "lammps, e = 1", tmp_path).outcome is Outcome.STABLE
    hot = pair_attempt(1e6, "lammps, e = 1 (heavy's step)", tmp_path)
    assert hot.outcome is Outcome.ENERGY_GAIN
    assert hot.said == "0"


def test_overlap_is_a_loaded_spring(tmp_path):
    below, above = around(overlap_attempt, overlap_theory, "lammps, k = 1e+06", tmp_path, 0.02)
    assert (below.outcome, above.outcome) == (Outcome.INACCURATE, Outcome.ENERGY_GAIN)
    assert overlap_attempt(1e-3, "lammps, k = 1e+06", tmp_path).outcome is Outcome.STABLE


def test_coinciding_centres_give_no_numbers_and_exit_status_0(tmp_path):
    require("yade")
    cell = overlap_attempt(2.0, "yade, k = 1e+06", tmp_path)
    assert cell.outcome is Outcome.LOST
    assert "finite" in cell.reason
    assert cell.said == "0"
    assert cell.guard == "finite"


def test_contacts_are_lost_by_a_skin_too_small_and_not_by_the_products_deck(tmp_path):
    below, above = around(skin_attempt, skin_theory, "lammps, every 30", tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.ENERGY_GAIN, Outcome.STABLE)
    assert below.silent
    assert skin_attempt(0.005, CHECKED, tmp_path).outcome is Outcome.STABLE
    passed = skin_attempt(0.005, "lammps, every 400", tmp_path)
    assert passed.outcome is not Outcome.STABLE


def test_fast_disks_pass_a_wall(tmp_path):
    below, above = around(wall_attempt, wall_theory, "lammps, Δt = 0.01", tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.LOST)
    assert above.silent


def test_soft_disks_are_squeezed_through_a_narrow_door(tmp_path):
    below, above = around(door_attempt, door_theory, "lammps, F/(k·r) = 0.1", tmp_path, 0.01)
    assert (below.outcome, above.outcome) == (Outcome.STABLE, Outcome.LOST)
    assert above.silent


def test_drift_over_many_steps(tmp_path):
    assert drift_attempt(0.02, "lammps", tmp_path).outcome is Outcome.STABLE
    assert drift_attempt(0.5, "lammps", tmp_path).outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


def test_speeds_below_the_rounding_of_positions_do_not_collide(tmp_path):
    row = "lammps, Δt = 0.01"
    above, below = (
        speed_attempt(speed_theory(row) * factor, row, tmp_path) for factor in (1.05, 0.95)
    )
    assert (above.outcome, below.outcome) == (Outcome.STABLE, Outcome.INACCURATE)
    assert below.silent
    assert speed_attempt(0.0, row, tmp_path).outcome is Outcome.STABLE


def test_a_run_split_in_two_forgets_its_tangential_springs(tmp_path):
    smooth, rough = (restart_attempt(friction, "lammps", tmp_path) for friction in (0.0, 0.5))
    assert smooth.outcome is Outcome.STABLE
    assert rough.outcome is Outcome.INACCURATE
    assert rough.numbers[0] > 10 * smooth.numbers[0]


def test_a_trial_is_taken_again_until_something_changes(tmp_path):
    scene = scene_of(line(2), [[1.0, 0.0], [0.0, 0.0]], duration=0.02)
    first = try_engine(scene, "lammps", tmp_path / "t")
    again = try_engine(scene, "lammps", tmp_path / "t")
    assert (first.reused, again.reused) == (False, True)
    assert again.status == first.status == "0"
    assert guard_says(again) == "nothing"
    other = try_engine(scene.with_contact(stiffness_N_per_m=2e6), "lammps", tmp_path / "t")
    assert not other.reused
    with pytest.raises(ValueError, match="nowhere"):
        try_engine(scene, "lammps", tmp_path / "u", [Edit(file="crowd.in", old="nowhere", new="")])
