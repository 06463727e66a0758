"""The pages of the paper's parts in one folder, and the links between them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from analysis.support.files import write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class PageName:
    """A page: its template, its file, the start of the names of the files beside it, its part of
    the errata."""

    template: str
    file: str
    prefix: str
    errata: str


DISCRETE = PageName(
    template="paper_discrete.html", file="index.html", prefix="", errata="Section 2"
)
CONTINUUM = PageName(
    template="paper_continuum.html", file="continuum.html", prefix="continuum_", errata="Section 3"
)
# on every page, shown only once the other page is there
HIDDEN = '<a class="other" hidden href="'


def link_pages(folder: Path) -> None:
    """Show on each page that is in the folder the link to the other one if that is there, and hide
    it if not."""
    shown = HIDDEN.replace(" hidden", "")
    for page, other in ((DISCRETE, CONTINUUM), (CONTINUUM, DISCRETE)):
        path = folder / page.file
        if not path.exists():
            continue
        text = path.read_text(encoding="utf-8")
        want, not_want = (shown, HIDDEN) if (folder / other.file).exists() else (HIDDEN, shown)
        if not_want in text:
            write_text(path, text.replace(not_want, want))
