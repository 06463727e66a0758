"""How runs end when something outside goes wrong: killed parents, two at once, damaged files."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from at_hand import ROOT, require

from analysis.compare.study import study
from analysis.engines.run import run_folder
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make

ENGINES = ["lammps", "yade"]
LONG = {"duration_s": 1000.0, "frames": 10000}


def started(program, folder, *words):
    """A Python process with this tree's code, working in the folder."""
    return subprocess.Popen(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def working_in(folder):
    """Ids of the processes whose working folder is the folder or in it."""
    found = []
    for link in Path("/proc").glob("[0-9]*/cwd"):
        try:
            if os.readlink(link).startswith(str(folder)):
                found.append(int(link.parts[2]))
        except OSError:
            pass
    return found


def wait(condition, longest=60.0):
    end = time.monotonic() + longest
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_an_engine_ends_with_the_command_that_started_it(tmp_path, name, number):
    require(name)
    make("arch", 100).with_run(**LONG).write(tmp_path)
    command = "from analysis.cli import main; main()"
    process = started(command, tmp_path, "run", "arch.toml", "--engine", name)
    assert wait(lambda: list(tmp_path.glob("out/arch/.*/bodies.dump")))
    assert len(working_in(tmp_path)) > 1
    process.send_signal(number)
    _, said = process.communicate(timeout=30)
    assert wait(lambda: not working_in(tmp_path), 10.0), working_in(tmp_path)
    if number == signal.SIGKILL:
        return
    assert process.returncode == 128 + number
    assert said.splitlines()[-1] == (
        f"percussions: ended by {number.name}; earlier results are untouched"
    )
    assert not [path for path in (tmp_path / "out").rglob("*") if path.is_file()]


def test_workers_and_their_engines_end_with_a_killed_parent(tmp_path):
    require("lammps")
    program = (
        "from pathlib import Path\n"
        "from analysis.engines.run import EngineRun, run_ahead\n"
        "from analysis.scene.shipped_scenes import make\n"
        "if __name__ == '__main__':\n"
        f"    scene = make('arch', 100).with_run(**{LONG!r})\n"
        "    scenes = [scene, scene.with_contact(stiffness_N_per_m=2e6)]\n"
        "    run_ahead([EngineRun.of(one, 'lammps', Path('out')) for one in scenes], processes=2)\n"
    )
    process = started(program, tmp_path)
    assert wait(lambda: len(list(tmp_path.glob("out/arch/.*/bodies.dump"))) == 2)
    assert len(working_in(tmp_path)) >= 5
    process.kill()
    process.communicate(timeout=30)
    assert wait(lambda: not working_in(tmp_path), 10.0), working_in(tmp_path)


@pytest.mark.parametrize("name", ENGINES)
def test_two_runs_into_one_folder_at_the_same_time(tmp_path, name):
    """The second waits and takes what the first has made."""
    require(name)
    make("arch", 100).with_run(duration_s=2.0, frames=10).write(tmp_path)
    command = "from analysis.cli import main; main()"
    both = [started(command, tmp_path, "run", "arch.toml", "--engine", name) for _ in range(2)]
    said = [process.communicate(timeout=120)[1] for process in both]
    assert [process.returncode for process in both] == [0, 0], said
    (folder,) = (tmp_path / "out/arch").iterdir()
    assert (folder / "run.json").exists()


def test_a_damaged_dump_is_one_failed_run(tmp_path):
    require("lammps")
    scene = read_scene("pair").with_run(duration_s=0.05, frames=100)
    stiffnesses = [1e5, 2e5]
    assert len(study(scene, ["lammps"], stiffnesses, tmp_path).comparisons) == 2
    folder = run_folder(tmp_path, scene.with_contact(stiffness_N_per_m=2e5), "lammps")
    dump = folder / "bodies.dump"
    dump.write_text(dump.read_text()[: dump.stat().st_size // 2])
    made = study(scene, ["lammps"], stiffnesses, tmp_path)
    assert len(made.comparisons) == 1
    (failure,) = made.failures
    assert "bodies.dump" in failure
    assert f"remove {folder}" in failure
