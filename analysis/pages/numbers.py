"""Numbers as they stand on a page."""

from __future__ import annotations

import math

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float, digits: int = 3) -> str:
    """A number with some significant digits, as read in a table; – where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    size = abs(value)
    if isinstance(value, int) or (size < 1e5 and float(value).is_integer()):
        return f"{value:,.0f}".replace(",", "\u202f")
    if 1e-2 <= size < 1e5:
        decimals = max(0, digits - 1 - math.floor(math.log10(size)))
        return f"{value:,.{decimals}f}".replace(",", "\u202f")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = "10" + str(int(exponent)).translate(SUPERSCRIPTS)
    return power if mantissa == "1" else f"{mantissa}·{power}"


def percent(value: float) -> str:
    """A share in per cent, with the digits that it deserves; – where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value and abs(value) < 1e-3:
        return f"{number(100 * value, 2)} %"
    return f"{100 * value:.1f} %"
