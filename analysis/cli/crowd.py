"""Commands that make crowds and run them: scenes, run, import."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.table import Table

from analysis.cli.app import Out, SceneName, progress

commands = typer.Typer()

Stiffness = Annotated[
    float | None, typer.Option(help="Contact stiffness in N/m, instead of the scene's.")
]


@commands.command()
def scenes(
    make: Annotated[
        str | None, typer.Option(help="Make this scene anew instead of listing.")
    ] = None,
    disks: Annotated[int | None, typer.Option(help="Number of disks.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    out: Out = Path("."),
) -> None:
    """List the scenes, or make one of any size.

    Example: percussions scenes --make arch --disks 5000 --seed 3 --out mine
    """
    from analysis.scene.scene import read_scene, scene_names
    from analysis.scene.shipped_scenes import make as make_scene

    if make is not None:
        scene = make_scene(make, disks, seed)
        scene.check(scene.name)
        print(scene.write(out))
        return
    table = Table("scene", "disks", "what", "compared")
    for name in scene_names():
        scene = read_scene(name)
        compared = "force against p/τ" if scene.analysis.kind == "driven" else "∫f dt against p"
        table.add_row(name, str(len(scene.snapshot)), scene.title, compared)
    Console().print(table)


@commands.command()
def run(
    scene: SceneName,
    engine: Annotated[
        str | None,
        typer.Option(help="lammps or yade; lammps if left out, or what --error chooses."),
    ] = None,
    error: Annotated[
        str | None,
        typer.Option(
            help="Let law, stiffness and time step be advised for this error, such as 5%."
        ),
    ] = None,
    stiffness: Stiffness = None,
    restitution: Annotated[float | None, typer.Option(help="Asked restitution, 0 to 1.")] = None,
    law: Annotated[str | None, typer.Option(help="hooke or hertz.")] = None,
    time_step: Annotated[
        float | None, typer.Option(help="Time step in s, instead of the rule's.")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time in s.")] = None,
    out: Out = Path("out"),
) -> None:
    """Run a scene with one engine.

    Example: percussions run arch --engine yade --stiffness 1e7
    """
    from analysis.engines.run import run_engine, run_folder
    from analysis.scene.scene import read_scene

    chosen = read_scene(scene)
    if error is not None and (stiffness, law, time_step) != (None, None, None):
        raise ValueError(
            "error: it chooses law, stiffness and time step; leave out --law, --stiffness, --time-step"
        )
    for warning in chosen.check(scene):
        print(f"warning: {warning}", file=sys.stderr)
    contact = {"stiffness_N_per_m": stiffness, "restitution": restitution, "law": law}
    chosen = chosen.with_contact(
        **{key: value for key, value in contact.items() if value is not None}
    )
    timing = {"time_step_s": time_step, "duration_s": duration}
    chosen = chosen.with_run(**{key: value for key, value in timing.items() if value is not None})
    if error is not None:
        from analysis.advice.advised_run import scene_within

        chosen, engine, choice = scene_within(chosen, error, engine)
        print(f"advised: {choice}")
    engine = engine or "lammps"
    folder = run_folder(out, chosen, engine)
    with progress() as report:
        record = run_engine(chosen, engine, folder, report)
    print(
        f"{folder}: {record.steps} steps of {record.time_step_s:.3g} s, restitution obtained "
        f"{record.restitution_most:.3g}, {record.cpu_seconds:.2f} CPU s"
    )


@commands.command(name="import")
def import_(
    file: Annotated[Path, typer.Argument(help="Trajectory file that PedPy can load.")],
    frame: Annotated[int, typer.Option(help="Number of the frame.")],
    room: Annotated[
        Path,
        typer.Option(help="TOML file with walls, drive, contact, run and analysis, as in a scene."),
    ],
    radius: Annotated[float, typer.Option(help="Radius of each disk in m.")] = 0.18,
    mass: Annotated[float, typer.Option(help="Mass of each person in kg.")] = 75.0,
    name: Annotated[
        str | None, typer.Option(help="Name of the scene; the room's by default.")
    ] = None,
    unit: Annotated[
        Literal["m", "cm"] | None, typer.Option(help="Unit of the file, where it does not say.")
    ] = None,
    frame_rate: Annotated[
        float | None, typer.Option(help="Frames per second, where the file does not say.")
    ] = None,
    window: Annotated[
        float, typer.Option(help="Time in s over which velocities are measured.")
    ] = 0.4,
    out: Out = Path("."),
) -> None:
    """Turn one frame of a real trajectory into a scene: heads become disks, overlaps are reconciled
    and reported.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    from analysis.scene.real.import_crowd import import_crowd

    imported = import_crowd(
        file,
        frame=frame,
        radius=radius,
        room=room,
        mass=mass,
        name=name,
        unit=unit,
        frame_rate=frame_rate,
        window_s=window,
    )
    print(imported.write(out))
    assert imported.scene.reconciliation is not None
    print(imported.scene.reconciliation.statement)
