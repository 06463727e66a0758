"""Words of a page: Markdown beside the code, with slots for numbers.

The words of a module `fig7.py` are in `fig7.md`, those of a package in its `words.md`. Such a file
is a list of blocks, each below a heading of level 2 that is its name:

    ## found
    - With k = {{ stiffness | number }} N/m the error is {{ error | percent }}.
    - M^−1/2^ and u~d~ are written so.

    ## claim_speed
    - where: Fig. 9
    - statement: the velocity is largest at the exit
    - reason: {{ near | decimals(2) }} m/s within 1 m of it

    ## table_errors
    Errors of {{ count }} meshes.

    | side (m) | error (–) |

Slots and loops are Jinja's. A float in a slot needs a filter, so that its digits are chosen.
"""

import importlib.util
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
from markdown_it import MarkdownIt
from markdown_it.rules_inline import StateInline
from matplotlib.figure import Figure

from analysis.pages.numbers import FILTERS
from analysis.pages.section import Cell, Claim, Drawn, Picture, Section, Table, Verdict

Rows = Sequence[Sequence[Cell]]
HEADING = re.compile(r"^## +(\S+) *$", re.MULTILINE)
UNIT = re.compile(r"(?<=\d) (?=(?:k?N|kg|[cm]?m|m?s|%)(?!\w))")  # the space before it
RAISED, LOWERED = re.compile(r"\^([^ \n^]+)\^"), re.compile(r"~([^ \n~]+)~")


class Words:
    """Read the blocks of a module's or a package's words, to be filled with numbers one by one.

    module: `__name__` of a module with a .md of its name beside it, or of a package with a words.md.
    values: what every block may use, beside what it is given itself and the module's constants.
    Raises ValueError for two blocks of one name, and (here and below) for a block that is not
    there, that lacks a value, or that holds a float without a filter.
    """

    def __init__(self, module: str, **values: Any) -> None:
        spec = importlib.util.find_spec(module)
        if spec is None or spec.origin is None:
            raise ValueError(f"{module}: no module or package of this name")
        home = Path(spec.origin)
        file = home.with_name("words.md") if home.stem == "__init__" else home.with_suffix(".md")
        constants = vars(sys.modules[module]) if module in sys.modules else {}
        self.values = {name: value for name, value in constants.items() if name.isupper()} | values
        self.place = f"{module}: {file.name}"
        source = file.read_text(encoding="utf-8")
        names, blocks = HEADING.findall(source), HEADING.split(source)[2::2]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{self.place}: two blocks are called {twice[0]}")
        self.blocks: dict[str, str] = dict(zip(names, blocks, strict=True))

    def text(self, name: str, **values: Any) -> str:
        """Fill a block and return it as one line of Markdown a paragraph."""
        return "\n\n".join(_lines(self._filled(name, values)))

    def items(self, name: str, **values: Any) -> list[str]:
        """Fill a block that is a list and return its items, each one line of Markdown."""
        return _lines(self._filled(name, values))

    def parts(self, name: str, **values: Any) -> dict[str, str]:
        """Fill a block of items `name: words` and return the words by their names."""
        return dict(item.split(": ", 1) for item in self.items(name, **values) if ": " in item)

    def claim(self, name: str, verdict: Verdict, **values: Any) -> Claim:
        """Fill a block of the items `where: …`, `statement: …`, `reason: …` and judge it."""
        parts = self.parts(name, **values)
        if sorted(parts) != ["reason", "statement", "where"]:
            raise ValueError(
                f"{self.place}: {name} needs the items where, statement and reason, has "
                f"{', '.join(parts) or 'none'}"
            )
        return Claim(verdict=verdict, **parts)

    def picture(
        self, name: str, figure: Figure, narrow: Figure | None = None, **values: Any
    ) -> Picture:
        """Give a figure its caption: the block with the picture's name; narrow: for telephones."""
        caption = self.text(name, **values)
        return Picture(name=name, caption=caption, figure=figure, narrow=narrow)

    def table(self, name: str, rows: Rows, **values: Any) -> Table:
        """Give rows their caption and the heads of their columns: `| a (m) | b |` in the block."""
        lines = self._filled(name, values).splitlines()
        caption = "\n".join(line for line in lines if not line.startswith("| "))
        headers = [line for line in lines if line.startswith("| ")]
        head = [cell for line in headers for cell in line.removeprefix("| ")[:-2].split(" | ")]
        return Table(caption="\n\n".join(_lines(caption)), head=head, rows=rows)

    def section(
        self,
        number: str,
        /,
        *,
        pictures: Sequence[Picture | Drawn] | Mapping[str, Figure],
        tables: Sequence[Table] | Mapping[str, Rows],
        claims: Sequence[Claim] | Mapping[str, Verdict] = (),
        warnings: Sequence[str] = (),
        **values: Any,
    ) -> Section:
        """Fill the blocks title, words and, where there is one, differs of a section.

        pictures, tables, claims: as made above, or figures, rows and verdicts by their blocks."""
        if isinstance(pictures, Mapping):
            pictures = [self.picture(name, figure) for name, figure in pictures.items()]
        if isinstance(tables, Mapping):
            tables = [self.table(name, rows) for name, rows in tables.items()]
        if isinstance(claims, Mapping):
            claims = [self.claim(name, verdict) for name, verdict in claims.items()]
        return Section(
            number=number,
            title=self.text("title"),
            words=self.items("words", **values),
            differs=self.items("differs", **values) if "differs" in self.blocks else (),
            pictures=pictures,
            tables=tables,
            claims=claims,
            warnings=warnings,
        )

    def _filled(self, name: str, values: dict[str, Any]) -> str:
        if name not in self.blocks:
            raise ValueError(f"{self.place}: no block {name}. It has {', '.join(self.blocks)}")
        try:
            return _SLOTS.from_string(self.blocks[name]).render(self.values | values)
        except (jinja2.TemplateError, ValueError) as error:
            raise ValueError(f"{self.place}: {name}: {error}") from error


def words_of(module: str, **values: Any) -> dict[str, str | list[str]]:
    """Fill all blocks of a module's or a package's words: a list for a block that is a list."""
    words = Words(module)
    return {
        name: words.items(name, **values)
        if source.lstrip().startswith("- ")
        else words.text(name, **values)
        for name, source in words.blocks.items()
    }


def html_of(words: str) -> markupsafe.Markup:
    """Render one line of Markdown as HTML; tags and pictures in it are text, and so are links but
    those within the page: what comes from a file must not call the network.

    x^2^ is raised and u~d~ lowered, as in Pandoc's Markdown. A unit stays on the line of its number.
    """
    return markupsafe.Markup(_MARKDOWN.renderInline(UNIT.sub("\u00a0", words)))


def _chosen_digits(value: Any) -> Any:
    if isinstance(value, float):
        raise ValueError(f"{value} stands in a slot without a filter such as number or percent")
    return value


def _lines(source: str) -> list[str]:
    """The paragraphs and items of Markdown, each in one line."""
    return [
        re.sub(r"[ \n]+", " ", token.content)
        for token in _MARKDOWN.parse(source)
        if token.type == "inline"
    ]


def _shifted(state: StateInline, silent: bool) -> bool:
    """Markdown rule: ^raised^ and ~lowered~."""
    for pattern, tag in ((RAISED, "sup"), (LOWERED, "sub")):
        match = pattern.match(state.src, state.pos, state.posMax)
        if match is not None:
            if not silent:
                state.push(f"{tag}_open", tag, 1)
                state.push("text", "", 0).content = match[1]
                state.push(f"{tag}_close", tag, -1)
            state.pos = match.end()
            return True
    return False


def _markdown() -> MarkdownIt:
    parser = MarkdownIt("commonmark", {"html": False})
    parser.inline.ruler.before("emphasis", "shifted", _shifted)
    parser.disable("image")
    parser.validateLink = lambda url: url.startswith("#")  # type: ignore[method-assign]
    return parser


_MARKDOWN = _markdown()
_SLOTS = jinja2.Environment(
    undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=_chosen_digits
)
_SLOTS.filters |= FILTERS
