"""docs/cases/dump.md, followed: the dumps, their tables, the plot; and the site's menu and API."""

import csv
import importlib.util
import re
from fnmatch import fnmatch

import pytest

from tests.docs.documented import ROOT, blocks, write_files
from tests.forked import python

PAGE = "docs/cases/dump.md"
SITE = ROOT / "docs/site"
PUBLIC = (
    "nscd", "nscd.friction", "nscd.indeterminacy", "nscd.stepping", "analysis.scene",
    "analysis.dumps", "analysis.engines", "analysis.percussions", "analysis.compare",
)  # fmt: skip
PROGRAM = """
import runpy, sys
from analysis.cli import main
commands = [words.split() for words in sys.argv[1:]]
for words in commands:
    sys.argv[1:] = words
    try:
        main()
    except SystemExit as end:
        assert end.code == 0
runpy.run_path("plot.py")
"""


def test_a_dump_of_your_own(tmp_path):
    write_files(PAGE, tmp_path)
    collide, press = (
        line.removeprefix("percussions ") for block in blocks(PAGE)
        for line in block.text.splitlines() if line.startswith("percussions solve")
    )  # fmt: skip
    made = python(PROGRAM, collide, press, cwd=tmp_path, MPLBACKEND="agg")
    assert made.returncode == 0, made.stderr
    with (tmp_path / "contacts.csv").open() as file:
        carried = [float(row["reaction_Ns"]) for row in csv.DictReader(file)]
    # two people of 75 kg at 1 m/s on each side of the middle
    assert carried == pytest.approx([75, 150, 75], rel=1e-9)
    with (tmp_path / "pressed.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["force_N"]) for row in rows] == pytest.approx([300, 150, 450], rel=1e-9)
    assert all(row["determined"] == "1" for row in rows)
    assert all(row["lower_Ns"] == row["upper_Ns"] for row in rows)
    assert made.stdout.splitlines()[-1].startswith("solved 150")
    assert (tmp_path / "crowd.png").stat().st_size > 1000


def module(name, monkeypatch):
    monkeypatch.syspath_prepend(str(SITE))
    spec = importlib.util.spec_from_file_location(name, SITE / f"{name}.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_every_page_is_in_the_menu():
    text = (SITE / "conf.py").read_text(encoding="utf-8")
    (menu,) = re.findall(r"^CONTENTS = \{(.*?)^\}", text, flags=re.DOTALL | re.MULTILINE)
    patterns = re.findall(r'"([\w/*]+)"', menu)
    pages = [
        str(path.relative_to(ROOT / "docs").with_suffix(""))
        for path in (ROOT / "docs").rglob("*.*")
        if path.suffix in (".md", ".rst")
    ]
    # index is the page that has the menu
    shown = [page for page in pages if not page.startswith("api/") and page != "index"]
    for page in shown:
        depth = page.count("/")
        assert any(fnmatch(page, one) and one.count("/") == depth for one in patterns), page
    api = {path.stem for path in (ROOT / "docs/api").glob("*.rst")} - {"index"}
    index = (ROOT / "docs/api/index.rst").read_text().split()
    assert api <= set(index)
    # what a new pattern would forget
    assert len(shown) > 25


def test_the_api_has_every_public_package():
    shown = {
        name
        for path in (ROOT / "docs/api").glob("*.rst")
        for name in re.findall(r"automodule:: (\S+)", path.read_text())
    }
    assert shown == {*PUBLIC, "crowd_percussions"}


def test_docstrings_become_lists_code_and_words(monkeypatch):
    as_rst = module("docstrings", monkeypatch).as_rst
    words = """Sum a_b of *all* |u|, as `x_y` says
over two lines.

radius, mass: (n,) m, kg; not
    less than 0
k: N/m

    u = v_n

>>> sum_of(1)
1""".splitlines()
    assert as_rst(words) == [
        r"Sum a\_b of *all* \|u\|, as \ ``x_y``\  says over two lines.",
        "",
        "- ``radius``, ``mass``: (n,) m, kg; not",
        "  less than 0",
        "- ``k``: N/m",
        "",
        "::",
        "",
        "    u = v_n",
        "",
        ">>> sum_of(1)",
        "1",
        "",
    ]
