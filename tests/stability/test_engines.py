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


STABLE, GAIN, LOST, INACCURATE = (
    Outcome.STABLE, Outcome.ENERGY_GAIN, Outcome.LOST, Outcome.INACCURATE
)  # fmt: skip
# case, row, how far below and above the theory, what is found there, whether the failure is silent
EDGES = [
    (time_step, Packed(1, False, "lammps"), 0.005, (STABLE, GAIN), True),
    (time_step, Packed(4, True, "lammps"), 0.005, (STABLE, GAIN), True),
    (time_step, Packed(4, True, "yade"), 0.005, (STABLE, GAIN), True),
    (damping, 0.1, 0.01, (STABLE, GAIN), True),
    (stiffness, 0.003, 0.02, (STABLE, (GAIN, LOST)), None),
    (mass_ratio_engines, Collision("lammps", 0.5), 0.01, (STABLE, INACCURATE), None),
    (initial_overlap, By("lammps", "k", 1e6), 0.02, (INACCURATE, GAIN), None),
    (skin, Renewal("lammps", 30), 0.01, (GAIN, STABLE), True),
    (tunnelling, By("lammps", "Δt", 0.01), 0.01, (STABLE, LOST), True),
    (narrow_door, By("lammps", "F/(k·r)", 0.1), 0.01, (STABLE, LOST), True),
    (small_speeds, By("lammps", "Δt", 0.01), 0.05, (INACCURATE, STABLE), True),
]


@pytest.mark.parametrize(("case", "row", "share", "found", "silent"), EDGES)
def test_a_method_fails_where_theory_says(case, row, share, found, silent, tmp_path):
    if "yade" in str(row).lower():
        require("yade")
    edge = case.theory(row)
    cells = [case.attempt(edge * factor, row, tmp_path) for factor in (1 - share, 1 + share)]
    for cell, outcome in zip(cells, found, strict=True):
        assert cell.outcome in (outcome if isinstance(outcome, tuple) else (outcome,))
        if cell.outcome is not STABLE and silent is not None:
            assert cell.silent == silent


def test_light_disks_and_soft_ones(tmp_path):
    """Elastic ones are not damped more than asked; hot ones are found, whatever the exit status."""
    assert stiffness.attempt(100.0, 0.003, tmp_path).outcome is INACCURATE
    light = mass_ratio_engines.attempt(1e4, Collision("lammps", 1.0), tmp_path)
    hot = mass_ratio_engines.attempt(1e6, Collision("lammps", 1.0, True), tmp_path)
    assert (light.outcome, hot.outcome, hot.said) == (STABLE, GAIN, "0")
    touching = initial_overlap.attempt(1e-3, By("lammps", "k", 1e6), tmp_path)
    slow = small_speeds.attempt(0.0, By("lammps", "Δt", 0.01), tmp_path)
    assert touching.outcome is slow.outcome is STABLE


def test_coinciding_centres_give_no_numbers_and_exit_status_0(tmp_path):
    require("yade")
    cell = initial_overlap.attempt(2.0, By("yade", "k", 1e6), tmp_path)
    assert cell.outcome is Outcome.LOST
    assert "finite" in cell.reason
    assert cell.said == "0"
    assert cell.guard == "finite"


def test_contacts_are_not_lost_by_the_products_deck(tmp_path):
    assert skin.attempt(0.005, Renewal("lammps"), tmp_path).outcome is STABLE
    assert skin.attempt(0.005, Renewal("lammps", 400), tmp_path).outcome is not STABLE


def test_drift_over_many_steps(tmp_path):
    assert drift.attempt(0.02, "lammps", tmp_path).outcome is Outcome.STABLE
    assert drift.attempt(0.5, "lammps", tmp_path).outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


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
