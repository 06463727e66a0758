"""How runs end when something outside goes wrong: killed parents, two at once, damaged files."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from analysis.compare.study import study
from analysis.engines import LAMMPS, EngineError
from analysis.engines import lammps as lammps_engine
from analysis.engines import run as engine_runs
from analysis.engines.guard import died, garbage
from analysis.engines.process import Command
from analysis.engines.run import run_folder, simulate, staged
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from tests.engines.at_hand import ROOT, require
from tests.engines.test_runs import RECORD

pytestmark = pytest.mark.long

ENGINES = ["lammps", "yade"]
LONG = {"duration_s": 1000.0, "frames": 10000}


def started(program, folder, *words):
    """A Python process with this tree's code, working in the folder."""
    return subprocess.Popen(
        [sys.executable, "-c", program, *words], cwd=folder, stdout=subprocess.DEVNULL, text=True,
        stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


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
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_an_engine_ends_with_the_command_that_started_it(tmp_path, name, number):
    require(name)
    make("arch", 100).with_run(**LONG).write(tmp_path)
    command = "from analysis.cli import main; main()"
    process = started(command, tmp_path, "run", "arch.toml", "--engine", name)
    assert wait(lambda: list(tmp_path.glob("out/arch/.*/bodies.dump")))
    assert len(working_in(tmp_path)) > 1
    process.send_signal(number)
    _, message = process.communicate(timeout=300)
    assert wait(lambda: not working_in(tmp_path), 10.0), working_in(tmp_path)
    if number == signal.SIGKILL:
        return
    assert process.returncode == 128 + number
    assert message.splitlines()[-1] == (
        f"percussions: ended by {number.name}. Earlier results are untouched"
    )
    assert not [path for path in (tmp_path / "out").rglob("*") if path.is_file()]


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.4])
def test_ranks_of_mpi_end_with_a_killed_command_while_they_begin(tmp_path, delay):
    """Each of them is in a session of its own. In use 40 kills in the first 3 s left none."""
    require("lammps")
    make("arch", 100).with_run(**LONG).write(tmp_path)
    process = started("from analysis.cli import main; main()", tmp_path,
                      *["run", "arch.toml", "--engine", "lammps", "--ranks", "2"])  # fmt: skip
    assert wait(lambda: len(working_in(tmp_path)) > 1)
    time.sleep(delay)
    process.kill()
    process.communicate(timeout=300)
    assert wait(lambda: not working_in(tmp_path), 10.0), working_in(tmp_path)


def test_ranks_that_do_not_start_are_ended(tmp_path, monkeypatch):
    require("lammps")
    monkeypatch.setattr(engine_runs, "MPI_STARTS_S", 0.2)
    silent = Command(words=("/bin/sh", "-c", "sleep 60"), environment={})
    monkeypatch.setattr(type(LAMMPS), "on_ranks", lambda *_: silent)
    with pytest.raises(EngineError, match="ranks: 2 of MPI wrote nothing in their"):
        engine_runs.run_engine(read_scene("pair"), "lammps", tmp_path / "run", ranks=2)
    assert not working_in(tmp_path)


@pytest.mark.parametrize("name", ["lammps", "rigid"])
def test_workers_and_their_engines_end_with_a_killed_parent(tmp_path, name):
    """A rigid run is a fork of its worker."""
    require(name)
    program = (
        "from pathlib import Path\n"
        "from analysis.engines.run import EngineRun, run_ahead\n"
        "from analysis.scene.shipped_scenes import make\n"
        "if __name__ == '__main__':\n"
        f"    scene = make('arch', 100).with_run(**{LONG!r})\n"
        "    scenes = [scene, scene.model_copy(update={'name': 'other'})]\n"
        f"    run_ahead([EngineRun.of(one, {name!r}, Path('out')) for one in scenes], processes=2)\n"
    )
    process = started(program, tmp_path)
    assert wait(lambda: len(list(tmp_path.glob("out/*/.*/bodies.dump"))) == 2)
    assert len(working_in(tmp_path)) >= 5
    process.kill()
    with process.stderr as constrained:  # until the last of them has ended
        constrained.read()  # Python warns of the semaphores that a killed process leaves
    process.wait(300)
    assert wait(lambda: not working_in(tmp_path), 10.0), working_in(tmp_path)


@pytest.mark.parametrize("name", ENGINES)
def test_two_runs_into_one_folder_at_the_same_time(tmp_path, name):
    """The second waits and takes what the first has made."""
    require(name)
    make("arch", 100).with_run(duration_s=2.0, frames=10).write(tmp_path)
    command = "from analysis.cli import main; main()"
    both = [started(command, tmp_path, "run", "arch.toml", "--engine", name) for _ in range(2)]
    sentences = [process.communicate(timeout=600)[1] for process in both]
    assert [process.returncode for process in both] == [0, 0], sentences
    (folder,) = (tmp_path / "out/arch").iterdir()
    assert (folder / "run.json").exists()


def test_a_run_whose_dump_is_damaged_is_run_again(tmp_path):
    require("lammps")
    scene = read_scene("pair").with_run(duration_s=0.05, frames=100)
    stiffnesses = [1e5, 2e5]
    assert len(study(scene, ["lammps"], stiffnesses, tmp_path).comparisons) == 2
    folder = run_folder(tmp_path, scene.with_contact(stiffness_N_per_m=2e5), "lammps")
    dump = folder / "bodies.dump"
    full = dump.read_text()
    dump.write_text(full[: len(full) // 2])
    made = study(scene, ["lammps"], stiffnesses, tmp_path)
    assert len(made.comparisons) == 2
    assert not made.failures
    assert dump.read_text() == full


@pytest.mark.parametrize(
    ("name", "limit", "says"),
    [
        ("lammps", "-f 200", r"a file became larger than is allowed \(ulimit -f\)"),
        ("yade", "-f 200", "File too large"),
        ("lammps", "-t 4", r"it used more CPU time than is allowed \(ulimit -t\)"),
    ],
)
def test_a_limit_of_the_system_is_named(tmp_path, name, limit, says):
    require(name)
    make("arch", 500).with_run(duration_s=60.0, frames=600).write(tmp_path)
    program = (
        "import os, resource, sys\n"
        "from pathlib import Path\n"
        "from analysis.engines import EngineError\n"
        "from analysis.engines.run import run_engine\n"
        "from analysis.scene.scene import read_scene\n"
        # the history of the user's IPython, which YADE opens, may be larger than the limit
        "os.environ['IPYTHONDIR'] = os.path.abspath('ipython')\n"
        "kind, most = sys.argv[2:]\n"
        "if kind == '-f':\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (int(most) * 1024,) * 2)\n"
        "try:\n"
        "    scene = read_scene('arch.toml')\n"
        "    if kind == '-t':\n"
        "        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])\n"
        "        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + int(most), 1000))\n"
        "    run_engine(scene, sys.argv[1], Path('run'))\n"
        "except EngineError as error:\n"
        "    sys.exit(str(error))\n"
    )
    process = started(program, tmp_path, name, *limit.split())
    _, message = process.communicate(timeout=600)
    assert process.returncode == 1
    assert re.search(says, message), message
    assert "time step" not in message
    assert ".next" not in message
    assert "run_engine" not in message


def test_a_file_that_cannot_be_written_is_named_as_it_would_be(tmp_path):
    require("lammps")
    scene = read_scene("pair").with_run(duration_s=0.01, frames=10)
    earlier, link = tmp_path / "elsewhere", tmp_path / "run"
    earlier.mkdir()
    link.symlink_to(earlier)
    simulate(scene, "lammps", link)
    assert link.is_symlink()
    assert (earlier / "run.json").exists()
    with pytest.raises(OSError, match="No space") as caught, staged(tmp_path / "new") as staging:
        raise OSError(errno.ENOSPC, "No space left on device", str(staging / "bodies.dump"))
    assert caught.value.filename == str(tmp_path / "new/bodies.dump")


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    """LAMMPS ends with status 0 where its dumps are cut off by a full disk."""
    require("lammps")
    scene = read_scene("pair").with_run(duration_s=0.01, frames=10)
    # there is room when the run begins, and none when it ends
    free = iter([10**12])
    monkeypatch.setattr("shutil.disk_usage", lambda folder: SimpleNamespace(free=next(free, 0)))
    monkeypatch.setattr(
        "analysis.engines.run.check_bodies",
        lambda path, record, scene: (_ for _ in ()).throw(garbage(record, "a frame is missing")),
    )
    with pytest.raises(EngineError, match="pair: no space is left on the disk of "):
        simulate(scene, "lammps", tmp_path / "run")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("status", "last", "says"),
    [
        (-9, [], "it was killed, perhaps since memory ran out"),
        (None, [], "it was killed, perhaps since memory ran out"),
        (256 - 25, [], r"a file became larger than is allowed \(ulimit -f\)"),
        (128 + 24, [], r"it used more CPU time than is allowed \(ulimit -t\)"),
        (
            1,
            ["ERROR: Lost atoms: original 20 current 18 (../thermo.cpp:494)"],
            "20 at the start, 18",
        ),
        (
            1,
            [
                "ERROR on proc 0: Cannot open dump file {}/pairs.dump (../src/dump.cpp:601)",
                "Last command: dump pairs",
            ],
            r"status 1 and said: ERROR on proc 0: Cannot open dump file pairs\.dump$",
        ),
        (3, ["GUARD nonsense at t = 1 s (step 3): x"], "status 3 and said: GUARD nonsense"),
        (3, ["GUARD speed at t = soon s (step 3): x"], "status 3 and said: GUARD speed"),
        (7, ["a last word"], "it ended with status 7 and said: a last word$"),
        (7, [], "it ended with status 7$"),
    ],
)
def test_how_an_engine_ended_in_words(tmp_path, status, last, says):
    end = died(RECORD, status, 5, [line.format(tmp_path) for line in last], tmp_path)
    assert re.search(says, end.record.reason), end.record.reason
    assert str(end).startswith("lammps, pair, after t = 5e-05 s (step 5): ")
    assert "smaller time step" not in str(end) or "Lost" in str(last)


FAKE = r"""#!/bin/sh
[ "$1" = --version ] && { echo "Yade version: fake"; exit; }
sleep 1000 &
head -c 20000000 /dev/zero
printf '\n%06000d 1.0 5 \nRESUMED at t = soon s\n' 7
printf 'error \033[31m\007 red\n' >&2
exit 5
"""


def test_an_engine_that_says_nonsense_and_leaves_a_process_behind(tmp_path, monkeypatch):
    """20 MB without an end of line, a step of 6,000 digits, a time that is none, control
    characters, and a child that holds the output open."""
    fake = tmp_path / "bin" / "yade"
    fake.parent.mkdir()
    fake.write_text(FAKE)
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{fake.parent}:{os.environ['PATH']}")
    begin = time.monotonic()
    says = r"yade, pair, after t = 0 s \(step 0\): it ended with status 5 and said: error \?\[31m\? red$"
    with pytest.raises(EngineError, match=says):
        simulate(read_scene("pair"), "yade", tmp_path / "run")
    assert time.monotonic() - begin < 60
    assert not working_in(tmp_path)


def test_a_killed_lammps_leaves_no_shared_memory_behind_the_next_run(tmp_path):
    """A container has 64 MB of it, and each LAMMPS takes one."""
    require("lammps")
    shared = Path("/dev/shm")
    lammps = subprocess.Popen(
        [LAMMPS.find()], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, process_group=0
    )

    def segments():
        found = []
        for path in shared.glob("mpich_shm_*"):
            try:
                if os.getpgid(int(path.name.split("_")[2], 16)) == lammps.pid:
                    found.append(path)
            except ProcessLookupError:
                pass
        return found

    left = wait(segments)
    assert left
    LAMMPS.write_input(make("pair"), tmp_path / "while it works")
    assert segments() == left
    os.killpg(lammps.pid, signal.SIGKILL)
    lammps.communicate()
    assert all(path.exists() for path in left)
    selected = Path("/proc") / str(int(left[0].name.split("_")[2], 16)) / "maps"
    assert wait(lambda: not selected.exists() or not selected.read_text())  # the killed one is dead
    LAMMPS.write_input(make("pair"), tmp_path / "decks")
    assert not any(path.exists() for path in left)


def test_a_lammps_may_end_while_it_is_looked_at(tmp_path, monkeypatch):
    left = tmp_path / "shared" / "mpich_shm_3fffff_0"  # no process has such a number
    left.parent.mkdir()
    left.touch()
    monkeypatch.setattr(lammps_engine, "SHARED", left.parent)
    ever = Path.exists
    monkeypatch.setattr(Path, "exists", lambda path: "/proc/" in str(path) or ever(path))
    LAMMPS.write_input(make("pair"), tmp_path / "decks")
    assert not left.exists()
