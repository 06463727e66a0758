"""Columns of tables, declared once: the code that writes a table takes the names, docs/columns.md
units and meanings."""

from typing import Self


class Columns(tuple[str, ...]):
    """The names of a table's columns in order, with their declaration.

    Each line of the declaration is `names | unit | meaning`; one that begins with a space goes on
    with the line before."""

    rows: list[list[str]]

    def __new__(cls, text: str) -> Self:
        """Read a declaration."""
        lines = text.strip().replace("\n ", " ").splitlines()
        rows = [[cell.strip() for cell in line.split("|")] for line in lines]
        made = super().__new__(cls, [name for row in rows for name in row[0].split(", ")])
        made.rows = rows
        return made

    def table(self) -> str:
        """Return the declaration as a table in Markdown."""
        lines = ["| column | unit | meaning |", "|---|---|---|"]
        for names, unit, meaning in self.rows:
            marked = ", ".join(f"`{name}`" for name in names.split(", "))
            lines.append(f"| {marked} | {unit} | {meaning} |".replace("|  |", "| |"))
        return "\n".join(lines)
