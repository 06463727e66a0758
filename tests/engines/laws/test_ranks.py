"""LAMMPS on several ranks of MPI: the run of one."""

import numpy as np
import pytest

from analysis.dumps import open_bodies, read_contacts
from analysis.engines.record import EngineError
from analysis.engines.run import run_engine
from analysis.scene.shipped_scenes import make


def test_two_ranks_give_the_run_of_one(tmp_path):
    """Pressed before a door: positions, forces and contacts."""
    scene = make("arch", 60).with_run(duration_s=0.4, frames=2)
    for ranks in (1, 2):
        run_engine(scene, "lammps", tmp_path / str(ranks), ranks=ranks)
    log = (tmp_path / "2" / "log.lammps").read_text()
    assert "fix shares all balance" in log
    bodies = [open_bodies(tmp_path / name / "bodies.dump").trajectory for name in "12"]
    for alone, shared in zip(*bodies, strict=True):
        for column, most in (("x", 1e-9), ("y", 1e-9), ("fx", 1e-2), ("fy", 1e-2)):
            np.testing.assert_allclose(shared.data[column], alone.data[column], rtol=0, atol=most)
    ends = [list(read_contacts(tmp_path / n / "contacts.dump"))[-1] for n in "12"]
    assert len(ends[0]) > 10
    np.testing.assert_array_equal(ends[0].second, ends[1].second)
    np.testing.assert_allclose(ends[0].force, ends[1].force, rtol=0, atol=1e-2)


def test_what_is_not_shared(tmp_path):
    scene = make("arch", 20).with_run(duration_s=0.1, frames=1)
    with pytest.raises(EngineError, match="ranks: 2; rigid runs on one core"):
        run_engine(scene, "rigid", tmp_path / "rigid", ranks=2)
    with pytest.raises(EngineError, match="impulses on one rank only"):
        run_engine(scene.with_run(impulses=True), "lammps", tmp_path / "run", ranks=2)
    assert not list(tmp_path.rglob("run.json"))
