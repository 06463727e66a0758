"""Every key of a room: changed to another value it changes what a command computes, or the command
refuses it, or names it in a note as not used."""

import copy
import logging
import shutil
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest
import tomli_w

from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import engine
from analysis.engines.programs import rigid
from analysis.engines.record import EngineError
from analysis.film.files import Given, open_any
from analysis.percussions import percussions_of
from analysis.percussions.setting import setting_beside
from analysis.scene.drive import Drive, Goal, Push, Stop
from analysis.scene.scene import Scene, read_room, read_scene
from analysis.scene.schema import Analysis, BodyForce, ContactModel, Material, Room, Run, Wall
from analysis.scene.unused import UNUSED, note_unused_keys
from tests.crowds import disks_at

# Two on a floor, one on both, one a hair and one an arm's length beside them.
PLACES = [[-0.25, 0.25], [0.25, 0.25], [0, 0.25 + np.sqrt(3) / 4], [0.7505, 0.25], [1.3, 0.25]]
BOX = {"floor": [-2, 0, 2, 0], "right": [2, 0, 2, 3], "top": [2, 3, -2, 3], "left": [-2, 3, -2, 0]}
ROOM = {
    "title": "a", "source": "b",
    "walls": [{"name": n, "start_m": e[:2], "end_m": e[2:]} for n, e in BOX.items()],
    "drive": {"speed_m_per_s": 1.0, "relaxation_time_s": 0.5, "outward": [0.0, -1.0],
              "door_start_m": [-0.1, 0.0], "door_end_m": [0.3, 0.0]},
    "contact": {"stiffness_N_per_m": 1e5, "restitution": 0.3, "friction": 0.2},
    "run": {"duration_s": 0.02, "frames": 2}, "analysis": {"kind": "driven"},
}  # fmt: skip
NO = {"drive": None}
ARMS = {"contact.friction": None, "contact.arm_reach_m": 0.1, "contact.arm_force_N": 30.0}
STEP = {"run.time_step_s": 1e-5}
PEOPLE = {"people": [1, 1], "outward": [1.0, 0.0]}
GOAL = PEOPLE | {"door_start_m": [1.0, 0.0], "door_end_m": [1.5, 0.0]}
STOP = {"people": [1, 2], "time_s": 5e-3}
SLOPE = {"drive": None, "body_force.slope_deg": 10.0, "body_force.downhill": [0.0, -1.0]}
HERTZ = {"contact.law": "hertz", "contact.stiffness_N_per_m": None, "contact.friction": None,
         "contact.young_modulus_Pa": 1e5, "contact.poisson_ratio": 0.3}  # fmt: skip
PUSH = {"drive.speed_m_per_s": None, "drive.push_N": 100.0}
GIVES = {"walls.0.end_m": [1.99, 0.0], "walls.0.mass_kg": 50.0, "walls.3.end_m": [-2.0, 0.01],
         "walls.0.start_m": [-1.99, 0.0], "walls.0.stiffness_N_per_m": 1e4}  # fmt: skip
BAR = {"drive.door_start_m": [2.0, 1.0], "drive.door_end_m": [2.0, 2.5], "drive.outward": [1.0, 0.0],
       "walls": [*ROOM["walls"][::2], ROOM["walls"][3], *({"name": n, "start_m": [x, a], "end_m": [x, b]} for n, x, a, b in (
           ("under", 2.0, 0.0, 1.0), ("over", 2.0, 2.5, 3.0), ("bar", 1.02, 0.0, 1.0)))]}  # fmt: skip
# Key, another value of it, and what else the room says before and after.
ROWS = [
    ("walls.name", "kerb", {}), ("walls.start_m", [-0.3, 0.0], {}), ("walls.end_m", [0.3, 0.0], {}),
    ("walls.mass_kg", 90.0, GIVES), ("walls.stiffness_N_per_m", 2e4, GIVES),
    ("walls.damping_N_s_per_m", 50.0, GIVES),
    ("drive.speed_m_per_s", 2.0, {}), ("drive.relaxation_time_s", 0.3, {}),
    ("drive.push_N", 200.0, PUSH), ("drive.outward", [0.6, -0.8], {"drive.door_start_m": None, "drive.door_end_m": None}),
    ("drive.door_start_m", [-0.5, 0.0], {}), ("drive.door_end_m", [0.2, 0.0], {}),
    ("drive.aim", "centre", {}), ("drive.clearance_m", 0.1, BAR),
    ("drive.goals", [GOAL], {}), ("drive.stops", [STOP], {}),
    *((f"drive.goals.0.{key}", value, {"drive.goals": [GOAL]}) for key, value in (
        ("people", [2, 3]), ("door_start_m", [0.9, 0.0]), ("door_end_m", [0.4, 0.0]))),
    ("drive.goals.0.outward", [0.0, -1.0], {"drive.goals": [PEOPLE]}),
    *((f"drive.stops.0.{key}", value, {"drive.stops": [STOP]})
      for key, value in (("people", [2, 3]), ("time_s", 5.0))),
    ("body_force.acceleration_m_per_s2", [1.0, -2.0], {}),
    ("body_force.acceleration_m_per_s2", [1.0, -2.0], NO | {"body_force.acceleration_m_per_s2": [0.0, -1.0]}),
    ("body_force.slope_deg", 20.0, SLOPE), ("body_force.downhill", [0.6, -0.8], SLOPE),
    ("contact.law", "hertz", {"contact.friction": None}), ("contact.stiffness_N_per_m", 2e5, {}),
    ("contact.wall_stiffness_N_per_m", 2e5, {}), ("contact.restitution", 0.6, {}),
    ("contact.restitution", 0.6, NO), ("contact.friction", 0.4, {}), ("contact.friction", 0.4, NO),
    ("contact.tangential_ratio", 0.5, {}), ("contact.tangential_ratio", 0.5, {"contact.friction": None}),
    ("contact.young_modulus_Pa", 2e5, HERTZ), ("contact.poisson_ratio", 0.1, HERTZ),
    ("contact.arm_reach_m", 0.2, ARMS), ("contact.arm_force_N", 60.0, ARMS),
    ("run.duration_s", 0.04, STEP), ("run.frames", 4, STEP), ("run.time_step_s", 2e-5, STEP),
    ("run.drive_interval_steps", 3, STEP), ("run.drive_interval_steps", 3, STEP | NO),
    ("run.rigid_step_s", 1e-3, {}), ("run.rigid_tolerance", 1e-3, {}), ("run.impulses", True, {}),
    ("analysis.kind", "impact", {}), ("analysis.time_s", 0.01, {}),
    ("analysis.time_s", 0.01, {"analysis.kind": "impact"}), ("analysis.contact_tolerance_m", 0.06, {}),
]  # fmt: skip
# Words; and periods, which have tests of their own.
ELSEWHERE = {"title", "source", "period_x_m"}
# What a comparison reads beside a run.
NOT_OF_RUNS = {f"analysis.{key}" for key in Analysis.model_fields} | {"walls.0.name"}
OVERRULED = {"analysis.kind"}  # by --left-velocity


def patched(**changes):
    content = copy.deepcopy(ROOM)
    for name, value in changes.items():
        *tables, key = (int(part) if part.isdigit() else part for part in name.split("."))
        table = content
        for part in tables:
            table = table[part] if isinstance(part, int) else table.setdefault(part, {})
        if value is None:
            table.pop(key, None)
        else:
            table[key] = copy.deepcopy(value)
    return content


def percussions(kind, folder, room):
    dump, given = folder / "crowd.dump", {} if kind is None else {"left_velocity": kind}
    given |= {"window": 0.01} if kind == "free" else {}
    setting = setting_beside(dump, room, **given)
    snapshot = snapshot_of(open_bodies(dump, 1e-2).trajectory[1], dump)
    return shown(percussions_of(setting, snapshot))


def shown(found):
    return found.unit, {name: np.asarray(one).tolist() for name, one in found.columns().items()}


def film(name, folder, room):
    step = {"time_step": 1e-2} if name.endswith("dump") else {"radius": 0.25}
    frames = list(open_any(folder / name, Given(room=room, **step)).frames(None))
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
    texts = {one.name: one.read_text() for one in sorted(out.iterdir())}
    shutil.rmtree(out)
    return texts | {"timing": engine(name).timing(scene)}


COMMANDS = {
    "solve": lambda *where: percussions(None, *where),
    **{f"solve {kind}": lambda *where, kind=kind: percussions(kind, *where) for kind in ("desired", "free", "dump")},
    **{f"film {name}": lambda *where, name=name: film(name, *where) for name in ("crowd.dump", "crowd.txt")},
    **{one: lambda *where, name=one[4:]: ran(name, *where) for one in ("run lammps", "run rigid")},
}  # fmt: skip


def leaves(model, place=""):
    """The keys of a table, with those of the tables in it."""
    inner = {"walls": Wall, "drive": Drive, "body_force": BodyForce, "contact": ContactModel, "run": Run,
             "analysis": Analysis, "goals": Goal, "stops": Stop}  # fmt: skip
    for key in model.model_fields:
        yield from leaves(inner[key], f"{place}{key}.") if key in inner else [f"{place}{key}"]


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


@pytest.mark.parametrize("command", COMMANDS)
def test_a_key_is_used_or_refused_or_named(tmp_path, caplog, command):
    crowd, silent = disks_at(PLACES, [0.1, -1.0]), []
    rows = [(k + 1, 1, *p, 0, 0.25, 75, 0.1, -1) for k, p in enumerate(crowd.position.tolist())]
    frame = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n5\nITEM: BOX BOUNDS ff ff pp\n-9 9\n-9 9\n-1 1\n"
    body = "ITEM: ATOMS id type x y z radius mass vx vy\n" + "".join(
        " ".join(map(str, row)) + "\n" for row in rows
    )
    (tmp_path / "crowd.dump").write_text("".join(frame.format(step) + body for step in (0, 1)))
    heads = [
        f"{k + 1} {f} {x:.9f} {y - 0.01 * (f + 1):.9f}\n"
        for f in range(2)
        for k, (x, y) in enumerate(PLACES)
    ]
    (tmp_path / "crowd.txt").write_text("# framerate: 100\n# id frame x/m y/m\n" + "".join(heads))
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
