"""Box2D 3 beside the rigid engine: the same crowd, the same steps; its percussions judged as ours are.

    python3.12 -m venv out/box2d && out/box2d/bin/pip install numpy box2d-python
    python benchmarks/box2d.py out/box2d/bin/python [--scene arch] [--seconds 4]

Box2D gets disks that do not turn, no friction, no restitution and, before each step, the velocities
of free flight with the drive. CPU seconds are of the steps alone (`b2World_Step`; `Motion.advance`
without the drive's field). The residual of a step is max|min(wλ, max(gap, 0)/h − C u)| / max|u_free|
over its contacts with u = u_free − M⁻¹Cᵀλ: Box2D removes overlaps by and by, which is not counted.
The overlap is the deepest after any step, the load the mean on all walls over the second half."""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.engines.programs.rigid import motion_of
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import options, show, timed
from benchmarks.rigid import overlap_of

WORLD = Path(__file__).parent / "processes" / "box2d_world.py"
SUBSTEPS, STEP_S = (1, 4, 16, 64), 0.005


def judged(u_free: Any, mass: Any, contacts: tuple[Any, ...], step: float) -> float:
    """The residual of percussions λ of contacts (first, second, normal, gap, λ) in a step (s)."""
    first, second, normal, gap, push = contacts
    pair = second >= 0
    velocity = u_free.copy()
    impulse = push[:, None] * normal
    np.subtract.at(velocity, first, impulse / mass[first, None])
    np.add.at(velocity, second[pair], impulse[pair] / mass[second[pair], None])
    other = np.where(pair[:, None], velocity[second], 0.0)
    closing = (normal * (velocity[first] - other)).sum(1)
    inverse = 1 / mass[first] + np.where(pair, 1 / mass[second], 0.0)
    slack = np.maximum(gap, 0.0) / step - closing
    missed = np.abs(np.minimum(inverse * push, slack)).max(initial=0.0)
    return float(missed / np.hypot(*u_free.T).max())


Step = tuple[float, float, float, float]


def started(scene: Scene) -> tuple[Any, Any, Callable[..., tuple[Any, Any]]]:
    """A motion of the rigid engine at its start, masses with what the drive adds in a step, and what
    gives the velocity of free flight with the drive, and the desired one (n,2) m/s."""
    motion, drive = motion_of(scene, scene.snapshot), scene.drive
    motion.separate()
    fraction = motion.step / drive.relaxation_time_s

    def free(position: Any, velocity: Any) -> tuple[Any, Any]:
        desired = drive.desired_velocity(position, ids=scene.snapshot.ids)
        return (velocity + fraction * desired) / (1 + fraction), desired

    return motion, (1 + fraction) * motion.mass, free


def rigid(scene: Scene, steps: int) -> Iterator[Step]:
    """Steps of this product's engine: CPU seconds, residual, largest overlap (m) after it, Σλ of
    walls (N·s)."""
    motion, mass, fly = started(scene)
    for _ in range(steps):
        free, desired = fly(motion.position, motion.velocity)
        motion._desired = lambda _, known=desired: known  # the field is not counted
        seconds, report = timed(motion.advance)
        neighbours = report.neighbours
        contacts = neighbours.first, neighbours.second, neighbours.normal, neighbours.gap, report.reaction
        residual = judged(free, mass, contacts, motion.step)
        yield seconds, residual, motion.overlap, float(report.reaction[neighbours.second < 0].sum())


def box2d(scene: Scene, steps: int, python: Path, substeps: int) -> Iterator[Step]:
    """The same of Box2D, from where the rigid engine begins."""
    (motion, mass, fly), walls = started(scene), scene.wall_segments()
    n = len(mass)
    with tempfile.TemporaryDirectory() as folder:
        input_file = Path(folder) / "given.npz"
        np.savez(
            input_file, position=motion.position, radius=motion.radius, mass=mass, start=walls.start,
            end=walls.end, step=motion.step, substeps=substeps,
        )  # fmt: skip
        words = [str(python), str(WORLD), str(input_file)]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as world:
            position, velocity = motion.position, motion.velocity
            for _ in range(steps):
                free, _ = fly(position, velocity)
                world.stdin.write(free.tobytes())
                world.stdin.flush()
                seconds, count = np.frombuffer(world.stdout.read(16))
                state = np.frombuffer(world.stdout.read(32 * n)).reshape(2, n, 2)
                position, velocity = state[0].copy(), state[1].copy()
                found = np.frombuffer(world.stdout.read(48 * int(count))).reshape(-1, 6)
                first, second = found[:, 0].astype(int), found[:, 1].astype(int)
                # Box2D's normals point from the first body to the second, like ours
                contacts = first, second, found[:, 2:4], found[:, 4], found[:, 5]
                residual = judged(free, mass, contacts, motion.step)
                overlap = overlap_of([replace(scene.snapshot, position=position)], scene)
                yield seconds, residual, overlap, float(found[second < 0, 5].sum())


def rows(arguments: argparse.Namespace) -> Iterator[list[str]]:
    """The rows of the table."""
    scene = make(arguments.scene).with_run(time_step_s=None, rigid_step_s=STEP_S)
    scene = scene.with_contact(restitution=0.0)
    count = round(arguments.seconds / STEP_S)
    every = {
        f"rigid, {name}": rigid(scene.with_run(rigid_tolerance=tolerance), count)
        for name, tolerance in (("exact", 1e-8), ("to 1e-4", 1e-4))
    }
    for substeps in SUBSTEPS:
        every[f"Box2D, {substeps} substeps"] = box2d(scene, count, arguments.python, substeps)
    for title, steps in every.items():
        seconds, residual, overlap, load = (np.array(one) for one in zip(*steps, strict=True))
        late = load[len(load) // 2 :].mean() / STEP_S
        errors = f"{np.median(residual):.1e}", f"{residual.max():.1e}"
        cells = f"{seconds.sum():.2g}", *errors, f"{1e3 * overlap.max():.2g}", f"{late / 1e3:.3g}"
        yield [title, *cells]


if __name__ == "__main__":
    names = "steps", "CPU s", "residual, median", "largest", "deepest overlap (mm)"
    args = options(__doc__, "python", scene="arch", seconds=4.0)
    show([*names, "load on walls (kN)"], rows(args))
