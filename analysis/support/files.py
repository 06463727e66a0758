"""Files: those that the product brings along, and writing whole ones, to a temporary name that is then
renamed, so that an interrupted run leaves earlier results."""

import contextlib
import csv
import dataclasses
import json
import math
import os
import stat
import sysconfig
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
        target = Path(os.path.realpath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            with part.open(mode, **words) as file:
                yield file
            os.replace(part, target)
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


def write_json(path: Path, content: Any) -> None:
    """Write the content as JSON, whole or not at all; null stands for NaN and infinities."""
    write_text(path, json.dumps(plain(content), indent=1, ensure_ascii=False) + "\n")


def write_rows(path: Path, head: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Write the names of columns and rows below them as CSV, whole or not at all; NaN and infinities
    as empty cells."""
    with whole_file(path) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(head)
        for row in rows:
            table.writerow(
                ["" if isinstance(one, float) and not math.isfinite(one) else one for one in row]
            )


def write_columns(path: Path, columns: Mapping[str, Any]) -> None:
    """Write arrays (k,) by their names as the columns of a CSV file, whole or not at all."""
    cells = (column.tolist() for column in columns.values())
    write_rows(path, list(columns), zip(*cells, strict=True))


def plain(value: Any) -> Any:
    """Give what JSON has for mappings, sequences, dataclasses, models and arrays; None stands for NaN
    and infinities."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if dataclasses.is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if hasattr(value, "model_dump"):
        return plain(value.model_dump(mode="json"))
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def shipped(name: str) -> Path:
    """`scenes`, `lammps_inputs`, `yade_scripts` or `docs/errata.md`: of the checkout, or what an
    installed wheel put under share/."""
    beside = Path(__file__).resolve().parents[2] / name
    return (
        beside
        if beside.exists()
        else Path(sysconfig.get_path("data")) / "share" / "crowd-percussions" / name
    )


def or_shipped(path: Path) -> Path:
    """Give a path as it is, or the product's own file of that name where there is none:
    `scenes/gate_excerpt.txt`, from any folder."""
    if path.parts[:1] != ("scenes",) or ".." in path.parts or path.exists():
        return path
    own = shipped(str(path))
    return own if own.is_file() else path
