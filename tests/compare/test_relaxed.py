"""Stiffer springs on a crowd at rest: begun anew from one configuration."""

import numpy as np
import pytest

from analysis.compare.study import study
from analysis.report.approach import moved_between
from analysis.scene.shipped_scenes import make
from tests.engines.at_hand import require

STIFFNESSES = [3e5, 1e5, 1e6, 3e6]


@pytest.fixture(scope="module")
def jam(tmp_path_factory):
    """Twelve disks too large for the door, in LAMMPS."""
    require("lammps")
    scene = make("jam", 12).with_run(duration_s=4.0, frames=4)
    scene = scene.model_copy(update={"analysis": scene.analysis.model_copy(update={"time_s": 4.0})})
    folder = tmp_path_factory.mktemp("runs")
    return scene, folder, study(scene, ["lammps"], STIFFNESSES, folder)


def test_stiffer_runs_begin_where_the_softest_rests(jam):
    scene, folder, made = jam
    assert not made.failures
    assert made.anew == {"lammps"}
    runs = made.comparisons
    assert [run.scene.contact.stiffness_N_per_m for run in runs] == sorted(STIFFNESSES)
    soft, *stiffer = runs
    assert np.array_equal(soft.scene.snapshot.position, scene.snapshot.position)
    for run in stiffer:
        first = run.scene.snapshot
        # overlaps of the soft run are gone, nobody has gone far, and nobody moves
        apart = np.hypot(*(first.position[:, None] - first.position[None]).T)
        np.fill_diagonal(apart, np.inf)
        assert (apart - np.add.outer(first.radius, first.radius)).min() > -1e-9
        assert not first.velocity.any()
        assert run.balance.unbalanced < 0.01
    # a disk that rests sinks by F/k: from one stiffness to the next by centimetres at most
    assert 0 < moved_between(made, "lammps") < 0.1
    anew = [path.name.endswith("_anew") for path in (folder / "jam").iterdir()]
    assert sorted(anew) == [False, True, True, True]


def test_three_stiffnesses_or_a_moving_crowd_begin_as_the_scene_does(jam):
    scene, folder, _ = jam
    assert not study(scene, ["lammps"], STIFFNESSES[:3], folder).anew
    start = scene.with_run(duration_s=0.1, frames=1)
    start = start.model_copy(update={"analysis": start.analysis.model_copy(update={"time_s": 0.1})})
    assert not study(start, ["lammps"], STIFFNESSES, folder / "moving").anew
