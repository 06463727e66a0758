"""A trial: an engine run without its guard, kept with its exit status whatever it left behind.

`analysis.engines.run.run_engine` has the guard stop a run that cannot be right; here such runs are
what is looked for."""

import hashlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from analysis.engines import PENALTY as KNOWN
from analysis.engines import engine as engine_of
from analysis.engines import installed
from analysis.engines.guard import Verdict
from analysis.engines.penalty import penalty_of
from analysis.engines.process import SCREEN, run_command
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.support.files import write_text

LONGEST_S = 60.0
LAST_WORDS = 400
FILE = "trial.json"
DECKS, GUARDED = "input", "guarded"
ENGINES = tuple(known.NAME for known in KNOWN)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """A change to a copy of the engine's own input: in `file`, `old` (there exactly once) becomes
    `new`."""

    file: str
    old: str
    new: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A finished trial.

    folder: of its dumps; engine: name; status: exit status, in words where it had to be killed;
    last_words: the end of what the engine said; time_step_s: s; steps: number; seconds: s, wall;
    reused: whether it was taken from an earlier build.
    """

    folder: Path
    engine: str
    status: str
    last_words: str
    time_step_s: float
    steps: int
    seconds: float
    reused: bool


def try_engine(scene: Scene, engine: str, folder: Path, edits: Sequence[Edit] = ()) -> Trial:
    """Run the scene's deck or script with the engine's own command, or take the trial in the folder
    if nothing changed.

    Raises EngineError where the engine is missing, ValueError where an edit does not fit.
    """
    chosen = engine_of(engine)
    chosen.check(scene)
    depends = [scene.digest(), installed(engine), chosen.deck_digest(), *map(asdict, edits)]
    digest = hashlib.sha256(json.dumps(depends).encode()).hexdigest()
    if found := kept(folder / FILE, digest):
        return Trial(**{**found, "folder": folder, "reused": True})
    if folder.exists():
        shutil.rmtree(folder)
    scene.model_copy(update={"name": "scene", "other_frames": None}).write(folder)
    chosen.write_input(scene, folder / DECKS)
    for edit in edits:
        file = folder / DECKS / edit.file
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
        if text.count(edit.old) != 1:
            raise ValueError(f"edit: {edit.file} does not hold {edit.old!r} exactly once")
        write_text(file, text.replace(edit.old, edit.new))
    penalty = penalty_of(scene)
    command = chosen.command(folder, penalty.time_step, decks=DECKS, guard=False)
    ended = run_command(command, folder, longest_s=LONGEST_S)
    said = (folder / SCREEN).read_text(encoding="utf-8", errors="replace")
    trial = Trial(
        folder=folder,
        engine=engine,
        status=_words(ended.status),
        last_words=said[-LAST_WORDS:].strip(),
        time_step_s=penalty.time_step,
        steps=penalty.steps,
        seconds=ended.wall_seconds,
        reused=False,
    )
    keep(folder / FILE, digest, {**asdict(trial), "folder": None})
    return trial


def guard_says(trial: Trial) -> str:
    """Return what the guard of the product's own runs makes of the same run: the kind of its
    verdict (energy, overlap, …), the engine's own end, or "nothing" where the run goes through;
    kept beside the trial."""
    said = trial.folder / "guard.txt"
    if not said.exists():
        (trial.folder / GUARDED).mkdir(exist_ok=True)
        command = engine_of(trial.engine).command(
            trial.folder, trial.time_step_s, decks=DECKS, out=GUARDED
        )
        log = f"{GUARDED}.log"
        ended = run_command(command, trial.folder, screen=log, longest_s=LONGEST_S)
        with (trial.folder / log).open(encoding="utf-8", errors="replace") as lines:
            verdict = Verdict.of(lines)
        status = _words(ended.status)
        words = verdict.kind if verdict else ("nothing" if status == "0" else f"status {status}")
        shutil.rmtree(trial.folder / GUARDED)
        write_text(said, words)
    return said.read_text(encoding="utf-8")


def _words(status: int | None) -> str:
    return f"none after {LONGEST_S:g} s" if status is None else str(status)
