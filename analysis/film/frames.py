"""Which frames of a file make a film."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

# About so many frames, evenly spread, where none are asked for.
USUAL = 50
FORM = re.compile(r"(?P<first>\d{0,9})(?P<range>:(?P<last>\d{0,9})(:(?P<step>\d{1,9}))?)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """Choose every `step`-th frame from the first to the last, both included.

    first, last: those of the file where left out
    step: about 50 frames where left out
    """

    first: int | None = None
    last: int | None = None
    step: int | None = None

    @classmethod
    def parse(cls, text: str) -> Frames:
        """Read `150:250:5` (every fifth from 150 to 250), `150:250`, `150:` or `150`.

        Raises ValueError for anything else."""
        found = FORM.fullmatch(text)
        if not found or not text:
            raise ValueError(f"--frames: {text}; first:last:step is needed, such as 150:250:5")
        first = int(found["first"]) if found["first"] else None
        last = int(found["last"]) if found["last"] else None
        step = int(found["step"] or 1)
        frames = cls(first=first, last=last if found["range"] else first, step=step)
        if step < 1 or (frames.first or 0) > (frames.last or 10**9):
            raise ValueError(f"--frames: {text}; from first to last, with a step of at least 1")
        return frames

    def of(self, first: int, last: int, file: Path) -> range:
        """List the numbers of the frames of a file that has them from first to last.

        Raises ValueError naming the file for frames that it has not."""
        start = first if self.first is None else self.first
        end = last if self.last is None else self.last
        if not first <= start <= end <= last:
            asked = f"{start} to {max(start, end)}"
            raise ValueError(f"--frames: {asked}; {file} has frames {first} to {last}")
        step = self.step or max(1, round((end - start) / (USUAL - 1)))
        return range(start, end + 1, step)
