"""The decks and the scripts as their READMEs say: without this project's Python, from the root of a
checkout."""

import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from analysis.dumps import index_contacts, index_dump
from analysis.engines.lammps import scene_deck
from analysis.engines.penalty import penalty_of
from analysis.scene.scene import read_scene, scene_names
from tests.crowds import spaced
from tests.engines.at_hand import ROOT, lammps, require, yade

PAPER = ["four_disks", "chain_wall", "corridor", "arch_masses"]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A copy of the folders that the plain commands need, and no others."""
    folder = tmp_path_factory.mktemp("a checkout")
    for part in ("scenes", "lammps_inputs", "yade_scripts"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def numbers(message):
    """What an engine says of its law: damping, dashpots, restitutions, time steps, steps, interval."""
    pattern = (
        r"damping ratio (\S+), dashpots (\S+) N s/m between disks, (\S+) N s/m at walls[^\n]*\n"
        r"restitution: asked \S+, obtained (\S+) to (\S+) over the masses\n"
        r"time step: (\S+) s, safe up to (\S+) s, (\d+) steps, a frame every (\d+)"
    )
    match = re.search(pattern, message)
    assert match, message[-2000:]
    return [float(word) for word in match.groups()]


def expected(scene):
    law = penalty_of(scene)
    found = [law.damping_ratio, law.damping, law.wall_damping, law.restitution_least]
    found += [law.restitution_most, law.time_step, law.safe_time_step, law.steps]
    return pytest.approx([*found, law.frame_interval], rel=1e-12)


def test_the_committed_decks_are_those_of_the_scenes():
    folder = ROOT / "lammps_inputs" / "scenes"
    assert sorted(path.stem for path in folder.glob("*.in")) == scene_names()
    for name in scene_names():
        text = (folder / f"{name}.in").read_text(encoding="utf-8")
        assert text == scene_deck(read_scene(name)), name


@pytest.mark.parametrize("name", [*PAPER, "shoulders"])
def test_plain_lammps_runs_each_scene(checkout, command, name):
    require("lammps")
    done = command(lammps(scene=name, duration=0.002, frames=2), checkout)
    assert done.returncode == 0, done.stdout[-2000:]
    out = checkout / "out" / name / "lammps"
    bodies = index_dump(out / "bodies.dump")
    assert bodies.counts == (len(read_scene(name).snapshot),) * 3
    columns = "id type x y z radius mass vx vy vz omegaz fx fy"
    columns += " mol body_inertia tqz" if name == "shoulders" else ""
    columns += " drive_x drive_y" if read_scene(name).drive else ""
    assert bodies.columns == tuple(columns.split())
    assert len(index_dump(out / "pairs.dump", "ENTRIES").steps) == 3
    assert numbers(done.stdout) == expected(read_scene(name).with_run(duration_s=0.002, frames=2))
    assert not list(checkout.glob("lammps_inputs/**/*.dump"))


@pytest.mark.long
def test_yade_makes_no_prompt_ready_for_a_script_after_which_it_ends(tmp_path, command):
    require("yade")
    (tmp_path / "ask.py").write_text(
        "import sys; print('asked', 'prompt_toolkit' in sys.modules, yade.runtime.ipython_version)"
    )
    words = ["yade", "-L", "noserver", "-n", "-x", str(tmp_path / "ask.py")]
    done = command(words, tmp_path, PYTHONPATH=str(ROOT / "yade_scripts"))
    assert "asked False 10" in done.stdout.splitlines(), done.stdout + done.stderr
    assert done.returncode == 0
    assert "Traceback" not in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", [*PAPER, "shoulders"])
def test_plain_yade_runs_each_scene(checkout, command, name):
    require("yade")
    done = command(yade(name, "duration=0.002", "frames=2"), checkout, PYTHONPATH="yade_scripts")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    out = checkout / "out" / name / "yade"
    assert index_dump(out / "bodies.dump").counts == (len(read_scene(name).snapshot),) * 3
    assert len(index_contacts(out / "contacts.dump").steps) == 3
    assert numbers(done.stdout) == expected(read_scene(name).with_run(duration_s=0.002, frames=2))


@pytest.mark.parametrize("law", ["hooke", "hertz"])
@pytest.mark.parametrize("restitution", [0.0, 0.05, 0.3, 0.95, 1.0])
def test_the_deck_finds_the_damping_of_restitutions(checkout, command, tmp_path, restitution, law):
    require("lammps")
    arguments = {"restitution": restitution, "law": law, "friction": 0.4}
    more = {"stiffness": 3e7, "dt": 0, "duration": 0.001, "frames": 3, "out": tmp_path}
    done = command(lammps(scene="chain_masses", **arguments, **more), checkout)
    scene = read_scene("chain_masses").with_contact(stiffness_N_per_m=3e7, **arguments)
    scene = scene.with_run(duration_s=0.001, frames=3, time_step_s=None)
    assert done.returncode == 0, done.stdout[-2000:]
    assert numbers(done.stdout) == expected(scene)


@pytest.mark.parametrize("name", ["lammps", "yade"])
def test_plain_commands_do_not_know_what_people_want_who_keep_their_distance(
    checkout, tmp_path, command, name
):
    require(name)
    path = (scene := spaced(read_scene("arch"))).write(tmp_path)
    (tmp_path / "arch.in").write_text(scene_deck(scene))
    arguments = {"deck": tmp_path / "arch.in", "data": path.with_suffix(".data"), "out": tmp_path}
    words = lammps(**arguments) if name == "lammps" else yade(path, f"out={tmp_path}")
    done = command(words, checkout, PYTHONPATH="yade_scripts")
    assert done.returncode == 1
    says = r"ERROR: .*drive\.time_gap_s: people who keep their distance run by `percussions run` only"
    assert re.search(says, done.stdout + done.stderr), done.stdout[-2000:] + done.stderr[-2000:]
    assert not (tmp_path / "bodies.dump").exists()


def test_a_deck_with_an_unknown_law_says_so(checkout, command):
    require("lammps")
    done = command(lammps(scene="pair", law="jelly"), checkout)
    assert done.returncode != 0
    assert "law: jelly. There are hooke, hertz, body and body_hertz" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "which scene?"),
        (["nowhere"], "nowhere.toml: No such file or directory"),
        (["pair", "colour=2"], "colour=2: unknown. There are: stiffness"),
        (["pair", "dt=fast"], "dt=fast: not a number"),
    ],
)
def test_the_script_names_what_is_wrong(checkout, command, words, message):
    require("yade")
    done = command(yade(*words), checkout, PYTHONPATH="yade_scripts")
    assert done.returncode != 0
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def listening(pid):
    """The TCP ports on which a process listens."""
    sockets = set()
    for link in Path(f"/proc/{pid}/fd").glob("*"):
        try:
            sockets.add(os.readlink(link))
        except OSError:
            continue
    texts = (Path(f"/proc/net/{table}").read_text() for table in ("tcp", "tcp6"))
    rows = (line.split() for text in texts for line in text.splitlines()[1:])
    mine = (row for row in rows if row[3] == "0A" and f"socket:[{row[9]}]" in sockets)
    return {int(row[1].split(":")[1], 16) for row in mine}


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux' /proc/net/tcp")
@pytest.mark.parametrize("started", ["as documented", "bare"])
def test_no_port_is_open_while_yade_runs(checkout, tmp_path, started):
    """Bare, YADE itself opens two before the script runs; the script must have closed them when it
    starts to work."""
    require("yade")
    words = yade() if started == "as documented" else ["yade", "-n", "-x", "yade_scripts/crowd.py"]
    added = {"PYTHONPATH": "yade_scripts"} if started == "as documented" else {}
    words += ["arch", "duration=3", "frames=6", f"out={tmp_path}"]
    log = tmp_path / "log"
    with log.open("w") as message:
        where = {"cwd": checkout, "env": os.environ | added, "stdout": message, "stderr": message}
        process = subprocess.Popen(words, **where)
        try:
            looked = 0
            while process.poll() is None and looked <= 5:
                working = "contact: hooke" in log.read_text()
                if working or started == "as documented":
                    assert listening(process.pid) == set()
                    looked += working
                time.sleep(0.01)
        finally:
            process.kill()
            process.wait()
    assert looked > 5, log.read_text()[-2000:]
