"""Cells of tables of text: separators, quotation marks, decimal commas, missing numbers."""

import csv
import math
import re

from analysis.support.reading import NUMBER

DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
LEAST_NUMBERS = 3  # of a row
MISSING = ("", "na", "n/a", "null", "none")


def cells_of(text: str) -> list[str]:
    """Split a line into cells: at ; or tabs or commas, else at spaces. A comma is a decimal one beside
    ; and tabs, and where spaces stand between three numbers or more."""
    bare = re.sub(r'"[^"]*"', "", text) if '"' in text else text
    mark = next((mark for mark in ";\t," if mark in bare and _separates(mark, bare)), None)
    if mark == "\t":
        cells = [cell for cell in text.split(mark) if cell]  # tabs may fill up
    elif mark and '"' in text:
        cells = next(csv.reader([text], delimiter=mark))
    else:
        cells = text.split(mark)
    return [cell.strip(' "\t') for cell in cells]


def _separates(mark: str, text: str) -> bool:
    """Tell whether a mark that is in a line stands between its cells."""
    if mark == "\t" and re.search(",[ ]*\t", text):
        return False
    if mark == ";" or (" " not in text and (mark == "\t" or "\t" not in text)):
        return True
    if mark == ",":
        return sum(number_of(cell) is not None for cell in text.split()) < LEAST_NUMBERS
    cells = (cell.split() for cell in text.split(mark))
    return not any(len(cell) > 1 and all(map(NUMBER.fullmatch, cell)) for cell in cells)


def number_of(cell: str) -> float | None:
    """The number that a cell holds, NaN where it is missing, None where it holds something else."""
    if NUMBER.fullmatch(cell):
        return float(cell)
    if DECIMAL_COMMA.fullmatch(cell):
        return float(cell.replace(",", "."))
    return math.nan if cell.lower() in MISSING else None
