"""How exact the text of a dump is: the last digits of its positions and radii."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from analysis.support.reading import NUMBER
from nscd.arrays import Floats

# Numbers of up to four digits are typed by hand, and exact, where they have fewer last digits than these.
BY_HAND = 4
# No number ends behind this place (power of ten).
LEAST_PLACE = -400


def largest_of(words: Iterable[str]) -> float:
    """Give the largest magnitude among the words that are numbers."""
    sizes = (abs(float(word)) for word in words if NUMBER.fullmatch(word))
    return max(filter(math.isfinite, sizes), default=0.0)


class LastDigit(NamedTuple):
    """Where the text of some numbers ends: after so many significant digits (as %g writes), and at
    10^place at the latest (as %f does). `largest` is their magnitude."""

    digits: int
    place: int
    largest: float

    @classmethod
    def of(cls, words: Iterable[str]) -> LastDigit | None:
        """Find it in some of the numbers. None where these are exact, as typed by hand."""
        ends: list[tuple[int, int, str]] = []  # digits, place and last digit of each number
        for word in (words := [*filter(NUMBER.fullmatch, words)]):
            mantissa, _, exponent = word.lower().partition("e")
            full, _, decimals = mantissa.lstrip("+-").partition(".")
            if (digits := (full + decimals).lstrip("0")).isdigit():
                ends.append((len(digits), int(exponent or 0) - len(decimals), digits[-1]))
        maximum = max((end[0] for end in ends), default=0)
        position = min((end[1] for end in ends), default=0)
        last = {end[2] for end in ends if end[0] == maximum or end[1] == position}
        exact = maximum < 5 and len(last) < BY_HAND
        return None if exact else cls(maximum, min(position, 0), largest_of(words))

    def step(self, largest: float) -> float:
        """Give one of the last digit of numbers up to a magnitude."""
        power = math.floor(math.log10(largest)) if largest > 0 else -math.inf
        return 10.0 ** max(power - self.digits + 1, self.place) if largest > 0 else 0.0


class Digits(NamedTuple):
    """Say how exact the text of positions and radii is.

    unit: m, of 1 in the text; box: m, the longest side, of positions that are shares of it"""

    position: LastDigit
    radius: LastDigit
    unit: float
    box: float | None

    def rounding(self, position: Floats | None = None, radius: float = 0.0) -> float:
        """Compute what the gap (m) of disks at (n,2) m, radii up to `radius` m, may be wrong by; where
        left out, of the whole dump, as far as it was looked at."""
        maximum = [self.position.largest] * 2
        if position is not None:
            maximum = (np.abs(position).max(axis=0, initial=0.0) / self.unit).tolist()
        steps = [self.unit * self.position.step(one) for one in maximum]
        if self.box is not None:
            steps = [self.box * self.position.step(0.5)] * 2
        # both ends of a gap are half a digit off, along both axes; and so are both radii
        size = self.unit * self.radius.step(radius / self.unit or self.radius.largest)
        return (1 + 1e-6) * (math.hypot(*steps) + size)
