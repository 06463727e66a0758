"""The errata of the paper, read from docs/errata.md."""

import re
from dataclasses import dataclass
from pathlib import Path

from analysis.support.shipped import shipped

PAGE = shipped("docs/errata.md")
_PART = re.compile(r"^[-*] \*\*(\w+)\*\*:\s(.*?)(?=^[-*] \*\*|\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """One entry: where in the paper, what is printed there, what is correct and why."""

    where: str
    printed: str
    correct: str
    why: str


def errata(section: str, page: Path = PAGE) -> list[Erratum]:
    """The entries below the heading that starts with `## {section}`.

    Raises ValueError for a page without that heading, or with an entry that lacks a part.
    """
    chapters = re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    chosen = [chapter for chapter in chapters[1:] if chapter.startswith(section)]
    if not chosen:
        raise ValueError(f"{page}: no heading '## {section}'")
    return [_entry(text, page) for text in re.split(r"^### ", chosen[0], flags=re.MULTILINE)[1:]]


def _entry(text: str, page: Path) -> Erratum:
    where, _, body = text.partition("\n")
    parts = {name.lower(): _marked(words) for name, words in _PART.findall(body)}
    missing = [name for name in ("printed", "correct", "why") if name not in parts]
    if missing:
        raise ValueError(f"{page}: the entry '{where}' has no {missing[0].capitalize()}")
    return Erratum(
        where=where.strip(), printed=parts["printed"], correct=parts["correct"], why=parts["why"]
    )


def _marked(words: str) -> str:
    """Words in one line, with u_d and x^{2} of the docs as u~d~ and x^2^, as pages take them.

    In the docs, which are also read elsewhere, `~` would strike out."""
    words = re.sub(r"\s+", " ", words).strip()
    words = re.sub(r"\^(?:\{([^}]*)\}|\(([^)]*)\)|(\w))", lambda m: _within(m, "^"), words)
    return re.sub(
        r"(?<=(?<!\w)[^\W_])_(?:\{([^}]*)\}|([A-Za-z0-9]+))", lambda m: _within(m, "~"), words
    )


def _within(match: re.Match[str], mark: str) -> str:
    """The group that matched between two marks, in which a space would end them."""
    words = next(group for group in match.groups() if group is not None)
    return mark + words.replace(" ", "\u00a0") + mark
