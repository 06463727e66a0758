"""Reports and films on a Dask cluster, one of whose two workers is lost: the same as on one
machine. Films of equal disks that touch: a number that cannot be computed is left out, the film
goes on."""

import numpy as np
import pytest
import shapely

from analysis.engines import engine
from analysis.engines.run import EngineRun, run_ahead
from analysis.scene.real.import_crowd import _voronoi, import_crowd
from analysis.scene.real.trajectory import Recording
from analysis.scene.shipped_scenes import make
from analysis.studies.film.export import film_heads, film_runs
from analysis.studies.film.frame import RIGID
from analysis.studies.film.summary import table
from analysis.support.parallel import workers
from tests.crowds import room_text


@pytest.mark.skipif(engine("lammps").find() is None, reason="no LAMMPS")
def test_a_worker_is_lost(tmp_path, cluster):
    """It is killed when the first run, and what that run was for, is finished; the other worker does
    the rest of the runs, and measures the frames of the film."""
    address, (one, other) = cluster
    scene = make("pair").with_run(duration_s=0.02, frames=8, time_step_s=None)
    scenes = [scene.with_contact(stiffness_N_per_m=k) for k in (1e6, 2e6, 3e6)]
    runs = [EngineRun.of(scene, "lammps", tmp_path) for scene in scenes]
    lost = []

    def kill(_, fraction):
        if fraction and not lost:
            one.kill()
            one.wait()
            lost.append(fraction)

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


HERE = "127.0.0.1"
BAD = f"tls://{HERE}:9", "inproc://x", f"smoke://{HERE}:9", f"tcp://{HERE}"


@pytest.mark.parametrize("address", BAD)
def test_an_address_that_cannot_be_used_is_said(address):
    says = f"scheduler: nothing answers at {address}"
    with pytest.raises(ValueError, match=says), workers(scheduler=address):
        pass


RADIUS_M = 0.2
ROOM = room_text("door_start_m = [-5.0, -0.5]\ndoor_end_m = [5.0, -0.5]")


@pytest.fixture
def rows(tmp_path):
    """Twelve people in three rows whose disks touch, turned by 0.1 rad: on the Voronoi cells of
    these places GEOS fails. They come in one frame and are gone in another."""
    across, along = (part.ravel() for part in np.meshgrid(np.arange(4), np.arange(3)))
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    position = np.round(2 * RADIUS_M * np.stack([across, along], axis=1) @ turn, 8)
    with pytest.raises(shapely.errors.GEOSException):
        _voronoi(position, shapely.box(*(position.min(0) - 10), *(position.max(0) + 10)))
    lines = [
        f"{one}\t{frame}\t{x:.8f}\t{y:.8f}\t1.7\n"
        for frame in range(6)
        for one, (x, y) in enumerate(position, start=1)
        if frame != 4
    ]
    file = tmp_path / "rows.txt"
    file.write_text("# framerate: 10 fps\n# id frame x/m y/m z/m\n" + "".join(lines))
    (tmp_path / "field.toml").write_text(ROOM)
    return file


def test_a_scene_lacks_its_densities_by_name(rows):
    tracked = Recording.read(rows).head_positions(2)
    crowd = import_crowd(tracked, radius=RADIUS_M, room=rows.parent / "field.toml")
    assert "The local densities are missing: " in crowd.statement
    assert crowd.report.density_after_mean_per_m2 is None
    assert crowd.report.contacts_after == 17
    crowd.write(rows.parent / "made")
    assert "densities are missing" in (rows.parent / "made" / "field.toml").read_text()


def test_a_film_keeps_all_frames_and_radii(rows):
    """Nobody is there in frame 4: it is no frame of the film."""
    animations = film_heads(Recording.read(rows), rows.parent / "field.toml", [0.19, RADIUS_M])
    for animation in animations:
        assert [frame.number for frame in animation.frames] == [0, 1, 2, 3, 5]
        assert not animation.unsolved
    (first, *_) = animations[1].frames
    assert first.values[RIGID]["contact_largest"][0] > 0
