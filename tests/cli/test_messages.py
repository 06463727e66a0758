"""What the command says while it works, and how it ends whatever is raised. The doctor against
what is really there, and in an environment where things are missing."""

import importlib.metadata
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest

from analysis.cli import app, main
from analysis.engines import LAMMPS, why_not
from analysis.engines.doctor import examine
from analysis.scene import scene as scene_module
from tests.forked import PROGRAM, ROOT, python


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.2, "1 s"), (89, "89 s"), (100, "2 min"), (3 * 3600, "3 h"), (4 * 86400, "4 days"),
        (1e12, "3.2e+04 years"), ],
)
def test_durations(seconds, words):
    assert app.lasting(seconds) == words


def test_a_line_every_few_seconds_where_there_is_no_terminal(monkeypatch, capsys):
    monkeypatch.setattr(app, "BETWEEN_LINES_S", 0.05)
    with app.progress() as report:
        time.sleep(0.15)
        report("frames", 0.0)
        time.sleep(0.15)
        report("frames", 0.5)
        time.sleep(0.1)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "0%, 1 s so far"
    assert "frames: 0%, 1 s so far" in lines
    assert re.fullmatch(r"frames: 50%, 1 s so far, about \S+ s to go", lines[-1])
    time.sleep(0.1)
    assert not capsys.readouterr().err


def test_the_time_to_go_follows_the_measured_pace_and_ends_with_it(monkeypatch):
    """97 % after 30 s and a last task of another 35 s: the pace knows of the first second only."""
    clock = iter([0.0, 10.0, 25.0, 40.0])
    monkeypatch.setattr(app.time, "monotonic", lambda: next(clock))
    lines = app._Lines()
    lines.report("runs", 0.5)  # of those before nobody knows how long they took
    assert lines.line(20.0) == "runs: 50%, 20 s so far"
    lines.report("runs", 0.8)
    assert lines.line(25.0) == "runs: 80%, 25 s so far, about 10 s to go"
    assert lines.line(31.0) == "runs: 80%, 31 s so far, about 4 s to go"
    lines.report("runs", 0.97)
    assert lines.line(41.0) == "runs: 97%, 41 s so far, about 1 s to go"
    assert lines.line(75.0) == "runs: 97%, 75 s so far"


def test_long_work_is_announced(capsys):
    app.say_expected(3.0, "ten runs")
    assert not capsys.readouterr().err
    app.say_expected(600.0, "ten runs", 2)
    assert capsys.readouterr().err == "ten runs: about 5 min\n"


def test_version(alone):
    made = alone("--version")
    assert made.stdout == f"percussions {version('crowd-percussions')}\n"


def test_help_does_not_wait_for_libraries(percussions):
    """Nothing heavy is imported before it is needed: so the start takes 0.3 s, not 4."""
    program = (
        "import sys\nfrom analysis.cli import main\ntry:\n    main()\nfinally:\n"
        "    print(sorted({name.partition('.')[0] for name in sys.modules}))"
    )
    made = python(program, "--help")
    *shown, modules = made.stdout.splitlines()
    assert any("stability" in line for line in shown)
    for heavy in ("numpy", "scipy", "MDAnalysis", "pydantic", "matplotlib", "nscd"):
        assert f"'{heavy}'" not in modules


@pytest.mark.parametrize(
    ("raised", "status", "says"),
    [
        (ValueError("field: 3 is\n  too much"), 1, "field: 3 is too much"),
        (FileNotFoundError(2, "No such file or directory", "x"), 1, "x: No such file or directory"),
        (OSError("odd"), 1, "odd"),
        (MemoryError(), 1, "out of memory. Fewer disks, frames or workers need less"),
        (KeyboardInterrupt(), 130, "interrupted. Earlier results are untouched"),
        (IndexError("list index"), 70, "a mistake in crowd-percussions, IndexError: list index\\. .*"),
        (OverflowError("too large"), 70, "a mistake in crowd-percussions, OverflowError: .*"),
        (RecursionError("deep"), 70, "a mistake in crowd-percussions, RecursionError: .*"),
    ],
)  # fmt: skip
def test_whatever_is_raised_is_one_line(monkeypatch, capsys, raised, status, says):
    def read(name):
        raise raised

    monkeypatch.setattr(scene_module, "read_scene", read)
    monkeypatch.setattr("sys.argv", ["percussions", "run", "pair"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == status
    assert re.fullmatch(f"percussions: {says}\n", capsys.readouterr().err)


def test_a_mistake_in_the_program_can_be_looked_at(monkeypatch):
    monkeypatch.setattr(scene_module, "read_scene", lambda name: [][0])
    monkeypatch.setattr("sys.argv", ["percussions", "--traceback", "run", "pair"])
    with pytest.raises(IndexError):
        main()


@pytest.mark.parametrize("after", [0.0, 0.1, 0.3, 0.6, 1.0, 1.5])
def test_an_interrupt_while_libraries_are_imported(tmp_path, after):
    program = f"import signal, sys; print('here', flush=True); {PROGRAM}"
    process = subprocess.Popen(
        [sys.executable, "-c", program, "run", "nowhere"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "here\n"
    # Python itself still reads the package's first lines before `main` begins
    time.sleep(0.05 + after)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=300)
    assert process.returncode in (130, 1)
    assert "Traceback" not in message
    assert len(message.splitlines()) == 1, message


def test_an_interrupt_that_an_import_makes_another_error_of(monkeypatch, capsys):
    def imported(**_):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise SystemError("initialization of a module failed") from None

    monkeypatch.setattr("analysis.cli.commands.app", imported)
    monkeypatch.setattr("sys.argv", ["percussions", "doctor"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 130
    assert "interrupted" in capsys.readouterr().err


def test_a_run_imports_little():
    """The parent of a run reads its scene, says its price and starts the engine."""
    program = (
        "import sys, analysis.cli.commands; few = 'rich' in sys.modules\n"
        "import analysis.engines.price, analysis.engines.run\n"
        "print(few, sorted(set(sys.modules) & set(sys.argv[1:])))"
    )
    heavy = ("MDAnalysis", "matplotlib", "pandas", "scipy.linalg", "scipy.optimize", "scipy.sparse")
    assert python(program, *heavy).stdout == "False []\n"


def findings():
    return {finding.name: finding for finding in examine()}


def test_finds_what_runs_here():
    found = findings()
    assert found["Python"].version == ".".join(map(str, sys.version_info[:3]))
    assert found["LAMMPS"].state == "ok"
    assert (
        found["LAMMPS"].version
        in subprocess.run(
            [found["LAMMPS"].path, "-h"], capture_output=True, text=True, check=True
        ).stdout
    )
    for name in ("MDAnalysis", "scipy", "PedPy"):
        assert found[name].state == "ok"
        assert found[name].version == importlib.metadata.version(name)
        assert found[name].path.is_dir()
    assert (found["scipy"].extra, found["PedPy"].extra) == ("", "real")


def test_yade_is_found_where_it_is_installed():
    if shutil.which("yade") is None:
        pytest.skip("YADE is not installed")
    yade = findings()["YADE"]
    assert yade.state == "ok"
    assert yade.version
    assert yade.version[:4].isdigit()


def test_missing_programs_have_advice(monkeypatch, tmp_path):
    """A PATH without anything on it, and a Python without an lmp beside it."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    found = findings()
    assert found["LAMMPS"].state == "optional"
    assert 'pip install "crowd-percussions[engines]"' in found["LAMMPS"].advice
    assert found["YADE"].state == "optional"
    assert "LAMMPS only" in found["YADE"].advice
    assert "apt-get install" in found["YADE"].advice
    assert found["Chromium"].state == "optional"
    assert found["Chromium"].version is None


def test_a_lammps_that_does_not_start_counts_as_none(monkeypatch, tmp_path):
    broken = tmp_path / "lmp"
    broken.write_text(
        "#!/bin/sh\necho 'libmpi.so.12: cannot open shared object file' >&2\nexit 127\n"
    )
    broken.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert LAMMPS.find() == Path(broken)
    finding = findings()["LAMMPS"]
    assert finding.state == "optional"
    assert "libmpi.so.12" in finding.advice


def test_an_engine_that_is_killed_is_quoted_with_what_it_said_before(tmp_path):
    """As LAMMPS' MPI ends where it finds no shared memory."""
    program = tmp_path / "lmp"
    program.write_text("#!/bin/sh\necho Shared memory error\nkill -TERM $$\n")
    program.chmod(0o755)
    broken = SimpleNamespace(find=lambda: program, ASK="-h")
    assert why_not(broken) == (
        f"{program} does not start (Shared memory error; it was told to end)"
    )
