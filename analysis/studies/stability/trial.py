"""A trial: an engine run without its guard, what its dumps hold, and the cell that this makes."""

import hashlib
import json
import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from analysis.dumps import DumpError, index_dump
from analysis.engines import PENALTY as KNOWN
from analysis.engines import engine as engine_of
from analysis.engines import installed
from analysis.engines.guard import verdict_of
from analysis.engines.penalty import penalty_of
from analysis.engines.process import SCREEN, run_command
from analysis.scene.scene import Scene
from analysis.studies.stability.case import ENGINE_QUANTITIES, Cell, Outcome
from analysis.support.cache import cached, store
from analysis.support.files import write_text
from nscd import Percussions, Snapshot, Status, find_contacts
from nscd.arrays import Floats

LONGEST_S = 60.0
LAST_WORDS = 400
FILE = "trial.json"
DECKS, GUARDED = "input", "guarded"
ENGINES = tuple(each.NAME for each in KNOWN)
# A change to a copy of the engine's own input: in this file, a text (there exactly once) becomes
# another.
Edit = tuple[str, str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A finished trial."""

    folder: Path  # of its dumps
    engine: str
    status: str  # exit status, in words where it had to be killed
    last_words: str  # the end of what the engine said
    time_step_s: float
    steps: int
    seconds: float  # s, wall
    reused: bool  # whether it was taken from an earlier build

    @property
    def error(self) -> str:
        """The last line in which the engine speaks of an error, "" where it does not."""
        lines = [line.strip() for line in self.last_words.splitlines() if "error" in line.lower()]
        return lines[-1] if lines else ""


def try_engine(scene: Scene, engine: str, folder: Path, *edits: Edit) -> Trial:
    """Run the scene's deck or script with the engine's own command, or take the trial in the folder
    if nothing changed.

    Raises EngineError where the engine is missing, ValueError where an edit does not fit."""
    chosen = engine_of(engine)
    chosen.check(scene)
    changes = [{"file": file, "old": old, "new": new} for file, old, new in edits]
    depends = [scene.digest(), installed(engine), chosen.deck_digest(), *changes]
    digest = hashlib.sha256(json.dumps(depends).encode()).hexdigest()
    if found := cached(folder / FILE, digest):
        return Trial(**{**found, "folder": folder, "reused": True})
    if folder.exists():
        shutil.rmtree(folder)
    scene.model_copy(update={"name": "scene", "other_frames": None}).write(folder)
    chosen.write_input(scene, folder / DECKS)
    for name, old, new in edits:
        file = folder / DECKS / name
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
        if text.count(old) != 1:
            raise ValueError(f"edit: {name} does not hold {old!r} exactly once")
        write_text(file, text.replace(old, new))
    penalty = penalty_of(scene)
    command = chosen.command(folder, penalty.time_step, decks=DECKS, guard=False)
    ended = run_command(command, folder, longest_s=LONGEST_S)
    output = (folder / SCREEN).read_text(encoding="utf-8", errors="replace")
    trial = Trial(
        folder=folder,
        engine=engine,
        status=_words(ended.status),
        last_words=output[-LAST_WORDS:].strip(),
        time_step_s=penalty.time_step,
        steps=penalty.steps,
        seconds=ended.wall_seconds,
        reused=False,
    )
    store(folder / FILE, digest, {**asdict(trial), "folder": None})
    return trial


def guard_says(trial: Trial) -> str:
    """Return what the guard of the product's own runs makes of the same run: the kind of its
    verdict (energy, overlap, …), the engine's own end, or "nothing" where the run goes through;
    kept beside the trial."""
    verdict_file = trial.folder / "guard.txt"
    if not verdict_file.exists():
        (trial.folder / GUARDED).mkdir(exist_ok=True)
        engine = engine_of(trial.engine)
        command = engine.command(trial.folder, trial.time_step_s, decks=DECKS, out=GUARDED)
        log = f"{GUARDED}.log"
        ended = run_command(command, trial.folder, screen=log, longest_s=LONGEST_S)
        with (trial.folder / log).open(encoding="utf-8", errors="replace") as lines:
            verdict = verdict_of(lines)
        status = _words(ended.status)
        words = verdict[1] if verdict else ("nothing" if status == "0" else f"status {status}")
        shutil.rmtree(trial.folder / GUARDED)
        write_text(verdict_file, words)
    return verdict_file.read_text(encoding="utf-8")


def _words(status: int | None) -> str:
    return f"none after {LONGEST_S:g} s" if status is None else str(status)


COLUMNS = ("id", "x", "y", "vx", "vy", "omegaz")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunFrames:
    """Frames of a trial that can be read (f of them).

    energy, kinetic, overlap: (f,) J, ½mu² + Σ½k·overlap² of the linear law, from the positions;
    the first of the two alone; the largest overlap over the smaller radius."""

    trial: Trial  # the run
    time: Floats  # (f,) s
    position: Floats  # (f,n,2) m
    velocity: Floats  # (f,n,2) m/s
    spin: Floats  # (f,n) rad/s
    energy: Floats
    kinetic: Floats
    overlap: Floats
    drift: float  # the largest change of Σmu over the largest Σm|u|; NaN where walls or a drive act
    disks: int  # how many the last frame has
    lost: bool  # whether disks are gone from the dump, or nowhere
    trouble: str  # why later frames are not here, "" if all are

    @property
    def gain(self) -> float:
        """Largest energy of a frame over that of the first; NaN without frames."""
        if not len(self.time) or not self.energy[0] > 0:
            return float("nan")
        return float(np.nanmax(self.energy) / self.energy[0])


def run_frames(scene: Scene, engine: str, folder: Path, *edits: Edit) -> RunFrames:
    """Run a scene as `try_engine` does, and read what bodies.dump holds, as far as it can be read
    and is finite."""
    trial = try_engine(scene, engine, folder, *edits)
    n = disks = len(scene.snapshot)
    times, tables, lost, trouble = [], [], False, ""
    try:
        index = index_dump(trial.folder / "bodies.dump")
        columns = [index.columns.index(name) for name in COLUMNS]
        for frame, (step, disks) in enumerate(zip(index.steps, index.counts, strict=True)):
            time = step * trial.time_step_s
            if disks != n:
                lost, trouble = True, f"{n - disks} of {n} disks are gone at t = {time:.3g} s"
                break
            table = index.table(frame)[:, columns]
            if not np.isfinite(table).all():
                disks = int(np.isfinite(table).all(1).sum())
                lost, trouble = True, f"not a finite number at t = {time:.3g} s"
                break
            times.append(time)
            tables.append(table[np.argsort(table[:, 0], kind="stable")])
        if not trouble and index.steps[-1] < trial.steps:
            trouble = f"ended at step {index.steps[-1]} of {trial.steps}"
    except DumpError as error:
        trouble = str(error).replace(str(trial.folder), "").lstrip("/")
    every = np.array(tables).reshape(-1, n, len(COLUMNS))
    position, velocity = every[:, :, 1:3], every[:, :, 3:5]
    kinetic = 0.5 * (scene.snapshot.mass @ (velocity**2).sum(2).T)
    pressed = np.array([_pressed(scene, one) for one in position]).reshape(-1, 2)
    return RunFrames(
        trial=trial,
        time=np.array(times),
        position=position,
        velocity=velocity,
        spin=every[:, :, 5],
        energy=kinetic + pressed[:, 0],
        kinetic=kinetic,
        overlap=pressed[:, 1],
        drift=float("nan") if scene.walls or scene.drive else _drift(scene.snapshot.mass, velocity),
        disks=disks,
        lost=lost,
        trouble=trouble,
    )


def _drift(mass: Floats, velocity: Floats) -> float:
    """Largest |Σmu(t) − Σmu(0)| over the largest Σm|u|, of velocities (f,n,2) m/s; 0 where nothing
    moves."""
    momentum = (mass[:, None] * velocity).sum(1)
    size = (mass * np.hypot(velocity[..., 0], velocity[..., 1])).sum(1).max(initial=0.0)
    change = float(np.abs(momentum - momentum[:1]).max(initial=0.0))
    return change / float(size) if size else 0.0


def _pressed(scene: Scene, position: Floats) -> tuple[float, float]:
    """Elastic energy (J), largest overlap over the smaller radius; NaN and 2 where two centres, or
    a centre and a wall, coincide."""
    radius = scene.snapshot.radius
    snapshot = Snapshot(position=position, radius=radius, mass=scene.snapshot.mass)
    try:
        contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    except ValueError:
        return float("nan"), 2.0
    elastic = 0.5 * scene.contact.stiffness_N_per_m * float((contacts.gap**2).sum())
    other = np.where(contacts.is_wall, contacts.first, contacts.second)
    smaller = np.minimum(radius[contacts.first], radius[other])
    return elastic, float((-contacts.gap / smaller).max(initial=0.0))


# More energy than the start had, as a share of it, that rounding and a sound time step do not make.
GAIN = 0.05
# The momentum of a crowd on which nothing acts, over Σm|u|: forces are equal and opposite to the
# last digit.
DRIFT = 1e-9
SOLVERS = ("auto", "interior_point", "active_set", "projected_gradient", "gauss_seidel")
TOLERANCE = 1e-8
# An answer with a residual of TOLERANCE may be further from the truth than that; this far is wrong.
WRONG = 1e-5
SOLVER_QUANTITIES = ("error of u⁺ / |u⁻|", "residual", "iterations")
# Whether it ended so, how, and why.
Ill = tuple[bool, Outcome, str]


def cell(message: str, numbers: tuple[float, ...], well: str, *ills: Ill) -> Cell:
    """Make a cell that ended as the first of the ills that holds; stable, for the reason `well`,
    where none does. message: `said` of `Cell`; numbers: as there."""
    found = ((outcome, why) for holds, outcome, why in ills if holds)
    outcome, reason = next(found, (Outcome.STABLE, well))
    return Cell(outcome=outcome, reason=reason, said=message, numbers=numbers)


def engine_cell(frames: RunFrames, well: str, *ills: Ill, numbers: tuple[float, ...] = ()) -> Cell:
    """Make a cell of a run: as `cell`, with the ENGINE_QUANTITIES where no numbers are given.

    Disks that are lost and a run that ended early override its ills; a momentum that changes counts
    where there is none."""
    trial, gain, trouble = frames.trial, frames.gain, frames.trouble
    overlap = float(frames.overlap.max()) if len(frames.overlap) else float("nan")
    named = trial.error if "ost atoms" in trial.last_words else ""
    found = cell(
        trial.status,
        numbers or (gain, overlap, float(frames.disks), frames.drift),
        well,
        (frames.lost, Outcome.LOST, trouble),
        (bool(named), Outcome.LOST, named),
        (
            bool(trouble) and gain > 1 + GAIN,
            Outcome.ENERGY_GAIN,
            f"{trouble}, with {gain:.3g} times the energy",
        ),
        (bool(trouble), Outcome.REFUSED, f"{trouble}: {trial.error}"),
        *ills,
        (
            frames.drift > DRIFT,
            Outcome.INACCURATE,
            f"momentum changed by {frames.drift:.2g} of Σm|u|",
        ),
    )
    guard = "" if found.outcome is Outcome.STABLE else guard_says(trial)
    return replace(found, guard=guard, reused=trial.reused)


def undriven_cell(frames: RunFrames) -> Cell:
    """Make a cell of a crowd that nothing drives: stable as long as its energy does not grow by
    more than GAIN."""
    gained = f"{frames.gain:.3g} times the energy of the start"
    when = frames.time[frames.energy > (1 + GAIN) * frames.energy[:1]]
    gains = f"{gained}, beyond {1 + GAIN:g} from t = {when[0]:.3g} s" if len(when) else ""
    well = f"energy at most {frames.gain:.4g} of the start's"
    return engine_cell(frames, well, (frames.gain > 1 + GAIN, Outcome.ENERGY_GAIN, gains))


def rigid_cell(message: str, well: str, *ills: Ill) -> Cell:
    """Make a cell of what runs no engine (the product's own checks, percussions): it has none of
    the ENGINE_QUANTITIES."""
    return cell(message, (float("nan"),) * len(ENGINE_QUANTITIES), well, *ills)


def solver_cell(
    solution: Percussions, reference: Floats, scale: float, *ills: Ill, more: tuple[float, ...] = ()
) -> Cell:
    """Make a cell with the SOLVER_QUANTITIES and more: not converged where the residual says so,
    inaccurate where u⁺ differs from the reference (n,2) m/s by more than WRONG of `scale`, the
    largest |u⁻| (m/s), then as the ills say."""
    error = float(np.abs(solution.right_velocity - reference).max()) / (scale or 1.0)
    return cell(
        str(solution.status),
        (error, solution.residual, float(solution.iterations), *more),
        f"u⁺ is right to {error:.2g}",
        (solution.status is not Status.SOLVED, Outcome.NOT_CONVERGED, solution.reason),
        (not error <= WRONG, Outcome.INACCURATE, f"u⁺ is wrong by {error:.2g}"),
        *ills,
    )
