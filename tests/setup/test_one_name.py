"""`crowd_percussions`: the whole product under one name, imported when it is used; one version."""

import ast
import doctest
import importlib
import tomllib
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

import crowd_percussions as cp
import nscd
from analysis import scene
from tests.forked import python

ROOT = Path(__file__).resolve().parents[2]


def test_it_hands_on_the_same_things():
    assert cp.solve is nscd.solve
    assert cp.scene is scene
    assert cp.read_scene is scene.read_scene
    assert cp.determinacy is importlib.import_module("nscd.indeterminacy").determinacy
    for name in cp.__all__:
        assert getattr(cp, name).__name__.rpartition(".")[2] == name
    assert set(nscd.__all__) | {"__version__"} <= set(dir(cp))
    with pytest.raises(AttributeError, match="has no 'nothing'"):
        _ = cp.nothing


def test_what_is_shown_of_each_kind_of_thing_is_short():
    pair = cp.Snapshot(
        position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25, 0.25], mass=[75, 75]
    )
    contacts = cp.find_contacts(pair, tolerance=1e-9)
    answer = cp.solve(pair, contacts, law=cp.ContactLaw(friction=0.3))
    gate = cp.read_scene("gate")
    found = cp.percussions_of(gate, gate.snapshot)
    things = {
        "ContactLaw": cp.ContactLaw(friction=0.3),
        "ContactState": cp.ContactState.OPEN,
        "Contacts": contacts,
        "Crowd": cp.Crowd(people=60),
        "Doorway": cp.Doorway(ends=((0.0, -0.5), (0.0, 0.5))),
        "Determinacy": cp.determinacy(contacts, 2),
        "Inside": cp.Inside(blocks=[(0.0, 0.0, 1.0, 1.0)]),
        "Question": cp.Question(error=0.05),
        "Motion": cp.Motion(pair, step=0.01),
        "Percussions": answer,
        "Scene": gate,
        "Setting": found.setting,
        "Snapshot": pair,
        "Status": answer.status,
        "Walls": found.setting.walls,
    }
    record = SimpleNamespace(engine="lammps")
    match = SimpleNamespace(contacts=contacts)
    things["Comparison"] = cp.Comparison(
        scene=gate, record=record, match=match, balance=None, percussions=found, law=None,
        by_balance=None,
    )  # fmt: skip
    others = [answer.friction, gate.drive, gate.contact, cp.read_room("gate")[0], found]
    for thing in (*things.values(), *others):
        shown = repr(thing)
        assert len(shown) <= 400, shown
        assert " object at 0x" not in shown
    assert "gate" in repr(things["Scene"])
    assert f"{len(gate.snapshot)} disks" in repr(things["Scene"])
    kinds = {name for name in cp.__all__ if isinstance(getattr(cp, name), type)}
    # an analysis and its results: tests/percussions
    assert kinds - set(things) == {"DumpError", "EngineError", "SceneError", "PercussionAnalysis"}


def test_its_example():
    assert doctest.testmod(cp) == (0, 3)


def test_types_know_the_same_names():
    tree = ast.parse(Path(cp.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    typed = {
        alias.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }  # fmt: skip
    assert typed == cp._HOMES


def test_nothing_is_imported_before_it_is_used():
    program = "import crowd_percussions, sys; print(*sys.modules)"
    made = python(program)
    heavy = {"numpy", "nscd", "analysis", "MDAnalysis", "importlib.metadata"}
    assert not heavy & set(made.stdout.split())


def test_one_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert cp.__version__ == metadata.version("crowd-percussions") == version
