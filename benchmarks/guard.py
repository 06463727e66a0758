"""What the guard costs: CPU seconds of the same run with and without it, alternating; the ratio of
the medians and of the least of each.

Usage: python benchmarks/guard.py [--repeats N] [--engine lammps yade] [--scenes SCENE …]"""

import argparse
import itertools
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.machine import in_turn, options, show

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


def rows(given: argparse.Namespace) -> Iterator[list[str]]:
    """One row per scene and engine."""
    for engine, scene in itertools.product(given.engine, given.scenes):
        with tempfile.TemporaryDirectory() as out:
            calls = {g: partial(cpu_seconds, engine, scene, g, out) for g in ("no", "yes")}
            spent = in_turn(calls, given.repeats)
        without, guarded = map(statistics.median, spent.values())
        least = min(spent["yes"]) / min(spent["no"])
        shares = [f"{100 * (ratio - 1):+.1f} %" for ratio in (guarded / without, least)]
        yield [engine, scene, f"{without:.3f}", f"{guarded:.3f}", *shares]


if __name__ == "__main__":
    asked = options(
        __doc__, scenes=("arch", "jam", "corridor", "four_disks"), repeats=5,
        engine=dict.fromkeys(("lammps", "yade")),
    )  # fmt: skip
    show(["engine", "scene", "without (CPU s)", "with", "medians", "least"], rows(asked))
