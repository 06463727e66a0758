"""Runs that go wrong, each provoked, in both engines: who stops them, why, when, and what is
left."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from analysis.dumps import index_dump
from analysis.engines import LAMMPS, EngineError, RunRecord
from analysis.engines.guard import CENTRES_SHARE, ENERGY_SHARE, STEP_SHARE
from analysis.engines.lammps import scene_deck
from analysis.engines.run import run_engine
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from analysis.studies.work_precision.soft import ReferenceError, leapfrog
from tests.engines.at_hand import ROOT, lammps, require, yade

ENGINES = ["lammps", "yade"]
SAID = re.compile(r"^GUARD (\w+) at t = (\S+) s \(step (\d+)\): (.+)$", re.MULTILINE)


def disks(scene, **changes):
    """The scene with other disks."""
    return scene.model_copy(update={"snapshot": replace(scene.snapshot, **changes)})


def timing(scene, time_step, duration, frames=10):
    return scene.with_run(time_step_s=time_step, duration_s=duration, frames=frames)


def hot():
    """A collision that gives energy: the time step is 2 ms, the critical one 2√(m_eff/k) = 12 ms,
    the rule's 0.09 ms."""
    return timing(read_scene("pair"), 2e-3, 0.1)


def inside():
    """A disk that starts inside another."""
    scene = read_scene("pair")
    return timing(disks(scene, position=np.array([[0.0, 0.0], [0.1, 0.0]])), 1e-5, 0.01)


def through_the_wall():
    """A chain runs into a wall that is too soft to stop it."""
    contact = {"stiffness_N_per_m": 1e5, "wall_stiffness_N_per_m": 3e3, "restitution": 1.0}
    return timing(read_scene("chain_wall").with_contact(**contact), 1e-4, 1.0)


def tunnelling():
    """A disk that passes the wall between two steps, of 2 m each."""
    return timing(chain_with(-1, 20000.0), 1e-4, 1e-3)


def chain_with(one, speed):
    """The chain before a wall, at rest but for one of its disks (m/s)."""
    scene = read_scene("chain_wall")
    velocity = np.zeros((len(scene.snapshot), 2))
    velocity[one] = speed, 0.0
    return disks(scene, velocity=velocity)


def away():
    """A disk that leaves the box of 200 m about the crowd."""
    return timing(chain_with(0, -200.0), 1e-4, 1.2)


def boiling():
    """A driven crowd at a time step of 0.58 √(m/k): jumps of the contact force give more than the
    walls take."""
    return timing(make("jam", 30), 5e-3, 4.0, 20)


def of_commands(name, scene, folder, command, decks="lammps_inputs", scripts="yade_scripts"):
    """The scene by the plain command of an engine, which no check of the scene precedes."""
    require(name)
    path = scene.write(folder)
    if name == "yade":
        words = yade(path, f"out={folder}")
        words[6] = f"{scripts}/crowd.py"
        return command(words, ROOT, PYTHONPATH=str(scripts), PYTHONDONTWRITEBYTECODE="1")
    (folder / "scene.in").write_text(scene_deck(scene))
    files = {"deck": folder / "scene.in", "data": path.with_suffix(".data"), "out": folder}
    words = lammps(decks=decks, **files)
    words[2] = f"{decks}/crowd.in"
    return command(words, ROOT)


# what is provoked, the reason, and the first step and the last in which the guard must have seen it
FAILURES = [
    (hot, "energy", 1, 10),
    (inside, "overlap", 1, 100),
    (through_the_wall, "wall", 100, 2500),
    (tunnelling, "speed", 1, 3),
    (away, "lost", 10000, 10200),
]


@pytest.mark.long
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("failure", FAILURES, ids=[f[0].__name__ for f in FAILURES])
def test_the_plain_command_stops_with_the_reason_and_the_time(tmp_path, command, name, failure):
    provoked, kind, first, last = failure
    scene = provoked()
    done = of_commands(name, scene, tmp_path, command)
    assert done.returncode == 3, done.stdout[-2000:] + done.stderr[-2000:]
    message = SAID.findall(done.stdout)
    assert len(message) == 1
    assert message[0][0] == kind
    step = int(message[0][2])
    assert first <= step <= last
    assert float(message[0][1]) == pytest.approx(step * scene.run.time_step_s, rel=1e-5)


@pytest.mark.parametrize("name", ENGINES)
def test_stiffer_walls_hold_the_same_chain(tmp_path, command, name):
    scene = through_the_wall().with_contact(wall_stiffness_N_per_m=1e5)
    done = of_commands(name, scene, tmp_path, command)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


def test_the_reference_stops_where_the_engines_do():
    scene = through_the_wall()
    with pytest.raises(ReferenceError, match="the centre of a disk has passed a wall"):
        leapfrog(scene)
    leapfrog(scene.with_contact(wall_stiffness_N_per_m=1e5))


@pytest.mark.parametrize("name", ENGINES)
def test_a_driven_crowd_with_too_long_a_step_is_stopped(tmp_path, name):
    require(name)
    scene = boiling()
    folder = tmp_path / "run"
    says = f"{name}, jam, t = .* stopped by its guard: (energy|speed|overlap)"
    with pytest.raises(EngineError, match=says):
        run_engine(scene, name, folder)
    record = RunRecord.read(folder, even_stopped=True)
    assert record.exit_state == "stopped"
    assert 0 < record.stopped_at_s < 4.0
    assert record.cpu_seconds > 0
    assert json.loads((folder / "run.json").read_text())["reason"] == record.reason


def changed(file, old, new):
    """Other words in a file, which had the old ones."""
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_a_force_that_the_scene_does_not_state_changes_the_momentum(tmp_path, command):
    """The deck and the script with one more force; the energy must not show it first."""
    scene = timing(read_scene("four_disks"), 1e-5, 0.01)
    decks = tmp_path / "decks"
    shutil.copytree(ROOT / "lammps_inputs", decks)
    wind = "fix wind all addforce 0.0 1e-2 0.0\nfix flat all"
    changed(decks / "crowd.in", "fix flat all", wind)
    done = of_commands("lammps", scene, tmp_path, command, decks=decks)
    assert done.returncode == 3, done.stdout[-2000:]
    assert SAID.findall(done.stdout)[0][0] == "momentum"


def test_numerical_damping_in_yade_changes_the_momentum(tmp_path, command):
    scene = timing(read_scene("four_disks"), 1e-5, 0.01)
    scripts = tmp_path / "scripts"
    shutil.copytree(ROOT / "yade_scripts", scripts, ignore=shutil.ignore_patterns("__pycache__"))
    changed(scripts / "crowd.py", "Integrator(damping=0.0)", "Integrator(damping=0.2)")
    done = of_commands("yade", scene, tmp_path, command, scripts=scripts)
    assert done.returncode == 3, done.stdout[-2000:] + done.stderr[-2000:]
    assert SAID.findall(done.stdout)[0][0] == "momentum"


def test_what_is_not_a_number_stops_lammps(tmp_path, monkeypatch):
    """`coeff_restitution` with restitution 0 gives NaN; without a guard LAMMPS ends with status
    0."""
    require("lammps")
    decks = tmp_path / "decks"
    shutil.copytree(ROOT / "lammps_inputs", decks)
    law = (decks / "law.in").read_text()
    broken = re.sub(
        r"hooke [^']*v_damping:[^']*limit_damping",
        "hooke $(v_stiffness:%.17g) 0.0 ${tangential} damping coeff_restitution",
        law,
    )
    assert broken != law
    (decks / "law.in").write_text(broken)
    monkeypatch.setattr(LAMMPS, "DECKS", str(decks))
    folder = tmp_path / "run"
    pair = timing(read_scene("pair"), 1e-5, 0.01)
    says = "stopped by its guard: finite: the kinetic energy is not a finite"
    with pytest.raises(EngineError, match=says):
        run_engine(pair, "lammps", folder)
    # and the check of the dumps finds it, if the guard does not look
    changed(decks / "crowd.in", "variable guard index yes", "variable guard index no")
    says = "its dumps cannot be right: not a finite number in column"
    with pytest.raises(EngineError, match=says):
        run_engine(pair, "lammps", folder)
    assert RunRecord.read(folder, even_stopped=True).exit_state == "failed"


@pytest.mark.parametrize(
    ("name", "scene", "contact", "run"),
    [
        ("lammps", "pair", {"restitution": 1.0}, {"duration_s": 0.1, "frames": 10}),
        ("lammps", "chain", {"restitution": 1.0}, {"duration_s": 0.1, "frames": 10}),
        ("lammps", "chain_wall_masses", {"restitution": 0.9}, {"duration_s": 0.1, "frames": 10}),
        ("lammps", "pair_oblique", {"friction": 0.5, "restitution": 0.9}, {"duration_s": 0.1, "frames": 20}),
        ("lammps", "corridor", {}, {"frames": 10}),
        ("lammps", "gate", {"law": "hertz"}, {"frames": 10}),
        ("lammps", "gate", {"restitution": 0.9, "stiffness_N_per_m": 3e4}, {"frames": 20}),
        ("lammps", "arch", {}, {"duration_s": 1.0, "frames": 10}),
        ("yade", "chain_wall_masses", {"restitution": 1.0}, {"duration_s": 0.1, "frames": 10}),
        ("yade", "gate", {"friction": 0.5, "restitution": 0.9}, {"frames": 10}),
    ],
)  # fmt: skip
def test_a_sound_run_is_not_stopped(simulate, name, scene, contact, run):
    valid = read_scene(scene).with_contact(**contact).with_run(**({"time_step_s": None} | run))
    assert simulate(name, valid).record.exit_state == "finished"


@pytest.mark.parametrize("name", [*ENGINES, "rigid"])
def test_the_drive_gives_the_same_to_who_spins(simulate, name):
    few = disks(make("arch", 2), spin=np.array([20.0, -20.0])).with_contact(friction=0.4)
    assert simulate(name, timing(few, None, 8.0)).record.exit_state == "finished"


@pytest.mark.parametrize("name", ENGINES)
def test_the_guard_changes_nothing(tmp_path, command, name):
    require(name)
    for guard in ("yes", "no"):
        arguments = {"duration": 0.2, "frames": 4, "out": tmp_path / guard, "guard": guard}
        if name == "yade":
            words = yade("gate", *(f"{key}={value}" for key, value in arguments.items()))
        else:
            words = lammps(scene="gate", **arguments)
        done = command(words, ROOT, PYTHONPATH="yade_scripts", PYTHONDONTWRITEBYTECODE="1")
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert (tmp_path / "yes/bodies.dump").read_bytes() == (tmp_path / "no/bodies.dump").read_bytes()


def test_a_stopped_run_is_shown_refused_replaced_and_replaces_nothing(tmp_path):
    require("lammps")
    folder = tmp_path / "run"
    with pytest.raises(EngineError, match="stopped by its guard"):
        run_engine(hot(), "lammps", folder)
    record = RunRecord.read(folder, even_stopped=True)
    assert record.reason.startswith("energy: kinetic energy")
    assert index_dump(folder / "bodies.dump").counts[0] == 2
    says = r"run: the run stopped at t = \S+ s: energy: kinetic energy"
    with pytest.raises(EngineError, match=says):
        RunRecord.read(folder)
    valid = timing(read_scene("pair"), 1e-5, 0.01)
    assert run_engine(valid, "lammps", folder).exit_state == "finished"
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(EngineError, match="stopped by its guard"):
        run_engine(hot(), "lammps", folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_the_engines_hold_the_limits_that_are_documented():
    deck = (ROOT / "lammps_inputs/guard.in").read_text()
    valid = next(line for line in deck.splitlines() if line.startswith("variable guard_sound"))
    assert f"(v_guard_stride<={STEP_SHARE:g})" in valid
    assert f"(v_guard_apart>={CENTRES_SHARE:g})" in valid
    assert f"{ENERGY_SHARE:g}*(v_guard_start+v_guard_desired)" in deck
    script = (ROOT / "yade_scripts/crowd_guard.py").read_text()
    for name, value in (("STEP", STEP_SHARE), ("CENTRES", CENTRES_SHARE), ("ENERGY", ENERGY_SHARE)):
        assert f"{name}_SHARE = {value:g}" in script
