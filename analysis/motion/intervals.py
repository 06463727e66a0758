"""Intervals as they stand in a cell: two significant digits, no powers of ten."""

from __future__ import annotations

from analysis.motion.ensemble import Interval
from analysis.pages.numbers import NONE, decimals, percent, significant


def interval_cell(found: Interval) -> str:
    """Write a median and its interval: 120 (90 – 150); – where there is none."""
    if not found.crowds:
        return NONE
    return f"{two(found.median)} ({two(found.low)} – {two(found.high)})"


def count_cell(found: Interval) -> str:
    """Write a median of counts and its interval, whole numbers of two digits: 12 (3 – 200)."""
    ends = (found.median, found.low, found.high)
    median, low, high = (decimals(float(f"{round(end):.2g}"), 0) for end in ends)
    return f"{median} ({low} – {high})"


def two(value: float) -> str:
    """Write two significant digits, and no powers of ten: these are loads to be read side by
    side."""
    short = float(f"{value:.2g}")
    return decimals(short, 0) if abs(short) >= 10 else significant(short, 2)


def signed(share: float) -> str:
    """Write a share in per cent with its sign and two significant digits."""
    text = percent(share, 2)
    return f"+{text}" if share > 0 and text[0].isdigit() else text
