"""Contact dumps: who touches whom, and with which force, as an engine wrote it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from analysis.dumps.frame import DumpError
from analysis.dumps.index import index_dump
from analysis.dumps.table import DumpIndex
from nscd.arrays import Flags, Floats, Indices

CONTACT_COLUMNS = ("first", "second", "is_wall", "nx", "ny", "overlap", "fx", "fy")
# Normals are unit vectors to this.
UNIT = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EngineContacts:
    """Hold contacts as an engine wrote them at one step.

    first: (k,) id of a disk
    second: (k,) id of the other disk, or the wall's number from 1 where is_wall
    is_wall: (k,)
    normal: (k,2), first→second
    overlap: (k,) m
    force: (k,2) N, of the first on the second
    """

    first: Indices
    second: Indices
    is_wall: Flags
    normal: Floats
    overlap: Floats
    force: Floats

    def __len__(self) -> int:
        return len(self.first)

    def select(self, keep: Flags) -> EngineContacts:
        """Take the contacts that a mask chooses, in their order."""
        names = [field.name for field in fields(self)]
        return EngineContacts(**{name: getattr(self, name)[keep] for name in names})

    @classmethod
    def joined(cls, parts: Sequence[EngineContacts]) -> EngineContacts:
        """Join the contacts of several steps, one after the other."""
        names = [field.name for field in fields(cls)]
        return cls(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})


def index_contacts(path: Path) -> DumpIndex:
    """Index a contact dump. Raises DumpError for missing columns and whatever `index_dump`
    finds."""
    index = index_dump(path, "ENTRIES")
    missing = [name for name in CONTACT_COLUMNS if name not in index.columns]
    if missing:
        raise DumpError(
            f"{path}: missing columns: {', '.join(missing)}; it has: {' '.join(index.columns)}"
        )
    return index


def contacts_at(index: DumpIndex, number: int) -> EngineContacts:
    """Read the contacts of one frame.

    Raises DumpError naming the line of a number that is not finite, an id that is none, a normal
    that is no unit vector, a disk that touches itself, and a contact that is listed twice."""
    table = index.table(number)
    get = {name: table[:, index.columns.index(name)] for name in CONTACT_COLUMNS}
    first, second = (index.ids(number, get[name], name) for name in ("first", "second"))
    normal = np.column_stack([get["nx"], get["ny"]])
    wall = get["is_wall"] == 1
    again = _again((wall.astype(np.int64) << 62) + (first << 31) + second)
    for bad, what in (
        (~np.isfinite(table).all(1), "not a finite number"),
        (~wall & (get["is_wall"] != 0), "is_wall: 0 or 1 is needed"),
        (np.abs(np.hypot(*normal.T) - 1) > UNIT, "nx, ny: not a unit vector"),
        (~wall & (first >= second), "first: the smaller id of the two is needed"),
        (again, "this contact is listed twice"),
    ):
        if bad.any():
            line = index.frames[number].line + int(np.argmax(bad))
            raise DumpError(f"{index.path}, line {line}: {what}")
    return EngineContacts(
        first=first,
        second=second,
        is_wall=wall,
        normal=normal,
        overlap=get["overlap"],
        force=np.column_stack([get["fx"], get["fy"]]),
    )


def _again(keys: Indices) -> Flags:
    """Which keys have occurred before."""
    if (keys[1:] > keys[:-1]).all():  # as every engine writes them
        return np.zeros(len(keys), dtype=bool)
    _, place = np.unique(keys, return_index=True)
    again = np.ones(len(keys), dtype=bool)
    again[place] = False
    return again


def read_contacts(path: Path) -> Iterator[EngineContacts]:
    """Read the contacts of a dump, frame by frame."""
    index = index_contacts(path)
    return (contacts_at(index, number) for number in range(len(index.frames)))
