"""The numbers of a table of text, each the float64 that is nearest to its digits.

Lemire (2021), Number parsing at a gigabyte per second, https://doi.org/10.1002/spe.2984, section 5:
a product of 128 bits decides nearly every number; what it does not decide is left to Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.support.reading import NUMBER
from nscd.arrays import Floats, Indices
from nscd.compiling import kernel
from nscd.compiling.bits import eight, high_product, zeros_above, zeros_below

# 10ⁿ of these n are looked up; beyond them there are no float64.
LEAST, MOST = -348, 308
# So many digits fit into 64 bits; so many of an exponent are read.
DIGITS, EXPONENT_DIGITS = 19, 4
# Whole numbers below this, and powers of ten up to this, are float64.
EXACT, EXACT_POWER = np.uint64(1 << 53), 22
SPACE, TAB, LINE, RETURN = (ord(sign) for sign in " \t\n\r")
PLUS, MINUS, POINT, LETTER_E = (ord(sign) for sign in "+-.e")
ZERO, TEN, ONE = np.uint64(ord("0")), np.uint64(10), np.uint64(1)
# Eight digits in the bytes of one number: what makes others of signs, which bytes are none, and by
# which their pairs and fours are put together (Lemire, section 4).
ZEROS, ABOVE_NINE = np.uint64(0x3030303030303030), np.uint64(0x7676767676767676)
TOPS, PAIRS = np.uint64(0x8080808080808080), np.uint64(0x000000FF000000FF)
MILLION_HUNDRED, MYRIAD_ONE = np.uint64(0x000F424000000064), np.uint64(0x0000271000000001)
SHORT_TENS = np.array([10**n for n in range(9)], dtype=np.uint64)
# Halves of 64 bits, the bit on top, the bits of a float64 behind its exponent, and the nine that
# are rounded away, whose carry is not sure if all are set.
HALF, LOWER, TOP = np.uint64(32), np.uint64((1 << 32) - 1), np.uint64(1 << 63)
FRACTION, UNSURE = np.uint64((1 << 52) - 1), np.uint64((1 << 9) - 1)


def _leading_bits() -> Any:
    """The leading 128 bits of 10ⁿ from LEAST to MOST, (n,2) uint64: high, low."""
    rows = []
    for n in range(LEAST, MOST + 1):
        power = 10 ** abs(n)
        if n < 0:
            power = (1 << (power.bit_length() + 127)) // power
        short = 128 - power.bit_length()
        leading = power << short if short >= 0 else power >> -short
        rows.append((leading >> 64, leading & ((1 << 64) - 1)))
    return np.array(rows, dtype=np.uint64)


POWERS = _leading_bits()
TENS = np.array([10.0**n for n in range(EXACT_POWER + 1)])


def numbers_of(text: bytes, rows: int, width: int) -> Floats | None:
    """Read (rows, width) numbers, one row a line, to the last bit as Python's float() reads them.

    None where the text holds anything else; the words nan and inf are numbers."""
    return numbers_in(text, np.array([[0, len(text), rows]]), width)


def numbers_in(text: bytes, parts: Indices, width: int) -> Floats | None:
    """Read the numbers of several parts of a text, one below the other, as `numbers_of` does.

    parts: (p,3) start and end of each (bytes), and its rows"""
    count = width * int(parts[:, 2].sum())
    values = np.empty(count)
    left = np.empty((count, 3), dtype=np.int64)
    undecided = _read(
        np.frombuffer(text, np.uint8), parts, width, values, values.view(np.uint64), left
    )
    if undecided < 0:
        return None
    for cell, start, stop in left[:undecided].tolist():
        word = text[start:stop].decode("ascii", "replace")
        if not NUMBER.fullmatch(word):
            return None
        values[cell] = float(word)
    return values.reshape(-1, width)


@kernel(nogil=True)
def _read(text: Any, parts: Any, width: int, values: Any, bits: Any, left: Any) -> int:
    """Read all words. Those that are not decided are listed: cell, start, stop. Returns how many
    these are; −1 where the rows of a part, or the words of a row, are too few or too many."""
    cell = undecided = 0
    for part in range(len(parts)):
        at, end, last = parts[part, 0], parts[part, 1], cell + parts[part, 2] * width
        words = 0
        while at < end:
            if text[at] == LINE:
                if words != width:
                    return -1
                words = 0
                at += 1
            elif text[at] == SPACE or text[at] == TAB or text[at] == RETURN:
                at += 1
            else:
                if words == width or cell == last:
                    return -1
                start, at = at, _number(text, at, end, cell, values, bits)
                if at < 0 or (at < end and text[at] > SPACE):
                    at = start
                    while at < end and text[at] > SPACE:
                        at += 1
                    if at == start:
                        return -1
                    left[undecided] = cell, start, at
                    undecided += 1
                cell += 1
                words += 1
        if cell != last or words:
            return -1
    return undecided


@kernel
def decide(text: Any, start: int, stop: int, cell: int, values: Any, bits: Any) -> Any:
    """Put the number that a word is into its cell; False where this is left to Python."""
    return _number(text, start, stop, cell, values, bits) == stop


@kernel
def _number(text: Any, start: int, end: int, cell: int, values: Any, bits: Any) -> int:
    """Put the number that begins here into a cell; return where it ends, −1 where it is not
    decided."""
    minus = text[start] == MINUS
    first = start + 1 if minus or text[start] == PLUS else start
    whole, at = _digits(text, first, end, np.uint64(0))
    digits, exponent = at - first, np.int64(0)
    if at < end and text[at] == POINT:
        point = at + 1
        whole, at = _digits(text, point, end, whole)
        exponent += point - at
        digits += at - point
    if digits == 0:
        return -1
    if digits > DIGITS:
        # zeros in front are none of its digits
        zero = first
        while zero < at and (text[zero] == POINT or text[zero] == ZERO):
            digits -= text[zero] == ZERO
            zero += 1
        if digits > DIGITS:
            return -1
    if at < end and text[at] | 32 == LETTER_E:
        at += 1
        back = at < end and text[at] == MINUS
        if back or (at < end and text[at] == PLUS):
            at += 1
        begin = at
        power, at = _digits(text, at, end, np.uint64(0))
        if not 0 < at - begin <= EXPONENT_DIGITS:
            return -1
        exponent += -np.int64(power) if back else np.int64(power)
    return at if _nearest(whole, exponent, minus, cell, values, bits) else -1


@kernel
def _eight(signs: Any) -> Any:
    """The number of eight digits in the bytes of a number."""
    signs = signs * TEN + (signs >> np.uint64(8))
    fours = (signs & PAIRS) * MILLION_HUNDRED + (signs >> np.uint64(16) & PAIRS) * MYRIAD_ONE
    return fours >> HALF


@kernel
def _digits(text: Any, at: int, end: int, whole: Any) -> Any:
    """Put the digits that begin here behind a whole number; where they end."""
    # what ends a number is no digit
    while at + 8 <= len(text):
        signs = eight(text, at) ^ ZEROS
        others = ((signs + ABOVE_NINE) | signs) & TOPS
        if others & np.uint64(0x80):
            return whole, at
        if others == 0:
            whole = whole * SHORT_TENS[8] + _eight(signs)
            at += 8
            continue
        count = np.int64(zeros_below(others) >> np.uint64(3))
        signs <<= np.uint64(64 - 8 * count)
        return whole * SHORT_TENS[count] + _eight(signs), at + count
    while at < end:
        digit = np.uint64(text[at]) - np.uint64(ZERO)
        if digit >= TEN:
            break
        whole = TEN * whole + digit
        at += 1
    return whole, at


@kernel
def _nearest(whole: Any, exponent: Any, minus: bool, cell: int, values: Any, bits: Any) -> bool:
    """Put ± whole · 10^exponent into a cell, to the nearest; False where that is not decided."""
    # zeros behind, as LAMMPS writes them in the box of a frame
    while whole >= EXACT and whole % TEN == 0:
        whole //= TEN
        exponent += 1
    if whole < EXACT and -EXACT_POWER <= exponent <= EXACT_POWER:
        value = np.float64(whole)
        value = value / TENS[-exponent] if exponent < 0 else value * TENS[exponent]
        values[cell] = -value if minus else value
        return True
    if whole == 0 or not LEAST <= exponent <= MOST:
        return False
    shift = zeros_above(whole)
    whole <<= shift
    high, low = _product(whole, POWERS[exponent - LEAST, 0])
    if high & UNSURE == UNSURE and low + whole < whole:
        over, under = _product(whole, POWERS[exponent - LEAST, 1])
        merged = low + over
        if merged < low:
            high += ONE
        if high & UNSURE == UNSURE and merged + ONE == 0 and under + whole < whole:
            return False
        low = merged
    top = high >> np.uint64(63)
    mantissa = high >> (top + np.uint64(9))
    # half way between two, which only exact digits decide
    if low == 0 and high & UNSURE == 0 and mantissa & np.uint64(3) == ONE:
        return False
    mantissa = (mantissa + (mantissa & ONE)) >> ONE
    binary = ((217706 * exponent) >> 16) + 1086 + np.int64(top) - np.int64(shift)
    if mantissa >> np.uint64(53):
        mantissa >>= ONE
        binary += 1
    if not 0 < binary < 2047:
        return False
    sign = TOP if minus else np.uint64(0)
    bits[cell] = sign | np.uint64(binary) << np.uint64(52) | mantissa & FRACTION
    return True


@kernel
def _product(a: Any, b: Any) -> Any:
    """The high and low 64 bits of a product of two of 64."""
    return high_product(a, b), a * b
