"""Cells of tables of text: separators, quotation marks, decimal commas, missing numbers."""

import csv
import math
import re

from analysis.support.reading import NUMBER

DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
MISSING = ("", "na", "n/a", "null", "none")


def cells_of(text: str) -> list[str]:
    """Split a line into cells: at ; or tabs or commas, else at spaces. A comma is a decimal one beside
    ; or tabs, and where cells between commas would hold two numbers."""
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
    """Tell whether a mark stands between cells, none of which holds two numbers."""
    if " " not in text and (mark == "\t" or "\t" not in text):
        return ",\t" not in text
    cells = [cell.split() for cell in text.split(mark)]
    if mark == "\t" and any(cell and cell[-1].endswith(",") for cell in cells):
        return False
    return all(sum(map(bool, map(NUMBER.fullmatch, cell))) < 2 for cell in cells)


def number_of(cell: str) -> float | None:
    """The number that a cell holds, NaN where it is missing, None where it holds something else."""
    if NUMBER.fullmatch(cell):
        return float(cell)
    if DECIMAL_COMMA.fullmatch(cell):
        return float(cell.replace(",", "."))
    return math.nan if cell.lower() in MISSING else None
