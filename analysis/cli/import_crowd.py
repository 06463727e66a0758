"""percussions import."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import Out, input_file, positive, refuse_beside, share, warn
from analysis.cli.options import FrameRate, Mass, Unit

if TYPE_CHECKING:
    from analysis.scene.real.import_crowd import ImportedCrowd

# Options that make disks of the heads of a trajectory.
OF_HEADS = (
    *("frame", "people", "radius", "mass", "radius_spread", "seed", "unit", "frame_rate"),
    *("window", "others", "apart"),
)


def import_(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(parser=input_file)],
    room: Annotated[Path, typer.Option(parser=input_file)],
    frame: int | None = None,
    one_disk: Annotated[bool, typer.Option("--one-disk")] = False,
    radius: Annotated[float, typer.Option(parser=positive)] = 0.18,
    mass: Mass = 75.0,
    radius_spread: Annotated[float, typer.Option(parser=share)] = 0.0,
    people: str | None = None,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    name: str | None = None,
    unit: Unit = None,
    frame_rate: FrameRate = None,
    window: Annotated[float, typer.Option(parser=positive)] = 0.4,
    others: Annotated[int, typer.Option(min=0, max=100)] = 4,
    apart: Annotated[float, typer.Option(parser=positive)] = 1.0,
    out: Out = Path("."),
) -> None:
    """Turn a frame of a real trajectory, and frames near it, or a crowd of LEMONS into a scene.

    room: TOML file with walls, drive, contact, run and analysis, as in a scene.
    frame: Of a trajectory: number of the frame.
    one_disk: Of LEMONS: take a person of several disks as one of the same area.
    radius: Radius of each disk in m.
    radius_spread: Radii are uniform within this share about --radius.
    people: Radii and masses of a survey instead: 'ANSUR II', … men, … women.
    seed: Seed of radii and masses.
    name: Name of the scene; the room's by default.
    others: Other frames that a report varies the crowd by; 0: none.
    apart: Time in s from one of these frames to the next.

    file: Trajectory file that PedPy can load, or AgentDynamics.xml of LEMONS, with its other files
        beside it.
    window: Time in s over which velocities are measured.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    if file.suffix.lower() == ".xml":
        refuse_beside(context, OF_HEADS, "only of a trajectory; LEMONS' files say it themselves")
        _import_lemons(file, room, name, one_disk, out)
        return
    if people is not None:
        sizes = ("radius", "radius_spread", "mass")
        refuse_beside(context, sizes, "--people has radii and masses of its own")
    if frame is None or one_disk:
        raise ValueError("--frame: of a trajectory it is needed, and --one-disk is for LEMONS")
    from analysis.scene.anthropometry import Varied
    from analysis.scene.real.import_crowd import import_crowd, with_other_frames
    from analysis.scene.real.trajectory import Recording

    recording = Recording.read(file, unit=unit, frame_rate=frame_rate)

    def crowd_of(number: int) -> ImportedCrowd:
        after = number - frame
        own = seed + 2 * abs(after) - (after > 0)  # each frame has its own
        varied = Varied(people=people, radius_share=radius_spread, seed=own)
        heads = recording.heads(number, window)
        return import_crowd(heads, radius=radius, room=room, mass=mass, name=name, varied=varied)

    _check_place(out / f"{name or room.stem}.toml", room)
    _write(*with_other_frames(crowd_of(frame), recording, others, apart, crowd_of), out)


def _write(imported: ImportedCrowd, refused: list[str], out: Path) -> None:
    for reason in refused:
        warn(f"left out of the other frames: {reason}")
    print(imported.write(out))
    print(imported.statement)
    if others := imported.scene.other_frames:
        print(others.statement)


def _check_place(scene: Path, room: Path) -> None:
    if scene.exists() and scene.samefile(room):
        raise ValueError(f"{scene}: the scene would replace its room; give --name or --out")


def _import_lemons(file: Path, room: Path, name: str | None, one_disk: bool, out: Path) -> None:
    from analysis.scene.real.lemons import read_lemons

    scene = read_lemons(file, one_disk=one_disk).into(room, name)
    _check_place(out / f"{scene.name}.toml", room)
    print(scene.write(out))
    print(scene.notes)
