"""The array types of the whole tree, and the checks of what comes from outside."""

import contextlib
import dataclasses
import math
import reprlib
from numbers import Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
"""Numbers of rows, and ids."""
Index32 = NDArray[np.int32]
"""Numbers of rows where the kernels want them small."""

# Beyond this, squares of a number and their products with another leave double precision.
LARGEST = 1e100
# No whole number of 64 bits is so large, 2⁶³.
TOO_LARGE = float(1 << 63)
# What np.asarray raises for what is no array, a tensor with a gradient among them.
NO_ARRAY = (TypeError, ValueError, OverflowError, RuntimeError)
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
    with np.errstate(over="ignore"):  # of longer floats: refused as infinite
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

    Raises ValueError naming the field where the shape is wrong, or a value is not a whole number or
    is beyond 2⁶³ − 1."""
    checked = _numbers(value, shape, name, "whole numbers")
    with np.errstate(invalid="ignore"):
        array = checked.astype(np.int64, order="C")
    if checked.dtype.kind != "i":
        # a float of 2⁶³ becomes another number on each processor
        good = (checked < TOO_LARGE) & (checked >= -TOO_LARGE) & (checked == np.floor(checked))
        _refuse_row(good, checked, name, "is not a whole number below 2⁶³")
    array.flags.writeable = False
    return array


def mask(value: ArrayLike, shape: tuple[int, ...], name: str) -> Mask:
    """Copy `value`, True and False or 1 and 0, to an array of bool of the given shape, set read-only.

    Raises ValueError naming the field for all else."""
    checked = _numbers(value, shape, name, "True and False", "biuf")
    _refuse_row((checked == 0) | (checked == 1), checked, name, "is not True or False")
    array = checked.astype(np.bool_, order="C")
    array.flags.writeable = False
    return array


def _refuse_row(good: Mask, array: NDArray[Any], name: str, what: str) -> None:
    if not good.all():
        index = tuple(np.argwhere(~good)[0].tolist())
        raise ValueError(f"{name}: {array[index]} in row {index[0]} {what}")


def number(value: Any, name: str, need: str = "A finite number") -> float:
    """Take a finite float of at most 10¹⁰⁰.

    Raises ValueError naming the field, and what is needed, for all else."""
    original, real = value, type(value) is float or isinstance(value, Real)  # the second takes 0.5 µs
    if not real:
        plain = _bare(value, name)
        with contextlib.suppress(*NO_ARRAY):
            value = np.asarray(plain)[()]
        real = isinstance(value, Real)
    made = math.nan
    if real and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):  # of whole numbers
            made = float(value)
    if not -LARGEST <= made <= LARGEST:
        raise ValueError(f"{name}: {shown(original)}. {need} is needed")
    return made


def numbers(value: ArrayLike, name: str) -> Floats:
    """Take an array of any shape, infinite numbers too, as float64.

    Raises ValueError naming the field for what is none, has a unit or masked entries."""
    return _numbers(value, None, name, "numbers").astype(np.float64, copy=False)


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


def _numbers(
    value: ArrayLike, shape: tuple[int, ...] | None, name: str, what: str, kinds: str = "iuf"
) -> NDArray[Any]:
    plain = _bare(value, name)
    try:
        array = np.asarray(plain)
    except NO_ARRAY:
        raise ValueError(f"{name}: {shown(value)} is no array of {what}") from None
    if array.dtype == object and _are_numbers(array, name):
        made = np.array(array.tolist())
        array = array.astype(np.float64) if made.dtype == object else made
    if not array.size:
        array = array.astype(np.float64)
    if array.dtype.kind not in kinds:
        raise ValueError(f"{name}: {shown(value)} ({array.dtype}) is no array of {what}")
    if shape is not None and (
        array.ndim != len(shape)
        or any(s not in (-1, a) for s, a in zip(shape, array.shape, strict=True))
    ):
        wanted = ", ".join("n" if s == -1 else str(s) for s in shape)
        raise ValueError(f"{name}: shape {array.shape} where ({wanted}) is needed")
    return array


def _bare(value: Any, name: str, row: int | None = None) -> Any:
    """Take numbers without a unit and without masked entries; `np.asarray` would drop both silently.

    row: of a list that the value is in"""
    if type(value) is np.ndarray:
        return value
    if isinstance(value, list | tuple):
        kinds = {*map(type, value)}
        if bool in kinds and not kinds <= {bool, np.bool_}:
            raise ValueError(f"{name}: {shown(value)}. True or False is no number")
        for number_, item in enumerate(value):
            if type(item) is not float:
                _bare(item, name, number_ if row is None else row)
        return value
    if hasattr(value, "iloc"):  # of pandas: names of columns are attributes too
        return value
    inner = value.data if hasattr(value, "dims") else None  # xarray has units of others in it
    for one in (value, inner):
        unit = getattr(one, "units", getattr(one, "unit", None))
        if unit is not None and str(unit) not in ("", "1", "dimensionless"):
            raise ValueError(f"{name}: it has the unit {unit}. Give plain numbers in SI units")
        mask = getattr(one, "mask", None)
        if mask is not None and not callable(mask) and np.any(mask):
            if row is None and np.ndim(mask):
                row = int(np.argwhere(mask)[0][0])
            raise ValueError(f"{name}: masked in row {row or 0}. Each entry is needed")
    return getattr(value, "magnitude", value)


def _are_numbers(array: NDArray[Any], name: str) -> bool:
    """Tell whether an array of objects, as tables with missing values have them, has numbers only."""
    for index, item in np.ndenumerate(array):
        row = index[0] if index else 0
        if item is None or type(item).__name__ in ("NAType", "NaTType"):
            raise ValueError(f"{name}: missing in row {row}. Each entry is needed")
        if not isinstance(item, Real) or isinstance(item, bool):
            _bare(item, name, row)
            return False
        if isinstance(item, int) and abs(item) >= 1 << 64:
            raise ValueError(f"{name}: {shown(item)} in row {row} has more than 64 bits")
    return True


def _remade(kind: type[T], values: dict[str, Any]) -> T:
    return kind(**values)


class Frozen:
    """Make a dataclass anew, and check it again, where it is copied or unpickled: NumPy's copies of
    read-only arrays can be written to."""

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, ...]:
        fields: Any = dataclasses.fields(self)  # type: ignore[arg-type]
        return _remade, (type(self), {one.name: getattr(self, one.name) for one in fields})


def shown(value: Any) -> str:
    """Write any value in short, on one line."""
    return " ".join(reprlib.repr(value).split())
