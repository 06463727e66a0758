"""Every key of a room: changed to another value it changes what a command computes, or the command
refuses it, or names it in a note as not used."""

import copy
import logging
import shutil
import tomllib
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import engine
from analysis.engines.programs import rigid
from analysis.engines.record import EngineError
from analysis.percussions import percussions_of
from analysis.percussions.setting import setting_beside
from analysis.scene.distance import Pusher
from analysis.scene.drive import Drive, Goal, Push, Stop
from analysis.scene.scene import Scene, read_room, read_scene
from analysis.scene.schema import Analysis, BodyForce, ContactModel, Material, Room, Run, Wall
from analysis.scene.unused import UNUSED, note_unused_keys
from analysis.studies.film.files import FileOptions, open_any
from tests.crowds import disks_at

# Two on a floor, one on both, one a hair and one an arm's length beside them.
PLACES = [[-0.25, 0.25], [0.25, 0.25], [0, 0.25 + np.sqrt(3) / 4], [0.7505, 0.25], [1.3, 0.25]]
DATA = tomllib.loads((Path(__file__).parents[1] / "data" / "room_keys.toml").read_text("utf-8"))
ROWS = [(one["key"], one["value"], one.get("beside", {})) for one in DATA["row"]]
LEFT_OUT = "left out"
# Words; and periods, which have tests of their own.
ELSEWHERE = {"title", "source", "period_x_m"}
# What a comparison reads beside a run.
NOT_OF_RUNS = {f"analysis.{key}" for key in Analysis.model_fields} | {"walls.0.name"}
OVERRULED = {"analysis.kind"}  # by --left-velocity


def patched(**changes):
    content = copy.deepcopy(DATA["room"])
    for name, value in changes.items():
        *tables, key = (int(part) if part.isdigit() else part for part in name.split("."))
        table = content
        for part in tables:
            table = table[part] if isinstance(part, int) else table.setdefault(part, {})
        if value == LEFT_OUT:
            table.pop(key, None)
        else:
            table[key] = copy.deepcopy(value)
    return content


def percussions(kind, folder, room):
    dump, inputs = folder / "crowd.dump", {} if kind is None else {"left_velocity": kind}
    inputs |= {"window": 0.01} if kind == "free" else {}
    setting = setting_beside(dump, room, **inputs)
    snapshot = snapshot_of(open_bodies(dump, 1e-2).trajectory[1], dump)
    return shown(percussions_of(setting, snapshot))


def shown(found):
    return found.unit, {name: np.asarray(one).tolist() for name, one in found.columns().items()}


def film(name, folder, room):
    step = {"time_step": 1e-2} if name.endswith("dump") else {"radius": 0.25}
    frames = list(open_any(folder / name, FileOptions(room=room, **step)).frames(None))
    if why := next((one.reason for one in frames if one.reason), ""):
        raise ValueError(why)
    return [shown(one.found) for one in frames]


def ran(name, folder, room):
    crowd = snapshot_of(open_bodies(folder / "crowd.dump").trajectory[0], folder)
    stated, _ = read_room(room, (0.25, 75.0))
    path = Scene.of(stated, name="scene", snapshot=crowd).write(folder / "scene")
    scene, out = read_scene(path), folder / "out"
    engine(name).check(scene)
    note_unused_keys(room, name)
    if name == "rigid":
        with redirect_stdout(StringIO()):
            assert rigid.main([str(path), "--out", str(out)]) == 0
    else:
        engine(name).write_input(scene, out)
    texts = {one.name: one.read_bytes() for one in sorted(out.iterdir())}
    shutil.rmtree(out)
    return texts | {"timing": engine(name).timing(scene)}


COMMANDS = {
    "solve": lambda *where: percussions(None, *where),
    **{f"solve {kind}": lambda *where, kind=kind: percussions(kind, *where) for kind in ("desired", "free", "dump")},
    **{f"film {name}": lambda *where, name=name: film(name, *where) for name in ("crowd.dump", "crowd.txt")},
    **{one: lambda *where, name=one[4:]: ran(name, *where) for one in ("run lammps", "run rigid")},
}  # fmt: skip


def leaves(model, position=""):
    """The keys of a table, with those of the tables in it."""
    inner = {"walls": Wall, "drive": Drive, "body_force": BodyForce, "contact": ContactModel, "run": Run,
             "analysis": Analysis, "goals": Goal, "stops": Stop, "pushers": Pusher}  # fmt: skip
    for key in model.model_fields:
        yield from leaves(inner[key], f"{position}{key}.") if key in inner else [f"{position}{key}"]


def test_every_key_has_a_row():
    more = {f"contact.{key}" for key in Material.model_fields} | {
        f"drive.{key}" for key in Push.model_fields
    }
    rows = {key.replace(".0.", ".") for key, _, _ in ROWS}
    assert {*leaves(Room)} | more <= rows | ELSEWHERE
    known = (
        set(rows)
        | {key.split(".")[0] for key in rows}
        | {"disks", "reconciliation", "other_frames"}
    )
    assert set().union(*UNUSED.values()) <= known


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_a_key_is_used_or_refused_or_named(tmp_path, caplog, command):
    crowd, silent = disks_at(PLACES, [0.1, -1.0]), []
    rows = [(k + 1, 1, *p, 0, 0.25, 75, 0.1, -1) for k, p in enumerate(crowd.position.tolist())]
    frame = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n5\nITEM: BOX BOUNDS ff ff pp\n-9 9\n-9 9\n-1 1\n"
    body = "ITEM: ATOMS id type x y z radius mass vx vy\n" + "".join(
        " ".join(map(str, row)) + "\n" for row in rows
    )
    (tmp_path / "crowd.dump").write_text("".join(frame.format(step) + body for step in (0, 1)))
    positions = [
        f"{k + 1} {f} {x:.9f} {y - 0.01 * (f + 1):.9f}\n"
        for f in range(2)
        for k, (x, y) in enumerate(PLACES)
    ]
    (tmp_path / "crowd.txt").write_text("# framerate: 100\n# id frame x/m y/m\n" + "".join(positions))
    room, caplog.handler.level = tmp_path / "room.toml", 0
    for key, value, beside in ROWS:
        key = key.replace("walls.", "walls.0.")
        found = []
        for changes in (beside, beside | {key: value}):
            room.write_text(tomli_w.dumps(patched(**changes)))
            caplog.clear()
            try:
                with caplog.at_level(logging.INFO, logger="analysis"):
                    found.append(COMMANDS[command](tmp_path, room))
            except (ValueError, EngineError) as error:
                found.append(str(error))
        named = (
            key in caplog.text or f" {key.split('.')[0]}" in caplog.text.partition("not used:")[2]
        )
        wanted = key in (
            NOT_OF_RUNS if command[:3] == "run" else OVERRULED if command[:6] == "solve " else ()
        )
        if found[0] == found[1] and not (named or wanted or isinstance(found[1], str)):
            silent.append((key, value))
    assert silent == []
