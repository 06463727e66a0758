"""The rigid engine against closed forms, itself after an interrupt, and what it refuses."""

import dataclasses
import os
import signal

import numpy as np
import pytest

from analysis.dumps import contacts_at, index_contacts, index_dump, open_bodies, snapshot_of
from analysis.engines import RIGID, EngineError
from analysis.engines.programs.rigid import NAMES, main, motion_of
from analysis.engines.run import simulate
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from nscd import find_contacts
from tests.crowds import spaced
from tests.engines.test_ends import started, wait, working_in

RUN = """
from pathlib import Path
from analysis.engines.run import simulate
from analysis.scene.shipped_scenes import make
simulate(make("arch", disks=60).with_run(duration_s=%g, frames=%d), "rigid", Path("run"))
"""


def crowd(duration=0.6, frames=6):
    """60 people who come to rest at their door."""
    return make("arch", disks=60).with_run(duration_s=duration, frames=frames)


def frames_of(folder):
    trajectory = open_bodies(folder / "bodies.dump").trajectory
    return [snapshot_of(trajectory[number]) for number in range(len(trajectory))]


def impulses(folder):
    """Frames of impulses.dump: first, second, is_wall, impulse_x, impulse_y."""
    index = index_dump(folder / "impulses.dump", "ENTRIES")
    assert index.columns == ("first", "second", "is_wall", "impulse_x", "impulse_y")
    return [index.table(number) for number in range(len(index.frames))]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigid") / "run"
    return folder, simulate(crowd(), "rigid", folder)


def test_a_crowd_in_motion_never_overlaps(finished):
    folder, record = finished
    walls = crowd().wall_segments()
    assert (record.engine, record.exit_state, record.steps) == ("rigid", "finished", 120)
    for snapshot in frames_of(folder):
        near = find_contacts(snapshot, walls, tolerance=1e-3)
        assert near.gap.min(initial=0.0) >= -1e-9


def test_forces_of_the_contact_dump_are_window_means(finished):
    folder, _ = finished
    index, window = index_contacts(folder / "contacts.dump"), 0.1
    for number, rows in enumerate(impulses(folder)):
        contacts = contacts_at(index, number)
        assert contacts.force * window == pytest.approx(rows[:, 3:], rel=1e-12, abs=1e-12)
        along = (contacts.force * contacts.normal).sum(1)
        assert (along >= 0.9 * np.hypot(*contacts.force.T)).all()


def test_an_impact_gives_the_percussion_of_its_restitution(tmp_path):
    scene = make("pair").with_contact(restitution=0.5).with_run(duration_s=0.1, frames=10)
    simulate(scene, "rigid", tmp_path / "run")
    total = sum(rows[:, 3:].sum(0) for rows in impulses(tmp_path / "run"))
    approach = scene.snapshot.velocity[0] - scene.snapshot.velocity[1]
    assert total == pytest.approx(0.5 * 75.0 * 1.5 * approach, rel=1e-9)


def test_a_jam_at_rest_stays_at_rest(tmp_path):
    """A chain between two walls, everybody pushing to the right."""
    chain = make("chain_wall", disks=6)
    door = {"door_start_m": (50.0, -1.0), "door_end_m": (50.0, 1.0), "outward": (1.0, 0.0)}
    drive = make("arch", disks=2).drive.model_copy(update=door)
    content = {name: getattr(chain, name) for name in Scene.model_fields}
    still = dataclasses.replace(chain.snapshot, velocity=np.zeros((6, 2)))
    wall = chain.wall_segments()
    towards = np.sign(wall.start[0, 0] - still.position[:, 0].mean())
    scene = Scene(**content | {"snapshot": still, "drive": drive})
    scene = scene.with_run(duration_s=1.0, frames=10, time_step_s=None)
    assert towards > 0
    simulate(scene, "rigid", tmp_path / "run")
    first, *_, last = frames_of(tmp_path / "run")
    moved = np.abs(last.position - first.position).max()
    assert moved <= 1e-9 + 2 * np.abs(find_contacts(still, wall, tolerance=1e-3).gap).max()
    assert np.abs(last.velocity).max() <= 1e-9


@pytest.mark.parametrize(("friction", "keeps"), [(0.0, False), (0.3, False), (0.3, True)])
def test_the_same_scene_gives_the_same_bytes_and_an_interrupted_run_goes_on(
    tmp_path, friction, keeps
):
    complete, parted = tmp_path / "whole", tmp_path / "parted"
    scene = crowd().with_contact(friction=friction).model_copy(update={"name": "scene"})
    scene = spaced(scene, jostling_m_per_s=0.1, heading_sd_rad=0.2) if keeps else scene
    for folder in (complete, parted):
        scene.write(folder)
    assert main([str(complete / "scene.toml"), "--out", str(complete)]) == 0
    names = (*NAMES, "energy.csv")
    wanted = [(complete / name).read_bytes() for name in names]
    # the dumps of a run that was killed while it wrote: each broken off somewhere else
    for name, content, fraction in zip(names, wanted, (0.6, 0.9, 0.45, 0.7, 0.8), strict=True):
        (parted / name).write_bytes(content[: int(fraction * len(content))])
    assert main([str(parted / "scene.toml"), "--out", str(parted)]) == 0
    assert [(parted / name).read_bytes() for name in names] == wanted


@pytest.mark.long
def test_a_killed_run_is_resumed_by_the_next_one(tmp_path):
    process = started(RUN % (600.0, 6000), tmp_path)
    dump = tmp_path / ".run.next" / "bodies.dump"
    assert wait(lambda: dump.exists() and dump.stat().st_size > 40_000)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    assert wait(lambda: not working_in(tmp_path / ".run.next"))
    # the same record, so that the next one takes it up; its end would be far
    process = started(RUN % (600.0, 6000), tmp_path)
    message = tmp_path / ".run.next" / "screen.log"
    assert wait(lambda: message.exists() and "RESUMED at t = " in message.read_text())
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rigid_step_s": 0.2}, "run.rigid_step_s: .* could cross a wall. Give a step of at most"),
        ({"rigid_step_s": 1e-99}, "would not end within a month"),
        ({"rigid_step_s": 1e-300}, "nearer to 0 than 1e-100"),
    ],
)
def test_steps_that_cannot_be_are_refused(tmp_path, change, message):
    with pytest.raises((EngineError, ValueError), match=message):
        simulate(crowd().with_run(**change), "rigid", tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_step_without_an_answer_stops_the_run(tmp_path, monkeypatch):
    scene = crowd().model_copy(update={"name": "scene"})
    scene.write(tmp_path)

    def unsolved(*inputs):
        motion = motion_of(*inputs)
        motion._core.stalled = -1.0
        return motion

    monkeypatch.setattr("analysis.engines.programs.rigid.motion_of", unsolved)
    assert main([str(tmp_path / "scene.toml"), "--out", str(tmp_path)]) == 3


def test_each_setting_has_a_folder_of_its_own():
    scene = crowd()
    named = [scene, scene.with_run(rigid_step_s=0.001), scene.with_run(rigid_tolerance=1e-4)]
    settings = [RIGID.setting(one) for one in named]
    assert settings == ["moreau_jean", "h0.001", "moreau_jean_tol0.0001"]
