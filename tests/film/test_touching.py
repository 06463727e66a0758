"""Films of equal disks that touch: a number that cannot be computed is left out, the film goes on."""

import numpy as np
import pytest
import shapely

from analysis.film.export import film_heads
from analysis.film.frame import RIGID
from analysis.scene.real.import_crowd import _voronoi, import_crowd
from analysis.scene.real.trajectory import Recording
from tests.crowds import room_text

RADIUS_M = 0.2
ROOM = room_text("door_start_m = [-5.0, -0.5]\ndoor_end_m = [5.0, -0.5]")


@pytest.fixture
def rows(tmp_path):
    """Twelve people in three rows whose disks touch, turned by 0.1 rad: on the Voronoi cells of
    these places GEOS fails. They come in one frame and are gone in another."""
    across, along = (part.ravel() for part in np.meshgrid(np.arange(4), np.arange(3)))
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    place = np.round(2 * RADIUS_M * np.stack([across, along], axis=1) @ turn, 8)
    with pytest.raises(shapely.errors.GEOSException):
        _voronoi(place, shapely.box(*(place.min(0) - 10), *(place.max(0) + 10)))
    lines = [
        f"{one}\t{frame}\t{x:.8f}\t{y:.8f}\t1.7\n"
        for frame in range(6)
        for one, (x, y) in enumerate(place, start=1)
        if frame != 4
    ]
    file = tmp_path / "rows.txt"
    file.write_text("# framerate: 10 fps\n# id frame x/m y/m z/m\n" + "".join(lines))
    (tmp_path / "field.toml").write_text(ROOM)
    return file


def test_a_scene_lacks_its_densities_by_name(rows):
    crowd = import_crowd(
        Recording.read(rows).heads(2), radius=RADIUS_M, room=rows.parent / "field.toml"
    )
    assert "The local densities are missing: " in crowd.statement
    assert crowd.report.density_after_mean_per_m2 is None
    assert crowd.report.contacts_after == 17
    crowd.write(rows.parent / "made")
    assert "densities are missing" in (rows.parent / "made" / "field.toml").read_text()


def test_a_film_keeps_all_frames_and_radii(rows):
    """Nobody is there in frame 4: it has failed, by name."""
    reels = film_heads(Recording.read(rows), rows.parent / "field.toml", [0.19, RADIUS_M])
    for reel in reels:
        assert [frame.number for frame in reel.frames] == list(range(6))
        assert [frame.number for frame in reel.unsolved] == [4]
        assert "frame 4" in reel.frames[4].reason
    (first, *_) = reels[1].frames
    assert first.values[RIGID]["contact_largest"].value > 0
