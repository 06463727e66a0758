"""What the command says while it works, and how it ends whatever is raised."""

import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import version

import pytest

from analysis.cli import app, main
from analysis.scene import scene as scene_module
from tests.forked import PROGRAM, ROOT, python


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.2, "1 s"),
        (89, "89 s"),
        (100, "2 min"),
        (3 * 3600, "3 h"),
        (4 * 86400, "4 days"),
        (1e12, "3.2e+04 years"),
    ],
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
        (MemoryError(), 1, "out of memory; fewer disks, frames or workers need less"),
        (KeyboardInterrupt(), 130, "interrupted; earlier results are untouched"),
        (IndexError("list index"), 70, "a mistake in crowd-percussions, IndexError: list index; .*"),
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
    _, said = process.communicate(timeout=300)
    assert process.returncode in (130, 1)
    assert "Traceback" not in said
    assert len(said.splitlines()) == 1, said


def test_a_run_imports_little():
    """The parent of a run reads its scene, says its price and starts the engine."""
    program = (
        "import sys, analysis.cli.commands; few = 'rich' in sys.modules\n"
        "import analysis.advice.library, analysis.engines.run\n"
        "print(few, sorted(set(sys.modules) & set(sys.argv[1:])))"
    )
    heavy = ("MDAnalysis", "matplotlib", "pandas", "scipy.linalg", "scipy.optimize", "scipy.sparse")
    assert python(program, *heavy).stdout == "False []\n"
