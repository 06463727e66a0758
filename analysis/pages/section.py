"""What a section of a paper page holds: words, pictures, tables and judged claims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from matplotlib.figure import Figure

Cell = str | float | int


class Verdict(StrEnum):
    """Whether a statement of the paper held when it was tried."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"

    @classmethod
    def of(cls, *each: bool) -> Verdict:
        """Judge a statement by its parts: it holds where all do, in part where some do."""
        return cls.HOLDS if all(each) else cls.PARTLY if any(each) else cls.FAILS


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A statement of the paper (in its words), whether it held, and the numbers that say so."""

    where: str
    statement: str
    verdict: Verdict
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A caption, column heads (with units) and rows; numbers are formatted by the page."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """A figure, its file name without suffix (fig_1_four_disks) and its caption."""

    name: str
    caption: str
    figure: Figure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """A picture that is drawn already: its files as bytes."""

    name: str
    caption: str
    png: bytes
    pdf: bytes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """One part of a page, in Markdown: a figure of the paper, a scene of the report, a quantity.

    number: what it is called in a link
    introduction: paragraphs before everything else
    words: what came out
    differs: what differs from the printed text
    files: names of files beside the page
    """

    number: str
    title: str
    introduction: Sequence[str] = ()
    words: Sequence[str] = ()
    pictures: Sequence[Picture | Drawn] = ()
    tables: Sequence[Table] = ()
    differs: Sequence[str] = ()
    claims: Sequence[Claim] = ()
    warnings: Sequence[str] = ()
    files: Sequence[str] = ()
