"""The code blocks of a Markdown page: files, commands and Python, as they stand."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the file name after it (or ""), its text."""

    language: str
    file: str
    text: str


def blocks(page):
    """The fenced blocks of a page of the project."""
    tokens = MarkdownIt("commonmark").parse((ROOT / page).read_text(encoding="utf-8"))
    found = []
    for token in tokens:
        if token.type == "fence":
            language, _, file = token.info.partition(" ")
            found.append(Block(language, file.strip(), token.content))
    return found


def write_files(page, folder):
    """Write every block that has a file name into the folder."""
    for block in blocks(page):
        if block.file:
            (folder / block.file).write_text(block.text, encoding="utf-8")


def columns():
    """The names of columns in the first cells of the tables of docs/columns.md."""
    text = (ROOT / "docs/columns.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    return {name for cell in rows for name in re.findall(r"`(\w+)`", cell)}
