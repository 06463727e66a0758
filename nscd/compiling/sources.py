"""What a kernel is compiled of: its own file, and those that it imports.

Numba looks at the kernel's own file only. But the code and the constants of others are compiled
into it, so a change in one of them would leave old code on the disk, and with it old numbers."""

from __future__ import annotations

import os
import re
from functools import cache
from hashlib import sha256
from pathlib import Path

_IMPORT = re.compile(rb"^[ \t]*(?:from|import)[ \t]+(\w[\w.]*)", re.MULTILINE)


@cache
def digest_of(file: str) -> str:
    """The digest of a file, and of all files of its package, of `nscd` and of single modules beside
    them which it imports, directly or not."""
    path = Path(file).resolve()
    root = next(parent for parent in path.parents if not (parent / "__init__.py").exists())
    own = path.relative_to(root).parts[0]
    found, waiting = {str(path)}, [str(path)]
    while waiting:
        new = _imported(str(root), own, waiting.pop()) - found
        found |= new
        waiting += new
    return sha256(b"".join(_content(one)[0] for one in sorted(found))).hexdigest()


@cache
def _content(path: str) -> tuple[bytes, frozenset[bytes]]:
    """The digest of a file, and the names that it imports."""
    text = Path(path).read_bytes()
    return sha256(text).digest(), frozenset(_IMPORT.findall(text))


@cache
def _imported(root: str, own: str, path: str) -> frozenset[str]:
    """The files under the root that a file imports; of a package all files in its folder."""
    return frozenset().union(*(_files(root, own, name) for name in _content(path)[1]))


@cache
def _files(root: str, own: str, name: bytes) -> frozenset[str]:
    parts = name.decode().split(".")
    place = os.path.join(root, *parts)
    # where this is installed, the packages of others stand beside it
    ours = parts[0] in (own, "nscd")
    if os.path.isfile(place + ".py") and (ours or len(parts) == 1):
        return frozenset([place + ".py"])
    return frozenset(str(one) for one in Path(place).glob("*.py")) if ours else frozenset()
