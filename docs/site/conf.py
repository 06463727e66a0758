"""The site of the docs, by Sphinx: `make docs`. It opens offline and asks no other machine."""

import re
import sys
import tomllib
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT)]

from docstrings import as_rst  # noqa: E402

from analysis.studies.explore.page import offered, write_explore  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

# The menu: a pattern takes every page of a folder.
CONTENTS = {
    "Start": ["getting_started", "questions", "examples"],
    "Worked cases": ["cases/room", "cases/trajectory", "cases/dump"],
    "How to": ["how_to/*"],
    "Quantities": [
        "concepts/percussion",
        "concepts/contact_force",
        "concepts/window",
        "concepts/person",
        "concepts/wall_load",
        "concepts/interval",
        "concepts/stiffness_number",
        "concepts/certificate",
    ],
    "Concepts": ["theory", "conventions", "inputs", "glossary"],
    "Results": ["results", "validation", "timing", "results/*"],
    "Reference": [
        "commands",
        "troubleshooting",
        "scenes",
        "columns",
        "errata",
        "api/index",
        "style",
        "licences",
    ],
}

# A link to what is outside docs/, from a page so many folders below it.
OUTSIDE = r"\[[^\]]*\]\((?:\.\./){%d}(benchmarks/[^)]*|CONTRIBUTING\.md)\)"

project, release = PROJECT["name"], PROJECT["version"]
copyright = PROJECT["authors"][0]["name"]
extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["site"]
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
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
    source[0] = re.sub(OUTSIDE % (page.count("/") + 1), r"`\1`", source[0])
    if page != "index":
        return
    first = '<p><a href="explore.html">Press a crowd in this browser</a></p>'
    source[0] = source[0].replace("\n\n", f"\n\n{first}\n\n", 1)
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


def _formula(to: HTML5Translator, node: nodes.math) -> None:
    """Write a formula of a line as MathML, which browsers draw by themselves."""
    to.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def _display(to: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own as MathML."""
    to.body.append(tex2mathml(node.astext()).replace("<math", '<math display="block"', 1))
    raise nodes.SkipNode


def _explore(app: Sphinx, failed: Exception | None) -> None:
    """Put the page that presses a crowd beside the first one."""
    if failed is None and app.builder.name == "html":
        write_explore(offered(), Path(app.outdir), "percussions explore")


def setup(app: Sphinx) -> None:
    """Connect them."""
    app.connect("build-finished", _explore)
    app.connect("source-read", _complete)
    app.connect("autodoc-process-docstring", _convert)
    app.connect("autodoc-process-signature", _signed)
    app.add_html_math_renderer("mathml", (_formula, None), (_display, None))
