"""Pages: templates, tables, pictures as files and inside the page, values as JSON."""

import base64
import hashlib
import io
import re
import urllib.parse
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from datetime import UTC, datetime
from importlib import metadata, resources
from pathlib import Path
from typing import Any, Literal

import jinja2
import markupsafe
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from analysis.engines.doctor import made_with
from analysis.pages.drawing import NARROW_IN, for_telephone
from analysis.pages.numbers import FILTERS, number, powers
from analysis.pages.section import Cell, Drawn, Picture, Section, Table
from analysis.pages.words import html_of
from analysis.support.files import whole_file, write_text

DIGITS, DPI = 4, 150
# a cell of more letters than these wraps
LONG = 28
SOLVED = "solved"
# what a script needs besides shared.js
BEFORE = {"explore.js": ("scene.js",)}
# So many times as wide as a telephone, a figure is drawn again for it.
WIDE = 1.3
# what reads as a number stands right, as numbers do
NUMERIC = re.compile(r"[−–≈*+]*\d|–$|not measured|determined$")


def templates() -> jinja2.Environment:
    """Return templates/, with the filters that they use."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("analysis.pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= FILTERS
    environment.filters |= {
        "md": html_of,
        "powers": powers,
        "sentence": sentence,
        "href": href,
        "stacked": stacked,
        "script": script,
        "source_of_script": source_of_script,
        "cell": cell_html,
        "cell_kind": cell_kind,
        "column_kind": column_kind,
    }
    return environment


def render(template: str, *, contents: Sequence[tuple[str, str]] = (), **content: Any) -> str:
    """Fill a page of templates/ with its content, the date, and the versions of what made it.

    contents: anchors and titles that the list in the header leads to
    content: of the template, and `engines`, the names of those that the page has numbers of"""
    return (
        templates()
        .get_template(template)
        .render(
            date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
            version=metadata.version("crowd-percussions"),
            findings=made_with({*content.pop("engines", ())}),
            contents=[*contents, ("reproduce", "How to reproduce, and cite")],
            **content,
        )
    )


def write_html(
    path: Path, template: str, pictured: Sequence[Section], figures: str = "figures", executor: Executor | None = None,
    **content: Any
) -> Path:  # fmt: skip
    """Write a page, with the pictures of sections as files beside it, drawn by the workers of an
    executor where there is one; return its path. See `render`.

    pictured: what the list in the header leads to, too, without `contents`
    figures: folder of the pictures, beside the page"""
    content = {"contents": [(one.number, one.title) for one in pictured]} | content
    images = write_pictures(pictured, path.parent / figures, executor)
    write_text(path, render(template, images=images, **content))
    return path


def sentence(words: str) -> str:
    """Write words, beginning large and ending with a stop."""
    return words[:1].upper() + words[1:] + ("" if words.endswith(".") else ".")


def script(name: str) -> markupsafe.Markup:
    """Write a script of templates/, after what all share."""
    folder = resources.files(__package__).joinpath("templates")
    parts = ("shared.js", *BEFORE.get(name, ()), name)
    texts = (folder.joinpath(one).read_text(encoding="utf-8") for one in parts)
    return markupsafe.Markup("".join(texts))


def source_of_script(name: str) -> markupsafe.Markup:
    """Name a script of templates/ for a Content-Security-Policy: by what is in it."""
    digest = hashlib.sha256(script(name).encode()).digest()
    return markupsafe.Markup(f"'sha256-{base64.b64encode(digest).decode('ascii')}'")


def stacked(caption: markupsafe.Markup) -> markupsafe.Markup:
    """Name panels of a caption by where they are on a narrow screen too: Left: is Above: there."""
    both = r'<span class="beside">\1:</span><span class="below">%s:</span>'
    words = str(caption)
    for side, there in (("Left", "Above"), ("Right", "Below")):
        words = re.sub(rf"\b({side}):", both % there, words)
    return markupsafe.Markup(words)


def href(name: str) -> str:
    """Name a file beside the page so that it is always one: `javascript:x` is a file too."""
    return "./" + urllib.parse.quote(name)


def cell_html(cell: Cell) -> markupsafe.Markup:
    """Write a cell: words as Markdown, a number with DIGITS digits, or fewer that say it all."""
    if isinstance(cell, str):
        return html_of(cell)
    enough = (digits for digits in range(1, DIGITS) if abs(cell - float(f"{cell:.{digits}g}")) <= 1e-12 * abs(cell))
    return markupsafe.escape(number(cell, next(enough, DIGITS)))


def cell_kind(cell: Cell, head: str) -> str:
    """Choose the class of a cell: words stand left, sentences wrap; a status that is not solved
    is an alarm."""
    if not isinstance(cell, str):
        return ""
    if len(re.sub(r"\]\([^)]*\)", "", cell)) > LONG:
        return "words"
    if head == "status" and cell != SOLVED:
        return "name alarm"
    return "" if NUMERIC.match(cell) else "name"


def column_kind(table: Table, column: int) -> str:
    """Choose the class of a head: above words it stands where they begin."""
    return cell_kind(table.rows[0][column], table.head[column]) if table.rows else ""


def drawn(picture: Picture | Drawn) -> Drawn:
    """Draw a picture, without the date, so that the same picture is the same file."""
    if isinstance(picture, Drawn):
        return picture
    figure, narrow = picture.figure, picture.narrow
    png, layout = saved(figure, "png"), figure.get_layout_engine()
    # the layout that the first one found serves the second
    figure.set_layout_engine("none")
    pdf = saved(figure, "pdf")
    width = figure.get_figwidth() > WIDE * NARROW_IN
    if narrow is None and width and not figure.subfigs:
        narrow = figure
        figure.set_layout_engine(layout)
        for_telephone(figure)
    small = b"" if narrow is None else saved(narrow, "png")
    return Drawn(name=picture.name, caption=picture.caption, png=png, pdf=pdf, narrow=small)


def saved(figure: Figure, form: Literal["png", "pdf"]) -> bytes:
    """Save a figure, without the date."""
    file, layout, dpi = io.BytesIO(), figure.get_layout_engine(), figure.dpi
    if isinstance(layout, ConstrainedLayoutEngine):  # savefig would draw everything once more for it
        figure.set_dpi(DPI)
        layout.execute(figure)
        figure.set_dpi(dpi)
        figure.set_layout_engine("none")
    undated = {"CreationDate": None} if form == "pdf" else {}
    figure.savefig(file, format=form, dpi=DPI, metadata=undated)
    figure.set_layout_engine(layout)
    return file.getvalue()


def write_pictures(sections: Iterable[Section], folder: Path, executor: Executor | None = None) -> dict[str, list[str]]:
    """Write the pictures of sections as PNG and PDF, each whole or not at all; return the PNG as
    base64 text, by name, and after it the one for a narrow screen where there is one."""
    images = {}
    every = [one for section in sections for one in section.pictures]
    for picture in executor.map(drawn, every) if executor else map(drawn, every):
        for suffix, content in (("png", picture.png), ("pdf", picture.pdf)):
            with whole_file(folder / f"{picture.name}.{suffix}", "wb") as file:
                file.write(content)
        shown = filter(None, [picture.png, picture.narrow])
        images[picture.name] = [base64.b64encode(png).decode("ascii") for png in shown]
    return images
