"""Rows of people by others: nscd's stepping of disks, and LAMMPS; and trials with a known truth."""

import subprocess
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import engines
from analysis.dumps import index_dump
from analysis.scene.lammps_data import write_data
from analysis.studies.push.hindcast import ARM_N, REACH_M, RIGID, Inputs, rigid, soft
from analysis.studies.push.trial import Trial
from nscd import Walls
from nscd.stepping import Motion, Push
from tests.crowds import disks_at

RADIUS_M, HELD_KG = 0.12, 1e7


def row_of(mass, first, wall=None, rate=25):
    """A trial of people at rest but for the first, who goes first (f,) m; their gaps are free."""
    along = np.tile(np.arange(len(mass)) * 0.5, (len(first), 1))
    along[:, 0] = first
    return Trial(
        name="row", people=tuple(map(str, range(len(mass)))), notes=(),
        time=np.arange(len(first)) / rate, start_s=0.0, along=along,
        pushed=along[:, 0] - along[0, 0], depth=np.full(len(mass), 0.25), depth_sd=0.019,
        mass=np.asarray(mass, float), wall=wall,
    )


def case_of(gap, tau, reach=0.0, force=200.0):
    gap = np.asarray(gap, float)[None]
    zero = np.zeros(1)
    batch, full = np.zeros(1, int), np.full(1, tau)
    layer = np.array([[reach], [force]])
    return Inputs(zero, zero, full, gap, batch, *layer)


def disks_of(trial, gap):
    """The row as disks, the wall the last of them where there is a gap before it."""
    count = len(gap) + 1
    mass = np.full(count, HELD_KG)
    mass[1 : len(trial.mass)] = trial.mass[1:]
    position = np.concatenate([[0.0], np.cumsum(gap + 2 * RADIUS_M)])
    return disks_at(np.column_stack([position, np.zeros(count)]), radius=RADIUS_M, mass=mass)


def stepped(trial, gap, tau, step=0.001):
    """Ways (f, n − 1) m of the others and the impulse on the second (N·s), by `nscd.stepping`."""
    n, frame = len(trial.mass), trial.time[1]
    disks, walls = disks_of(trial, gap[: n - 1]), None
    if trial.wall is not None:
        x = disks.position[-1, 0] + gap[-1] + RADIUS_M
        walls = Walls(start=np.array([[x, -0.4]]), end=np.array([[x, 0.4]]))
    wanted = np.zeros((n, 2))
    motion = Motion(
        disks,
        walls,
        step=step,
        push=Push(desired=lambda _: wanted, relaxation_time=tau),
        tolerance=1e-10,
    )
    ways, impulse = [np.zeros(n - 1)], 0.0
    for speed in np.diff(trial.along[:, 0]) / frame:
        wanted[0, 0] = motion.velocity[0, 0] = speed
        for _ in range(round(frame / step)):
            done = motion.advance()
            motion.position[:, 1], motion.velocity[:, 1] = 0.0, 0.0
            first = (done.neighbours.wall < 0) & (done.neighbours.first == 0)
            impulse += np.abs(done.reaction[first]).sum()
        ways.append(motion.position[1:, 0] - disks.position[1:, 0])
    return np.array(ways), impulse


def by_lammps(trial, gap, tau, stiffness, folder):
    """Ways (f, n − 1) m of the others, largest force (N) and impulse (N·s) on the second."""
    frame = trial.time[1]
    between = int(np.ceil(frame / (0.02 * np.sqrt(trial.mass.min() / stiffness))))
    write_data(folder / "row.data", disks_of(trial, gap), trial.name)
    speeds = [*(np.diff(trial.along[:, 0]) / frame), 0.0]
    (folder / "speeds.txt").write_text("".join(f"{speed!r}\n" for speed in map(float, speeds)))
    fit = [4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728 - 2.0]
    critical = max(root.real for root in np.roots(fit) if abs(root.imag) < 1e-9)
    arguments = {
        "stiffness": stiffness, "critical": critical, "dt": frame / between,
        "frames": len(speeds) - 1, "between": between, "rate": 1 / tau,
        "held": "1" if trial.wall is None else f"1 {len(gap) + 1}",
    }
    words = [str(w) for name, value in arguments.items() for w in ("-var", name, value)]
    found = engines.engine("lammps").find()
    deck = Path(__file__).with_name("row.in")
    subprocess.run(
        [str(found), "-in", str(deck), "-log", "none", *words],
        cwd=folder,
        check=True,
        capture_output=True,
        env={"OMP_NUM_THREADS": "1"},
    )
    dump = index_dump(folder / "row.dump")
    positions = np.array([dump.table(frame)[:, 1] for frame in range(len(trial.time))])
    force = np.abs(np.loadtxt(folder / "force.txt")[:, 1])
    ways = (positions - positions[0])[:, 1 : len(trial.mass)]
    return ways, force.max(), force.sum() * frame / between


def made(folder, seed, name, wall=True, noise=0.002, people=5, arms=True):
    """Write the heads of a row whose model (a stiffness, or rigid) and inputs are known, a soft layer
    of arms included, with noise (m) on every head. Return the file, the wall's x (m), largest force and impulse."""
    random = np.random.default_rng(seed)
    room = random.uniform(0.03, 0.2, people - 1 + wall)
    fraction = np.full(len(room), random.uniform())
    if wall:
        room[-1], fraction[-1] = random.uniform(0.1, 0.3), random.uniform()
    gap = (1 - fraction) * np.maximum(room + random.normal(0, 0.019, len(room)), 0.0)
    time = np.arange(65) / 25
    far = random.uniform(0.3, 0.5)
    far = min(far, 0.85 * gap.sum()) if wall else far
    phase = np.clip((time - 0.25) / random.uniform(0.5, 0.9), 0, 1)
    start = np.concatenate([[0.0], np.cumsum(room[: people - 1] + 0.254)])
    end = start[-1] + room[-1] + 0.127 if wall else None
    row = row_of(
        random.uniform(55, 100, people), far * (phase - np.sin(2 * np.pi * phase) / 2 / np.pi), end
    )
    row.along[:, 1:] = start[1:]
    layer = np.random.default_rng([seed, 1]).uniform(*np.transpose([REACH_M, ARM_N]))
    case = case_of(gap, 0.1 ** random.uniform(), *(layer if arms else ()))
    moved = rigid(row, case) if name == RIGID else soft(row, case, float(name))
    headers = moved.along[..., 0] + random.normal(0, noise, row.along.shape)
    table = pd.DataFrame(
        [
            (person, at, x, 0.0, row.mass[person], "male")
            for person in range(people)
            for at, x in zip(time, headers[:, person], strict=True)
        ],
        columns=["id", "time", "x", "y", "Weight_kg", "Gender"],
    )
    file = folder / f"{seed}.csv"
    table.to_csv(file, index=False)
    return file, end, float(moved.largest[0]), float(moved.impulse[0])
