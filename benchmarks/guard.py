"""What the guard costs: CPU seconds of the same run with and without it, alternating; the ratio of
the medians and of the least of each.

Usage: python benchmarks/guard.py [--repeats N] [--engine lammps yade] [--scenes SCENE …]"""

import itertools
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from machine import describe, head, line, options

ROOT = Path(__file__).resolve().parents[1]


def cpu_seconds(engine: str, scene: str, guard: str, out: Path) -> float:
    """User CPU time of one plain run, its start included."""
    words = ["yade", "-L", "noserver", "-j1", "-n", "-x", "yade_scripts/crowd.py"]
    words += [scene, f"guard={guard}", f"out={out}"]
    if engine == "lammps":
        words = ["lmp", "-in", "lammps_inputs/crowd.in", "-log", "none"]
        words += ["-var", "scene", scene, "-var", "guard", guard, "-var", "out", str(out)]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"}
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), environment["PATH"]])
    environment["PYTHONPATH"] = "yade_scripts"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main() -> None:
    """Print one row per scene and engine."""
    scenes = ("arch", "jam", "corridor", "four_disks")
    given = options(__doc__, scenes=scenes, repeats=5, engine=dict.fromkeys(("lammps", "yade")))
    print(
        describe(),
        head("engine", "scene", "without (CPU s)", "with", "medians", "least"),
        sep="\n\n",
    )
    for engine, scene in itertools.product(given.engine, given.scenes):
        spent: dict[str, list[float]] = {"no": [], "yes": []}
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(given.repeats):
                for guard, seconds in spent.items():
                    seconds.append(cpu_seconds(engine, scene, guard, Path(folder)))
        without, guarded = (statistics.median(spent[guard]) for guard in ("no", "yes"))
        least = min(spent["yes"]) / min(spent["no"]) - 1
        shares = [f"{100 * share:+.1f} %" for share in (guarded / without - 1, least)]
        print(line([engine, scene, f"{without:.3f}", f"{guarded:.3f}", *shares]), flush=True)


if __name__ == "__main__":
    main()
