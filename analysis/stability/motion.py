"""What an engine's dumps hold, measured without asking the engine: energy, momentum, overlap,
disks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.dumps.reader import DumpError, index_dump
from analysis.scene.scene import Scene
from analysis.stability.case import Cell, Outcome, Value
from analysis.stability.trial import Trial, guard_says
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats

# More energy than the start had, as a share of it, that rounding and a sound time step do not make.
GAIN = 0.05
# The momentum of a crowd on which nothing acts, over Σm|u|: forces are equal and opposite to the
# last digit.
DRIFT = 1e-9
QUANTITIES = (
    "largest energy / energy at the start",
    "largest overlap / radius",
    "disks in the last frame",
    "change of momentum / Σm|u|",
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Frames of a trial that can be read (f of them).

    time (f,) s; position and velocity (f,n,2) m, m/s; spin (f,n) rad/s; kinetic and elastic energy
    (f,) J: ½mu² and Σ½k·overlap² of the linear law, from the positions; overlap (f,): the largest
    over the smaller radius. drift: the largest change of Σmu over the largest Σm|u|, NaN where
    walls or a drive act. disks: how many the last frame has. trouble: why later frames are not
    here, "" if all are."""

    time: Floats
    position: Floats
    velocity: Floats
    spin: Floats
    kinetic: Floats
    elastic: Floats
    overlap: Floats
    drift: float
    disks: int
    trouble: str

    @property
    def energy(self) -> Floats:
        """Kinetic and elastic energy (f,) J."""
        total: Floats = self.kinetic + self.elastic
        return total

    @property
    def gain(self) -> float:
        """Largest energy of a frame over that of the first; NaN without frames."""
        if not len(self.time) or not self.energy[0] > 0:
            return float("nan")
        return float(np.nanmax(self.energy) / self.energy[0])


def read_motion(trial: Trial, scene: Scene) -> Motion:
    """What bodies.dump of a trial holds, as far as it can be read and is finite."""
    n = len(scene.snapshot)
    rows: list[tuple[float, Floats, Floats, float, float, float]] = []
    spins: list[Floats] = []
    disks, trouble = n, ""
    try:
        index = index_dump(trial.folder / "bodies.dump")
        for frame, (step, count) in enumerate(zip(index.steps, index.counts, strict=True)):
            disks = count
            if count != n:
                trouble = (
                    f"{n - count} of {n} disks are gone at t = {step * trial.time_step_s:.3g} s"
                )
                break
            table = index.table(frame)
            columns = [index.columns.index(name) for name in ("id", "x", "y", "vx", "vy", "omegaz")]
            chosen = table[:, columns]
            if not np.isfinite(chosen).all():
                disks = int(np.isfinite(chosen).all(1).sum())
                trouble = f"not a finite number at t = {step * trial.time_step_s:.3g} s"
                break
            chosen = chosen[np.argsort(chosen[:, 0], kind="stable")]
            spins.append(chosen[:, 5])
            rows.append(
                (step * trial.time_step_s, *_measure(scene, chosen[:, 1:3], chosen[:, 3:5]))
            )
        if not trouble and index.steps[-1] < trial.steps:
            trouble = f"ended at step {index.steps[-1]} of {trial.steps}"
    except DumpError as error:
        trouble = str(error).replace(str(trial.folder), "").lstrip("/")
    velocity = np.array([row[2] for row in rows]).reshape(-1, n, 2)
    return Motion(
        time=np.array([row[0] for row in rows]),
        position=np.array([row[1] for row in rows]).reshape(-1, n, 2),
        velocity=velocity,
        spin=np.array(spins).reshape(-1, n),
        kinetic=np.array([row[3] for row in rows]),
        elastic=np.array([row[4] for row in rows]),
        overlap=np.array([row[5] for row in rows]),
        drift=float("nan") if scene.walls or scene.drive else _drift(scene.snapshot.mass, velocity),
        disks=disks,
        trouble=trouble,
    )


def _drift(mass: Floats, velocity: Floats) -> float:
    """Largest |Σmu(t) − Σmu(0)| over the largest Σm|u|, of velocities (f,n,2) m/s; 0 where nothing
    moves."""
    momentum = (mass[:, None] * velocity).sum(1)
    size = (mass * np.hypot(velocity[..., 0], velocity[..., 1])).sum(1).max(initial=0.0)
    change = float(np.abs(momentum - momentum[:1]).max(initial=0.0))
    return change / float(size) if size else 0.0


def _measure(
    scene: Scene, position: Floats, velocity: Floats
) -> tuple[Floats, Floats, float, float, float]:
    """Position, velocity, kinetic and elastic energy (J), largest overlap over the smaller
    radius."""
    start = scene.snapshot
    kinetic = 0.5 * float(start.mass @ (velocity**2).sum(1))
    snapshot = Snapshot(position=position, velocity=velocity, radius=start.radius, mass=start.mass)
    try:
        contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    except ValueError:
        # two centres, or a centre and a wall, coincide
        return position, velocity, kinetic, float("nan"), 2.0
    elastic = 0.5 * scene.contact.stiffness_N_per_m * float((contacts.gap**2).sum())
    smaller = start.radius[contacts.first].copy()
    pairs = ~contacts.is_wall
    smaller[pairs] = np.minimum(smaller[pairs], start.radius[contacts.second[pairs]])
    return position, velocity, kinetic, elastic, float((-contacts.gap / smaller).max(initial=0.0))


def lost(trial: Trial, motion: Motion) -> str:
    """Why disks count as lost: gone from the dump, nowhere, or lost by the engine's own words; ""
    where none is."""
    if "gone" in motion.trouble or "finite" in motion.trouble:
        return motion.trouble
    return last_error(trial) if "ost atoms" in trial.last_words else ""


def last_error(trial: Trial) -> str:
    """The last line in which the engine speaks of an error, "" where it does not."""
    lines = [line.strip() for line in trial.last_words.splitlines() if "error" in line.lower()]
    return lines[-1] if lines else ""


def common_cell(
    column: Value, row: Value, trial: Trial, motion: Motion, outcome: Outcome, reason: str
) -> Cell:
    """A cell with the QUANTITIES, after what overrides any other outcome: disks that are lost, a
    run that ended early."""
    if lost(trial, motion):
        outcome, reason = Outcome.LOST, lost(trial, motion)
    elif motion.trouble and motion.gain > 1 + GAIN:
        outcome, reason = (
            Outcome.ENERGY_GAIN,
            f"{motion.trouble}, with {motion.gain:.3g} times the energy",
        )
    elif motion.trouble:
        outcome, reason = Outcome.REFUSED, f"{motion.trouble}: {last_error(trial)}"
    elif outcome is Outcome.STABLE and motion.drift > DRIFT:
        outcome, reason = Outcome.INACCURATE, f"momentum changed by {motion.drift:.2g} of Σm|u|"
    overlap = float(motion.overlap.max()) if len(motion.overlap) else float("nan")
    return Cell(
        column=column,
        row=row,
        outcome=outcome,
        reason=reason,
        said=trial.status,
        numbers=(motion.gain, overlap, float(motion.disks), motion.drift),
        guard="" if outcome is Outcome.STABLE else guard_says(trial),
        reused=trial.reused,
    )


def undriven_cell(column: Value, row: Value, trial: Trial, motion: Motion) -> Cell:
    """A cell of a crowd that nothing drives: stable as long as its energy does not grow by more
    than GAIN."""
    if motion.gain > 1 + GAIN:
        when = motion.time[int(np.argmax(motion.energy > (1 + GAIN) * motion.energy[0]))]
        outcome = Outcome.ENERGY_GAIN
        reason = f"{motion.gain:.3g} times the energy of the start; beyond {1 + GAIN:g} from t = {when:.3g} s"
    else:
        outcome, reason = Outcome.STABLE, f"energy at most {motion.gain:.4g} of the start's"
    return common_cell(column, row, trial, motion, outcome, reason)


def rigid_cell(column: Value, row: Value, outcome: Outcome, reason: str, said: str) -> Cell:
    """A cell of what runs no engine (the product's own checks, percussions): it has none of the
    QUANTITIES."""
    nothing = (float("nan"),) * len(QUANTITIES)
    return Cell(column=column, row=row, outcome=outcome, reason=reason, said=said, numbers=nothing)


def refused_cell(column: Value, row: Value, why: Exception) -> Cell:
    """A cell of something that the product turned down before anything ran."""
    return rigid_cell(column, row, Outcome.REFUSED, str(why), "refused")
