"""Writing files whole: to a temporary name, then renamed, so that an interrupted run leaves earlier
results."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any


@contextlib.contextmanager
def whole_file(path: Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside `path` for writing text (or bytes: mode `wb`); it takes the name
    `path` only if the block ends well.

    A link stays, and what it points to is replaced. What is no file, such as a pipe or a device, is
    written directly. Raises OSError naming the path."""
    text = "b" not in mode
    words: dict[str, Any] = {"encoding": "utf-8", "newline": "\n"} if text else {}
    try:
        if path.exists() and not stat.S_ISREG(path.stat().st_mode):
            with path.open(mode, **words) as file:
                yield file
            return
        # the file itself, where the path is a link to it
        place = Path(os.path.realpath(path))
        place.parent.mkdir(parents=True, exist_ok=True)
        part = place.with_name(f".{place.name}.{os.getpid()}.part")
        try:
            with part.open(mode, **words) as file:
                yield file
            os.replace(part, place)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        # a write that fails, as on a full disk, names no file
        if error.filename is None and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with whole_file(path) as file:
        file.write(text)
