"""LAMMPS on several ranks of MPI: wall and CPU seconds of the same pressed crowd, alternating; the
least of each, and their ratios to the first number of ranks.

Usage: python benchmarks/scaling/ranks.py [--disks N …] [--ranks N …] [--steps N] [--repeats N]"""

import argparse
import logging
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from machine import describe

from analysis.engines import lammps
from analysis.engines.run import run_engine
from analysis.scene.shipped_scenes import make


def main() -> None:
    """Print one row per size and number of ranks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--disks", type=int, nargs="+", default=[5000, 20_000])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)  # crowds so large are too soft: here only their cost counts
    print(describe())
    print(f"{'disks':>7}{'ranks':>7}{'wall s':>9}{'ratio':>7}{'CPU s':>9}{'ratio':>7}")
    for disks in arguments.disks:
        scene = make("arch", disks)
        duration = arguments.steps * lammps.timing(scene).time_step
        scene = scene.with_run(duration_s=duration, frames=1)
        found: dict[int, list[tuple[float, float]]] = {ranks: [] for ranks in arguments.ranks}
        with tempfile.TemporaryDirectory() as folder:
            for repeat in range(arguments.repeats):
                for ranks, spent in found.items():
                    place = Path(folder) / f"{ranks}_{repeat}"
                    record = run_engine(scene, "lammps", place, ranks=ranks)
                    spent.append((record.wall_seconds, record.cpu_seconds))
        least = {ranks: [min(one) for one in zip(*found[ranks], strict=True)] for ranks in found}
        first = least[arguments.ranks[0]]
        for ranks, now in least.items():
            columns = "".join(
                f"{one:>9.2f}{one / other:>7.2f}" for one, other in zip(now, first, strict=True)
            )
            print(f"{disks:>7}{ranks:>7}{columns}", flush=True)


if __name__ == "__main__":
    main()
