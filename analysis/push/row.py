"""A row of people as disks: pushed by its first, whose motion is given, in LAMMPS and in the rigid
engine.

In one dimension a contact is a gap and nothing else, so all disks are alike, and rows differ by
their gaps. Rows with other inputs lie side by side in one run."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps import index_dump
from analysis.engines import engine
from analysis.engines.process import Command, run_command
from analysis.engines.record import EngineError
from analysis.engines.rigid import TOLERANCE
from analysis.push.trial import Trial
from analysis.scene.lammps_data import write_data
from analysis.support.files import write_text
from analysis.support.shipped import shipped
from nscd import Snapshot, Walls
from nscd.arrays import Floats
from nscd.stepping import Motion, Push

RADIUS_M, BETWEEN_ROWS_M = 0.12, 1.0
# Of those whose motion is given: nobody moves them.
HELD_KG = 1e7
# Time steps: of the rigid engine (s), and of LAMMPS as a share of sqrt(m/k) of the lightest.
RIGID_STEP_S, SOFT_SHARE = 0.008, 0.05
# Farther behind the motion it is given than this, the first is stopped (m).
STOPPED_M = 0.001
# Inputs that are not known. Share of the room between chests that arms fill; times (s) in which
# the floor takes the speed of a person; draws of the depth of chests, the first of them the mean.
ARMS, TAUS_S, DRAWS = (0.0, 0.5, 1.0), (0.1, 0.2, 0.5, 1.0), 8
TAU_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """Hold what is not known of a row, in s cases.

    arms: (s,) share of the room between chests that is bridged from the start: 0 where chests
        meet, 1 where arms touch already
    tau: (s,) s, in which the floor takes a speed
    draw: (s,) which draw of depths; 0 is the mean
    gap: (s, g) m, from the start to contact; the last one at the wall, where there is one
    """

    arms: Floats
    tau: Floats
    draw: Floats
    gap: Floats

    @property
    def central(self) -> Floats:
        """Tell which cases (s,) have the middle floor and mean depths: one for each posture."""
        return np.asarray((self.tau == TAU_S) & (self.draw == 0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moved:
    """Hold what a model makes of the cases.

    along: (s, f, n) m, heads along the row
    largest, impulse: (s,) N and N·s of the contact with the first; NaN where there is none
    """

    along: Floats
    largest: Floats
    impulse: Floats


def inputs_of(trial: Trial, arms: Sequence[float] = ARMS, seed: int = 1) -> Inputs:
    """List all cases: each posture, each floor, each draw of the room between chests (standard
    deviation of the mean of two chests)."""
    room = trial.torso_gap
    error = np.random.default_rng([seed, 5]).normal(0.0, trial.depth_sd, (DRAWS, len(room)))
    error[0] = 0.0
    found = np.array([(a, t, d) for a in arms for t in TAUS_S for d in range(DRAWS)])
    share, tau, draw = found.T
    gap = (1 - share)[:, None] * np.maximum(room + error[draw.astype(int)], 0.0)
    return Inputs(arms=share, tau=tau, draw=draw, gap=gap)


def rigid(trial: Trial, inputs: Inputs) -> Moved:
    """Step the rows as rigid disks that do not rebound (`nscd.stepping`)."""
    frames = len(trial.time)
    along = np.empty((len(inputs.tau), frames, len(trial.mass)))
    impulse = np.full(len(inputs.tau), np.nan)
    for tau in np.unique(inputs.tau):
        chosen = np.flatnonzero(inputs.tau == tau)
        along[chosen], impulse[chosen] = _rigid(trial, inputs.gap[chosen], float(tau))
    impulse[behind(trial, along) > STOPPED_M] = np.nan
    return Moved(along=along, largest=np.full(len(along), np.nan), impulse=impulse)


def behind(trial: Trial, along: Floats) -> Floats:
    """Find how far the first of each case (s, f, n) m falls behind the motion it is given (s,) m:
    rigid people who stand at a wall stop it."""
    return np.asarray((trial.along[:, 0] - along[:, :, 0]).max(1))


def _rigid(trial: Trial, gap: Floats, tau: float) -> tuple[Floats, Floats]:
    """Heads (s, f, n) m and impulses on the second person (s,) N·s of rows on one floor."""
    n, frame = len(trial.mass), float(trial.time[1])
    disks, walls = _disks(trial, gap[:, : n - 1]), None
    pushing = np.arange(0, len(disks), n)
    if trial.wall is not None:
        end = disks.position[n - 1 :: n] + np.array([1.0, 0.0]) * (gap[:, -1:] + RADIUS_M)
        half = np.array([0.0, 0.4 * BETWEEN_ROWS_M])
        walls = Walls(start=end - half, end=end + half)
    many = int(np.ceil(frame / RIGID_STEP_S))
    wanted = np.zeros_like(disks.position)
    motion = Motion(
        disks,
        walls,
        step=frame / many,
        push=Push(desired=lambda _: wanted, relaxation_time=tau),
        tolerance=TOLERANCE,
    )
    places, impulse = [disks.position[:, 0]], np.zeros(len(disks))
    for speed in np.diff(trial.along[:, 0]) / frame:
        wanted[pushing, 0] = speed
        motion.velocity[pushing, 0] = speed
        for _ in range(many):
            done = motion.advance()
            # a row has one dimension: pressed hard, rounding would make it buckle
            motion.position[:, 1], motion.velocity[:, 1] = disks.position[:, 1], 0.0
            pairs = done.neighbours.wall < 0
            for ends in (done.neighbours.first, done.neighbours.second):
                np.add.at(impulse, ends[pairs], done.reaction[pairs])
        places.append(motion.position[:, 0].copy())
    return _heads(trial, np.array(places), n), impulse[pushing]


def soft(trial: Trial, inputs: Inputs, stiffness: float) -> Moved:
    """Run the rows in LAMMPS (lammps_inputs/row.in) with critically damped contacts of so many N/m.

    Raises EngineError where LAMMPS is missing or fails."""
    lammps = engine("lammps")
    if lammps.find() is None:
        raise EngineError(f"LAMMPS is not installed; install it with: {lammps.INSTALL}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command, step = _written(trial, inputs, stiffness, folder)
        ended = run_command(command, folder)
        if ended.status != 0:
            raise EngineError(f"LAMMPS, row of {stiffness:g} N/m: {' '.join(ended.last[-2:])}")
        width = inputs.gap.shape[1] + 1
        dump = index_dump(folder / "rows.dump")
        places = np.array([dump.table(frame)[:, 1] for frame in range(len(trial.time))])
        force = np.loadtxt(folder / "force.txt", ndmin=2)[:, 1:]
    largest, impulse = (np.full(len(inputs.tau), np.nan) for _ in range(2))
    largest[inputs.central] = np.abs(force).max(0)
    impulse[inputs.central] = np.abs(force.sum(0) * step)
    return Moved(along=_heads(trial, places, width), largest=largest, impulse=impulse)


def _written(trial: Trial, inputs: Inputs, stiffness: float, folder: Path) -> tuple[Command, float]:
    """Write what the deck reads; return the command, and the time step (s)."""
    disks, width = _disks(trial, inputs.gap), inputs.gap.shape[1] + 1
    frame = float(trial.time[1])
    between = int(np.ceil(frame / (SOFT_SHARE * np.sqrt(trial.mass.min() / stiffness))))
    write_data(folder / "rows.data", disks, trial.name)
    rates = np.repeat(1.0 / inputs.tau, width).tolist()
    lines = [f"{number} {rate!r}" for number, rate in zip(disks.ids, rates, strict=True)]
    write_text(folder / "rates.txt", "\n".join([str(len(lines)), *lines]) + "\n")
    pushing = disks.ids[::width]
    held = pushing if trial.wall is None else np.union1d(pushing, disks.ids[width - 1 :: width])
    speeds = [*(np.diff(trial.along[:, 0]) / frame).tolist(), 0.0]
    write_text(folder / "speeds.txt", "".join(f"{speed!r}\n" for speed in speeds))
    shutil.copyfile(shipped("lammps_inputs") / "row.in", folder / "row.in")
    given: dict[str, list[object]] = {
        "stiffness": [repr(float(stiffness))],
        "critical": [repr(critical_coefficient())],
        "dt": [repr(frame / between)],
        "frames": [len(speeds) - 1],
        "between": [between],
        "pushing": [" ".join(map(str, pushing))],
        "held": [" ".join(map(str, held))],
        "watched": pushing[inputs.central].tolist(),
    }
    words = [str(word) for name, values in given.items() for word in ("-var", name, *values)]
    found = engine("lammps").find()
    return Command(
        words=(str(found), "-in", "row.in", "-log", "none", "-nonbuf", *words),
        environment={"OMP_NUM_THREADS": "1"},
    ), frame / between


def critical_coefficient() -> float:
    """Return the coefficient whose `damping tsuji` is critical: where its polynomial is 2."""
    fit = [4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728 - 2.0]
    roots = np.roots(fit)
    return float(max(root.real for root in roots if abs(root.imag) < 1e-9))


def _disks(trial: Trial, gap: Floats) -> Snapshot:
    """The disks of all rows, row after row, a wall last in each where there is a gap before it;
    those whose motion is given cannot be moved."""
    rows, width = len(gap), gap.shape[1] + 1
    place = np.cumsum(np.column_stack([np.zeros(rows), gap + 2 * RADIUS_M]), axis=1)
    across = np.repeat(BETWEEN_ROWS_M * np.arange(rows), width)
    mass = np.full((rows, width), HELD_KG)
    mass[:, 1 : len(trial.mass)] = trial.mass[1:]
    return Snapshot(
        position=np.column_stack([place.ravel(), across]),
        velocity=np.zeros((rows * width, 2)),
        radius=np.full(rows * width, RADIUS_M),
        mass=mass.ravel(),
    )


def _heads(trial: Trial, places: Floats, width: int) -> Floats:
    """Heads (s, f, n) m of disks at places (f, s·width) m: they move as their disks do."""
    moved = (places - places[0]).reshape(len(places), -1, width)[:, :, : len(trial.mass)]
    return np.asarray(trial.along[0] + moved.transpose(1, 0, 2))
