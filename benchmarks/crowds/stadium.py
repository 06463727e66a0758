"""What it would cost to compute a stadium: core hours, memory and files of each model, from short
runs of its sectors.

    nice -n 15 python benchmarks/crowds/stadium.py FOLDER [--people 50000] [--doors 40] [--hours 1]
        [--seeds 10] [--stiffness 1e6 1e7 1e8] [--frame-seconds 1]

A sector is the people of one door, pressed as in the scene `arch`; people of different sectors do
not touch, so that each is a run of its own. Every model runs a sector for 1 s and for 3 s: the
difference is what its steps cost without its start. Memory of all people in one run is of a few
steps. Prints the tables of docs/timing.md; runs that are in the folder are not run
again."""

import argparse
import json
import resource
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from analysis.dumps import index_dump
from analysis.engines import engine
from analysis.engines.run import simulate
from analysis.engines.softness import judged, softness
from analysis.pages.numbers import number
from analysis.percussions.setting import setting_beside
from analysis.percussions.solving import DumpToSolve
from analysis.percussions.table import table_file
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.support.files import write_json
from analysis.support.machine import machine
from benchmarks.machine import apart, options, table, timed

# Simulated seconds of the two runs of a sector, and of the one of all people.
SHORT_S, LONG_S, BRIEF_S = 1.0, 3.0, 0.05
GB, HOUR = 1e9, 3600.0
# Of the frames of bodies and of contacts.
KINDS = ("ATOMS", "ENTRIES")


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
    paths = [folder / f"{kind}.dump" for kind in ("bodies", "contacts")]
    last = sum(
        index_dump(path, kind).frames[-1].length for path, kind in zip(paths, KINDS, strict=True)
    )
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return {"cpu": record.cpu_seconds, "memory": 1024.0 * peak, "frame": last}


def solve_one(_: int, stiffness: float | None, seconds: float, folder: Path) -> dict[str, float]:
    """Solve the last frame of a run; what it took."""
    setting = setting_beside(folder / "bodies.dump", left_velocity="desired")
    job = DumpToSolve(path=folder / "bodies.dump", setting=setting, openness="none", parquet=True)
    for _ in range(2):  # the second time kernels are loaded
        used, (found,) = timed(partial(job.solve, range(1, 2)))
    assert not found.said.unsolved, found.said.unsolved
    with table_file(folder / "contacts.parquet") as add:
        add(found.columns, found.rows)
    return {
        "cpu": used,
        "contacts": found.said.contacts,
        "memory": 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "frame": (folder / "contacts.parquet").stat().st_size,
    }


PARTS = {"run": run_one, "solve": solve_one}
Measured = dict[str, float]


class Stadium:
    """What was asked for, and the runs of a sector of each model."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given, self.people = given, given.people // given.doors
        self.frames = given.doors * given.hours * HOUR / given.frame_seconds
        self.models = (None, *given.stiffness)

    def measured(self, what: str, people: int, stiffness: float | None, seconds: float) -> Measured:
        """Run, or solve the last frame of the run of so many seconds, in a process of its own, unless
        it was done before."""
        place = self.given.folder / f"{people}_{stiffness or 0:g}_{seconds:g}"
        kept = place / f"measured_{what}.json"
        if not kept.exists():
            write_json(kept, apart(PARTS[what], people, stiffness, seconds, place))
        found: Measured = json.loads(kept.read_text())
        return found

    def sectors(self) -> Iterator[list[str]]:
        """A row for each model: all sectors for the whole time."""
        given, people = self.given, self.people
        for stiffness in self.models:
            short, longer = (self.measured("run", people, stiffness, t) for t in (SHORT_S, LONG_S))
            second = (longer["cpu"] - short["cpu"]) / (LONG_S - SHORT_S)
            hours = given.doors * given.hours * second
            scene, name = scene_of(people, stiffness, LONG_S)
            yield [
                name_of(stiffness),
                f"{1e3 * engine(name).timing(scene).time_step:.2g} ms",
                f"{number(second, 2)} s",
                number(hours, 2),
                number(given.seeds * hours, 2),
                f"{longer['memory'] / GB:.2f} GB",
                f"{number(self.frames * longer['frame'] / GB, 2)} GB",
                judgement(scene) if stiffness else "–",
            ]

    def percussions(self) -> Iterator[list[str]]:
        """A row for the percussions of a frame of a sector of each model."""
        for stiffness in self.models:
            found = self.measured("solve", self.people, stiffness, LONG_S)
            yield [
                name_of(stiffness),
                f"{found['contacts']:.0f}",
                f"{number(1e3 * found['cpu'], 2)} ms",
                number(self.frames * found["cpu"] / HOUR, 2),
                f"{found['memory'] / GB:.2f} GB",
                f"{number(self.frames * found['frame'] / GB, 2)} GB",
            ]

    def together(self) -> Iterator[list[str]]:
        """A row for each model: all people in one run, for a moment."""
        for stiffness in self.models:
            found = self.measured("run", self.given.people, stiffness, BRIEF_S)
            scene, _ = scene_of(self.given.people, stiffness, BRIEF_S)
            deep = judgement(scene) if stiffness else "–"
            yield [name_of(stiffness), f"{found['memory'] / GB:.2f} GB", deep]


def name_of(stiffness: float | None) -> str:
    """Name a model."""
    return f"LAMMPS, {stiffness:.0e} N/m" if stiffness else "rigid"


def judgement(scene: Scene) -> str:
    """How soft a crowd is, and what that means."""
    s = softness(scene)
    return f"{s:.2g}, {judged(s).split(':')[0]}"


def main() -> None:
    """Measure, and print the tables."""
    given = options(
        __doc__, "folder", people=50_000, doors=40, hours=1.0, seeds=10,
        stiffness=(1e6, 1e7, 1e8), frame_seconds=1.0,
    )  # fmt: skip
    stadium = Stadium(given)
    print(machine())
    costs = ["core hours", f"of {given.seeds} crowds"]
    head = ["model", "step", "CPU time of 1 s of a sector", *costs, "memory", "dumps", "s"]
    print("", table(head, stadium.sectors()), sep="\n")
    head = ["frames of", "contacts", "a frame of a sector", "core hours", "memory", "Parquet"]
    print("", table(head, stadium.percussions()), sep="\n")
    print("", table(["all in one run", "memory", "s"], stadium.together()), sep="\n")


if __name__ == "__main__":
    main()
