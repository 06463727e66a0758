"""`crowd_percussions`: the whole product under one name, imported when it is used; one version."""

import ast
import doctest
import importlib
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import crowd_percussions as cp
import nscd
from analysis import scene

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
    made = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    heavy = {"numpy", "nscd", "analysis", "MDAnalysis", "numba", "importlib.metadata"}
    assert not heavy & set(made.stdout.split())


def test_one_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert cp.__version__ == metadata.version("crowd-percussions") == version
