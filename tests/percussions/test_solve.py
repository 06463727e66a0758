"""Percussions of snapshots, trajectories and dumps: one rule, one reader, one table."""

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from analysis.cli import options
from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.percussions import PercussionAnalysis, Setting, percussions_of
from analysis.percussions.contact_rows import Indeterminacy
from analysis.percussions.setting import setting_beside
from analysis.percussions.solve_dump import DumpToSolve, solve_dump
from analysis.scene.scene import SceneError, read_scene
from analysis.scene.shipped_scenes import make
from nscd import ContactLaw, Walls
from tests.crowds import PEOPLE as FEW
from tests.crowds import disks_at, frame

PAIR = [[1, 0, 0, 0.25, 75, 2, 0], [2, 0.5, 0, 0.25, 75, 0, 0]]


def dump_of(folder, *frames):
    path = folder / "some.dump"
    path.write_text("".join(frames))
    return path


def solved(path, tmp_path, **arguments):
    """Rows of the table that is written."""
    import csv

    job = {name: arguments.pop(name) for name in ("time_step", "indeterminacy", "unit") if name in arguments}
    room = arguments.pop("room", None)
    solve_dump(
        DumpToSolve(path=path, setting=setting_beside(path, room, **arguments), **job),
        tmp_path / "contacts.csv",
    )
    with (tmp_path / "contacts.csv").open() as file:
        return list(csv.DictReader(file))


def in_cm(row):
    """A row of lengths and velocities in cm."""
    return [row[0], *(100 * each for each in row[1:4]), row[4], *(100 * each for each in row[5:])]


@pytest.mark.parametrize("indeterminacy", ["none", "determined"])
def test_a_dump_in_centimetres_is_asked_about(tmp_path, indeterminacy):
    path = dump_of(tmp_path, frame(1, PAIR), frame(2, [PAIR[1], PAIR[0]]))
    known = solved(path, tmp_path, indeterminacy=indeterminacy)
    path = dump_of(tmp_path, *(frame(step, [in_cm(row) for row in PAIR]) for step in (1, 2)))
    with pytest.raises(DumpError, match=r"some.dump: radius: 25 m in the middle, .* m, cm or mm"):
        solved(path, tmp_path, indeterminacy=indeterminacy)
    assert solved(path, tmp_path, indeterminacy=indeterminacy, unit="cm") == known
    in_m = solved(path, tmp_path, indeterminacy=indeterminacy, unit="m")
    assert float(in_m[0]["impulse_x_Ns"]) == pytest.approx(100 * float(known[0]["impulse_x_Ns"]))
    with pytest.raises(DumpError, match=r"unit: 'ft'\. There are: m, cm, mm"):
        open_bodies(path, unit="ft")


@pytest.mark.parametrize(
    ("inputs", "kg_per_m3"),
    [({"unit": "cm"}, 1000), ({"unit": "mm"}, 1), ({"unit": "cm", "mass_unit": "kg"}, 1)],
)
def test_a_density_beside_cm_is_in_grams_as_in_the_units_of_lammps(tmp_path, inputs, kg_per_m3):
    size, m = (20, 0.2) if inputs["unit"] == "cm" else (200, 0.2)
    row = [1, 0, 0, size, 1140 / kg_per_m3]
    path = dump_of(tmp_path, frame(1, [row], "id x y radius density"))
    mass = snapshot_of(open_bodies(path, **inputs).trajectory.ts, needs_velocity=False).mass
    assert mass == pytest.approx([1140 * 4 / 3 * np.pi * m**3])


def test_an_analysis_takes_the_scene_beside_the_dump_as_the_command_does(tmp_path):
    """Walls, drive and friction."""
    scene = read_scene("gate").with_contact(friction=0.3)
    scene.model_copy(update={"name": "scene"}).write(tmp_path)
    disks = scene.snapshot
    rows = zip(
        disks.ids, *disks.position.T, disks.radius, disks.mass, *disks.velocity.T, strict=True
    )
    path = dump_of(tmp_path, frame(0, list(rows)))
    beside = PercussionAnalysis(open_bodies(path))
    assert (beside.setting.kind, beside.setting.friction) == ("desired", 0.3)
    found, known = beside.run().results.frames[0], percussions_of(scene, disks)
    assert len(known.contacts) > 40
    np.testing.assert_allclose(found.pressing, known.pressing, atol=1e-6)
    assert (
        PercussionAnalysis(open_bodies(path), Setting(left_velocity="dump")).setting.walls is None
    )


@pytest.fixture
def pressed():
    """A heap of 30 people at a door: the scene as made."""
    return make("arch", 30)


def test_a_frame_without_a_time_step_has_its_step(tmp_path):
    path = dump_of(tmp_path, frame(700, PAIR))
    (row,) = solved(path, tmp_path)
    assert row["step"] == "700"
    assert "time_s" not in row
    assert float(row["impulse_x_Ns"]) == pytest.approx(75)
    assert "force_x_N" not in row
    (row,) = solved(path, tmp_path, time_step=1e-3)
    assert float(row["time_s"]) == pytest.approx(0.7)


def test_people_leave_between_frames(tmp_path):
    three = [*PAIR, [3, 1.0, 0, 0.25, 75, 0, 0]]
    path = dump_of(tmp_path, frame(0, three), frame(1, PAIR), frame(2, []), frame(3, three[1:]))
    rows = solved(path, tmp_path)
    assert [(row["step"], row["first"], row["second"]) for row in rows] == [
        ("0", "1", "2"),
        ("0", "2", "3"),
        ("1", "1", "2"),
        ("3", "2", "3"),
    ]
    analysis = PercussionAnalysis(open_bodies(path)).run()
    assert [len(ids) for ids in analysis.results.ids] == [3, 2, 0, 2]
    assert analysis.all_solved


def test_velocities_count_only_where_they_are_needed(tmp_path):
    """Misnamed velocities: an impact of nobody is refused, desired velocities do without."""
    path = dump_of(tmp_path, frame(0, PAIR, FEW.replace("vx vy", "v_x v_y")))
    with pytest.raises(DumpError, match=r"some.dump: missing columns: vx, vy"):
        solved(path, tmp_path)
    room = make("arch").write(tmp_path)
    (tmp_path / "arch.data").unlink()  # a room needs no disks
    (row,) = (row for row in solved(path, tmp_path, room=room) if row["is_wall"] == "0")
    assert "force_x_N" in row


def test_a_room_needs_walls_and_drive_alone(tmp_path):
    room = tmp_path / "room.toml"
    room.write_text("""
        walls = [{name = "end", start_m = [0.75, -1.0], end_m = [0.75, 1.0]}]
        [drive]
        speed_m_per_s = 2.0
        relaxation_time_s = 0.5
        door_start_m = [5.0, -1.0]
        door_end_m = [5.0, 1.0]
        outward = [1.0, 0.0]
    """)
    rows = solved(dump_of(tmp_path, frame(0, PAIR)), tmp_path, room=room)
    # both want to go on, m u/τ each
    assert [float(row["force_N"]) for row in rows] == pytest.approx([300, 600])
    room.write_text(room.read_text().replace("outward", "onward"))
    with pytest.raises(SceneError, match=r"room.toml: drive.onward: unknown key"):
        solved(dump_of(tmp_path, frame(0, PAIR)), tmp_path, room=room)


def test_a_table_keeps_its_kinds_where_a_frame_has_no_contact(tmp_path):
    """Ids are whole numbers, `determined` as in the CSV, and a force has its magnitude."""
    difference = [PAIR[0], [2, 3.0, 0, 0.25, 75, 0, 0]]
    path = dump_of(tmp_path, frame(0, difference), frame(10, PAIR))
    walls = Walls(start=[[0.75, -1.0]], end=[[0.75, 1.0]])
    setting = Setting(walls=walls, left_velocity="free", window=0.1, acceleration=(3.0, 4.0))
    table = PercussionAnalysis(open_bodies(path, 0.1), setting).run().to_dataframe()
    assert {str(table[name].dtype) for name in ("first", "second", "is_wall")} == {"int64"}
    assert table[["second", "is_wall", "determined"]].to_numpy().tolist() == [[2, 0, 1], [1, 1, 1]]
    assert str(table["determined"].dtype) == "Int64"
    np.testing.assert_allclose(table["force_N"], np.hypot(table["force_x_N"], table["force_y_N"]))
    rows = solved(path, tmp_path)
    assert [row["determined"] for row in rows] == ["1"]


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"contact_tolerance": 1e9}, "contact_tolerance: 1e\\+09 m. The smallest radius is 0.25 m"),
        ({"contact_tolerance": -1.0}, "contact_tolerance: -1.0 m. A finite length"),
        ({"contact_tolerance": math.nan}, "contact_tolerance: nan m. A finite length"),
        ({"left_velocity": "free", "window": math.inf}, "window: inf s. A finite time above 0"),
        ({"left_velocity": "free", "window": -1.0}, "window: -1.0 s. A finite time above 0"),
        ({"left_velocity": "wished"}, "left_velocity: 'wished'. There are: desired, dump, free"),
        ({"friction": -0.1}, "friction: -0.1. A finite number ≥ 0"),
        ({"wall_friction": math.nan}, "wall_friction: nan. A finite number ≥ 0"),
        ({"wall_friction": 0.3}, "wall_friction: 0.3. There are no walls"),
        ({"largest_overlap": math.nan}, "largest_overlap: nan. A share"),
        ({"time_step": math.nan}, "time_step: nan s. A finite time above 0"),
    ],
)
def test_nonsense_is_refused_by_name(tmp_path, inputs, message):
    path = dump_of(tmp_path, frame(0, PAIR))
    with pytest.raises(ValueError, match=message):
        solved(path, tmp_path, **inputs)
    assert not (tmp_path / "contacts.csv").exists()


def test_one_rule_for_python_and_the_command(tmp_path, pressed):
    """A drive means forces, in the command line's table and in an analysis without
    left_velocity."""
    pressed.write(tmp_path)
    disks = pressed.snapshot
    rows = [
        [i, *x, r, m, 0, 0]
        for i, x, r, m in zip(
            disks.ids, disks.position, 1.3 * disks.radius, disks.mass, strict=True
        )
    ]
    path = dump_of(tmp_path, frame(0, rows))
    table = solved(path, tmp_path, room=tmp_path / "arch.toml")
    analysis = PercussionAnalysis(
        open_bodies(path), walls=pressed.wall_segments(), drive=pressed.drive
    ).run()
    (found,) = analysis.results.frames
    assert found.unit == "N"
    np.testing.assert_allclose(found.force[:, 0], [float(row["force_x_N"]) for row in table])
    np.testing.assert_allclose(
        found.solution.impulse / pressed.drive.relaxation_time_s, found.force, rtol=1e-15
    )
    assert found.largest > 100


def test_results_have_times_frames_and_tables(tmp_path):
    path = dump_of(tmp_path, frame(0, PAIR), frame(10, PAIR))
    analysis = PercussionAnalysis(open_bodies(path, 0.1))
    assert repr(analysis) == "<PercussionAnalysis of 2 frames, not run>"
    results = analysis.run().results
    assert results.times == [0.0, 1.0]
    assert results.steps == [0, 10]
    table = analysis.to_dataframe()
    assert list(table["step"]) == [0, 10]
    np.testing.assert_allclose(table["impulse_x_Ns"], 75)
    assert repr(analysis) == (
        "<PercussionAnalysis: 2 frames, 2 solved, 2 contacts, largest 75 N·s>"
    )
    assert repr(results).startswith("<results of 2 frames: frames, contacts, percussions, ids")
    assert len(repr(results)) < 100
    assert "impulse_x_Ns" in analysis._repr_html_()
    (found, _) = results.frames
    assert repr(found).startswith("<SnapshotPercussions: 2 disks, 1 contacts, largest 75 N·s, solv")
    assert found.to_dataframe()["reaction_Ns"].iloc[0] == pytest.approx(75)
    axes = analysis.plot()
    assert "N·s" in axes.figure.axes[1].get_ylabel()
    with pytest.raises(ValueError, match="force: an impact has impulses"):
        _ = found.force


@pytest.mark.parametrize(
    ("mu", "across", "state"), [(0.1, 7.5, "forward"), (0.5, 12.5, "stick"), (0.0, 0.0, None)]
)
def test_friction_has_columns_of_its_own(tmp_path, mu, across, state):
    oblique = [[1, 0, 0, 0.25, 75, 2, 1], [2, 0.5, 0, 0.25, 75, 0, 0]]
    path = dump_of(tmp_path, frame(0, oblique))
    (row,) = solved(path, tmp_path, friction=mu, indeterminacy="ranges")
    assert float(row["reaction_Ns"]) == pytest.approx(75)
    assert float(row["impulse_y_Ns"]) == pytest.approx(across)
    assert row["determined"] == "1"
    if state is None:
        assert "friction_Ns" not in row
        return
    names = ("friction_Ns", "friction_lower_Ns", "friction_upper_Ns")
    assert [float(row[name]) for name in names] == pytest.approx([across] * 3)
    assert row["state"] == state


def test_a_scene_has_its_own_friction_and_a_blocked_crowd_no_spin(pressed):
    frictional = pressed.with_contact(friction=0.3)
    disks = pressed.snapshot
    in_contact = disks_at(
        disks.position, disks.velocity, 1.3 * disks.radius, disks.mass, spin=np.ones(len(disks))
    )
    found = percussions_of(frictional, in_contact)
    at_rest = replace(in_contact, spin=np.zeros(len(disks)))
    again = percussions_of(pressed, at_rest, ContactLaw(friction=0.3))
    assert found.solution.status == "solved"
    assert np.abs(found.solution.friction.tangential).max() > 1.0
    np.testing.assert_array_equal(found.solution.impulse, again.solution.impulse)


def test_a_universe_of_another_reader_says_what_to_do(tmp_path):
    import MDAnalysis

    universe = MDAnalysis.Universe.empty(2, trajectory=True)
    with pytest.raises(DumpError, match=r"open the dump with analysis.dumps.open_bodies"):
        PercussionAnalysis(universe)


def test_ranges_hold_the_reaction(pressed):
    """Four disks in a square between four walls: hyperstatic, yet each range has its reaction."""
    r = 0.25
    square = disks_at([[-r, -r], [r, -r], [-r, r], [r, r]], [[1, 1], [-1, 1], [1, -1], [-1, -1]], r)
    found = percussions_of(Setting(), square)
    cells = found.columns("ranges", step=0)
    assert len(cells["first"]) == 4
    for low, reaction, high in zip(
        cells["lower_Ns"], cells["reaction_Ns"], cells["upper_Ns"], strict=True
    ):
        assert low - 1e-6 <= reaction <= high + 1e-6
    assert set(cells["determined"]) <= {0, 1}
    beam = Walls(start=[[-1, -2 * r]], end=[[1, -2 * r]])
    named = percussions_of(Setting(walls=beam, wall_names=("floor",)), square)
    assert named.columns()["wall"].count("floor") == 2


def test_overlaps_that_no_crowd_has(tmp_path):
    deep = [PAIR[0], [2, 0.2, 0, 0.25, 75, 0, 0]]
    path = dump_of(tmp_path, frame(3, deep))
    with pytest.raises(DumpError, match=r"step 3: disk 1 and disk 2 overlap by 1.2 .*--largest-ov"):
        solved(path, tmp_path)
    assert len(solved(path, tmp_path, largest_overlap=2.0)) == 1


def test_the_ensemble_has_mean_spread_and_a_status(tmp_path, monkeypatch):
    """A flower of seven: each spoke has an even law on [0, m U], and so has each side of the rim."""
    angle, load = np.pi / 3 * np.arange(6), 150.0
    rim = np.column_stack([np.cos(angle), np.sin(angle)])
    rows = [[2 + i, *(0.5 * at), 0.25, 75, *(-2.0 * at)] for i, at in enumerate(rim)]
    path = dump_of(tmp_path, frame(0, [[1, 0, 0, 0.25, 75, 0, 0], *rows]))
    found = solved(path, tmp_path, indeterminacy="ensemble")
    assert len(found) == 12
    for row in found:
        assert (row["sampling"], row["determined"]) == ("converged", "0")
        error = 4 * load / math.sqrt(12 * 100)  # of as few draws as are enough
        assert float(row["mean_Ns"]) == pytest.approx(load / 2, abs=error)
        assert float(row["sd_Ns"]) == pytest.approx(load / math.sqrt(12), abs=error)
        assert 0 < float(row["q05_Ns"]) < 0.2 * load < 0.8 * load < float(row["q95_Ns"]) < load
    monkeypatch.setattr("nscd.indeterminacy.ensemble.ENOUGH", 10**9)
    job = DumpToSolve(path=path, setting=setting_beside(path, None), indeterminacy="ensemble")
    message = solve_dump(job, tmp_path / "again.parquet")
    assert message.unsolved == [f"{path}, step 0: sampling of 12 contacts not converged"]
    oblique = [[1, 0, 0, 0.25, 75, 2, 1], [2, 0.5, 0, 0.25, 75, 0, 0]]
    (row,) = solved(
        dump_of(tmp_path, frame(0, oblique)), tmp_path, friction=0.5, indeterminacy="ensemble"
    )
    assert row["sampling"] == "determined"
    assert (float(row["least_energy_Ns"]), float(row["mean_Ns"])) == pytest.approx((75, 75))
    both = float(row["friction_least_energy_Ns"]), float(row["friction_mean_Ns"])
    assert both == pytest.approx((12.5, 12.5))
    assert get_args(options.Indeterminacy) == get_args(Indeterminacy)
