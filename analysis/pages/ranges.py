"""Ranges as bars on one axis, with limits as marks: what a page shows beside its words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.pages.numbers import NONE, between, decimals, integer, significant, two

# About so much of the axis is a letter of a label, and labels end there: of a bar alone, and of bars
# with names and numbers beside them, on a telephone.
ALONE, MANY = (0.022, 1.0), (0.05, 1.5)


@dataclass(frozen=True, slots=True)
class Chart:
    """Hold means of one quantity with their ranges, as bars on an axis from 0 to `top`.

    found: mean (NaN: none), low and high, by name
    widest: the range of all; behind the bar, where there is one
    marks: limits, in the unit
    most: of how many people it is a count
    """

    title: str
    unit: str
    found: Mapping[str, tuple[float, float, float]]
    widest: tuple[float, float] | None = None
    marks: Sequence[float] = ()
    most: float | None = None

    @property
    def heading(self) -> str:
        """The title, beginning large."""
        return self.title[:1].upper() + self.title[1:]

    @property
    def text(self) -> str:
        """The result in words: the widest range."""
        _, lows, highs = zip(*self.found.values(), strict=True)
        return f"{self.between(*(self.widest or (min(lows), max(highs))))} {self.unit}"

    def between(self, low: float, high: float) -> str:
        """Write a range: of counts whole numbers; – of none."""
        if not math.isfinite(low + high):
            return NONE
        return between(low, high, two if self.most is None else integer)

    @property
    def alone(self) -> bool:
        """Whether there is one bar, which needs no name."""
        return len(self.found) == 1

    @property
    def top(self) -> float:
        """The end of the axis: a round number above all bars, and above a mark that is near."""
        if self.most is not None:
            return self.most
        ends = [end for mean, _, high in self.found.values() for end in (mean, high)]
        ends += self.widest if self.widest and self.alone else ()
        highest = max((end for end in ends if math.isfinite(end)), default=0.0)
        near = (1.04 * mark for mark in self.marks if mark <= 1.5 * highest)
        highest = max([highest, *near]) or 1.0
        scale = 10.0 ** math.floor(math.log10(highest))
        return next(
            step * scale for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * scale >= highest
        )

    def fraction(self, value: float) -> float:
        """Give the place of a value on the axis, in per cent."""
        return round(100 * min(max(value / self.top, 0.0), 1.0), 2) if math.isfinite(value) else 0.0

    @property
    def shown(self) -> list[float]:
        """The marks on this axis."""
        return [mark for mark in self.marks if mark <= self.top]

    @property
    def labelled(self) -> list[tuple[float, str, bool]]:
        """The labels of marks, one for those that it would run into: where it begins, its words,
        and whether it ends there, since the axis does."""
        (letter, end), groups = ALONE if self.alone else MANY, list[list[float]]()
        for mark in sorted(self.shown):
            if groups and (mark - groups[-1][0]) / self.top < self._words(groups[-1], letter)[1]:
                groups[-1].append(mark)
            else:
                groups.append([mark])
        found = []
        for group in groups:
            text, width_text = self._words(group, letter)
            late = group[0] / self.top + width_text > end
            found.append((group[-1] if late else group[0], text, late))
        return found

    def _words(self, marks: Sequence[float], letter: float) -> tuple[str, float]:
        """The label of marks, and what it takes with its arrow, as a share of the axis."""
        text = f"{', '.join(significant(mark, 4) for mark in marks)}\u202f{self.unit}"
        return text, letter * (len(text) + 1)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """The only bar's mean, and the ends of the axis where it leaves room: where and in words."""
        means = [mean for mean, *_ in self.found.values() if self.alone and mean > 0]
        top = decimals(self.top, 0) if self.top == self.most else two(self.top)
        ends = [(0.0, "0")] * all(one > 0.08 * self.top for one in means)
        ends += [(self.top, top)] * all(one < 0.82 * self.top for one in means)
        return sorted([*ends, *((one, two(one)) for one in means)])


def mattering(spans: Mapping[str, tuple[float, float]]) -> list[tuple[str, str]]:
    """Name what changes a quantity, widest first, and from what to what.

    spans: by what is varied, the least and the largest"""
    widest = sorted(spans.items(), key=lambda one: one[1][0] - one[1][1])
    return [(name, between(*ends)) for name, ends in widest]
