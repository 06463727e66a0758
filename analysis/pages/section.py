"""What a section of a page holds: words, pictures, tables and judged claims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from matplotlib.figure import Figure

from analysis.pages.ranges import Chart

Cell = str | float | int


class Verdict(StrEnum):
    """Say whether a statement of the paper held when it was tried."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"

    @classmethod
    def of(cls, *each: bool) -> Verdict:
        """Judge a statement by its parts: it holds where all do, in part where some do."""
        return cls.HOLDS if all(each) else cls.PARTLY if any(each) else cls.FAILS


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """Judge a statement of the paper.

    where: in the paper
    statement: in its words, or close to them
    reason: the numbers that say so
    """

    where: str
    statement: str
    verdict: Verdict
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Hold rows with their heads; numbers are formatted by the page.

    caption: in Markdown; the page shows what is bold in a cell as an alarm
    head: one per column, with its unit
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    file: str = ""  # beside the page, in place of the rows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """Hold a figure.

    name: of its files, without suffix
    caption: in Markdown
    narrow: the same for a telephone; where left out, a wide figure's panels below each other
    """

    name: str
    caption: str
    figure: Figure
    narrow: Figure | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """Hold a picture that is drawn already: its files as bytes."""

    name: str
    caption: str
    png: bytes
    pdf: bytes
    narrow: bytes = b""  # PNG for a telephone, where it is another


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """Hold one part of a page, in Markdown: a figure of the paper, a scene, a quantity.

    number: what it is called in a link
    introduction: paragraphs before everything else
    charts: bars beside the pictures, of a first screen
    words: what came out
    differs: what differs from the printed text
    files: names of files beside the page
    """

    number: str
    title: str
    introduction: Sequence[str] = ()
    words: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    pictures: Sequence[Picture | Drawn] = ()
    tables: Sequence[Table] = ()
    differs: Sequence[str] = ()
    claims: Sequence[Claim] = ()
    warnings: Sequence[str] = ()
    files: Sequence[str] = ()
