"""Ranges and differences in cells and sentences: two significant digits, no powers of ten."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite

from analysis.motion.inference import Difference
from analysis.motion.series import Measure
from analysis.motion.study import Interval
from analysis.pages.numbers import (
    NONE,
    decimals,
    percent,
    signed,
    significant,
    with_sign,
    with_unit,
)


def interval_cell(found: Interval) -> str:
    """Write a mean and its range: 120 (90 – 150); the mean alone of one replicate, – of none. Where
    all windows are equal: 120 in all 3."""
    return _cell(found, two)


def count_cell(found: Interval) -> str:
    """Write a mean of counts and its range, whole numbers of two digits: 12 (3 – 200)."""
    return _cell(found, lambda value: decimals(float(f"{round(value):.2g}"), 0))


def _cell(found: Interval, written: Callable[[float], str]) -> str:
    if not found.replicates:
        return NONE
    if found.alike or found.replicates == 1:
        return in_all(written(found.mean), found.alike or 1)
    return f"{written(found.mean)} ({written(found.low)} – {written(found.high)})"


def in_all(value: str, count: int) -> str:
    """Write a number that so many runs or windows gave alike, which have no interval: 120 in all
    3; alone where there is one."""
    return value if count == 1 else f"{value} in all {count}"


def two(value: float) -> str:
    """Write two significant digits, and no powers of ten: these are loads to be read side by
    side."""
    short = float(f"{value:.2g}")
    return decimals(short, 0) if abs(short) >= 10 else significant(short, 2)


def more_words(value: float, relative: bool, unit: str) -> str:
    """Write a difference, two significant digits with their sign: in per cent of the other, or in
    the unit of the quantity where the other is next to zero."""
    return signed(value) if relative else with_unit(with_sign(value, two(value)), unit)


def difference_words(found: Difference, unit: str) -> tuple[str, str, str]:
    """Write a difference and the ends of its interval."""
    ends = (found.value, found.low, found.high)
    value, low, high = (more_words(end, found.relative, unit) for end in ends)
    return value, low, high


def least_words(found: Difference, unit: str) -> str:
    """Write the smallest difference that would have been seen: 12 %; none where no difference
    would."""
    if not isfinite(found.least):
        return "none"
    if not found.least:
        return "all equal"
    return percent(found.least, 2) if found.relative else with_unit(two(found.least), unit)


def split(
    found: Mapping[str, Difference], measures: Mapping[str, Measure]
) -> tuple[list[tuple[str, str, str, str]], list[tuple[str, str]]]:
    """Write the differences in these measures: those that are significant, with value and interval,
    but for what stops; and the others, with the smallest that would have been seen."""
    known = [(measures[key], one) for key, one in found.items() if key in measures]
    differ = [
        (measure.title, *difference_words(one, measure.unit))
        for measure, one in known
        if one.significant and not one.stops
    ]
    alike = [
        (measure.title, least_words(one, measure.unit))
        for measure, one in known
        if not one.significant
    ]
    return differ, alike


def difference_cell(found: Difference, unit: str) -> str:
    """Write a verdict with what it rests on: yes: +12 % (+3 % to +20 %); no: ± 12 % would have been
    seen."""
    value, low, high = difference_words(found, unit)
    if found.stops:
        return f"yes: {'stops' if found.value < 0 else f'{value}, the other stops'}"
    if found.significant:
        return f"yes: {value} ({low} to {high})"
    return f"no: {value} (smallest seen: {least_words(found, unit)})"
