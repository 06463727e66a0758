"""Damage to files and command lines, as disks, editors, scripts and people do it."""

from __future__ import annotations

import bz2
import gzip
import re

# Words where a number or a name is expected.
WORDS = (
    "nan", "inf", "-inf", "0", "-0.0", "-1", "1", "2", "3", "2.7", "1e19", "1e308", "-1e308",
    "1e-308", "5e-324", "1e400", "1e200", "1e-9", "9999999999", "2147483648", "18446744073709551616",
    "0x10", "1_000", "1,5", "1d3", "\N{FULLWIDTH DIGIT TWO}", "x", "", "true", "None", '"1.0"', "[]",
    "{}", "ITEM:", "id", "vx", "pp", "xy", "../evil", "a b", "$(id)", "%s", "\N{MINUS SIGN}1",
)  # fmt: skip
VALUE = re.compile(rb"[^\s=,\[\]{}:\"]+")
LINE_END = b"\n"
BINARY = (".sqlite", ".h5", ".hdf5")


def damage(random, content, name=""):
    """The bytes of a file with one to three faults, mostly one; of one that is no text, mostly
    bytes where they are not zero."""
    if name.endswith(BINARY) and random.random() < 0.85:
        return change_bytes(random, content)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = random.choice(FAULTS)(random, content)
    return content


def change_bytes(random, content):
    """One to eight bytes that say something, or their neighbours."""
    changed = bytearray(content)
    indices = [k for k, byte in enumerate(content) if byte]
    for _ in range(random.choice((1, 1, 2, 4, 8))):
        position = min(random.choice(indices) + random.choice((0, 0, 0, 1)), len(content) - 1)
        changed[position] = random.choice((0, 1, 2, 4, 16, 64, 127, 128, 255, random.randrange(256)))
    return bytes(changed)


def change_word(random, content):
    return _replaced(random, content, lambda word: random.choice(WORDS).encode())


def change_digit(random, content):
    """One digit, sign or point of a number, or the number negated or scaled."""

    def changed(word):
        if not any(chr(c).isdigit() for c in word):
            return word
        index = random.randrange(len(word))
        by = random.choice((b"0", b"7", b"-", b".", b"e9", b""))
        return random.choice(
            (word[:index] + by + word[index + 1 :], b"-" + word, word + b"0", word + b"e3")
        )

    return _replaced(random, content, changed)


def drop_word(random, content):
    return _replaced(random, content, lambda word: b"")


def double_word(random, content):
    return _replaced(random, content, lambda word: word + b" " + word)


def swap_words(random, content):
    words = list(VALUE.finditer(content))
    if len(words) < 2:
        return content
    first, second = sorted(random.sample(range(len(words)), 2))
    if random.random() < 0.5:
        second = min(first + random.choice((1, 2, 3)), len(words) - 1)
    a, b = words[first], words[second]
    if first == second:
        return content
    between = content[a.end() : b.start()]
    return content[: a.start()] + b[0] + between + a[0] + content[b.end() :]


def move_word(random, content):
    """From one row to the next: the file has as many words as before."""
    lines = content.split(LINE_END)
    row = random.randrange(max(1, len(lines) - 1))
    head, _, last = lines[row].rpartition(b" ")
    if row + 1 < len(lines):
        lines[row], lines[row + 1] = head, last + b" " + lines[row + 1]
    return LINE_END.join(lines)


def drop_line(random, content):
    lines = content.split(LINE_END)
    del lines[random.randrange(len(lines))]
    return LINE_END.join(lines)


def double_line(random, content):
    lines = content.split(LINE_END)
    row = random.randrange(len(lines))
    lines.insert(random.randrange(len(lines)), lines[row])
    return LINE_END.join(lines)


def swap_lines(random, content):
    lines = content.split(LINE_END)
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return LINE_END.join(lines)


def drop_lines(random, content):
    lines = content.split(LINE_END)
    start = random.randrange(len(lines))
    del lines[start : start + random.randrange(1, 12)]
    return LINE_END.join(lines)


def cut_off(random, content):
    return content[: random.randrange(len(content) + 1)]


def cut_head(random, content):
    return content[random.randrange(min(len(content), 200) + 1) :]


def flip_byte(random, content):
    if not content:
        return content
    index = random.randrange(len(content))
    return content[:index] + bytes([random.randrange(256)]) + content[index + 1 :]


def insert_bytes(random, content):
    index = random.randrange(len(content) + 1)
    what = random.choice(
        (b"\0", b"\xff\xfe", b"\r", b"\n\n", b"\t", b"#", b"\x1b[31m", b" " * 70000)
    )
    return content[:index] + what + content[index:]


def other_line_ends(random, content):
    return content.replace(LINE_END, random.choice((b"\r\n", b"\r", b"\n\n")))


def packed(random, content):
    pack = random.choice((gzip.compress, bz2.compress))
    return pack(content)


def packed_and_cut(random, content):
    return cut_off(random, packed(random, content))


def other_encoding(random, content):
    text = content.decode("utf-8", "replace")
    return random.choice((text.encode("utf-16"), b"\xef\xbb\xbf" + content))


def appended(random, content):
    return content + random.choice((content, b"0\n", b"\n", b"{", b"ITEM: TIMESTEP\n", b"x = 1\n"))


def nothing_left(random, content):
    return random.choice((b"", b"\n", b" "))


def _replaced(random, content, change):
    words = list(VALUE.finditer(content))
    if not words:
        return content
    word = random.choice(words)
    return content[: word.start()] + change(word[0]) + content[word.end() :]


# What happens often stands there often.
FAULTS = (
    *(change_word,) * 8, *(change_digit,) * 6, *(drop_word,) * 2, *(swap_words,) * 3, move_word,
    double_word, *(drop_line,) * 3, double_line, swap_lines, drop_lines, *(cut_off,) * 2, cut_head,
    flip_byte, insert_bytes, other_line_ends, packed, packed_and_cut, other_encoding, appended,
    nothing_left,
)  # fmt: skip


def damage_words(random, words, options):
    """A command line with one or two faults; options: name → values that make sense."""
    words = list(words)
    for _ in range(random.choice((1, 1, 2))):
        kind = random.randrange(5)
        index = random.randrange(1, len(words)) if len(words) > 1 else 0
        if kind == 0 and index:
            del words[index]
        elif kind == 1:
            words[index] = random.choice(WORDS)
        elif kind == 2:
            words.insert(index + 1, words[index])
        else:
            name = random.choice(sorted(options))
            value = random.choice((*options[name], *options[name], random.choice(WORDS)))
            words += [name, value]
    return words
