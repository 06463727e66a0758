"""percussions import."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import refuse_beside, warn
from analysis.cli.options import InputFile, Out, Positive, Seed, Share, Unit

if TYPE_CHECKING:
    from analysis.scene.real.import_crowd import ImportedCrowd

# Options that make disks of the heads of a trajectory.
OF_HEADS = (
    *("frame", "people", "radius", "mass", "radius_spread", "seed", "unit", "frame_rate"),
    *("window", "others", "apart"),
)


def import_(
    context: typer.Context,
    file: InputFile,
    *,
    room: InputFile,
    frame: int | None = None,
    one_disk: bool = False,
    radius: Positive = 0.18,
    mass: Positive = 75.0,
    radius_spread: Share = 0.0,
    people: str | None = None,
    seed: Seed = 1,
    name: str | None = None,
    unit: Unit | None = None,
    frame_rate: Positive | None = None,
    window: Positive = 0.4,
    others: Annotated[int, typer.Option(min=0, max=100)] = 4,
    apart: Positive = 1.0,
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
    name: Name of the scene. Default: the room's.
    others: Other frames that a report varies the crowd by. 0: none.
    apart: Time in s from one of these frames to the next.

    file: Trajectory file that PedPy can load, or AgentDynamics.xml of LEMONS, with its other files
        beside it.
    window: Time in s over which velocities are measured.

    Example: percussions import scenes/gate_excerpt.txt --frame 405 --room scenes/rooms/gate.toml
    --name mine"""
    if file.suffix.lower() == ".xml":
        refuse_beside(context, OF_HEADS, "only of a trajectory. Files of LEMONS say it")
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
    crowd = crowd_of(frame)
    imported, refused = with_other_frames(crowd, recording, others, apart, crowd_of)
    for reason in refused:
        warn(f"left out of the other frames: {reason}")
    print(imported.write(out))
    print(imported.statement)
    if more := imported.scene.other_frames:
        print(more.statement)


def _check_place(scene: Path, room: Path) -> None:
    if scene.exists() and scene.samefile(room):
        raise ValueError(f"{scene}: the scene would replace its room. Give --name or --out")


def _import_lemons(file: Path, room: Path, name: str | None, one_disk: bool, out: Path) -> None:
    from analysis.scene.real.lemons import read_lemons

    scene = read_lemons(file, one_disk=one_disk).into(room, name)
    _check_place(out / f"{scene.name}.toml", room)
    print(scene.write(out))
    print(scene.notes)
