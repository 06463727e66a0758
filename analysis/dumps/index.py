"""The index of a dump: where each of its frames is, found in one pass."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from analysis.dumps.binary import BEGIN, BinaryFrames, is_binary
from analysis.dumps.frame import DumpError, Frame
from analysis.dumps.heads import MARK, TIME, Heads
from analysis.dumps.table import DumpIndex
from analysis.support.reading import DAMAGED, UnreadableError, next_line, open_file
from nscd import _core

# Bytes of a file that are read at once.
BLOCK = 1 << 17


def index_dump(path: Path, kind: str = "ATOMS") -> DumpIndex:
    """Find and check the frames of a dump (kind ATOMS; text, or binary as LAMMPS writes it) or a dump
    local (kind ENTRIES), plain or compressed.

    Raises DumpError for a missing or empty file, one that is not such a dump, one that ends in
    mid-frame, periodic or triclinic boxes, steps or times that do not grow, times in some frames
    only, and columns that change or occur twice."""
    try:
        with open_file(path) as file:
            binary = kind == "ATOMS" and _begins_binary(file)
            reader = BinaryFrames(path, file) if binary else _Frames(path, kind, file)
            frames = tuple(reader.all())
    except DAMAGED as error:
        raise DumpError(f"{path}: damaged: {error}") from None
    except UnreadableError as error:
        raise DumpError(str(error)) from None
    if not frames:
        raise DumpError(f"{path}: empty: no frame in it")
    _check_times(path, frames)
    return DumpIndex(path, frames, reader.columns, binary)


def _check_times(path: Path, frames: tuple[Frame, ...]) -> None:
    """Refuse frames that a table with a column of times could not tell apart."""
    timed = [frame.time is not None for frame in frames]
    if any(timed) and not all(timed):
        step = frames[timed.index(not timed[0])].step
        raise DumpError(f"{path}, step {step}: a time is in some frames and not in others")
    if not timed[0]:
        return
    late = np.diff(np.array([frame.time for frame in frames], dtype=np.float64)) <= 0
    if late.any():
        before, after = frames[late.argmax()], frames[late.argmax() + 1]
        raise DumpError(
            f"{path}, step {after.step}: its time, {after.time:.6g} s, follows {before.time:.6g} s; "
            "times must grow; without them (`dump_modify ID time no`) frames go by their steps"
        )


def _begins_binary(file: IO[bytes]) -> bool:
    binary = is_binary(file.read(len(BEGIN)))
    file.seek(0)
    return binary


class _Text:
    """The bytes of an open file, of which a block is kept; it is read forwards only."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file: Any = file
        self.kept, self.at, self.before = b"", 0, 0

    def more(self) -> bool:
        """Read on; what is behind is dropped. False at the end of the file."""
        self.kept, self.before, self.at = self.kept[self.at :], self.before + self.at, 0
        # of a compressed file, what is unpacked at once
        read: bytes = self._file.read1(BLOCK)
        self.kept += read
        return bool(read)

    def readline(self, most: int) -> bytes:
        """Read a line, or `most` bytes of it, as a file does."""
        while (end := self.kept.find(b"\n", self.at, self.at + most) + 1) == 0:
            if len(self.kept) - self.at >= most or not self.more():
                end = min(len(self.kept), self.at + most)
                break
        line, self.at = self.kept[self.at : end], end
        return line


class _Frames:
    """The frames of a dump. A head that differs from the one before is read line by line."""

    def __init__(self, path: Path, kind: str, file: IO[bytes]) -> None:
        self.path = path
        self.columns: tuple[str, ...] = ()
        self._text = _Text(file)
        self._heads = Heads(path, kind, self._text)
        self._scan = _core.Scan()
        self._count = 0

    def all(self) -> Iterator[Frame]:
        """Read all frames, in order."""
        scan = self._scan
        while True:
            end = self._run()
            if end == _core.Scan.MORE and self._more():
                continue
            if scan.rows_left:
                if end == _core.Scan.STRANGE:
                    next_line(self._text, self.path, self._heads.line + 1)
                raise DumpError(
                    f"{self.path}: truncated: the file ends inside step {scan.last}, "
                    f"frame {self._count + len(scan)}"
                )
            yield from self._taken()
            if not self._read_head():
                return

    def _run(self) -> int:
        """Go on in the core, as far as that goes."""
        text, heads, scan = self._text, self._heads, self._scan
        scan.at, scan.lines = text.at, heads.line
        end = scan.run(text.kept, text.before, heads.form, len(self.columns))
        text.at, heads.line = scan.at, scan.lines
        return end

    def _more(self) -> bool:
        try:
            return self._text.more()
        except DAMAGED as error:
            line = self._heads.line + 1
            raise DumpError(f"{self.path}, line {line}: damaged: {error}") from None

    def _taken(self) -> Iterator[Frame]:
        """The frames that were found since."""
        self._count += len(self._scan)
        timed = bytes((MARK, TIME)) in self._heads.form
        whole, values = (array.tolist() for array in self._scan.taken())
        for (step, rows, *place), (time, x0, x1, y0, y1, *_) in zip(whole, values, strict=True):
            yield Frame(step, time if timed else None, (x0, y0), (x1, y1), rows, *place)

    def _read_head(self) -> bool:
        """Read a head line by line; False at the end of the file."""
        found = self._heads.next_frame()
        if found is None:
            return False
        frame, names = found
        if frame.step <= self._scan.last:
            raise DumpError(
                f"{self.path}, line {self._heads.step_line}: step {frame.step} follows step "
                f"{self._scan.last}; frames must be in order, each once"
            )
        if self.columns and names != self.columns:
            raise DumpError(
                f"{self.path}, line {frame.line - 1}: the columns change at step {frame.step}"
            )
        self.columns = names
        ends = [end for axis in zip(frame.low, frame.high, strict=True) for end in axis]
        self._scan.begin(
            frame.step,
            frame.rows,
            frame.line,
            self._text.before + self._text.at,
            np.array([frame.time or 0.0, *ends, 0.0, 0.0]),
        )
        return True
