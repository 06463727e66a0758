"""Intervals as they stand in a cell: two significant digits, no powers of ten."""

from __future__ import annotations

from analysis.motion.ensemble import Difference, Interval
from analysis.pages.numbers import NONE, decimals, signed, significant, with_sign, with_unit


def interval_cell(found: Interval) -> str:
    """Write a median and its interval: 120 (90 – 150); – where there is none. Where all numbers are
    equal: 120 in all 3."""
    if not found.crowds:
        return NONE
    if found.alike:
        return in_all(two(found.median), found.alike)
    return f"{two(found.median)} ({two(found.low)} – {two(found.high)})"


def count_cell(found: Interval) -> str:
    """Write a median of counts and its interval, whole numbers of two digits: 12 (3 – 200). Where
    all numbers are equal: 12 in all 30."""
    ends = (found.median, found.low, found.high)
    median, low, high = (decimals(float(f"{round(end):.2g}"), 0) for end in ends)
    if found.alike:
        return in_all(median, found.alike)
    return f"{median} ({low} – {high})"


def in_all(value: str, count: int) -> str:
    """Write a number that so many runs or windows gave alike, which have no interval: 120 in all
    3; alone where there is one."""
    return value if count == 1 else f"{value} in all {count}"


def two(value: float) -> str:
    """Write two significant digits, and no powers of ten: these are loads to be read side by
    side."""
    short = float(f"{value:.2g}")
    return decimals(short, 0) if abs(short) >= 10 else significant(short, 2)


def difference_words(found: Difference, unit: str) -> tuple[str, str, str]:
    """Write a difference and the ends of its interval, two significant digits with their sign: in
    per cent of the other, or in the unit of the quantity where the other is next to zero."""
    ends = (found.value, found.low, found.high)
    if found.relative:
        value, low, high = map(signed, ends)
        return value, low, high
    value, low, high = (with_sign(end, two(end)) for end in ends)
    return with_unit(value, unit), low, with_unit(high, unit)


def difference_cell(found: Difference, unit: str) -> str:
    """Write a difference and its interval in a cell: +12 % (+3 % to +20 %)."""
    value, low, high = difference_words(found, unit)
    return f"{value} ({low} to {high})"
