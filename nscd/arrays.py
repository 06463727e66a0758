"""The array types of the whole tree, and the checks of what comes from outside."""

import reprlib
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]
"""Numbers of rows, and ids."""
Index32 = NDArray[np.int32]
"""Numbers of rows where the kernels want them small."""

# Beyond this, squares of a number and their products with another leave double precision.
LARGEST = 1e100
T = TypeVar("T")


def normal(random: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Draw from the standard normal law. numpy makes draws beyond 3.65 with a logarithm, whose first
    twelve digits are those of every processor: they are rounded."""
    drawn = random.normal(size=shape)
    return np.where(np.abs(drawn) > 3.65, drawn.round(11), drawn)


def read_only(
    value: ArrayLike, shape: tuple[int, ...], name: str, largest: float = LARGEST
) -> Floats:
    """Copy `value` to a finite float64 array, set read-only.

    shape: of the array; -1 for any length
    largest: magnitude that is refused beyond

    Raises ValueError naming the field, and the first bad row, where shape or a value is wrong."""
    array = _numbers(value, shape, name, "numbers").astype(np.float64, order="C")
    if array.size and not np.abs(array).max() <= largest:  # nor where one is no number
        if not np.isfinite(array).all():
            row = int(np.argwhere(~np.isfinite(array))[0][0])
            raise ValueError(f"{name}: not a finite number in row {row}")
        row = int(np.argwhere(np.abs(array) > largest)[0][0])
        worst = float(np.abs(array[row]).max())
        raise ValueError(
            f"{name}: {worst:g} in row {row}. At most {largest:g} can be computed with"
        )
    array.flags.writeable = False
    return array


def whole_numbers(value: ArrayLike, shape: tuple[int, ...], name: str) -> Indices:
    """Copy `value` to an int64 array of the given shape, set read-only.

    Raises ValueError naming the field where the shape is wrong or a value is not a whole number."""
    given = _numbers(value, shape, name, "whole numbers")
    with np.errstate(invalid="ignore"):
        array = given.astype(np.int64, order="C")
    if given.dtype.kind not in "ib" and not np.array_equal(given, array):
        row = int(np.argwhere(given != array)[0][0])
        raise ValueError(f"{name}: {given[row]} in row {row} is not a whole number")
    array.flags.writeable = False
    return array


def number(value: Any, name: str, need: str = "A finite number") -> float:
    """Take a finite float of at most 10¹⁰⁰.

    Raises ValueError naming the field, and what is needed, for all else."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    real = type(value) is float or isinstance(value, Real)  # the second takes 0.5 µs
    if not real or not -LARGEST <= value <= LARGEST:
        raise ValueError(f"{name}: {shown(value)}. {need} is needed")
    return float(value)


def count(value: Any, name: str) -> int:
    """Take a whole number of at least 1; raise ValueError naming the field for all else."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name}: {shown(value)}. 1 or more are needed")
    return int(value)


def flag(value: Any, name: str) -> bool:
    """Take True or False; raise ValueError naming the field for all else."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: {shown(value)}. True or False is needed")
    return bool(value)


def instance(value: Any, kind: type[T], name: str) -> T:
    """Take an object of a class; raise ValueError naming the field for all else."""
    if not isinstance(value, kind):
        raise ValueError(f"{name}: a {type(value).__name__} where a {kind.__name__} is needed")
    return value


def _numbers(value: ArrayLike, shape: tuple[int, ...], name: str, what: str) -> NDArray[Any]:
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name}: {shown(value)} is no array of {what}") from None
    if array.size and array.dtype.kind not in "biuf":
        raise ValueError(f"{name}: {shown(value)} is no array of {what}")
    if array.ndim != len(shape) or any(
        s not in (-1, a) for s, a in zip(shape, array.shape, strict=True)
    ):
        wanted = ", ".join("n" if s == -1 else str(s) for s in shape)
        raise ValueError(f"{name}: shape {array.shape} where ({wanted}) is needed")
    return array


def shown(value: Any) -> str:
    """Write any value in short, on one line."""
    return " ".join(reprlib.repr(value).split())
