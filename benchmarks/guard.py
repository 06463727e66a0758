"""What the guard costs: CPU seconds of the same run with and without it, alternating; the ratio of
the medians and of the least of each.

Usage: python benchmarks/guard.py [--repeats N] [--engine lammps|yade] [SCENE …]"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from machine import describe

ROOT = Path(__file__).resolve().parents[1]


def cpu_seconds(engine: str, scene: str, guard: str, out: Path) -> float:
    """User CPU time of one plain run, its start included."""
    words = {
        "lammps": [
            *("lmp", "-in", "lammps_inputs/crowd.in", "-log", "none"),
            *("-var", "scene", scene, "-var", "guard", guard, "-var", "out", str(out)),
        ],
        "yade": [
            *("yade", "-L", "noserver", "-j1", "-n", "-x", "yade_scripts/crowd.py"),
            *(scene, f"guard={guard}", f"out={out}"),
        ],
    }[engine]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"}
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment["PATH"]])
    environment["PYTHONPATH"] = "yade_scripts"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main() -> None:
    """Print one row per scene and engine."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["arch", "jam", "corridor", "four_disks"])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument(
        "--engine", nargs="+", default=["lammps", "yade"], choices=["lammps", "yade"]
    )
    arguments = parser.parse_args()
    print(describe())
    print(
        f"{'engine':<8}{'scene':<14}{'without (CPU s)':>16}{'with':>9}{'medians':>10}{'least':>9}"
    )
    for engine in arguments.engine:
        for scene in arguments.scenes:
            spent: dict[str, list[float]] = {"no": [], "yes": []}
            with tempfile.TemporaryDirectory() as folder:
                for _ in range(arguments.repeats):
                    for guard, seconds in spent.items():
                        seconds.append(cpu_seconds(engine, scene, guard, Path(folder)))
            without, guarded = (statistics.median(spent[guard]) for guard in ("no", "yes"))
            least = min(spent["yes"]) / min(spent["no"]) - 1
            print(
                f"{engine:<8}{scene:<14}{without:>16.3f}{guarded:>9.3f}"
                f"{100 * (guarded / without - 1):>+9.1f}%{100 * least:>+8.1f}%",
                flush=True,
            )


if __name__ == "__main__":
    main()
