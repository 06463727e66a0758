"""Numbers of a table of text: to the last bit as Python reads them, and nothing else is one."""

import math
from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from analysis.support.reading import NUMBER
from nscd import _core

FORMATS = ("{!r}", "{:.17g}", "{:.9g}", "{:.20e}", "{:+.16E}", "{:f}")
written = st.builds(str.format, st.sampled_from(FORMATS), st.floats())
digits = st.from_regex(
    r"[+-]?([0-9]{0,22}\.?[0-9]|[0-9]\.)[0-9]{0,22}([eE][+-]?[0-9]{1,4})?", fullmatch=True
)


def numbers_of(text, rows, width):
    return _core.rows(text, np.array([[0, len(text), rows]]), width)


def same(found, word):
    wanted = float(word)
    return math.isnan(found) if math.isnan(wanted) else found.hex() == wanted.hex()


@given(st.lists(st.tuples(written, digits), min_size=1, max_size=30))
def test_to_the_last_bit(rows):
    text = "".join(f"{first}\t {second} \r\n" for first, second in rows).encode()
    table = numbers_of(text, len(rows), 2)
    assert table is not None
    assert table.shape == (len(rows), 2)
    for found, words in zip(table.tolist(), rows, strict=True):
        assert all(map(same, found, words))


@given(st.integers(2**52, 2**53 - 1), st.integers(-1074, 970), st.integers(-1, 1))
def test_half_way_between_two_numbers(mantissa, power, beside):
    """Exactly half way, and one digit of 40 beside it."""
    half = Fraction(2 * mantissa + 1) * Fraction(2) ** (power - 1)
    exponent = math.floor(math.log10(half)) - 40
    word = f"{int(half / Fraction(10) ** exponent) + beside}e{exponent}"
    table = numbers_of(f"{word}\n".encode(), 1, 1)
    assert table is not None
    assert same(table[0, 0].item(), word)


@given(st.lists(st.text("0123456789+-.eEnaif_x\0", min_size=1, max_size=4), min_size=4, max_size=4))
def test_a_table_or_none(words):
    table = numbers_of("{} {}\n{} {}\n".format(*words).encode(), 2, 2)
    if all(map(NUMBER.fullmatch, words)):
        assert table is not None
        assert all(map(same, table.ravel().tolist(), words))
    else:
        assert table is None
