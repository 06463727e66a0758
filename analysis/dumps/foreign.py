"""A dump that no engine here wrote: what of it is not used, and what it may mean otherwise."""

from __future__ import annotations

import logging
import math
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from analysis.dumps.bodies import JOINED, BodyColumns
from analysis.dumps.frames import DumpError
from analysis.support.reading import NOTE, NUMBER, note_unused
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats

# Where half of the disks have a larger radius (m), or a mass (kg) outside of these, the dump may be in
# another unit.
LARGEST_PERSON, MASSES_OF_PEOPLE = 2.0, (0.5, 1000.0)
# Disks of one `mol` nearer than this share of the smallest radius may be one body. One that is that of
# all disks, and more than so many, is a label.
NEAR, MOST_DISKS = 1e-3, 16
log = logging.getLogger(__name__)


def look_at(columns: BodyColumns, data: Mapping[str, Floats]) -> None:
    """Look at the first frame of a dump, and at its sample. Raises DumpError for sizes of no person and
    for disks that may be one body, where nothing is stated."""
    path, stated, names = columns.index.path, columns.stated, columns.index.columns
    for name, unit, said, (least, most), units in (
        (
            "radius",
            "m",
            stated.unit,
            (0.0, LARGEST_PERSON),
            "the unit of its lengths: m, cm or mm (--unit)",
        ),
        ("mass", "kg", stated.mass_unit, MASSES_OF_PEOPLE, "their unit: kg or g (--mass-unit)"),
    ):
        middle = float(np.median(data[name])) if len(data[name]) else most
        if said is None and not least <= middle <= most:
            raise DumpError(
                f"{path}: {name}: {middle:g} {unit} in the middle, which is no person. Say {units}"
            )
    note_unused(path, "columns", (name for name in names if name not in columns.used))
    if "type" in names:
        _say_types(columns, {int(one) for one in data["type"].tolist() if math.isfinite(one)})
    if "mol" in names and stated.mol is None and not {*JOINED} <= {*names}:
        _refuse_clumps(columns, data)


def _say_types(columns: BodyColumns, types: set[int]) -> None:
    """Say which types are people, where there are several or one never moves, and none is fixed."""
    still = sorted(types & _still(columns)) if not columns.stated.fixed_type else []
    if still or (len(types) > 1 and not columns.stated.fixed_type):
        listed = ", ".join(map(str, sorted(types)))
        never = f" Type {' and '.join(map(str, still))} never moves." if still else ""
        words = "%s: all rows are taken as people: types %s.%s Fixed ones: --fixed-type"
        log.log(NOTE, words, columns.index.path, listed, never)


def _still(columns: BodyColumns) -> set[int]:
    """The types whose disks never move where others do, in the rows of the sample."""
    where = {name: k for k, name in enumerate(columns.index.columns)}
    axes = [where[name] for name in columns.place[:2]]
    speed = [where[name] for name in ("vx", "vy") if name in where]
    places: dict[Any, set[Any]] = defaultdict(set)
    moving, types = set(), set()
    for row in columns.index.sample:
        words = [row[where[name]] for name in ("id", "type")] + [row[k] for k in (*axes, *speed)]
        if not all(map(NUMBER.fullmatch, words)):
            continue
        one, kind = float(words[0]), int(float(words[1]))
        places[one].add((*words[2:4],))
        types.add(kind)
        if any(map(float, words[4:])) or len(places[one]) > 1:
            moving.add(kind)
    return types - moving if moving else set()


def _refuse_clumps(columns: BodyColumns, data: Mapping[str, Floats]) -> None:
    """Refuse disks of one `mol` that touch, as those of LAMMPS' fix rigid/small do."""
    mol, place = data["mol"], np.column_stack([data["x"], data["y"]])
    if len(mol) > MOST_DISKS and not np.ptp(mol):
        return
    try:
        now = Snapshot(position=place, radius=data["radius"], mass=data["mass"])
        near = find_contacts(now, tolerance=NEAR * float(now.radius.min(initial=1.0)))
    except ValueError:  # whoever solves it says so
        return
    second = np.where(near.is_wall, near.first, near.second)
    same = (mol[near.first] > 0) & (mol[near.first] == mol[second])
    if same.any():
        one, other = (int(data["id"][of[same.argmax()]]) for of in (near.first, second))
        raise DumpError(
            f"{columns.index.path}: mol: disks {one} and {other} of one mol touch. Say whether it is a "
            "rigid body (--mol rigid) or they move alone (--mol single)"
        )
