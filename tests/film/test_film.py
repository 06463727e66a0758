"""Films: what the page, the viewer and the table show is what was computed."""

import base64
import csv
import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.engines import engine
from analysis.engines.run import simulate
from analysis.pages.numbers import significant
from analysis.percussions import percussions_of
from analysis.scene.real.import_crowd import import_crowd
from analysis.scene.real.trajectory import Recording, read_heads
from analysis.scene.shipped_scenes import make
from analysis.studies.film.export import export, film_heads, film_runs
from analysis.studies.film.frame import ENGINE, RIGID, FrameRange
from analysis.studies.film.page import (
    _headlines,
    _what,
    draw_series,
    draw_still,
    packed,
    words_of,
    write_film,
)
from analysis.studies.film.summary import headline, headline_rows, left_open, table, write_table
from nscd import find_contacts
from tests.crowds import OWN_LIMIT

SCENES = Path(__file__).resolve().parents[2] / "scenes"
EXCERPT, GATE = SCENES / "gate_excerpt.txt", SCENES / "rooms" / "gate.toml"


@pytest.fixture(scope="module")
def animations():
    """Two frames of the shipped trajectory, with two radii."""
    recording = Recording.read(EXCERPT)
    return film_heads(recording, GATE, [0.16, 0.18], FrameRange.parse("400:405:5"))


def unpacked(films):
    return json.loads(gzip.decompress(base64.b64decode(packed(films))))


def test_the_first_frame_is_that_of_an_import(animations):
    scene = import_crowd(read_heads(EXCERPT, 400), radius=0.18, room=GATE).scene
    found = percussions_of(scene, scene.snapshot)
    frame = animations[1].frames[0]
    assert frame.status == "solved"
    np.testing.assert_array_equal(frame.found.snapshot.position, scene.snapshot.position)
    assert frame.values[RIGID]["contact_largest"][0] == pytest.approx(found.largest)


def test_nobody_overlaps_and_everybody_balances_in_every_frame(animations):
    """Σ of the forces on a person is m (u⁺ − u⁻)/τ, in any frame."""
    for frame in (frame for animation in animations for frame in animation.frames):
        found = frame.found
        gaps = find_contacts(found.snapshot, found.setting.walls, tolerance=1e-6).gap
        assert gaps.min(initial=0.0) > -1e-7
        total = np.zeros((len(found.snapshot), 2))
        rank = np.searchsorted(found.snapshot.ids, frame.match.ids)
        np.subtract.at(total, rank[:, 0], frame.match.rigid)
        pairs = ~frame.match.is_wall
        np.add.at(total, rank[pairs, 1], frame.match.rigid[pairs])
        change = found.solution.right_velocity - found.left_velocity
        gained = found.snapshot.mass[:, None] * change / 0.5
        np.testing.assert_allclose(total, gained, atol=1e-3)


def test_a_frame_starts_from_the_one_before(animations):
    """Disks follow their heads: nobody jumps farther than the heads moved and were pushed apart."""
    for animation in animations:
        for before, after in zip(animation.frames, animation.frames[1:], strict=False):
            old, new = before.found.snapshot, after.found.snapshot
            ids, i, j = np.intersect1d(old.ids, new.ids, return_indices=True)
            jump = new.position[j] - old.position[i]
            walked = after.head_positions[j] - before.head_positions[i]
            assert len(ids) > 40
            assert np.hypot(*(jump - walked).T).max() < 0.1


def test_the_viewer_has_the_numbers_of_the_film(animations):
    for made, animation in zip(unpacked(animations)["reels"], animations, strict=True):
        position = {}
        for coded, frame in zip(made["frames"], animation.frames, strict=True):
            people = np.cumsum(coded["p"])
            for one, step in zip(people, np.reshape(coded["x"], (-1, 2)), strict=True):
                position[one] = position.get(one, 0) + step
            ids = np.array(made["ids"])
            np.testing.assert_array_equal(ids[people], frame.found.snapshot.ids)
            shown = np.array([position[one] for one in people]) * 1e-3
            assert np.abs(shown - frame.found.snapshot.position).max() <= 0.51e-3
            np.testing.assert_array_equal(ids[np.cumsum(coded["a"])], frame.match.ids[:, 0])
            size = np.array(coded["f"][0]) * made["step"]
            assert np.abs(size - frame.size(RIGID)).max() <= made["step"]
    assert made["step"] < 1e-3 * frame.found.largest


def test_the_picture_and_the_viewer_have_the_limits_of_the_user(animations, tmp_path):
    own = tmp_path / "mine.toml"
    own.write_text(OWN_LIMIT)
    figure = draw_still(animations[0], animations[0].frames[0], (own,))
    (legend,) = figure.legends
    figure.draw_without_rendering()
    label = figure.axes[0].xaxis.label.get_window_extent()
    assert not legend.get_window_extent().overlaps(label)
    coded = json.loads(gzip.decompress(base64.b64decode(packed(animations, (own,)))))
    named = [text.get_text() for text in legend.get_texts()]
    assert named == [f"above {significant(one, 4)} N" for one in coded["limits"]]
    assert "above 500 N" in named


def test_the_table_has_a_row_for_each_radius_and_frame(animations, tmp_path):
    write_table(animations, tmp_path)
    with (tmp_path / "film.csv").open() as file:
        rows = list(csv.DictReader(file))
    frames = [(animation.radius, frame) for animation in animations for frame in animation.frames]
    assert [radius for radius, _ in frames] == [0.16, 0.16, 0.18, 0.18]
    for row, (radius, frame) in zip(rows, frames, strict=True):
        assert (row["radius_m"], row["frame"]) == (str(radius), str(frame.number))
        ends = [float(row[f"contact_largest{end}_N"]) for end in ("_low", "", "_high")]
        assert ends == sorted(ends)
        far = np.hypot(*(frame.found.snapshot.position - frame.head_positions).T) > 0.5 * radius
        assert float(row["moved_far_percent"]) == pytest.approx(100 * far.mean())
    for before, now in (rows[:2], rows[2:]):
        mean = 0.5 * (float(before["walls_N"]) + float(now["walls_N"]))
        change = float(now["walls_N"]) - float(before["walls_N"])
        assert float(now["walls_jump"]) == pytest.approx(change / mean if mean else 0.0)
        assert before["walls_jump"] == ""
        every = [float(now[name]) for name in now if name.endswith("_jump")]
        assert now["jump"] == str(int(max(map(abs, every)) > 0.5))
    found = headline(animations, RIGID, "contact_largest")
    values = [float(row["contact_largest_N"]) for row in rows]
    assert found.median == pytest.approx(np.median(values[2:]))
    assert min(values) <= found.low <= found.median <= found.high <= max(values)


def with_walls(frame, ends):
    """The frame with another wall load."""
    values = {RIGID: {**frame.values[RIGID], "walls": np.array([1.0, *ends])}}
    return replace(frame, values=values)


def test_what_equilibrium_fixes_is_said_of_this_film_alone(animations):
    fixed = _headlines(words_of(animations), animations).caption
    assert left_open(animations) == (0, 0.0, 0)
    assert "fixes these numbers in all 4 frames." in fixed
    assert "Radii are up to 0.02 m apart" in fixed
    one = [with_walls(frame, (0.75, 2.25)) for frame in animations[0].frames]
    two = [with_walls(animations[0].frames[0], (np.nan, np.nan)), one[1]]
    width = [replace(animations[0], frames=one), replace(animations[1], frames=two)]
    assert left_open(width) == (3, 1.5, 1)
    message = _headlines(words_of(width), width).caption
    assert "does not fix all of these numbers in 3 of 4 frames: the bounds" in message
    assert "up to 150 % of its mean apart" in message
    assert "In up to 1 frame bounds are" in message


def names_are_apart(films):
    """The name of each axis is beside its own panel."""
    figure = draw_series(films)
    figure.draw_without_rendering()
    for axes in figure.axes:
        name, panel = axes.yaxis.label.get_window_extent(), axes.get_window_extent()
        assert panel.y0 <= name.y0 < name.y1 <= panel.y1, axes.get_ylabel()


@pytest.mark.skipif(engine("lammps").find() is None, reason="no LAMMPS")
def test_an_impact_has_newtons_of_its_engine_and_newton_seconds_of_percussions(tmp_path):
    """Two equal disks: p = m/2 (1 + e) times the approach velocity of that instant."""
    scene = make("pair").with_contact(restitution=0.5)
    scene = scene.with_run(duration_s=0.02, frames=60, time_step_s=None)
    simulate(scene, "lammps", tmp_path / "run")
    films = film_runs([tmp_path / "run"], FrameRange.parse("0:4"))
    names, rows = table(films)
    engine_row, rigid_row = (dict(zip(names, row, strict=True)) for row in rows[:2])
    assert rigid_row["contact_largest_Ns"] == pytest.approx(75 / 2 * 1.5 * 2, rel=1e-3)
    assert engine_row["contact_largest_Ns"] is rigid_row.get("contact_largest_N") is None
    _, shown = headline_rows(films)
    assert [cell.rpartition(" ")[2] for cell in shown[0][1:]] == ["N", "N·s"]
    assert unpacked(films)["reels"][0]["units"] == {"engine": "N", "percussions": "N·s"}
    names_are_apart(films)


@pytest.mark.skipif(engine("lammps").find() is None, reason="no LAMMPS")
def test_runs_of_one_engine_are_kept_apart(tmp_path):
    """Two stiffnesses, and another crowd, in folders of one name: in the headlines, the table, the
    viewer, the export and the words of the page."""
    brief = {"duration_s": 0.01, "frames": 2, "time_step_s": None}
    scene, other = (make(name).with_run(**brief) for name in ("pair", "four_disks"))
    soft, hard, few = (tmp_path / one / "run" for one in ("soft", "hard", "few"))
    simulate(scene, "lammps", soft)
    simulate(scene.with_contact(stiffness_N_per_m=1e7), "lammps", hard)
    simulate(other, "lammps", few)
    titles = [f"LAMMPS ({name}/run)" for name in ("soft", "hard", "few")]
    films = film_runs([soft, hard, few])
    assert [animation.title for animation in films] == titles
    columns, _ = headline_rows(films)
    assert columns[::2] == titles
    assert columns[1::2] == [f"percussions, places of {title}" for title in titles]
    names, rows = table(films)
    assert names[:2] == ["reel", "model"]
    assert [row[0] for row in rows] == [title for title in titles for _ in range(6)]
    assert [one["engine"] for one in unpacked(films)["reels"]] == titles
    assert len({path.parent for path in export(films, "vtk", tmp_path)}) == 3
    message = " ".join(_what(words_of(films), films, ""))
    assert f"by {' and '.join(titles)}." in message
    assert "The runs have 2, 2, 4 people" in message
    with pytest.raises(ValueError, match=r"\.\./soft/run: is given twice"):
        film_runs([soft, few / ".." / ".." / "soft" / "run"])


def test_people_of_three_disks_are_drawn_and_counted_as_they_are(tmp_path):
    """Forces on a person are those on its disks; of open ones the bounds hold the value."""
    simulate(make("shoulders", 8).with_run(duration_s=1.4, frames=4), "yade", tmp_path / "run")
    (animation,) = films = film_runs([tmp_path / "run"])
    (viewed,) = unpacked(films)["reels"]
    assert viewed["person"] == np.repeat(np.arange(0, 24, 3), 3).tolist()
    end = animation.frames[-1]
    borne = np.zeros(8)
    for force, ids, wall in zip(end.size(ENGINE), end.match.ids, end.match.is_wall, strict=True):
        for one in ids[: 1 if wall else 2]:
            borne[(one - 1) // 3] += force
    assert end.values[ENGINE]["person_largest"][0] == pytest.approx(borne.max())
    assert borne.max() > end.size(ENGINE).max()
    value, low, high = end.values[RIGID]["person_largest"]
    assert low - 1e-6 <= value <= high + 1e-6
    names, rows = table(films)
    assert {row[names.index("people")] for row in rows} == {8}


def in_centimetres(line):
    words = line.split()
    return "\t".join([*words[:2], *(f"{100 * float(word):.2f}" for word in words[2:])])


def without(line, person, frames):
    one, frame = map(int, line.split()[:2])
    return one != person or frame not in frames


@pytest.mark.parametrize("change", ["cm", "comments", "columns", "unsorted", "crlf", "16 fps"])
def test_other_copies_of_a_file_are_the_same_film(tmp_path, change):
    """In centimetres, with comments between rows, a further column, rows in any order."""
    lines = EXCERPT.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = [line for line in lines if not line.startswith("#")]
    end, rate = "\n", 25
    if change == "cm":
        head = [line.replace("/m", "/cm") for line in head]
        rows = [in_centimetres(line) for line in rows]
    elif change == "comments":
        rows = [line for row in rows for line in (row, "# seen twice")][:-1]
    elif change == "columns":
        rows = [f"{row}\t0.5" for row in rows]
    elif change == "unsorted":
        rows = rows[::-1]
    elif change == "crlf":
        end = "\r\n"
    else:
        head, rate = [line.replace("25 fps", "16 fps") for line in head], 16
    copy = tmp_path / "copy.txt"
    copy.write_bytes(end.join([*head, *rows, ""]).encode())
    recording = Recording.read(copy)
    assert recording.frame_rate == rate
    tracked = recording.head_positions(405)
    expected = Recording.read(EXCERPT).head_positions(405)
    np.testing.assert_array_equal(tracked.ids, expected.ids)
    np.testing.assert_allclose(tracked.position, expected.position, atol=1e-4)


def test_a_film_whose_first_frame_failed_and_where_nobody_touches(tmp_path):
    """The picture is of a frame that there is; and frames go with rows, not with their numbers."""
    rows = [(one, frame, one, frame / 10) for one in (1, 2, 3) for frame in range(4)]
    rows += [(4, 1, 3, 0.1), (1, 10**9, 0, 0)]
    text = "# framerate: 10\n# in m\n" + "".join(" ".join(map(str, row)) + "\n" for row in rows)
    (tmp_path / "heads.txt").write_text(text)
    drive = GATE.read_text()
    drive = drive[drive.index("title") : drive.index("[[walls]]")] + drive[drive.index("[drive]") :]
    (tmp_path / "open.toml").write_text(drive)
    recording, room = Recording.read(tmp_path / "heads.txt"), tmp_path / "open.toml"
    found = film_heads(recording, room, [0.2], FrameRange.parse("1:2"))
    assert [frame.status for frame in found[0].frames] == ["failed", "solved"]
    page = write_film(found, tmp_path, "percussions film", "heads.txt")
    names_are_apart(found)
    output = page.read_text()
    assert "frame 1: persons 3 and 4 are at the same place" in output
    assert "Red: limits" not in output  # none is near forces of nothing
    assert "Dotted: limits" not in output
    assert "m do not overlap." in output
    assert "matters most" not in output
    every = FrameRange.parse("0::1").of(recording.numbers, tmp_path)
    assert every == [0, 1, 2, 3, 10**9]


def test_people_may_come_and_go_between_frames(tmp_path, animations):
    """Who is missing in one frame is in the next; the others are as they were."""
    lines = EXCERPT.read_text().splitlines()
    gone = int(animations[0].frames[0].found.snapshot.ids[3])
    selected = [one for one in lines if one.startswith("#") or without(one, gone, range(403, 410))]
    copy = tmp_path / "copy.txt"
    copy.write_text("\n".join(selected) + "\n")
    (animation,) = film_heads(Recording.read(copy), GATE, [0.16], FrameRange.parse("400:410:5"))
    there = [gone in frame.found.snapshot.ids for frame in animation.frames]
    assert there == [True, False, True]
    assert [frame.status for frame in animation.frames] == ["solved"] * 3
    assert len(packed([animation])) > 100
