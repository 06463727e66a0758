"""A trial: an engine run without its guard, kept with its exit status whatever it left behind.

`analysis.compare.study.run_engine` has the guard stop a run that cannot be right; here such runs
are what is looked for."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from analysis.engines import lammps, yade
from analysis.engines.guard import Verdict
from analysis.engines.penalty import penalty_of
from analysis.engines.record import EngineError
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.support.files import write_text

LONGEST_S = 60.0
LAST_WORDS = 400
FILE = "trial.json"
ENGINES = (lammps.NAME, yade.NAME)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """A change to a copy of the engine's own input: in `file`, `old` (there exactly once) becomes
    `new`."""

    file: str
    old: str
    new: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A finished trial: engine, exit status (a word where it had to be killed), last words, time
    step (s), steps, seconds; the dumps are in `folder`. `words` and `environment`: its command,
    without the folder for its results."""

    folder: Path
    engine: str
    status: str
    last_words: str
    time_step_s: float
    steps: int
    seconds: float
    words: list[str]
    environment: dict[str, str]
    reused: bool


def try_engine(scene: Scene, engine: str, folder: Path, edits: Sequence[Edit] = ()) -> Trial:
    """Run the scene's deck or script with the engine's own command, or take the trial in the folder
    if nothing changed.

    Raises EngineError where the engine is missing, ValueError where an edit does not fit.
    """
    if engine not in ENGINES:
        raise EngineError(f"unknown engine {engine!r}; there are: {', '.join(ENGINES)}")
    module = lammps if engine == lammps.NAME else yade
    command = module.find()
    if command is None:
        raise EngineError(module.INSTALL)
    source = lammps.decks_folder() if engine == lammps.NAME else yade.scripts_folder()
    inputs = {
        path.name: path.read_text(encoding="utf-8") for path in sorted(source.glob("*.[ip][ny]*"))
    }
    for edit in edits:
        if inputs.get(edit.file, "").count(edit.old) != 1:
            raise ValueError(f"edit: {edit.file} does not hold {edit.old!r} exactly once")
        inputs[edit.file] = inputs[edit.file].replace(edit.old, edit.new)
    digest = hashlib.sha256(
        json.dumps([scene.digest(), str(command), command.stat().st_mtime, inputs]).encode()
    ).hexdigest()
    penalty = penalty_of(scene)
    if found := kept(folder / FILE, digest):
        return Trial(**{**found, "folder": folder, "reused": True})
    if folder.exists():
        shutil.rmtree(folder)
    decks = folder / "input"
    decks.mkdir(parents=True)
    for name, text in inputs.items():
        (decks / name).write_text(text, encoding="utf-8")
    scene.model_copy(update={"name": "scene"}).write(folder)
    if engine == lammps.NAME:
        write_text(decks / "scene.in", lammps.scene_deck(scene))
        given = {"decks": "input", "deck": "input/scene.in", "data": "scene.data"}
        given["dt"] = repr(penalty.time_step)
        words = [str(command), "-in", "input/crowd.in", "-log", "none", "-nonbuf"]
        words += [word for name, value in given.items() for word in ("-var", name, value)]
        environment = {"OMP_NUM_THREADS": "1"}
    else:
        words = [str(command), "-L", "noserver", "-j1", "-n", "-x", "input/crowd.py"]
        words += ["scene.toml", f"dt={penalty.time_step!r}"]
        environment = {
            "PYTHONPATH": str(decks.absolute()),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
        }
    started = time.perf_counter()
    status, said = _run([*words, *_options(engine, ".", "no")], folder, environment)
    trial = Trial(
        folder=folder,
        engine=engine,
        status=status,
        last_words=said,
        time_step_s=penalty.time_step,
        steps=penalty.steps,
        seconds=time.perf_counter() - started,
        words=words,
        environment=environment,
        reused=False,
    )
    keep(folder / FILE, digest, {**asdict(trial), "folder": None})
    return trial


def guard_says(trial: Trial) -> str:
    """What the guard of the product's own runs makes of the same run: the kind of its verdict
    (energy, overlap, …), the engine's own end, or "nothing" where the run goes through; kept beside
    the trial."""
    said = trial.folder / "guard.txt"
    if not said.exists():
        (trial.folder / "guarded").mkdir(exist_ok=True)
        options = _options(trial.engine, "guarded", "yes")
        status, _ = _run([*trial.words, *options], trial.folder, trial.environment, "guarded.log")
        with (trial.folder / "guarded.log").open(encoding="utf-8", errors="replace") as log:
            verdict = Verdict.of(log)
        words = verdict.kind if verdict else ("nothing" if status == "0" else f"status {status}")
        shutil.rmtree(trial.folder / "guarded")
        write_text(said, words)
    return said.read_text(encoding="utf-8")


def _options(engine: str, out: str, guard: str) -> list[str]:
    if engine == lammps.NAME:
        return ["-var", "out", out, "-var", "guard", guard]
    return [f"out={out}", f"guard={guard}"]


def _run(
    words: Sequence[str], folder: Path, environment: dict[str, str], log_name: str = "screen.log"
) -> tuple[str, str]:
    """Exit status and last words of a command; the whole group of its processes ends with this
    call."""
    with (folder / log_name).open("w", encoding="utf-8") as log:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            status = str(process.wait(timeout=LONGEST_S))
        except subprocess.TimeoutExpired:
            status = f"none after {LONGEST_S:g} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    text = (folder / log_name).read_text(encoding="utf-8", errors="replace")
    return status, text[-LAST_WORDS:].strip()
