"""LAMMPS text dumps, one reader for all engines: bodies (in MDAnalysis) and contacts. Streaming,
float64, checked."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.coordinates.timestep import Timestep

from analysis.scene.lammps_data import SPHERE
from nscd import Snapshot
from nscd.arrays import Flags, Floats, Indices

CONTACT_COLUMNS = ("first", "second", "is_wall", "nx", "ny", "overlap", "fx", "fy")
HEADER_LINES = 9


class DumpError(ValueError):
    """A dump that cannot be read; the message names the file and the line, frame or column."""


@dataclass(frozen=True, slots=True)
class DumpIndex:
    """Where the frames of a dump are: offsets (bytes), steps, counts (rows) and the columns of its
    tables."""

    path: Path
    offsets: tuple[int, ...]
    lengths: tuple[int, ...]
    steps: tuple[int, ...]
    counts: tuple[int, ...]
    columns: tuple[str, ...]

    def table(self, frame: int) -> Floats:
        """The numbers of one frame, (rows, columns). Raises DumpError for text, or a row of the
        wrong length."""
        with self.path.open("rb") as file:
            file.seek(self.offsets[frame])
            content = file.read(self.lengths[frame])
        rows, columns = self.counts[frame], len(self.columns)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                numbers = np.fromstring(content.decode("ascii"), sep=" ")
                return numbers.reshape(rows, columns)
            except (ValueError, DeprecationWarning):
                pass
        for number, line in enumerate(content.decode("utf-8", "replace").splitlines()):
            words = line.split()
            if len(words) != columns or not all(_is_number(word) for word in words):
                raise DumpError(
                    f"{self.path}, step {self.steps[frame]}, row {number + 1}: {len(words)} words where {columns} "
                    f"numbers ({' '.join(self.columns)}) are needed: {line.strip()[:80]!r}"
                )
        raise DumpError(
            f"{self.path}, step {self.steps[frame]}: {rows} rows announced, other numbers found"
        )


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def index_dump(path: Path, kind: str = "ATOMS") -> DumpIndex:
    """Find and check the frames of a dump (kind ATOMS) or a dump local (kind ENTRIES).

    Raises DumpError for a missing or empty file, one that is not such a dump, one that ends in
    mid-frame, steps that do not grow, or columns that change."""
    offsets: list[int] = []
    lengths: list[int] = []
    steps: list[int] = []
    counts: list[int] = []
    columns: tuple[str, ...] = ()
    number = 0
    try:
        file = path.open("rb")
    except OSError as error:
        raise DumpError(f"{path}: {error.strerror}") from None
    with file:
        while first := file.readline():
            head = [first.decode("ascii", "replace")] + [
                file.readline().decode("ascii", "replace") for _ in range(8)
            ]
            line, number = number + 1, number + HEADER_LINES
            if not head[-1]:
                raise DumpError(
                    f"{path}, line {line}: truncated: the file ends inside the head of frame {len(steps) + 1}"
                )
            names = head[8].split()
            good = (
                head[0].strip() == "ITEM: TIMESTEP"
                and head[2].strip() == f"ITEM: NUMBER OF {kind}"
                and head[4].startswith("ITEM: BOX BOUNDS")
                and names[:2] == ["ITEM:", kind]
            )
            try:
                step, count = int(head[1]), int(head[3])
            except ValueError:
                good = False
            if not good:
                raise DumpError(
                    f"{path}, line {line}: not the head of a frame of a LAMMPS dump with ITEM: {kind}: {head[0].strip()!r}"
                )
            if steps and step <= steps[-1]:
                raise DumpError(
                    f"{path}, line {line + 1}: step {step} follows step {steps[-1]}; frames must be in order, each once"
                )
            if columns and tuple(names[2:]) != columns:
                raise DumpError(f"{path}, line {line + 8}: the columns change at step {step}")
            columns = tuple(names[2:])
            start = file.tell()
            last = b"\n"
            for _ in range(count):
                last = file.readline()
            number += count
            if count and (not last.endswith(b"\n") or len(last.split()) != len(columns)):
                raise DumpError(
                    f"{path}: truncated: the file ends inside step {step}, frame {len(steps) + 1}"
                )
            offsets.append(start)
            lengths.append(file.tell() - start)
            steps.append(step)
            counts.append(count)
    if not steps:
        raise DumpError(f"{path}: empty: no frame in it")
    return DumpIndex(path, tuple(offsets), tuple(lengths), tuple(steps), tuple(counts), columns)


class BodiesReader(ReaderBase):  # type: ignore[misc]
    """MDAnalysis reader of body dumps: every column in float64 and id order in `ts.data`, whatever
    the row order.

    MDAnalysis' own reader of this format rounds positions to float32, shifts them by the box corner
    and needs z. Its `dt` is the time between steps (the LAMMPS time step); times are step · dt."""

    format = "CROWD_BODIES"
    units = {"time": None, "length": None, "velocity": None}  # noqa: RUF012  (MDAnalysis' protocol)

    def __init__(self, filename: Any, **kwargs: Any) -> None:
        super().__init__(str(filename), **kwargs)
        self._index = index_dump(Path(self.filename))
        path, columns = self.filename, self._index.columns
        missing = [name for name in ("id", "x", "y") if name not in columns]
        missing += [] if {"radius", "diameter"} & set(columns) else ["radius"]
        missing += [] if {"mass", "density"} & set(columns) else ["mass (or density)"]
        if missing:
            raise DumpError(
                f"{path}: missing columns: {', '.join(missing)}; it has: {' '.join(columns)}"
            )
        for count, step in zip(self._index.counts, self._index.steps, strict=True):
            if count != self._index.counts[0]:
                raise DumpError(
                    f"{path}: {count} disks at step {step} where the first frame has {self._index.counts[0]}; "
                    "the number must not change (keep those who leave in a wide box)"
                )
        self.n_atoms = self._index.counts[0]
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(0)

    @property
    def steps(self) -> tuple[int, ...]:
        """The step of each frame."""
        return self._index.steps

    @property
    def n_frames(self) -> int:
        return len(self._index.steps)

    def _read_frame(self, frame: int) -> Timestep:
        table = self._index.table(frame)
        columns = self._index.columns
        ids = table[:, columns.index("id")]
        order = np.argsort(ids, kind="stable")
        if len(np.unique(ids)) < len(ids):
            raise DumpError(f"{self.filename}, step {self._index.steps[frame]}: an id occurs twice")
        ts = self.ts
        ts.frame = frame
        table = table[order]
        for column, name in enumerate(columns):
            ts.data[name] = table[:, column]
        ts.data["step"] = self._index.steps[frame]
        ts.data["time"] = self._index.steps[frame] * ts.dt
        ts.positions = np.column_stack(
            [ts.data["x"], ts.data["y"], ts.data.get("z", np.zeros(len(ids)))]
        )
        return ts

    def _read_next_timestep(self, ts: Timestep | None = None) -> Timestep:
        if self.ts.frame + 1 >= self.n_frames:
            raise OSError("no next frame")
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Nothing stays open between frames."""


def open_bodies(path: Path, time_step: float = 1.0) -> MDAnalysis.Universe:
    """A body dump as an MDAnalysis Universe; time_step is that of the simulation (s). Raises
    DumpError."""
    universe = MDAnalysis.Universe.empty(index_dump(path).counts[0], trajectory=False)
    universe.load_new(str(path), format="CROWD_BODIES", dt=time_step)
    return universe


def snapshot_of(ts: Timestep, path: str | Path = "") -> Snapshot:
    """The disks of the current frame, ids in increasing order; velocities, spins and drive 0 or
    None where the dump has none. A density column is that of a sphere, as LAMMPS writes it. Raises
    DumpError naming the step and the field."""
    data, n = ts.data, ts.n_atoms
    radius = data["radius"] if "radius" in data else 0.5 * data["diameter"]
    mass = data["mass"] if "mass" in data else data["density"] * SPHERE * radius**3
    drive = np.column_stack([data["drive_x"], data["drive_y"]]) if "drive_x" in data else None
    none = np.zeros(n)
    try:
        return Snapshot(
            position=np.column_stack([data["x"], data["y"]]),
            velocity=np.column_stack([data.get("vx", none), data.get("vy", none)]),
            radius=radius,
            mass=mass,
            ids=data["id"].astype(np.int64),
            spin=data.get("omegaz", none),
            time=float(ts.time),
            drive=drive,
        )
    except ValueError as error:
        raise DumpError(f"{path}, step {data['step']}: {error}") from None


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


def contacts_at(index: DumpIndex, frame: int) -> EngineContacts:
    """The contacts of one frame."""
    table = index.table(frame)
    if not np.isfinite(table).all():
        raise DumpError(f"{index.path}, step {index.steps[frame]}: not a finite number")
    get = {name: table[:, index.columns.index(name)] for name in CONTACT_COLUMNS}
    return EngineContacts(
        first=get["first"].astype(np.int64),
        second=get["second"].astype(np.int64),
        is_wall=get["is_wall"] != 0,
        normal=np.column_stack([get["nx"], get["ny"]]),
        overlap=get["overlap"],
        force=np.column_stack([get["fx"], get["fy"]]),
    )


def read_contacts(path: Path) -> Iterator[EngineContacts]:
    """The contacts of a dump, frame by frame."""
    index = index_contacts(path)
    return (contacts_at(index, frame) for frame in range(len(index.steps)))


def frame_at(times: Sequence[float] | Floats, wanted: float) -> int:
    """The frame nearest to a time (s)."""
    return int(np.argmin(np.abs(np.asarray(times) - wanted)))
