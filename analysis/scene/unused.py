"""What commands do not use of a scene or room file, all of it here: keys, or whole tables."""

from collections.abc import Collection
from pathlib import Path

from analysis.scene.distance import Distance
from analysis.scene.scene import file_content
from analysis.support.reading import note_unused

SPRINGS = frozenset(
    f"contact.{key}" for key in ("law", "stiffness_N_per_m", "young_modulus_Pa", "poisson_ratio",
                                 "tangential_ratio", "wall_stiffness_N_per_m")
)  # fmt: skip
RIGID_RUN = frozenset(["run.rigid_step_s", "run.rigid_tolerance"])
# Rigid bodies at single instants, for which others ran or that somebody filmed.
INSTANTS = SPRINGS | {"run", "analysis.time_s"}
# A crowd that is put into a room is another one.
CROWD = frozenset(["disks", "reconciliation", "other_frames"])
PRESSING = frozenset(
    ["body_force", "contact.arm_reach_m", "contact.arm_force_N", "drive.speed_m_per_s", "drive.push_N",
     "drive.aim", "drive.relaxation_time_s", "drive.goals", "drive.stops", "drive.clearance_m",
     *(f"drive.{key}" for key in Distance.model_fields)]
)  # fmt: skip
# By the command, or by the left velocity of percussions.
UNUSED = {
    "lammps": RIGID_RUN,
    "yade": RIGID_RUN,
    "rigid": SPRINGS | {"run.time_step_s", "run.drive_interval_steps", "run.impulses"},
    "left velocity desired": INSTANTS | {"contact.restitution"},
    "left velocity free": INSTANTS | {"contact.restitution"},
    "left velocity dump": INSTANTS | PRESSING,
    "import": CROWD,
}
# Of what runs use, that which needs another table or key.
BESIDE = {
    "contact.tangential_ratio": "contact.friction",
    "contact.wall_stiffness_N_per_m": "walls",
    "run.drive_interval_steps": "drive",
}


def note_unused_keys(room: str | Path, command: str, more: Collection[str] = ()) -> None:
    """Say in one line which keys that a scene or room file states are not used.

    command: of `UNUSED`; more: further keys or tables

    Raises SceneError for a file that cannot be read."""
    path, content = file_content(room)
    tables = {name: keys for name, keys in content.items() if isinstance(keys, dict)}
    stated = {f"{name}.{key}" for name, keys in tables.items() for key in keys if keys[key]}
    unused = {
        *UNUSED[command],
        *more,
        *(key for key in BESIDE if BESIDE[key] not in {*stated, *content}),
    }
    names: list[str] = []
    for name, keys in tables.items():
        mine = [f"{name}.{key}" for key in keys if {name, f"{name}.{key}"} & unused]
        names += [name] if mine and len(mine) == len(keys) else mine
    note_unused(path, f"keys ({command})", names)
