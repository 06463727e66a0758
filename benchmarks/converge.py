"""Rigid steps that grow short against springs that grow stiff: whole runs of a scene, over crowds.

    python benchmarks/converge.py FOLDER [--crowds 10] [--duration 4] [--models rigid:0.005 ...]

Each model is ENGINE:NUMBER, the number being the step (s) of the rigid engine or the stiffness (N/m)
of another; the first is what the others are measured from. Runs that are in the folder are taken as
they are; with --read nothing is run, and models are compared on the crowds that the folder has.
Prints a table, writes FOLDER/converge.png and FOLDER/whole_runs.json and .csv. With --store the
statistics named take the place of those that advice reads (analysis/studies/advice/whole_runs.json)."""

from analysis.scene.scene import read_scene
from analysis.studies.advice.whole_runs import STORED
from analysis.studies.work_precision import whole_runs as measured
from analysis.studies.work_precision.point import content_of, read_points, write_points
from analysis.support.files import write_json
from benchmarks.machine import describe, options, table

MODELS = (
    "rigid:0.001", "rigid:0.005", "rigid:0.02", "lammps:1e6", "lammps:1e7", "lammps:1e8",
    "yade:1e6", "yade:1e7",
)  # fmt: skip
# Frames per second: windows of 0.1 s.
FRAMES = 10


def setting_of(model: str) -> measured.RunSetting:
    """Read ENGINE:NUMBER."""
    engine, _, value = model.partition(":")
    if engine == measured.RIGID:
        return measured.RunSetting(engine=engine, step_s=float(value))
    return measured.RunSetting(engine=engine, stiffness_N_per_m=float(value))


def main() -> None:
    """Run every crowd by every model, one after the other, and compare them."""
    args = options(
        __doc__, "out", scene="scenes/arch.toml", crowds=10, duration=4.0, models=MODELS,
        read=False, store=(),
    )  # fmt: skip
    frames = round(FRAMES * args.duration)
    scene = read_scene(args.scene).with_run(duration_s=args.duration, frames=frames)
    settings = [setting_of(model) for model in args.models]
    every = measured.runs_of(settings, measured.crowds_of(scene, args.crowds), args.out)
    for _, _, run in [] if args.read else every:
        print(run.folder, f"{run.record().cpu_seconds:.2f} s", flush=True)
    found = measured.measure_whole_runs(scene, every, read_only=True)
    head = ["model", "crowds", "CPU s", "with impulses (s)", *measured.heads_of(found)]
    print(describe(), table(head, measured.whole_runs_rows(found)), sep="\n\n")
    write_points(args.out, found.points, measured.NAME, measured.WholeRunPoint)
    if args.store:
        selected = [one for one in read_points(STORED, measured.WholeRunPoint) if one.quantity not in args.store]
        new = [one for one in found.points if one.quantity in args.store]
        content = content_of([*selected, *new], measured.WholeRunPoint)
        write_json(STORED, content)
    measured.whole_runs_picture(found).savefig(args.out / "converge.png", dpi=120)


if __name__ == "__main__":
    main()
