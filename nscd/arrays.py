"""The array types of the whole tree, and the check of an array that comes from outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
"""Numbers of rows, and ids."""
Index32 = NDArray[np.int32]
"""Numbers of rows where the kernels want them small."""


def read_only(value: ArrayLike, shape: tuple[int, ...], name: str) -> Floats:
    """Copy `value` to a finite float64 array of the given shape (-1: any), set read-only.

    Raises ValueError naming the field (and the first bad row) when the shape or a value is wrong.
    """
    array = np.array(value, dtype=np.float64)
    if array.ndim != len(shape) or any(
        s not in (-1, a) for s, a in zip(shape, array.shape, strict=True)
    ):
        wanted = ", ".join("n" if s == -1 else str(s) for s in shape)
        raise ValueError(f"{name}: shape {array.shape} where ({wanted}) is needed")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0][0])
        raise ValueError(f"{name}: not a finite number in row {row}")
    array.flags.writeable = False
    return array
