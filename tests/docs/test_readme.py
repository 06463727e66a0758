"""What README and docs show is run as it stands: Python, commands, and the form of every command.
docs/cases/dump.md, followed: the dumps, their tables, the plot; and the site's menu and API."""

import csv
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from fnmatch import fnmatch
from functools import partial

import pytest
import typer

from analysis import engines
from analysis.cli import app as cli
from analysis.cli.commands import app
from tests.docs.documented import ROOT, blocks, write_files
from tests.forked import as_program, in_fork, python

PAGES = ["README.md", *(str(p.relative_to(ROOT)) for p in sorted(ROOT.glob("docs/**/*.md")))]
# Their Python runs after the first commands of README.
SHOWN = ("README.md", "docs/getting_started.md")
NAMES = {"SCENE", "FILE", "FOLDER", "NAME"}
# Commands that take more than a few seconds, and the exit status of one that is ended when it
# begins.
LONG = {"report", "film", "chart", "advise", "stability", "standards", "paper", "push"}
BEGUN = 99


def commands(page):
    """The calls of `percussions` in the fenced blocks of a page, without comments."""
    for block in blocks(page):
        for line in block.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True) if line.startswith("percussions ") else []
            if words:
                yield words[1:]


def test_first_commands_of_readme_get_make_and_are_its_targets():
    """A bare Debian has no make."""
    first = next(block for block in blocks("README.md") if block.language == "sh")
    getting, *calls = first.text.splitlines()
    assert getting == "apt-get update && apt-get install --yes make"
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    assert calls == ["make report", "make test"]
    assert {call.split()[1] for call in calls} <= set(targets)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which the first commands of README have been run."""
    here = tmp_path_factory.mktemp("readme")
    if engines.engine("lammps").find() is None:
        pytest.skip("LAMMPS is not installed")
    for line in lines_of("README.md"):
        status, message, _ = in_fork(partial(as_program, line, here), 600)
        assert status == 0, f"{line}: {message}"
        assert "Warning" not in message, message  # of Python
    return here


def lines_of(page):
    """The commands of a page's one block of them."""
    (lines,) = (
        [shlex.split(line, comments=True) for line in block.text.splitlines()]
        for block in blocks(page)
        if block.language == "bash"
    )
    assert {line[0] for line in lines} == {"percussions"}
    return [line[1:] for line in lines]


def until_it_begins(words, here):
    """Run a command until it says how long it will take, or shows its first progress."""

    def ends(*_):
        raise SystemExit(BEGUN)

    cli.lasting = cli._Lines = ends
    return as_program(words, here)


def test_every_command_of_the_page_runs_after_those_of_readme(folder):
    """One after the other, as printed; those that take longer until they begin: by then they have
    read what they are given."""
    lines = lines_of("docs/commands.md")
    for line in lines:
        begin, ends = (until_it_begins, BEGUN) if line[0] in LONG else (as_program, 0)
        status, message, _ = in_fork(partial(begin, line, folder), 600)
        assert status == ends, f"{line}: {message}"
        assert "Warning" not in message, message  # of Python
    assert {line[0] for line in lines} > LONG


def called(command, folder):
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    how = {"cwd": folder, "env": own, "capture_output": True, "text": True, "timeout": 600}
    return subprocess.run(command, **how, check=False)


def test_python_of_readme(folder):
    pages = [str(ROOT / page) for page in SHOWN]
    words = ["-m", "doctest", "-o", "NORMALIZE_WHITESPACE", *pages]
    made = called([sys.executable, *words], folder)
    assert made.returncode == 0, made.stdout + made.stderr
    assert sum((ROOT / page).read_text(encoding="utf-8").count(">>>") for page in SHOWN) > 10


def test_docstrings_of_what_readme_shows(folder):
    """The examples in the docstrings of what these pages import, in the folder of its commands."""
    text = "".join((ROOT / page).read_text(encoding="utf-8") for page in SHOWN)
    shown = re.findall(r">>> from (crowd_percussions) import (.*)", text)
    names = [(module, name) for module, names in shown for name in names.split(", ")]
    assert len(names) > 5
    program = """
import doctest, importlib, sys
runner = doctest.DocTestRunner()
for module, name in zip(sys.argv[1::2], sys.argv[2::2]):
    shown = getattr(importlib.import_module(module), name)
    home = sys.modules[shown.__module__]
    (example,) = doctest.DocTestFinder(recurse=False).find(shown, name, globs=dict(vars(home)))
    assert example.examples, name
    runner.run(example)
sys.exit(runner.failures)
"""
    words = [word for pair in names for word in pair]
    made = called([sys.executable, "-c", program, *words], folder)
    assert made.returncode == 0, made.stdout + made.stderr


@pytest.mark.parametrize("page", PAGES)
def test_every_command_has_the_form_that_the_program_takes(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    group = typer.main.get_command(app)
    for words in commands(page):
        context = group.make_context("percussions", list(words))
        name, command, rest = group.resolve_command(context, list(words))
        if not NAMES & set(words):
            command.make_context(name, rest, parent=context)


def test_commands_are_found_at_all():
    shown = {words[0] for page in ("README.md", "docs/commands.md") for words in commands(page)}
    assert shown >= {"scenes", "run", "solve", "compare", "report", "chart", "advise", "import"}


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
    paths = (path for kind in ("md", "rst") for path in (ROOT / "docs").rglob(f"*.{kind}"))
    pages = [str(path.relative_to(ROOT / "docs").with_suffix("")) for path in paths]
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
    text = "".join(path.read_text() for path in (ROOT / "docs/api").glob("*.rst"))
    shown = set(re.findall(r"automodule:: (\S+)", text))
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
        "  less than 0", "- ``k``: N/m", "", "::", "", "    u = v_n", "", ">>> sum_of(1)", "1",
        "",
    ]
