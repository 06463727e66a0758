"""Processes that want the same kernel: one compiles it, the others wait and load it."""

from __future__ import annotations

import contextlib
import os
import time
from hashlib import sha256
from typing import Any

try:
    import fcntl
except ImportError:  # Windows: everybody compiles
    fcntl = None  # type: ignore[assignment]

# So long one waits (s): whoever compiles longer hangs, and one of our own takes a minute.
LONGEST_S, BETWEEN_S = 600.0, 0.05


class Turns:
    """The turns of this process at compiling a function; place: beside which file locks are."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._held: dict[Any, tuple[int, str]] = {}

    def take(self, signature: Any) -> bool:
        """Wait for the turn at a signature; whether others had it meanwhile. A lock ends with its
        process, whatever ends that."""
        if fcntl is None or signature in self._held:
            return False
        path = f"{self._place}.{sha256(repr(signature).encode()).hexdigest()[:16]}.lock"
        try:
            file = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        except OSError:  # a folder that cannot be written keeps no kernels either
            return False
        waited, end = False, time.monotonic() + LONGEST_S
        while time.monotonic() < end:
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            waited = True
            time.sleep(BETWEEN_S)
        self._held[signature] = file, path
        return waited

    def end(self, signature: Any) -> None:
        """Give the turn at a signature to the next."""
        if signature in self._held:
            file, path = self._held.pop(signature)
            with contextlib.suppress(OSError):
                os.unlink(path)
            # not by closing alone: a forked child may have it open too
            fcntl.flock(file, fcntl.LOCK_UN)
            os.close(file)
