"""Columns of tables, declared once, in columns.txt: the code that writes a table takes the names,
docs/columns.md units and meanings."""

import functools
from pathlib import Path
from typing import Self


@functools.cache
def declared() -> dict[str, list[list[str]]]:
    """Read names, unit and meaning of the columns of all tables.

    Each line is `names | unit | meaning`; one that begins with a space goes on with the line before."""
    text = Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").replace("\n ", " ")
    tables = (block.split("]\n") for block in text[1:].split("\n["))
    rows = ((name, filter(None, lines.split("\n"))) for name, lines in tables)
    return {name: [[*map(str.strip, line.split("|"))] for line in lines] for name, lines in rows}


class Columns(tuple[str, ...]):
    """The names of a table's columns in order."""

    def __new__(cls, table: str) -> Self:
        """Take those of the table of that name."""
        names = (row[0].split(", ") for row in declared()[table])
        return super().__new__(cls, [one for each in names for one in each])


def markdown(table: str) -> str:
    """Return the declaration of a table in Markdown."""
    lines = ["| column | unit | meaning |", "|---|---|---|"]
    for names, unit, meaning in declared()[table]:
        marked = ", ".join(f"`{name}`" for name in names.split(", "))
        lines.append(f"| {marked} | {unit} | {meaning} |".replace("|  |", "| |"))
    return "\n".join(lines)
