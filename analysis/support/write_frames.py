"""Frames in the form of LAMMPS' dumps, as every engine writes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from analysis.support.columns import Columns
from nscd import _core

if TYPE_CHECKING:  # the process of an engine begins at once without
    from nscd.arrays import Floats

IMPULSE_COLUMNS = Columns("impulses")


def write_frame(
    file: IO[str],
    kind: str,
    step: int,
    names: Sequence[str],
    columns: Sequence[ArrayLike],
    *,
    box: str = "",
) -> None:
    """Append a frame to a dump; numbers as short as they can be and still the same when
    read.

    kind: ATOMS or ENTRIES
    names, columns: of the table; all columns have one length
    box: its lines; else it is as large as the places in the table"""
    arrays = [np.asarray(column) for column in columns]
    rows = len(arrays[0])
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{rows}\n"
    box = box or _bounds(names, arrays)
    file.write(f"{head}ITEM: BOX BOUNDS ff ff pp\n{box}ITEM: {kind} ")
    file.write(" ".join(names) + "\n")
    wanted = [np.int64 if a.dtype.kind in "iub" else np.float64 for a in arrays]
    table = [np.ascontiguousarray(a, kind) for a, kind in zip(arrays, wanted, strict=True)]
    file.write(_core.table(table, csv=False).decode())
    file.flush()


def _bounds(names: Sequence[str], arrays: Sequence[Floats]) -> str:
    """The box around all places of the table, a metre wider; a metre around nothing."""
    box = []
    for name in ("x", "y", "z"):
        values = arrays[names.index(name)] if name in names else np.zeros(1)
        box.append((values.min(initial=0.0) - 1.0, values.max(initial=0.0) + 1.0))
    return "".join(f"{low:.17g} {high:.17g}\n" for low, high in box)
