"""Rigid steps that grow short against springs that grow stiff: whole runs of a scene, over crowds.

    python benchmarks/converge.py FOLDER [--crowds 10] [--duration 4] [--models rigid:0.005 ...]

Each model is ENGINE:NUMBER, the number being the step (s) of the rigid engine or the stiffness (N/m)
of another; the first is what the others are measured from. Runs that are in the folder are taken as
they are; with --read nothing is run, and models are compared on the crowds that the folder has.
Prints a table, writes FOLDER/converge.png and FOLDER/whole_runs.json and .csv. With --store the
statistics named take the place of those that advice reads (analysis/advice/whole_runs.json)."""

from pathlib import Path

from machine import describe, options, table

from analysis.advice import motion as advice
from analysis.advice.motion import stored_whole_runs
from analysis.scene.scene import read_scene
from analysis.support.files import write_json
from analysis.work_precision.whole_runs import (
    RIGID,
    Setting,
    content_of,
    crowds_of,
    measure_whole_runs,
    points_of,
    runs_of,
    whole_runs_picture,
    whole_runs_rows,
    write_whole_runs,
)

MODELS = (
    "rigid:0.001", "rigid:0.005", "rigid:0.02", "lammps:1e6", "lammps:1e7", "lammps:1e8",
    "yade:1e6", "yade:1e7",
)  # fmt: skip
# Frames per second: windows of 0.1 s.
FRAMES = 10


def setting_of(model: str) -> Setting:
    """Read ENGINE:NUMBER."""
    engine, _, value = model.partition(":")
    if engine == RIGID:
        return Setting(engine=engine, step_s=float(value))
    return Setting(engine=engine, stiffness_N_per_m=float(value))


def main() -> None:
    """Run every crowd by every model, one after the other, and compare them."""
    given = options(
        __doc__, "out", scene="scenes/arch.toml", crowds=10, duration=4.0, models=MODELS,
        read=False, store=(),
    )  # fmt: skip
    scene = read_scene(given.scene).with_run(
        duration_s=given.duration, frames=round(FRAMES * given.duration)
    )
    settings = [setting_of(model) for model in given.models]
    every = runs_of(settings, crowds_of(scene, given.crowds), given.out)
    for one in [] if given.read else every:
        for run in one.every:
            print(run.folder, f"{run.record().cpu_seconds:.2f} s", flush=True)
    found = measure_whole_runs(scene, every, read_only=True)
    head = ["model", "crowds", "CPU s", "with impulses (s)"]
    head += [f"{one.title} ({one.unit})" for one in found.statistics.values()]
    print(describe(), table(head, whole_runs_rows(found)), sep="\n\n")
    points = list(points_of(found))
    write_whole_runs(given.out, points)
    if given.store:
        kept = [one for one in stored_whole_runs() if one.quantity not in given.store]
        new = [one for one in points if one.quantity in given.store]
        write_json(Path(advice.__file__).with_name(advice.FILE), content_of([*kept, *new]))
    whole_runs_picture(found).savefig(given.out / "converge.png", dpi=120)


if __name__ == "__main__":
    main()
