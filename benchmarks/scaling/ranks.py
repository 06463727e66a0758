"""LAMMPS on several ranks of MPI: wall and CPU seconds of the same pressed crowd, alternating; the
least of each, and their ratios to the first number of ranks.

Usage: python benchmarks/scaling/ranks.py [--disks N …] [--ranks N …] [--steps N] [--repeats N]"""

import logging
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from machine import describe, head, line, options

from analysis.engines import lammps
from analysis.engines.run import run_engine
from analysis.scene.shipped_scenes import make


def main() -> None:
    """Print one row per size and number of ranks."""
    given = options(__doc__, disks=(5000, 20_000), ranks=(1, 2), steps=1000, repeats=5)
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only their cost counts
    print(describe(), head("disks", "ranks", "wall s", "ratio", "CPU s", "ratio"), sep="\n\n")
    for disks in given.disks:
        scene = make("arch", disks)
        duration = given.steps * lammps.timing(scene).time_step
        scene = scene.with_run(duration_s=duration, frames=1)
        found: dict[int, list[tuple[float, float]]] = {ranks: [] for ranks in given.ranks}
        with tempfile.TemporaryDirectory() as folder:
            for repeat in range(given.repeats):
                for ranks, spent in found.items():
                    place = Path(folder) / f"{ranks}_{repeat}"
                    record = run_engine(scene, "lammps", place, ranks=ranks)
                    spent.append((record.wall_seconds, record.cpu_seconds))
        least = {ranks: [min(one) for one in zip(*found[ranks], strict=True)] for ranks in found}
        first = least[given.ranks[0]]
        for ranks, now in least.items():
            pairs = zip(now, first, strict=True)
            cells = [f"{value:.2f}" for one, other in pairs for value in (one, one / other)]
            print(line([disks, ranks, *cells]), flush=True)


if __name__ == "__main__":
    main()
