"""Tables of people as text, read and checked row by row."""

import csv
import itertools
import re
from array import array
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analysis.support import reading
from analysis.support.reading import UnreadableError

# A row of a table has at least so many numbers, and its columns are named where one is an id.
LEAST_NUMBERS = 3
ID = re.compile(r"id|pedID|NO|\w*edestrianId\S*")


def read_rows(file: Path, named: bool) -> tuple[list[str], pd.DataFrame]:
    """The lines before the first row of a text file, and all rows by their lines, the columns named
    by the last of these lines that has the name of an id, or numbered.

    Raises UnreadableError naming the first row that is not as the one before all: as many cells,
    numbers in the same places."""
    head: list[str] = []
    like: list[bool] = []
    values, lines = array("d"), array("q")
    with reading.open_file(file) as content:
        for number, line in enumerate(reading.lines_of(content, file), start=1):
            text = line.decode("utf-8", "replace").removeprefix("\ufeff").strip()
            cells = _cells(text)
            numbers = [bool(reading.NUMBER.fullmatch(cell)) for cell in cells]
            where = f"{file}, line {number}: {text[:60]!r}"
            if "\r" in text:
                raise UnreadableError(f"{where} has a carriage return. Lines end in \\n or \\r\\n")
            if not like:
                if cells and all(numbers) and len(cells) < LEAST_NUMBERS:
                    raise UnreadableError(f"{where} has too few cells for a row")
                if text.startswith("#") or sum(numbers) < LEAST_NUMBERS:
                    head.append(text)
                    continue
                like = numbers
            if text and text[0] not in "#$*":
                if numbers != like:
                    raise UnreadableError(
                        f"{where} is not a row as the first one, with {len(like)} cells"
                    )
                values.extend(map(float, itertools.compress(cells, numbers)))
                lines.append(number)
    if not like:
        raise UnreadableError(f"{file}: no row of numbers")
    names: list[Any] = [*range(len(like))]
    for text in head if named else ():
        cells = [cell.rpartition(":")[2] for cell in _cells(text)]
        if len(cells) == len(like) and any(map(ID.fullmatch, cells)):
            names = cells
    table = np.frombuffer(values).reshape(len(lines), sum(like))
    columns = pd.Index(list(itertools.compress(names, like)))
    return head, pd.DataFrame(table, index=pd.Index(lines, name="line"), columns=columns)


def _cells(text: str) -> list[str]:
    mark = next((mark for mark in ";," if mark in text), None)
    cells = next(csv.reader([text], delimiter=mark)) if mark and '"' in text else text.split(mark)
    return [cell.strip() for cell in cells]
