"""Seconds and particle-steps per second of each engine on `arch`, and seconds per snapshot of the
percussions.

Usage: python benchmarks/engines.py [--disks N] [--duration S]"""

import argparse
import platform
import tempfile
import time
from pathlib import Path

import numpy as np

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import PENALTY
from analysis.engines.record import EngineError
from analysis.engines.run import simulate
from analysis.percussions.snapshot import percussions_of
from analysis.scene.shipped_scenes import make


def main() -> None:
    """Run each engine once and the percussions on every frame of its dump; print one table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--disks", type=int, default=594)
    parser.add_argument("--duration", type=float, default=2.0, help="simulated seconds")
    arguments = parser.parse_args()
    scene = make("arch", arguments.disks).with_run(duration_s=arguments.duration)
    print(
        f"{platform.processor() or platform.machine()}, Python {platform.python_version()}, "
        f"{arguments.disks} disks"
    )
    print(
        f"{'what':<34}{'CPU s':>10}{'wall s':>10}{'steps':>9}{'particle-steps per CPU s':>27}"
        f"{'worst residual':>16}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for name in (known.NAME for known in PENALTY):
            place = Path(folder) / name
            try:
                record = simulate(scene, name, place)
            except EngineError as error:
                print(f"{name:<34}{error}")
                continue
            rate = record.particle_steps / record.cpu_seconds
            print(
                f"{name:<34}{record.cpu_seconds:>10.3f}{record.wall_seconds:>10.3f}{record.steps:>9}{rate:>27.3g}{'–':>16}"
            )
            percussions(place, scene, record.time_step_s, name)


def percussions(place: Path, scene, time_step: float, name: str) -> None:
    """Read every frame and compute its percussions; the first solve, which compiles or loads, is
    left out."""
    universe = open_bodies(place / "bodies.dump", time_step)
    seconds, residuals = np.zeros(2), []
    for repeat in range(2):
        seconds[:] = 0
        residuals.clear()
        for frame in range(1, universe.trajectory.n_frames):
            started = time.process_time()
            snapshot = snapshot_of(universe.trajectory[frame])
            read = time.process_time()
            answer = percussions_of(scene, snapshot, tolerance=1e-10).answer
            seconds += np.array([read - started, time.process_time() - read])
            residuals.append(answer.residual)
        if repeat:
            break
    for what, total in zip(("read", "percussions"), seconds, strict=True):
        worst = f"{max(residuals):.1e}" if what == "percussions" else "–"
        label = f"  {name} dump: {what}, a snapshot"
        print(
            f"{label:<34}{total / len(residuals):>10.5f}{'–':>10}{len(residuals):>9}{'–':>27}"
            f"{worst:>16}"
        )


if __name__ == "__main__":
    main()
