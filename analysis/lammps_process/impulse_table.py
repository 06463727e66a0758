"""A compiled table of impulses: places of keys, found by hashing, and the sums at them.

A key is one integer that says both bodies, and above them whether the second is a wall; no key is
0."""

import numba
import numpy as np

# Ids are below 2³¹.
BITS = 31


@numba.njit(cache=True)
def _place_of(keys, key):  # type: ignore[no-untyped-def]
    """Where a key is in the table, or the empty place where it belongs."""
    last = len(keys) - 1
    place = (key * 0x9E3779B97F4A7C1 >> 20) & last
    while keys[place] != 0 and keys[place] != key:
        place = (place + 1) & last
    return place


@numba.njit(cache=True)
def _add_one(keys, sums, key, x, y):  # type: ignore[no-untyped-def]
    """Add to one key; return 1 if it is new, else 0."""
    place = _place_of(keys, key)
    new = keys[place] == 0
    keys[place] = key
    sums[place, 0] += x
    sums[place, 1] += y
    return 1 if new else 0


@numba.njit(cache=True)
def add_keys(keys, sums, more, impulse):  # type: ignore[no-untyped-def]
    """Add impulses (k,2) to keys (k,); return how many are new."""
    new = 0
    for row in range(len(more)):
        new += _add_one(keys, sums, more[row], impulse[row, 0], impulse[row, 1])
    return new


@numba.njit(cache=True)
def add_pairs(keys, sums, ids, forces, times):  # type: ignore[no-untyped-def]
    """Add as `ImpulseSums.add_pairs` does; return how many keys are new."""
    new = 0
    for row in range(len(ids)):
        x, y = forces[row, 0] + forces[row, 2], forces[row, 1] + forces[row, 3]
        if x == 0.0 and y == 0.0:
            continue
        first, second = np.int64(ids[row, 0]), np.int64(ids[row, 1])
        sign = times
        if first > second:
            first, second, sign = second, first, -times
        new += _add_one(keys, sums, first << BITS | second, sign * x, sign * y)
    return new


@numba.njit(cache=True)
def add_wall(keys, sums, wall, ids, rows, times):  # type: ignore[no-untyped-def]
    """Add as `ImpulseSums.add_wall` does; return how many keys are new."""
    new = 0
    for row in range(len(ids)):
        if rows[row, 0] != 0.0:
            key = np.int64(1) << 2 * BITS | np.int64(ids[row]) << BITS | np.int64(wall)
            new += _add_one(keys, sums, key, times * rows[row, 1], times * rows[row, 2])
    return new
