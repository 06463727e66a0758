"""The site of the docs, by Sphinx: `make docs`. It opens offline and asks no other machine."""

import re
import sys
import tomllib
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT)]

from docstrings import as_rst  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

# Which pages stand where in the menu; a pattern takes those that no line before it took.
CONTENTS = {
    "Start": ["getting_started", "examples"],
    "How to": ["how_to/*"],
    "Theory": ["theory", "conventions", "errata"],
    "Results": ["results", "results/*", "results/details/*"],
    "Reference": ["scenes", "columns", "api/index", "*"],
}

OUTSIDE = re.compile(r"\[[^\]]*\]\((?:\.\./)+((?:benchmarks|examples)/[^)]*)\)")

project, release = PROJECT["name"], PROJECT["version"]
copyright = PROJECT["authors"][0]["name"]
extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["site"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_default_options = {"exclude-members": "model_config"}
autodoc_type_aliases = {name: name for name in ("Floats", "Indices", "Flags", "Door", "Engine")}
python_use_unqualified_type_names = True
html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = [str(HERE / "static")]
html_css_files = ["site.css"]
# a browser lets no page that it opened from a file read another
html_show_search_summary = False
html_copy_source = html_show_sourcelink = False


def _complete(_: Sphinx, page: str, source: list[str]) -> None:
    """Add the menu to the first page, whose text on its own is read elsewhere too; name what is
    outside docs/ without a link."""
    source[0] = OUTSIDE.sub(r"`\1`", source[0])
    if page != "index":
        return
    for caption, pages in CONTENTS.items():
        entries = "\n".join(pages)
        source[0] += (
            f"\n\n```{{toctree}}\n:hidden:\n:glob:\n:caption: {caption}\n\n{entries}\n```\n"
        )


def _signed(_app: Sphinx, _what: str, _name: str, of: object, *_: object) -> tuple[str, str] | None:
    """Shorten the signature of what a file is checked against; its docstring has the units."""
    fields = getattr(of, "model_fields", None)
    return None if fields is None else (f"({', '.join(fields)})", "")


def _convert(_app: Sphinx, _what: str, _name: str, _of: object, _opt: object, lines: list[str]):
    """Turn a docstring into what Sphinx reads."""
    lines[:] = as_rst(lines)


def setup(app: Sphinx) -> None:
    """Connect them."""
    app.connect("source-read", _complete)
    app.connect("autodoc-process-docstring", _convert)
    app.connect("autodoc-process-signature", _signed)
