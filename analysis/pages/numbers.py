"""Numbers as they stand on a page, in a picture and in the terminal: the one set of formats."""

import math
import re
from collections.abc import Callable, Sequence

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# between digits of thousands, and before a unit that is one sign
THIN = "\u202f"
NONE = "–"
# below this a share is a rounding error
ROUNDING = 1e-9


def number(value: float | None, digits: int = 3) -> str:
    """Write a number with some significant digits, as read in a table; – where there is none."""
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    size = abs(value)
    if isinstance(value, int) or (size < 1e5 and float(value).is_integer()):
        return decimals(value, 0)
    if 1e-2 <= size < 1e5:
        return decimals(value, max(0, digits - 1 - math.floor(math.log10(size))))
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = "10" + str(int(exponent)).translate(SUPERSCRIPTS)
    text = power if mantissa == "1" else f"{mantissa}·{power}"
    return text.replace("-", "−")


def decimals(value: float | None, digits: int) -> str:
    """Write a number with so many places after the point; – where there is none."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:,.{digits}f}".replace(",", THIN).replace("-", "−")


def significant(value: float | None, digits: int = 3) -> str:
    """Write a number with at most so many significant digits and no zeros at its end: 0.05."""
    if value is None or not math.isfinite(value):
        return NONE
    short = float(f"{value:.{digits}g}")
    enough = (d for d in range(1, digits) if float(f"{short:.{d}g}") == short)
    return number(short, next(enough, digits))


def two(value: float) -> str:
    """Write two significant digits, and no powers of ten: these are loads to be read side by
    side; what is rounding is 0."""
    short = float(f"{value:.2g}") if abs(value) > ROUNDING else 0.0
    return decimals(short, 0) if abs(short) >= 10 else significant(short, 2)


def between(low: float, high: float, written: Callable[[float], str] = two) -> str:
    """Write a range, with two digits; one number where its ends read the same."""
    minimum, maximum = written(low), written(high)
    return minimum if minimum == maximum else f"{minimum}–{maximum}"


def integer(value: float) -> str:
    """Write a count, also a mean of counts, as a whole number of two digits."""
    return decimals(float(f"{round(value):.2g}"), 0)


def percent(value: float | None, digits: int | None = None) -> str:
    """Write a share in per cent with one place (or so many significant digits); – where none."""
    if value is None or not math.isfinite(value):
        return NONE
    if digits is not None:
        if 0 <= value < ROUNDING:
            return "≈ 0 %"
        return f"{significant(100 * value, digits)} %"
    if value and abs(value) < 1e-3:
        return f"{number(100 * value, 2)} %"
    return f"{decimals(100 * value, 1)} %"


def signed(fraction: float) -> str:
    """Write a share in per cent with its sign and two significant digits."""
    return with_sign(fraction, percent(fraction, 2))


def with_sign(value: float, text: str) -> str:
    """Put a plus before the words for a number above zero."""
    return f"+{text}" if value > 0 and text[0].isdigit() else text


def with_unit(text: str, unit: str) -> str:
    """Write a number with its unit in words: 4 per m², not 4 1/m²; without one, the number alone."""
    return text if unit == NONE else f"{text} {unit.replace('1/', 'per ')}"


def interval(ends: Sequence[float], digits: int = 3) -> str:
    """Write an interval; one number where both ends read the same."""
    minimum, maximum = (significant(end, digits) for end in ends)
    return minimum if minimum == maximum else f"{minimum} to {maximum}"


def seconds(value: float | None) -> str:
    """Write a time with two digits, in ms below a tenth of a second."""
    if value is None or not math.isfinite(value):
        return NONE
    if value < 0.0995:
        return f"{significant(1e3 * value, 2)} ms"
    return f"{significant(value, 2) if value < 99.5 else decimals(value, 0)} s"


def statistic(name: str, value: float, unit: str) -> str:
    """Write a number of a comparison by its name: loads with their unit, shares in per cent."""
    if name.endswith(("_mean", "_max")):
        return f"{number(value)} {unit}"
    if name.endswith(("_difference", "_error", "_share")):
        return percent(value)
    return number(value, 4 if name.endswith("_correlation") else 2)


def powers(words: str) -> str:
    """Write the numbers 1e+03 of a message of the terminal as powers of ten, 10^3^, for a page."""
    return re.sub(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?\d+)\b", _power, words)


def _power(match: re.Match[str]) -> str:
    power = f"10^{int(match[2])}^".replace("-", "−")
    return power if match[1] == "1" else f"{match[1]}·{power}"


FILTERS: dict[str, Callable[..., str]] = {
    "number": number,
    "decimals": decimals,
    "significant": significant,
    "two": two,
    "percent": percent,
    "interval": interval,
    "seconds": seconds,
}
