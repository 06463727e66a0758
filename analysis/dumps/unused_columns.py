"""A dump that no engine here wrote: what of it is not used, and what it may mean otherwise."""

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from analysis.dumps.bodies import JOINED, BodyColumns
from analysis.dumps.find_frames import DumpError
from analysis.support.reading import note, note_unused
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats

# Sizes of which half are outside of these may be in another unit.
PEOPLE = {"radius": (0.0, 2.0), "mass": (0.5, 1000.0)}
# Disks of one `mol` nearer than this share of the smallest radius may be one body. One that is that of
# all disks, and more than so many, is a label.
NEAR, MOST_DISKS = 1e-3, 16


def look_at(columns: BodyColumns, data: Mapping[str, Floats]) -> None:
    """Look at the first frame of a dump, and at its sample. Raises DumpError for sizes of no person and
    for disks that may be one body, where nothing is stated."""
    path, stated, names = columns.index.path, columns.stated, columns.index.columns
    for name, unit, message, how in (
        ("radius", "m", stated.unit, "the unit of its lengths: m, cm or mm (--unit)"),
        ("mass", "kg", stated.mass_unit, "their unit: kg or g (--mass-unit)"),
    ):
        middle = float(np.median(data[name])) if len(data[name]) else 1.0
        if message is None and not PEOPLE[name][0] <= middle <= PEOPLE[name][1]:
            words = f"{middle:g} {unit} in the middle, which is no person. Say {how}"
            raise DumpError(f"{path}: {name}: {words}")
    of_walls = {f"{fix}[{k}]" for fix in wall_fixes(names) for k in range(1, 9)}
    note_unused(path, "columns", (name for name in names if name not in columns.used | of_walls))
    if of_walls:
        note(path, f"{', '.join(wall_fixes(names))}: forces on walls, one a disk and fix, for --contacts without walls")
    if "type" in names and not stated.fixed_type:
        _say_types(columns, {f"{kind:g}" for kind in data["type"]})
    if "mol" in names and stated.mol is None and not {*JOINED} <= {*names}:
        _refuse_clumps(columns, data)


def wall_fixes(names: Iterable[str]) -> tuple[str, ...]:
    """Name LAMMPS' fixes wall/gran … contacts of which all eight columns are there."""
    has = {*names}
    fixes = sorted({name[:-3] for name in has if name.startswith("f_") and name.endswith("[8]")})
    return tuple(fix for fix in fixes if {f"{fix}[{k}]" for k in range(1, 9)} <= has)


def _say_types(columns: BodyColumns, types: set[str]) -> None:
    """Say that all types are people, where there are several or one never moves and others do, in the
    rows of the sample."""
    names, moving = columns.index.columns, set()
    positions: dict[str, set[tuple[str, ...]]] = defaultdict(set)
    for words in columns.index.sample:
        row = dict(zip(names, words, strict=True))
        positions[row["id"]].add(tuple(row[name] for name in columns.place[:2]))
        still = {*row.get("vx", "0"), *row.get("vy", "0")} <= {*"+-.0"}
        if not still or len(positions[row["id"]]) > 1:
            moving.add(row["type"])
    still_types = sorted(types - moving) if moving else []
    if still_types or len(types) > 1:
        never = f" Type {' and '.join(still_types)} never moves." if still_types else ""
        message = f"types {', '.join(sorted(types))}.{never} Fixed ones: --fixed-type"
        note(columns.index.path, f"all rows are taken as people: {message}")


def _refuse_clumps(columns: BodyColumns, data: Mapping[str, Floats]) -> None:
    """Refuse disks of one `mol` that touch, as those of LAMMPS' fix rigid/small do."""
    mol, position = data["mol"], np.column_stack([data["x"], data["y"]])
    if len(mol) > MOST_DISKS and not np.ptp(mol):
        return
    try:
        now = Snapshot(position=position, radius=data["radius"], mass=data["mass"])
        near = find_contacts(now, tolerance=NEAR * float(now.radius.min(initial=1.0)))
    except ValueError:  # whoever solves it says so
        return
    same = (mol[near.first] > 0) & (mol[near.first] == mol[near.second])
    if same.any():
        one, other = (int(data["id"][of[same.argmax()]]) for of in (near.first, near.second))
        raise DumpError(
            f"{columns.index.path}: mol: disks {one} and {other} of one mol touch. Say whether it is a "
            "rigid body (--mol rigid) or they move alone (--mol single)"
        )
