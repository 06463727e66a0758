"""Reports and films on a Dask cluster, one of whose two workers is lost: the same as on one machine."""

import numpy as np
import pytest

from analysis.engines import engine
from analysis.engines.run import EngineRun, run_ahead
from analysis.film.export import film_runs
from analysis.film.summary import table
from analysis.scene.shipped_scenes import make
from analysis.support.parallel import workers


@pytest.mark.skipif(engine("lammps").find() is None, reason="no LAMMPS")
def test_a_worker_is_lost(tmp_path, cluster):
    """It is killed when the first run, and what that run was for, is finished; the other worker does
    the rest of the runs, and measures the frames of the film."""
    address, (one, other) = cluster
    scene = make("pair").with_run(duration_s=0.02, frames=8, time_step_s=None)
    scenes = [scene.with_contact(stiffness_N_per_m=k) for k in (1e6, 2e6, 3e6)]
    runs = [EngineRun.of(scene, "lammps", tmp_path) for scene in scenes]
    lost = []

    def kill(_, share):
        if share and not lost:
            one.kill()
            one.wait()
            lost.append(share)

    costs = run_ahead(runs, kill, scheduler=address)
    assert len(lost) == 1
    assert lost[0] < 1
    assert other.poll() is None
    assert [(cost.made, cost.failed) for cost in costs.values()] == [(1, 0)] * 3
    assert all(run.is_finished() and run.record().cpu_seconds > 0 for run in runs)
    with workers(scheduler=address) as executor:
        there = film_runs([runs[0].folder], executor=executor)
    names, rows = table(film_runs([runs[0].folder]))
    assert table(there) == (names, rows)
    assert np.count_nonzero([frame.number for frame in there[0].frames]) == 8


@pytest.mark.parametrize(
    "address", ["tls://127.0.0.1:9", "inproc://x", "smoke://127.0.0.1:9", "tcp://127.0.0.1"]
)
def test_an_address_that_cannot_be_used_is_said(address):
    with (
        pytest.raises(ValueError, match=f"scheduler: nothing answers at {address}"),
        workers(scheduler=address),
    ):
        pass
