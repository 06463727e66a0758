"""Reading what comes from outside: plain or compressed, never without end."""

import bz2
import gzip
import importlib
import logging
import lzma
import re
import stat
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import IO, Any, Protocol
from xml.etree import ElementTree

from analysis.support.extras import MissingExtraError, load

# A row of a table has some hundred bytes; without this limit one line could be a whole file.
LONGEST_LINE = 1 << 16
# Scene files have some kB, records of runs less.
LARGEST_TEXT = 10 << 20
# What the libraries raise for a compressed file that is damaged or cut off.
DAMAGED = (EOFError, zlib.error, lzma.LZMAError, OSError)

# As LAMMPS writes and reads numbers: no underscores, no other digits.
NUMBER = re.compile(r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|nan|inf)", re.I)
# Ids and steps are whole numbers of at most so many digits.
LARGEST_WHOLE = 2**31 - 1
# Of a line of the log that a user reads beside every result: more than information, no warning.
NOTE = 25
log = logging.getLogger(__name__)


class Lines(Protocol):
    """What is read line by line, such as a file."""

    def readline(self, size: int, /) -> bytes:
        """Read a line, or `size` bytes of it."""


class UnreadableError(ValueError):
    """A file that cannot be read; the message names it, and the line where there is one."""


def open_file(path: Path) -> IO[bytes]:
    """Open a regular file for reading, decompressed where it is gz, bz2, xz or zst (by its first
    bytes, whatever its name).

    Raises UnreadableError for a missing file, and for folders, devices and pipes, which may have no
    end."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise UnreadableError(f"{path}: not a regular file")
        with path.open("rb") as file:
            start = file.read(6)
        opener = next((PACKED[head] for head in PACKED if start.startswith(head)), None)
        opened: IO[bytes] = opener(path) if opener else path.open("rb")
        return opened
    except FileNotFoundError:
        raise UnreadableError(f"{path}: no such file") from None
    except OSError as error:
        raise UnreadableError(f"{path}: {error.strerror or error}") from None
    except MissingExtraError as error:
        raise UnreadableError(f"{path}: {error}, or unpack it") from None
    except UnreadableError:
        raise
    except ValueError as error:  # a name with a null character
        raise UnreadableError(f"{str(path)!r}: {error}") from None


def _zstd(path: Path) -> Any:
    try:
        library: Any = importlib.import_module("compression.zstd")
    except ModuleNotFoundError:
        library = load("backports.zstd")
    return library.open(path)


# How files that begin so are opened.
PACKED: dict[bytes, Callable[[Path], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
    b"\x28\xb5\x2f\xfd": _zstd,
}


def start_of(path: Path, size: int) -> bytes:
    """The first bytes of a file, decompressed; none where it is damaged. Raises UnreadableError for
    what is no file."""
    with open_file(path) as file:
        try:
            return file.read(size)
        except DAMAGED:
            return b""


def begins(path: Path, start: bytes) -> bool:
    """Tell whether a file begins so; see `start_of`."""
    return start_of(path, len(start)) == start


def lines_of(file: IO[bytes], path: Path) -> Iterator[bytes]:
    """The lines of an open file. Raises UnreadableError for one that is too long to be text, for
    null bytes, and for damaged compression."""
    number = 0
    while line := next_line(file, path, number + 1):
        number += 1
        yield line


def next_line(file: Lines, path: Path, number: int) -> bytes:
    """The next line of an open file, empty at its end; `number` is for the message."""
    try:
        line = file.readline(LONGEST_LINE)
    except DAMAGED as error:
        raise UnreadableError(f"{path}, line {number}: damaged: {error}") from None
    if b"\0" in line:
        raise UnreadableError(f"{path}, line {number}: binary. A text file is needed")
    if len(line) == LONGEST_LINE and not line.endswith(b"\n"):
        raise UnreadableError(
            f"{path}, line {number}: longer than {LONGEST_LINE} characters. A text file is needed"
        )
    return line


def read_text(path: Path, maximum: int = LARGEST_TEXT) -> str:
    """The text of a small file. Raises UnreadableError as `open_file` does, for more than `maximum`
    bytes and for what is not UTF-8."""
    with open_file(path) as file:
        try:
            content = file.read(maximum + 1)
        except DAMAGED as error:
            raise UnreadableError(f"{path}: damaged: {error}") from None
    if len(content) > maximum:
        raise UnreadableError(f"{path}: more than {maximum >> 20} MB. A text of some kB is expected")
    try:
        return content.decode("utf-8-sig")  # editors of Windows begin with a mark
    except UnicodeDecodeError as error:
        raise UnreadableError(
            f"{path}, line {content[: error.start].count(10) + 1}: not UTF-8 text"
        ) from None


def parsed_xml(file: Path, text: str) -> ElementTree.Element:
    """Parse the text of an XML file. Raises UnreadableError for what is none, and for a document
    type, which could grow without end."""
    if "<!DOCTYPE" in text:
        raise UnreadableError(f"{file}: a document type is not read")
    try:
        return ElementTree.fromstring(text.encode())
    except ElementTree.ParseError as error:
        raise UnreadableError(f"{file}: no XML: {error}") from None


def whole_number(word: str, what: str, *, minimum: int = 1, maximum: int = LARGEST_WHOLE) -> int:
    """The whole number that a word is. Raises UnreadableError beginning with `what` otherwise."""
    if word.isascii() and word.isdigit() and len(word) < 20 and minimum <= int(word) <= maximum:
        return int(word)
    raise UnreadableError(f"{what}: {word[:40]!r} where a whole number ≥ {minimum} is needed")


def note(path: Path | str, message: str) -> None:
    """Say a line about an input."""
    log.log(NOTE, "%s: %s", path, message)


def note_unused(path: Path, what: str, names: Iterable[str]) -> None:
    """Say in one line which columns, keys or features (`what`) of an input change nothing."""
    if listed := ", ".join(dict.fromkeys(names)):
        log.log(NOTE, "%s: %s not used: %s", path, what, listed)
