"""Docstrings as they are written here, for Sphinx: fields as a list, code and examples as they stand."""

import re
from collections.abc import Iterator, Sequence

# A field begins a line: one name or several, and what they are.
FIELD = re.compile(r"([a-zA-Z_]\w*(?:, [a-zA-Z_]\w*)*): (.*)")


def as_rst(lines: Sequence[str]) -> list[str]:
    """Turn the lines of a docstring into reStructuredText."""
    made: list[str] = []
    for block in _blocks(lines):
        if block[0].startswith(">>>"):
            made += block
        elif block[0].startswith(" "):
            made += ["::", "", *block]
        elif all(FIELD.match(line) or line.startswith(" ") for line in block):
            made += _fields(block)
        else:
            made += [_escaped(" ".join(block))]
        made.append("")
    return made


def _blocks(lines: Sequence[str]) -> Iterator[list[str]]:
    """What stands between empty lines."""
    block: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line.rstrip())
        elif block:
            yield block
            block = []


def _fields(block: Sequence[str]) -> list[str]:
    """A list of fields; lines that are indented go on with the one before."""
    made: list[str] = []
    for line in block:
        if match := FIELD.match(line):
            names = ", ".join(f"``{name}``" for name in match[1].split(", "))
            made.append(f"- {names}: {_escaped(match[2])}")
        else:
            made.append("  " + _escaped(line.strip()))
    return made


def _escaped(text: str) -> str:
    """Words as they stand; what is in back-quotes is code, a *word* between stars is stressed."""
    parts = re.split(r"`+([^`]+)`+", text)
    words = [re.sub(r"([|_\\]|\*(?!\w+\*)(?<!\w\*))", r"\\\1", part) for part in parts]
    words[1::2] = [f"\\ ``{part.strip()}``\\ " for part in parts[1::2]]
    return "".join(words)
