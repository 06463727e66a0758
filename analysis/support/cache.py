"""Results kept on disk with the key of what they depend on, so that unchanged work is not repeated.

The suffix of the file says what is in it: `.npz` numpy arrays, `.json` anything else. A file that
is missing, damaged or was kept under another key counts as not there."""

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from analysis.support.files import whole_file

KEY = "key"


def cached(path: Path, key: str) -> dict[str, Any] | None:
    """Read what `store` wrote to the file under the same key, without the key; None where there is
    no such thing."""
    try:
        if path.suffix == ".npz":
            with np.load(path) as arrays:
                content = dict(arrays)
        else:
            content = json.loads(path.read_text(encoding="utf-8"))
        return content if str(content.pop(KEY)) == key else None
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, BadZipFile):
        return None


def store(path: Path, key: str, content: Mapping[str, Any]) -> None:
    """Write the content, of names other than `key`, to the file, whole or not at all."""
    with whole_file(path, "wb" if path.suffix == ".npz" else "w") as file:
        if path.suffix == ".npz":
            np.savez(file, **{KEY: np.array(key), **content})
        else:
            content = {KEY: key, **content}
            json.dump(content, file, ensure_ascii=False, indent=1, default=_plain)
            file.write("\n")


def _plain(value: Any) -> Any:
    """Bytes as base64 text, a numpy number or array as Python's own."""
    return base64.b64encode(value).decode("ascii") if isinstance(value, bytes) else value.tolist()
