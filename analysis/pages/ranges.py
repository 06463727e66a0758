"""Ranges as bars on one axis, with limits as marks: what a page shows beside its words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.pages.numbers import between, decimals, significant, two, whole

# Marks nearer than this share of the axis have one label; about so much of it is a letter.
APART, LETTER = 0.2, 0.022


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """Hold a mean (NaN: none) with its range, and a wider range behind it.

    label: nothing where a chart has one bar
    text: the range in words
    """

    mean: float
    low: float
    high: float
    label: str = ""
    text: str = ""
    widest: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """Hold the bars of one quantity, on an axis from 0 to `top`.

    text: the result in words
    marks: limits, in the unit
    """

    title: str
    unit: str
    text: str
    bars: Sequence[Bar]
    marks: Sequence[float] = ()
    most: float | None = None

    @property
    def top(self) -> float:
        """The end of the axis: a round number above all bars, and above a mark that is near."""
        if self.most is not None:
            return self.most
        ends = [end for bar in self.bars for end in (bar.mean, bar.high, *(bar.widest or ()))]
        highest = max((end for end in ends if math.isfinite(end)), default=0.0)
        highest = max([highest, *(mark for mark in self.marks if mark <= 1.5 * highest)]) or 1.0
        scale = 10.0 ** math.floor(math.log10(highest))
        return next(
            step * scale for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * scale >= highest
        )

    def share(self, value: float) -> float:
        """Give the place of a value on the axis, in per cent."""
        return round(100 * min(max(value / self.top, 0.0), 1.0), 2)

    @property
    def shown(self) -> list[float]:
        """The marks on this axis."""
        return [mark for mark in self.marks if mark <= self.top]

    @property
    def labelled(self) -> list[tuple[float, str, bool]]:
        """The labels of marks, one for those that are near each other: where it begins, its words,
        and whether it ends there, since the axis does."""
        groups: list[list[float]] = []
        for mark in sorted(self.shown):
            if groups and mark - groups[-1][-1] < APART * self.top:
                groups[-1].append(mark)
            else:
                groups.append([mark])
        found = []
        for group in groups:
            text = ", ".join(significant(mark, 4) for mark in group)
            late = group[0] / self.top + LETTER * (len(text) + 1) > 1
            found.append((group[-1] if late else group[0], text, late))
        return found

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """The ends of the axis, and the only bar's mean where it is apart from them, in words."""
        apart = [bar.mean for bar in self.bars if 0.08 < bar.mean / self.top < 0.82]
        at = [0.0, *(apart if len(self.bars) == 1 else ()), self.top]
        return [(each, decimals(each, 0) if each == self.most else two(each)) for each in at]


def chart(
    title: str,
    unit: str,
    found: Mapping[str, tuple[float, float, float]],
    *,
    widest: tuple[float, float] | None = None,
    marks: Sequence[float] = (),
    most: float | None = None,
) -> Chart:
    """Make a chart of means with their ranges, by name; widest: of all, behind the only one;
    most: of how many people it is a count."""
    alone, written = len(found) == 1, two if most is None else whole
    bars = [
        Bar(
            label="" if alone else name,
            mean=mean,
            low=low,
            high=high,
            text="" if alone else between(low, high, written),
            widest=widest if alone else None,
        )
        for name, (mean, low, high) in found.items()
    ]
    low, high = widest or (min(bar.low for bar in bars), max(bar.high for bar in bars))
    text, title = f"{between(low, high, written)} {unit}", title[0].upper() + title[1:]
    return Chart(title=title, unit=unit, text=text, bars=bars, marks=marks, most=most)


def mattering(spans: Mapping[str, tuple[float, float]]) -> list[tuple[str, str]]:
    """Name what changes a quantity, widest first, and from what to what.

    spans: by what is varied, the least and the largest"""
    widest = sorted(spans.items(), key=lambda one: one[1][0] - one[1][1])
    return [(name, between(*ends)) for name, ends in widest]
