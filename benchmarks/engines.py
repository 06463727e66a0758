"""Seconds and particle-steps per second of each engine on `arch`, and seconds per snapshot of the
percussions.

Usage: python benchmarks/engines.py [--disks N] [--duration S]"""

import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe, head, line, options

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import PENALTY
from analysis.engines.record import EngineError
from analysis.engines.run import simulate
from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make


def main() -> None:
    """Run each engine once and the percussions on every frame of its dump; print one table."""
    given = options(__doc__, disks=594, duration=2.0)
    scene = make("arch", given.disks).with_run(duration_s=given.duration)
    print(f"{describe()}\n\n{given.disks} disks\n")
    print(head("what", "CPU s", "wall s", "steps", "particle-steps per CPU s", "worst residual"))
    with tempfile.TemporaryDirectory() as folder:
        for name in (known.NAME for known in PENALTY):
            place = Path(folder) / name
            try:
                record = simulate(scene, name, place)
            except EngineError as error:
                print(f"{name}: {error}")
                continue
            rate = f"{record.particle_steps / record.cpu_seconds:.3g}"
            seconds = f"{record.cpu_seconds:.3f}", f"{record.wall_seconds:.3f}"
            print(line([name, *seconds, record.steps, rate, "–"]))
            percussions(place, scene, record.time_step_s, name)


def percussions(place: Path, scene: Scene, time_step: float, name: str) -> None:
    """Read every frame and compute its percussions."""
    trajectory = open_bodies(place / "bodies.dump", time_step).trajectory
    seconds, residuals = np.zeros(2), []
    for frame in range(1, trajectory.n_frames):
        started = time.process_time()
        snapshot = snapshot_of(trajectory[frame])
        read = time.process_time()
        residuals.append(percussions_of(scene, snapshot, tolerance=1e-10).answer.residual)
        seconds += np.array([read - started, time.process_time() - read])
    count = len(residuals)
    for what, total, worst in zip(
        ("read", "percussions"), seconds, ("–", f"{max(residuals):.1e}"), strict=True
    ):
        label = f"{name} dump: {what}, a snapshot"
        print(line([label, f"{total / count:.5f}", "–", count, "–", worst]))


if __name__ == "__main__":
    main()
