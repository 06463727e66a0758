"""Frames of rows that have times: evenly numbered where times are even, and people who are seen at
different times brought to common ones."""

from pathlib import Path

import numpy as np
import pandas as pd

from analysis.support.reading import note
from nscd.arrays import Floats, Indices

# Times are told apart to a microsecond; later first times (s) are dates, and are subtracted.
DIGITS, LATEST_START_S, LONGEST_S = 6, 1e6, 1e9
# Times are even that are this near to a multiple of a step, as a share of it.
EVEN = 0.1
# Somebody is between two rows of his up to so many of his usual steps apart.
LARGEST_GAP = 2.5
# Where people fill less than this share of the times they are seen at different ones, and frames
# are the usual step apart; no file has more than so many times its rows.
FILLED, TIMES_OF_ROW = 0.5, 100


def in_seconds(time: pd.Series, ms: bool, file: Path) -> pd.Series:
    """Give times in s, to a microsecond, from the first one where that is a date.

    Raises ValueError naming the row of one that is no number, or too far from the first."""
    time = time * (1e-3 if ms else 1.0)
    start = float(time.min())
    if LATEST_START_S < start < np.inf:
        note(file, f"times are counted from the first, which is {start:.3f} s")
        time = time - start
    if not (good := time.abs() <= LONGEST_S).all():
        index = good.idxmin()
        name = time.index.name or "row"
        raise ValueError(f"{name} {index}: time: {time[index]:g}. Up to {LONGEST_S:g} s are needed")
    return time.round(DIGITS)


def framed(rows: pd.DataFrame, file: Path) -> pd.DataFrame:
    """Number the frames of rows with id, time (s), x and y: multiples of the step where times are
    even, else 0, 1, 2, …; places of people are interpolated at times at which others are seen.

    Raises ValueError where nobody is seen at two times that grow."""
    steps = rows.groupby("id").time.diff()
    usual = float(steps[steps > 0].median())
    if not usual > 0 or (steps < 0).all():
        raise ValueError("no frame rate: nobody is seen at two times that grow")
    rows = rows.sort_values(["id", "time"], kind="stable")
    times = np.unique(rows.time)
    present = rows.groupby("id").time.agg(["min", "max", "nunique"])
    could = np.searchsorted(times, present["max"], "right") - np.searchsorted(times, present["min"])
    if present["nunique"].sum() < FILLED * could.sum():
        count = (times[-1] - times[0]) / usual
        if count > TIMES_OF_ROW * len(rows):
            raise ValueError(f"{count:.3g} frames of {len(rows)} rows. Are the times right?")
        times = times[0] + usual * np.arange(int(count + EVEN) + 1)
    if present["nunique"].sum() < could.sum():
        rows = _at(rows, times, file)
        times = np.unique(rows.time)
    numbers = numbers_of(times)
    return rows.assign(frame=numbers[np.searchsorted(times, rows.time)])


def numbers_of(times: Floats) -> Indices:
    """Number growing times (s): multiples of their step where they are even, else 0, 1, 2, …"""
    intervals = np.diff(times)
    if not len(intervals):
        return np.zeros(1, dtype=np.int64)
    steps = np.concatenate([[0], np.cumsum(np.rint(intervals / np.median(intervals)))])
    step = float(times[-1] - times[0]) / max(steps[-1], 1)
    even = (np.diff(steps) > 0).all() and np.abs(
        times - times[0] - step * steps
    ).max() < EVEN * step
    full = steps + np.rint(times[0] / step) if even else np.arange(len(times))
    return np.asarray(full, dtype=np.int64)


def _at(rows: pd.DataFrame, times: Floats, file: Path) -> pd.DataFrame:
    """The rows of people, sorted, at all of these times at which they are between two of theirs."""
    made, count = [], 0
    for who, one in rows.groupby("id"):
        own = one.time.to_numpy()
        intervals = np.diff(own)
        maximum = LARGEST_GAP * np.median(intervals) if len(intervals) else 0.0
        when = times[(times >= own[0]) & (times <= own[-1])]
        after = np.searchsorted(own, when)
        exact = own[after] == when
        near = ~exact & (own[after] - own[after - 1] <= maximum)
        when = when[exact | near]
        count += int(near.sum())
        if (intervals <= 0).any():  # twice there: whoever takes the frame says so
            made.append(one)
            continue
        positions = {
            name: np.interp(when, own, one[name]) for name in one if name not in ("id", "time")
        }
        made.append(pd.DataFrame({"id": who, "time": when, **positions}))
    found = pd.concat(made, ignore_index=True)
    if count:
        note(file, "people are seen at different times. Places between theirs are interpolated")
    return found
