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
from functools import partial
from pathlib import Path

from benchmarks.machine import describe, head, in_turn, line, options

ROOT = Path(__file__).resolve().parents[1]


def cpu_seconds(engine: str, scene: str, guard: str, out: str) -> float:
    """User CPU time of one plain run, its start included."""
    words = ["yade", "-L", "noserver", "-j1", "-n", "-x", "yade_scripts/crowd.py"]
    words += [scene, f"guard={guard}", f"out={out}"]
    if engine == "lammps":
        words = ["lmp", "-in", "lammps_inputs/crowd.in", "-log", "none"]
        words += ["-var", "scene", scene, "-var", "guard", guard, "-var", "out", out]
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
    names = head("engine", "scene", "without (CPU s)", "with", "medians", "least")
    print(describe(), names, sep="\n\n")
    for engine, scene in itertools.product(given.engine, given.scenes):
        with tempfile.TemporaryDirectory() as out:
            calls = {g: partial(cpu_seconds, engine, scene, g, out) for g in ("no", "yes")}
            spent = in_turn(calls, given.repeats)
        without, guarded = map(statistics.median, spent.values())
        least = min(spent["yes"]) / min(spent["no"])
        shares = [f"{100 * (ratio - 1):+.1f} %" for ratio in (guarded / without, least)]
        print(line([engine, scene, f"{without:.3f}", f"{guarded:.3f}", *shares]), flush=True)


if __name__ == "__main__":
    main()
