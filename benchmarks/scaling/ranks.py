"""LAMMPS on several ranks of MPI: wall and CPU seconds of the same pressed crowd, alternating; the
least of each, and their ratios to the first number of ranks.

Usage: python benchmarks/scaling/ranks.py [--disks N …] [--ranks N …] [--steps N] [--repeats N]"""

import itertools
import logging
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from analysis.engines import LAMMPS
from analysis.engines.run import run_engine
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import describe, head, in_turn, line, options


def spent(scene: Scene, ranks: int, folder: Path, number: "itertools.count[int]") -> list[float]:
    """Wall and CPU seconds of one run."""
    record = run_engine(scene, "lammps", folder / str(next(number)), ranks=ranks)
    return [record.wall_seconds, record.cpu_seconds]


def main() -> None:
    """Print one row per size and number of ranks."""
    given = options(__doc__, disks=(5000, 20_000), ranks=(1, 2), steps=1000, repeats=5)
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only their cost counts
    print(describe(), head("disks", "ranks", "wall s", "ratio", "CPU s", "ratio"), sep="\n\n")
    for disks in given.disks:
        scene = make("arch", disks)
        duration = given.steps * LAMMPS.timing(scene).time_step
        scene = scene.with_run(duration_s=duration, frames=1)
        with tempfile.TemporaryDirectory() as folder:
            where = Path(folder), itertools.count()
            calls = {ranks: partial(spent, scene, ranks, *where) for ranks in given.ranks}
            found = in_turn(calls, given.repeats)
        least = {ranks: np.min(times, axis=0) for ranks, times in found.items()}
        for ranks, now in least.items():
            pairs = np.column_stack([now, now / least[given.ranks[0]]]).ravel()
            print(line([disks, ranks, *(f"{value:.2f}" for value in pairs)]), flush=True)


if __name__ == "__main__":
    main()
