"""Compiled code that finds frames in a block of a dump: it reads heads of a known form, and goes past
rows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from analysis.dumps.frame import LARGEST_LENGTH, LARGEST_STEP
from analysis.dumps.heads import BOX, COUNT, MARK, STEP
from analysis.dumps.numbers import LINE, RETURN, SPACE, TAB, TEN, ZERO, decide
from analysis.support.reading import LARGEST_WHOLE, LONGEST_LINE
from nscd.compiling import kernel

# So many frames are found at once.
MOST = 4096
# Rows are gone past by so many bytes at once.
CHUNK = 64
# How a scan ends: at the end of the block; at a line that is not as it should be; with as many
# frames as there is room for; in a last row that lacks words. DONE: a part of it is.
DONE, MORE, STRANGE, FULL, SHORT = range(5)
# Where it is: place in the block, lines before it, rows that are left of the last frame, frames that
# were found, step of the last.
AT, LINES, ROWS, FRAMES, LAST = range(5)
# What is found of each frame: whole numbers, and others (time, then ends of x, y and z).
STEP_IS, COUNT_IS, LINE_IS, OFFSET_IS, LENGTH_IS, WHOLE = range(6)
REAL = 7


class Found(NamedTuple):
    """Hold where a scan is and the frames that it found.

    now: (5,) place in the block, lines before it, rows left of the last frame, frames, last step
    whole: (MOST,5) step, rows, line of the first, offset and length of the table (bytes)
    real: (MOST·7,) time, then lowest and highest x, y, z of the box, for each
    bits: (MOST·7,) those of `real`
    """

    now: Any
    whole: Any
    real: Any
    bits: Any

    @classmethod
    def nothing(cls) -> Found:
        """Begin with the first line."""
        real = np.zeros(REAL * MOST)
        return cls(
            np.array([0, 0, 0, 0, -1]),
            np.zeros((MOST, WHOLE), np.int64),
            real,
            real.view(np.uint64),
        )


@kernel
def scan(text: Any, before: int, form: Any, width: int, found: Any) -> int:
    """Find frames from where the scan is; say how it ended.

    text: a block of a file, `before` bytes from its beginning
    form: of the heads (see `Heads`)
    width: of the tables
    """
    now, whole = found.now, found.whole
    while True:
        if now[ROWS] > 0:
            start = now[AT]
            end = _past(text, width, now)
            whole[now[FRAMES] - 1, LENGTH_IS] += now[AT] - start
            if end != DONE:
                return end
        if now[AT] == len(text):
            return MORE
        if now[FRAMES] == MOST:
            return FULL
        end = _head(text, form, found)
        if end != DONE:
            return end
        whole[now[FRAMES] - 1, OFFSET_IS] = before + now[AT]


@kernel
def _past(text: Any, width: int, now: Any) -> int:
    """Go past rows: as many as can be counted at once, the others one by one."""
    first, at, rows, quiet = now[AT], now[AT], now[ROWS], 0
    while at + CHUNK <= len(text):
        lines = nulls = 0
        for i in range(at, at + CHUNK):
            lines += text[i] == LINE
            nulls += text[i] == 0
        quiet = 0 if lines else quiet + CHUNK
        if nulls or lines >= rows or quiet >= LONGEST_LINE:
            break
        rows -= lines
        at += CHUNK
    while at > first and text[at - 1] != LINE:
        at -= 1
    end = DONE
    while rows > 0:
        stop, most = at, min(len(text), at + LONGEST_LINE)
        while stop < most and text[stop] != LINE and text[stop] != 0:
            stop += 1
        if stop == most and stop < at + LONGEST_LINE:
            end = MORE
        elif stop == most or text[stop] == 0:
            end = STRANGE
        elif rows == 1 and _words(text, at, stop) < width:
            end = SHORT
        if end != DONE:
            break
        at = stop + 1
        rows -= 1
    now[LINES] += now[ROWS] - rows
    now[AT], now[ROWS] = at, rows
    return end


@kernel
def _words(text: Any, start: int, stop: int) -> int:
    count, within = 0, False
    for i in range(start, stop):
        blank = text[i] == SPACE or TAB <= text[i] <= RETURN
        if not blank and not within:
            count += 1
        within = not blank
    return count


@kernel
def _head(text: Any, form: Any, found: Any) -> int:
    """Read a head of this form that begins here; STRANGE where there is none, or nothing that it may
    say."""
    now, whole = found.now, found.whole
    frame, at, lines, bounds, k = now[FRAMES], now[AT], 0, 1, 0
    if not len(form):
        return STRANGE
    while k < len(form):
        if form[k] != MARK:
            if at == len(text):
                return MORE
            if text[at] != form[k]:
                return STRANGE
            lines += form[k] == LINE
            at += 1
            k += 1
            continue
        kind = form[k + 1]
        for _ in range(2 if kind == BOX else 1):
            start, at = _word(text, at)
            if at == len(text):
                return MORE if at - now[AT] < LONGEST_LINE else STRANGE
            if kind in (STEP, COUNT):
                number = _whole_number(text, start, at)
                whole[frame, STEP_IS if kind == STEP else COUNT_IS] = number
                if not 0 <= number <= (LARGEST_STEP if kind == STEP else LARGEST_WHOLE):
                    return STRANGE
            else:
                cell = REAL * frame + (bounds if kind == BOX else 0)
                bounds += kind == BOX
                if bounds > REAL or at == start:
                    return STRANGE
                if not decide(text, start, at, cell, found.real, found.bits):
                    return STRANGE
                if not abs(found.real[cell]) <= LARGEST_LENGTH:
                    return STRANGE
        at = _word(text, at)[0]
        k += 2
    if whole[frame, STEP_IS] <= now[LAST]:
        return STRANGE
    now[AT], now[FRAMES], now[LAST] = at, frame + 1, whole[frame, STEP_IS]
    now[ROWS] = whole[frame, COUNT_IS]
    now[LINES] += lines
    whole[frame, LINE_IS], whole[frame, LENGTH_IS] = now[LINES] + 1, 0
    return DONE


@kernel
def _word(text: Any, at: int) -> Any:
    """Start and stop of the next word of a line."""
    start = at
    while start < len(text) and (
        text[start] == SPACE or text[start] == TAB or text[start] == RETURN
    ):
        start += 1
    stop = start
    while stop < len(text) and text[stop] > SPACE:
        stop += 1
    return start, stop


@kernel
def _whole_number(text: Any, start: int, stop: int) -> Any:
    """The whole number of digits, −1 where there are none or others."""
    if not 0 < stop - start < 19:
        return -1
    number = np.int64(0)
    for i in range(start, stop):
        digit = np.uint64(text[i]) - ZERO
        if digit >= TEN:
            return -1
        number = 10 * number + np.int64(digit)
    return number
