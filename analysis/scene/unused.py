"""What commands do not use of a scene or room file, all of it here: keys, or whole tables, by their names."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

from analysis.scene.scene import file_content
from analysis.support.reading import note_unused

SPRINGS = frozenset(
    f"contact.{key}"
    for key in ("law", "stiffness_N_per_m", "young_modulus_Pa", "poisson_ratio", "tangential_ratio",
                "wall_stiffness_N_per_m")
)  # fmt: skip
RIGID_RUN = frozenset(["run.rigid_step_s", "run.rigid_tolerance"])
# Rigid bodies at single instants, for which others ran or that somebody filmed.
PERCUSSIONS = SPRINGS | {"run", "analysis.time_s"}
# A crowd that is put into a room is another one.
CROWD = frozenset(["disks", "reconciliation", "other_frames"])
IMPACT = frozenset(
    ["body_force", "contact.arm_reach_m", "contact.arm_force_N"]
    + [f"drive.{key}" for key in ("speed_m_per_s", "relaxation_time_s", "push_N", "aim")]
    + [f"drive.{key}" for key in ("goals", "stops", "clearance_m")]
)
UNUSED = {
    "run lammps": RIGID_RUN,
    "run yade": RIGID_RUN,
    "run rigid": SPRINGS | {"run.time_step_s", "run.drive_interval_steps", "run.impulses"},
    "desired": PERCUSSIONS | {"contact.restitution"},
    "free": PERCUSSIONS | {"contact.restitution"},
    "dump": PERCUSSIONS | IMPACT,
    "import": CROWD,
}
# Of those that are used only beside another table or key, these.
BESIDE = {
    "contact.tangential_ratio": "contact.friction",
    "contact.wall_stiffness_N_per_m": "walls",
    "run.drive_interval_steps": "drive",
}


def note_unused_keys(
    room: str | Path, command: str, *, more: Collection[str] = (), why: str = ""
) -> None:
    """Say in one line which keys that a scene or room file states are not used.

    command: of `UNUSED`, which has the left velocities of percussions too
    more: further keys or tables; why: what is said behind `keys`

    Raises SceneError for a file that cannot be read."""
    path, content = file_content(room)
    unused = {*UNUSED[command], *more}
    unused |= {key for key, other in BESIDE.items() if not _stated(content, other)}
    names: list[str] = []
    for table, keys in content.items():
        stated = [f"{table}.{key}" for key in keys] if isinstance(keys, dict) else []
        mine = [key for key in stated if key in unused or table in unused]
        names += [table] if mine and len(mine) == len(stated) else mine
    note_unused(path, f"keys{why}", names)


def _stated(content: dict[str, Any], name: str) -> Any:
    table, _, key = name.partition(".")
    return content.get(table, {}).get(key) if key else content.get(table)
