"""The parts of an install: what each brings is declared, and what is missing is named in one line."""

import ast
import json
import re
import sys
import tomllib

import pytest

from analysis.support import parallel
from analysis.support.extras import BASE, EXTRAS, MissingExtraError, install, load
from tests.crowds import two_people
from tests.forked import ROOT, python

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = PROJECT["optional-dependencies"]
PACKAGES = ("nscd", "analysis", "crowd_percussions")

# Every command without any of the extras, and how it ends: a part that it needs, status 0, or
# status 0 with a part that something is left out without.
ENDS = [
    (["--version"], 0),
    (["doctor"], 0),
    (["scenes", "--make", "pair", "--out", "made"], 0),
    (["solve", "crowd.dump", "--left-velocity", "dump", "--out", "contacts.csv"], 0),
    (["run", "pair", "--engine", "lammps"], "engines"),
    (["new", "room", "--room", "4x3", "--door", "0.8", "--people", "3"], "without pages"),
    (["report", "pair"], "pages"),
    (["film", "out"], "pages"),
    (["chart", "arch", "--quick"], "continuum"),
    (["stability", "--quick"], "pages"),
    (["paper"], "pages"),
    (["push", "heads.csv"], "real"),
    (["import", "heads.txt", "--frame", "3", "--room", "room.toml", "--name", "x"], "real"),
]
PROGRAM = """
import contextlib, importlib.abc, io, json, os, sys

class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in MISSING:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

MISSING = set(json.loads(sys.argv[1]))
sys.meta_path.insert(0, Absent())
os.environ["PATH"] = sys.executable = "/nowhere/python"
from analysis.cli import main

ends = []
for words in json.loads(sys.argv[2]):
    sys.argv = ["percussions", *words]
    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            main()
        except SystemExit as end:
            ends.append([end.code, said.getvalue()])
print(json.dumps(ends))
"""


@pytest.fixture(scope="module")
def without_extras(tmp_path_factory):
    """Exit status and last words of each command where no library of an extra can be imported."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "crowd.dump").write_text(two_people())
    missing = [library.partition(".")[0] for part in EXTRAS for library in part.libraries]
    calls = [words for words, _ in ENDS]
    made = python(PROGRAM, json.dumps(missing), json.dumps(calls), cwd=folder)
    assert made.returncode == 0, made.stderr
    assert (folder / "contacts.csv").read_text().count("\n") == 2
    assert not (folder / "room.png").exists()
    assert (folder / "room.toml").exists()
    return dict(zip(map(" ".join, calls), json.loads(made.stdout), strict=True))


@pytest.mark.parametrize(("words", "end"), ENDS, ids=lambda part: str(part)[:20])
def test_what_is_missing_is_one_line(without_extras, words, end):
    status, message = without_extras[" ".join(words)]
    if end == 0:
        assert (status, message) == (0, "")
    elif end == "without pages":
        assert status == 0
        (line,) = message.splitlines()
        assert line.startswith("room.png: not drawn: ")
        assert line.endswith('pip install "crowd-percussions[pages]"')
    else:
        assert status == 1
        (line,) = (one for one in message.splitlines() if not one.startswith("note: "))
        assert line.startswith("percussions: ")
        assert line.endswith(f'pip install "crowd-percussions[{end}]"')


def test_a_library_that_is_missing_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=re.escape(install("parquet"))):
        load("pyarrow")
    with pytest.raises(ModuleNotFoundError, match="nowhere_at_all"):
        load("nowhere_at_all")


def names(requirements):
    return {re.split(r"[<>=!~; \[]", line)[0] for line in requirements}


def test_the_parts_are_those_of_pyproject():
    assert names(PROJECT["dependencies"]) == set(BASE.libraries.values())
    for part in EXTRAS:
        # mpich has nothing to import; Parquet is written from data frames
        rest = {"engines": {"mpich"}, "parquet": {"pandas"}}.get(part.extra, set())
        assert names(OPTIONAL[part.extra]) == set(part.libraries.values()) | rest
    (everything,) = OPTIONAL["all"]
    assert re.search(r"\[(.*)\]", everything)[1] == "engines,continuum,pages,real,exchange"


def test_every_library_that_is_imported_is_declared():
    """None is there only because another one needs it."""
    declared = {library for part in (BASE, *EXTRAS) for library in part.libraries}
    own = {*PACKAGES, *sys.stdlib_module_names, "pytest"}  # of its plugin
    found = set()
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add((node.module or "").partition(".")[0])
    assert found - own - declared == set()
    assert {"numpy", "skfem", "jinja2", "pedpy"} <= found


def test_where_processes_can_share_no_memory_it_is_said(monkeypatch):
    """As in a container without /dev/shm, where the system says no more than this."""

    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(parallel, "ProcessPoolExecutor", refused)
    with pytest.raises(ValueError, match=r"^jobs: .*Permission denied. Is /dev/shm there"):
        parallel.workers(2).__enter__()
