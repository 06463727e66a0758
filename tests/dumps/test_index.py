"""The index of a dump: every frame is where it was put, however the file is read; and its numbers, to the last
bit as Python reads them."""

import gzip
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.dumps import DumpError, index_dump
from analysis.dumps import find_frames as text_frames
from analysis.support.reading import NUMBER
from nscd import _core

BLOCKS = [70, 1000, text_frames.BLOCK]
LONG = f"9 {'9' * 70_000} 9\n"


def frames_of(count, seed=1):
    """Text of some frames, and what an index of them has."""
    rng = np.random.default_rng(seed)
    text, wanted, step = "", [], 0
    for number in range(count):
        step += int(rng.integers(1, 10**6))
        rows = int(rng.integers(0, 200)) if number % 3 else int(rng.integers(0, 3))
        low, high = (rng.normal(size=2) * 10.0 ** rng.integers(-3, 3)).tolist()
        head = "ITEM: UNITS\nsi\n" * (number == 0)
        head += f"ITEM: TIMESTEP\n{step}\nITEM: TIME\n{step / 7!r}\nITEM: NUMBER OF ATOMS\n{rows}\n"
        head += (
            f"ITEM: BOX BOUNDS ff sm pp\n{low!r} {high:.16e}\n-1 1e3 \n-.5 0.50000000000000000\n"
        )
        head += "ITEM: ATOMS id x y\n"
        table = "".join(f"{i} {i / 3!r} 0\n" for i in range(rows))
        position = len(text) + len(head)
        line = (text + head).count("\n") + 1
        wanted.append((step, step / 7, (low, high), (-1.0, 1e3), rows, line, position, len(table)))
        text += head + table
    return text, wanted


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_where_frames_are(tmp_path, monkeypatch, block, pack):
    monkeypatch.setattr(text_frames, "BLOCK", block)
    text, wanted = frames_of(30)
    path = tmp_path / "some.dump"
    path.write_bytes(pack(text.encode()))
    found = index_dump(path)
    for frame, (step, time, x, y, *position) in zip(found.frames, wanted, strict=True):
        assert (frame.step, frame.time) == (step, time)
        assert (frame.low, frame.high) == ((x[0], y[0]), (float(f"{x[1]:.16e}"), y[1]))
        assert [frame.rows, frame.line, frame.offset, frame.length] == position
    for number in (*range(30), 3, 17, 18, 19, 2):  # in order, then from anywhere
        rows = wanted[number][4]
        np.testing.assert_array_equal(found.table(number)[:, 0], np.arange(rows))


def test_more_frames_than_are_found_at_once(tmp_path, monkeypatch):
    """Whatever stands in a head is read: a head of another form than the one before is read line by
    line, and the numbers of lines are right ever after."""
    path = tmp_path / "many.dump"
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS {} pp\n0 1\n0 1\n0 1\n"
    row = "ITEM: ATOMS id x\n1 {}\n"
    count = 9000
    path.write_text(
        "".join(
            head.format(step, "ss ff" if step % 1000 == 0 else "ff ff") + row.format(step)
            for step in range(count)
        )
    )
    found = index_dump(path)
    assert found.steps == tuple(range(count))
    assert [frame.line for frame in found.frames] == [10 + 10 * step for step in range(count)]
    assert [found.table(step)[0, 1] for step in range(count)] == list(range(count))


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ITEM: TIMESTEP\n9\n", "ITEM: TIMESTEP\n8\n", "line 101: step 8 follows step 8"),
        ("ITEM: TIMESTEP\n9\n", "ITEM: TIMESTEP\n-9\n", "line 101: step: '-9' where a whole"),
        ("ITEM: TIMESTEP\n9\n", "ITEM: TIMESTEP\n9 9\n", "line 101: step: '9 9' where a whole"),
        ("-7 9\n", "-7 1e31\n", "line 107: box: '1e31' is not a number"),
        ("-7 9\n", "-7 9 9\n", "line 104: BOX BOUNDS: two numbers"),
        ("-7 9\n", "-7\n9\n", "line 104: BOX BOUNDS: two numbers"),
        ("9 9 9\n", "9 9\0 9\n", "line 110: binary"),
        ("9 9 9\n", LONG, "line 110: longer than 65536"),
        ("9 9 9\n", "9 9 9\n\n", "line 111: not the head of a frame"),
        ("8 9 9\n9 9 9\n", "8 9 9\n9 9\n", "truncated: the file ends inside step 9, frame 10"),
        ("8 9 9\n9 9 9\n", "8 9 9\n9 9 9", "truncated: the file ends inside step 9, frame 10"),
    ],
)
def test_what_is_wrong_with_a_later_frame(tmp_path, monkeypatch, block, old, new, message):
    """Frame 9 is the last of ten; a line of it is replaced."""
    monkeypatch.setattr(text_frames, "BLOCK", block)
    text = "".join(
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n-7 {step}\n"
        f"0 1\n0 1\nITEM: ATOMS id x y\n8 {step} 9\n{step} {step} 9\n"
        for step in range(10)
    )
    assert text.count(old) == 1
    path = tmp_path / "bad.dump"
    path.write_text(text.replace(old, new))
    with pytest.raises(DumpError) as error:
        index_dump(path)
    assert message in str(error.value)


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
