"""Contacts of other programs: tables as text or Parquet, and exaDEM's text of interactions."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.dumps.find_frames import DumpError, Frame
from analysis.dumps.index import DumpIndex
from analysis.support.extras import load
from analysis.support.reading import begins, note, open_file
from nscd.arrays import Floats

# What exaDEM writes of an interaction, without names: ids from 0, its type (4 to 12: with what stands), the
# contact point, normal and tangential force on the first; in some versions its place. A file a step and rank.
EXADEM = ["id_i", "id_j", "sub_i", "sub_j", "type", "dn", "x", "y", "z", "fx", "fy", "fz", "tx", "ty", "tz"]
AFTER, STANDS, OF_STEP = ["x_i", "y_i", "z_i"], (4, 12), re.compile(r"(?:.*\D)?(\d+)_\d+\.txt")
# Times of a table are those of a frame if they are within this share of the time between two.
SAME = 1e-3


@dataclass(frozen=True)
class TableIndex(DumpIndex):
    """Hold a table in memory, cut into the frames of a dump of bodies."""

    tables: tuple[Floats, ...] = ()

    def table(self, number: int) -> Floats:
        """Give the rows of one frame."""
        return self.tables[number]


def index_table(path: Path, bodies: Any, rename: Callable[[Sequence[str]], Sequence[str]]) -> TableIndex:
    """Read a table with a column step or time_s, for the frames of a trajectory of bodies.

    Raises DumpError for what is no table of numbers, and rows of which the frame is not known."""
    files = sorted(path.rglob("*_*.txt")) if path.is_dir() else [path]
    files = [one for one in files if one == path or (OF_STEP.fullmatch(one.name) and one.stat().st_size)]
    parts = [_read(file) for file in files]
    if not parts or any(names != parts[0][0] for names, _ in parts):
        raise DumpError(f"{path}: no table, and no folder with interactions of exaDEM")
    if "sub_i" in parts[0][0]:
        note(path, "taken as interactions of exaDEM, its ids from 0 as those from 1")
    names, data = _with_walls(path, [*rename(parts[0][0])], np.concatenate([rows for _, rows in parts]))
    steps = np.array(bodies.steps)
    if "step" in names:
        of = data[:, names.index("step")]
    elif "time_s" in names:
        when, times = data[:, names.index("time_s")], np.array([bodies[k].time for k in range(len(steps))])
        near = np.searchsorted(0.5 * (times[1:] + times[:-1]), when)
        fits = np.abs(times[near] - when) <= SAME * float(np.diff(times).min(initial=1.0))
        of = np.where(fits, steps[near], -1)
    elif len(steps) == 1:
        of = np.full(len(data), steps[0])
    else:
        message = f"no column step or time_s, and the bodies have {len(steps)} frames. It has: {' '.join(names)}"
        raise DumpError(f"{path}: {message}")
    lost = int((~np.isin(of, steps)).sum())
    if 0 < lost == len(data):
        raise DumpError(f"{path}: no row is at a frame of the bodies. Their steps are {steps[0]} to {steps[-1]}")
    if lost:
        note(path, f"{lost} rows not used: they are at no frame of the bodies")
    order = np.argsort(of, kind="stable")
    ends = np.searchsorted(of[order], [steps, steps + 0.5])
    collected = tuple(data[order[start:end]] for start, end in ends.T)
    frames = tuple(Frame(step, None, (0, 0), (0, 0), len(one), 0) for step, one in zip(bodies.steps, collected, strict=True))
    sample = tuple(tuple(f"{one:.17g}" for one in row) for row in data[:100].tolist())
    return TableIndex(path, frames, tuple(names), sample=sample, tables=collected)


def _with_walls(path: Path, names: list[str], data: Floats) -> tuple[list[str], Floats]:
    """Take an id below 0 as a wall, where nothing else says which are, and put it second."""
    one, two = names.index("first"), names.index("second")
    if "is_wall" in names or not (data[:, [one, two]] < 0).any():
        return names, data
    back, force = data[:, one] < 0, [names.index(name) for name in ("fx", "fy", "tx", "ty") if name in names]
    data[:, [one, two]] = np.where(back[:, None], data[:, [two, one]], data[:, [one, two]])
    data[:, force] *= np.where(back, -1.0, 1.0)[:, None]
    note(path, "ids below 0 are taken as walls, each as the one that its disk touches")
    return [*names, "is_wall"], np.column_stack([data, data[:, two] < 0])


def _read(file: Path) -> tuple[list[str], Floats]:
    """Names and numbers of a table."""
    if begins(file, b"PAR1"):
        frame = load("pandas").read_parquet(file)
        return [*map(str, frame.columns)], frame.to_numpy(dtype=float)
    with open_file(file) as content:
        text = content.read().decode("utf-8", "replace")
    head, _, rows = text.partition("\n")
    mark, step = next((one for one in ",;\t" if one in head), None), OF_STEP.fullmatch(file.name)
    names = [word.strip(' "#\r') for word in head.strip("# \r").split(mark)]
    exadem = len(names) - len(EXADEM) in (0, len(AFTER)) and not set(head) - set("-+.eE0123456789, \t\r")
    if exadem:
        names, rows = [*EXADEM, *AFTER][: len(names)], text
    try:
        rows = re.sub(r"\b(?:true|false)\b", lambda one: str(int(one[0][0] in "tT")), rows, flags=re.I)
        data = np.loadtxt(io.StringIO(rows), delimiter=mark, ndmin=2).reshape(-1, len(names))
    except ValueError as error:
        raise DumpError(f"{file}: no table of numbers: {error}") from None
    if not exadem:
        return names, data
    wall = (data[:, 4] >= STANDS[0]) & (data[:, 4] <= STANDS[1])
    data[:, 1][wall] = -1  # numbered by the order of its drivers
    more = [data[:, :2] + 1, wall[:, None], data[:, 2:], *([np.full((len(data), 1), int(step[1]))] if step else [])]
    return ["first", "second", "is_wall", *names[2:], *(["step"] if step else [])], np.hstack(more)
