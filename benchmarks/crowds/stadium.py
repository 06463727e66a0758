"""What it would cost to compute a stadium: core hours, memory and files of each model, from short
runs of its sectors.

    nice -n 15 python benchmarks/crowds/stadium.py FOLDER [--people 50000] [--doors 40] [--hours 1]
        [--seeds 10] [--stiffness 1e6 1e7 1e8] [--frame-seconds 1]

A sector is the people of one door, pressed as in the scene `arch`; people of different sectors do
not touch, so that each is a run of its own. Every model runs a sector for 1 s and for 3 s: the
difference is what its steps cost without its start. Prints the table of docs/timing.md; runs that
are in the folder are not run again."""

import argparse
import json
import resource
from pathlib import Path

from analysis.dumps import index_dump
from analysis.engines import engine
from analysis.engines.run import simulate
from analysis.engines.softness import judged, softness
from analysis.pages.numbers import number
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.support.files import write_json
from benchmarks.machine import in_process, options, show

# Simulated seconds of the two runs of a sector.
SHORT_S, LONG_S = 1.0, 3.0
GB, HOUR = 1e9, 3600.0
KINDS = {"bodies.dump": "ATOMS", "contacts.dump": "ENTRIES"}


def scene_of(people: int, stiffness: float | None, seconds: float) -> tuple[Scene, str]:
    """Make the crowd, to run for so long in one frame, and name the engine: rigid without
    stiffness."""
    scene, name = make("arch", people), "lammps" if stiffness else "rigid"
    if stiffness:
        scene = scene.with_contact(stiffness_N_per_m=stiffness)
    return scene.with_run(duration_s=seconds, frames=1), name


def run_one(people: int, stiffness: float | None, seconds: float, folder: Path) -> dict[str, float]:
    """Run one model in this process; what it took."""
    scene, name = scene_of(people, stiffness, seconds)
    record = simulate(scene, name, folder)
    last = sum(index_dump(folder / file, kind).frames[-1].length for file, kind in KINDS.items())
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return {"cpu": record.cpu_seconds, "memory": 1024.0 * peak, "frame": last}


def measured(people: int, stiffness: float | None, seconds: float, out: Path) -> dict[str, float]:
    """Run for so many seconds, in a process of its own, unless it was done before."""
    path = out / f"{people}_{stiffness or 0:g}_{seconds:g}"
    cached = path / "measured_run.json"
    if not cached.exists():
        write_json(cached, in_process(run_one, people, stiffness, seconds, path))
    found: dict[str, float] = json.loads(cached.read_text())
    return found


def sector_row(stiffness: float | None, args: argparse.Namespace) -> list[str]:
    """All sectors for the whole time by a model."""
    people = args.people // args.doors
    short, longer = (measured(people, stiffness, t, args.folder) for t in (SHORT_S, LONG_S))
    second = (longer["cpu"] - short["cpu"]) / (LONG_S - SHORT_S)
    hours = args.doors * args.hours * second
    frames = args.doors * args.hours * HOUR / args.frame_seconds
    scene, name = scene_of(people, stiffness, LONG_S)
    s = softness(scene)
    return [
        f"LAMMPS, {stiffness:.0e} N/m" if stiffness else "rigid",
        f"{1e3 * engine(name).timing(scene).time_step:.2g} ms",
        f"{number(second, 2)} s",
        number(hours, 2),
        number(args.seeds * hours, 2),
        f"{longer['memory'] / GB:.2f} GB",
        f"{number(frames * longer['frame'] / GB, 2)} GB",
        f"{s:.2g}, {judged(s).split(':')[0]}" if stiffness else "–",
    ]


def main() -> None:
    """Measure, and print the table."""
    args = options(
        __doc__, "folder", people=50_000, doors=40, hours=1.0, seeds=10,
        stiffness=(1e6, 1e7, 1e8), frame_seconds=1.0,
    )  # fmt: skip
    costs = ["core hours", f"of {args.seeds} crowds"]
    head = ["model", "step", "CPU time of 1 s of a sector", *costs, "memory", "dumps", "s"]
    show(head, (sector_row(one, args) for one in (None, *args.stiffness)))


if __name__ == "__main__":
    main()
