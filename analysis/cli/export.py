"""percussions export."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from analysis.cli.app import command_line, drop_none, warn
from analysis.cli.options import Openness, Out, Taken

if TYPE_CHECKING:
    from analysis.percussions import SnapshotPercussions


def export(
    target: Path,
    *,
    fclib: Out,
    taken: Taken,
    frame: int | None = None,
    local: bool = False,
    openness: Openness = "ranges",
) -> None:
    """Write the contact problem of one instant as an FCLIB file, with its answer.

    Global form, in the plane. Contacts are inelastic, with friction. The groups /crowd (bodies,
    walls, units, dt, origin) and /truth (rank, determined, intervals) are beside FCLIB's own.
    `percussions solve FILE` reads it back.

    Exit status 1 if the problem is not solved. It is then written without a solution.

    target: Folder of a run, a LAMMPS dump, or a scene (its name or .toml file).
    fclib: HDF5 file to write.
    frame: Of a run or dump: its number from 0, or from the end: -1. Default: the last.
    local: Write FCLIB's local form W r + q too.

    Example: percussions export out/gate/lammps_hooke_k1e+06 --fclib gate.hdf5"""
    from analysis.exchange.fclib import write_problem

    dump = target / "bodies.dump" if target.is_dir() else target
    if dump.is_file() and dump.suffix != ".toml":
        if fclib.exists() and fclib.samefile(dump):
            raise ValueError(f"--fclib: {fclib}: it would replace what it is made of")
        found, origin = _of_dump(dump, frame, taken)
    elif target.is_dir():
        raise ValueError(f"{dump}: no such file, so {target} is no folder of a run")
    else:
        named = drop_none(frame=frame, room=taken.room) | taken.of_dump()
        if named:
            name = next(iter(named)).replace("_", "-")
            raise ValueError(f"--{name}: only of a run or a dump, and {target} is a scene")
        found, origin = _of_scene(target, taken)
    write_problem(
        fclib, found, origin | {"command": command_line()}, local=local, openness=openness
    )
    print(f"{len(found.snapshot)} people, {len(found.contacts)} contacts")
    print(fclib)
    solved = found.answer.status == "solved"
    if not solved:
        print(f"{fclib}: {found.answer.status}: {found.answer.reason}", file=sys.stderr)
    raise typer.Exit(not solved)


def _of_dump(
    dump: Path, frame: int | None, taken: Taken
) -> tuple[SnapshotPercussions, dict[str, str]]:
    """The percussions of a frame, and where it is from."""
    from analysis.dumps import open_bodies, snapshot_of
    from analysis.percussions import percussions_of
    from analysis.percussions.setting import setting_beside

    setting = setting_beside(dump, taken.room, **taken.setting())
    trajectory = open_bodies(dump, **taken.of_dump()).trajectory
    number, count = -1 if frame is None else frame, len(trajectory)
    if not -count <= number < count:
        raise ValueError(f"--frame: {number} where {dump} has {count}, from 0")
    ts = trajectory[number % count]
    snapshot = snapshot_of(ts, dump, needs_velocity=setting.moves)
    step = str(int(ts.data["step"]))
    try:
        found = percussions_of(setting, snapshot, tolerance=taken.tolerance)
    except ValueError as error:
        raise ValueError(f"{dump}, step {step}: {error}") from None
    return found, {"source": str(dump), "step": step}


def _of_scene(target: Path, taken: Taken) -> tuple[SnapshotPercussions, dict[str, str]]:
    """The percussions of a scene's initial state, and where it is from."""
    import dataclasses

    from analysis.percussions import Setting, percussions_of
    from analysis.scene import read_scene

    scene = read_scene(target)
    setting = dataclasses.replace(Setting.of(scene), **taken.setting())
    if scene.analysis.kind == "impact" and scene.contact.restitution:
        said = f"contact.restitution: {scene.contact.restitution:g}"
        warn(f"{target}: {said}. FCLIB has inelastic contacts, and those are written")
    found = percussions_of(setting, scene.snapshot, tolerance=taken.tolerance)
    origin = {"source": scene.title, "scene": scene.name, "scene_sha256": scene.digest()}
    return found, origin
