"""The wheel: built, installed into a bare environment, used from outside of the source tree. No
network: what it depends on is lent from the environment of the tests. `crowd_percussions`: the
whole product under one name, imported when it is used; one version."""

import doctest
import importlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

import crowd_percussions as cp
import nscd
from analysis import scene
from nscd import _core
from tests.forked import python

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SOURCES = (
    "nscd", "analysis", "crowd_percussions", "scenes", "lammps_inputs", "yade_scripts", "docs",
)
FILES = ("pyproject.toml", "CMakeLists.txt", "README.md", "LICENSE")
# What a stranger does first, each from the folder that the wheel knows nothing of.
FIRST = """
import importlib.metadata, pathlib, sys
import analysis, crowd_percussions, nscd
from analysis.scene import read_scene, scene_names
from crowd_percussions import ContactLaw, Snapshot, find_contacts, solve

home = pathlib.Path(sys.prefix).resolve()
for package in (nscd, analysis, crowd_percussions):
    assert home in pathlib.Path(package.__file__).resolve().parents, package.__file__
assert pathlib.Path(nscd.__file__).with_name("core").joinpath("nscd.h").is_file()
assert "gate" in scene_names()
assert len(read_scene("gate").snapshot) == 55
two = Snapshot(
    position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25, 0.25], mass=[75, 75]
)
found = solve(two, find_contacts(two, tolerance=1e-9), law=ContactLaw(restitution=0.5))
print(found.status, found.impulse.round(9).tolist(), importlib.metadata.version("crowd-percussions"))
"""


def called(*words, **rest):
    made = subprocess.run(words, capture_output=True, text=True, check=False, timeout=300, **rest)
    assert made.returncode == 0, made.stdout + made.stderr
    return made.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built from a copy, so that nothing is left in the source tree, with the core that is compiled
    already."""
    source, out = (tmp_path_factory.mktemp(name) for name in ("source", "dist"))
    for name in SOURCES:
        leave = shutil.ignore_patterns("__pycache__", "*.png")
        shutil.copytree(ROOT / name, source / name, ignore=leave)
    for name in FILES:
        shutil.copyfile(ROOT / name, source / name)
    build = (sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out))
    called(*build, f"-Ccmake.define.PREBUILT={_core.__file__}", str(source))
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """The folder of an environment with the wheel and nothing else of ours."""
    folder = tmp_path_factory.mktemp("bare")
    called(sys.executable, "-m", "venv", "--without-pip", "--symlinks", str(folder))
    python = str(folder / "bin/python")
    pip = (sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check")
    called(*pip, "install", "--quiet", "--no-deps", "--no-compile", "--no-index", str(wheel))
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "lent.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder


def outside(tmp_path):
    """Of a process that knows nothing of the source tree."""
    selected = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return {"cwd": tmp_path, "env": {**selected, "HOME": str(tmp_path)}}


def test_the_wheel_has_the_one_version(wheel):
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert wheel.name.startswith(f"crowd_percussions-{PROJECT['version']}-{python}-{python}-")


def test_a_stranger_can_import_and_solve(bare, tmp_path):
    message = called(str(bare / "bin/python"), "-c", FIRST, **outside(tmp_path))
    assert message == f"solved [[112.5, 0.0]] {PROJECT['version']}\n"


def test_the_command_is_there(bare, tmp_path):
    command = str(bare / "bin/percussions")
    assert called(command, "--version", **outside(tmp_path)).split()[1] == PROJECT["version"]
    assert "stability" in called(command, "--help", **outside(tmp_path))


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
    solution = cp.solve(pair, contacts, law=cp.ContactLaw(friction=0.3))
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
        "Question": cp.Question(error=0.05), "Motion": cp.Motion(pair, step=0.01),
        "Percussions": solution, "Scene": gate, "Setting": found.setting, "Snapshot": pair,
        "Status": solution.status, "Walls": found.setting.walls,
    }
    record = SimpleNamespace(engine="lammps")
    match = SimpleNamespace(contacts=contacts)
    things["Comparison"] = cp.Comparison(
        scene=gate, record=record, match=match, balance=None, percussions=found, law=None,
        by_balance=None,
    )  # fmt: skip
    others = [solution.friction, gate.drive, gate.contact, cp.read_room("gate")[0], found]
    for thing in (*things.values(), *others):
        shown = repr(thing)
        assert len(shown) <= 400, shown
        assert " object at 0x" not in shown
    assert "gate" in repr(things["Scene"])
    assert f"{len(gate.snapshot)} disks" in repr(things["Scene"])
    kinds = {name for name in cp.__all__ if isinstance(getattr(cp, name), type)}
    # an analysis and its results: tests/percussions, tests/audit; people of JuPedSim: tests/exchange
    errors = {"DumpError", "EngineError", "NoGradientError", "SceneError"}
    assert kinds - set(things) == errors | {"Audit", "PercussionAnalysis", "RigidPeople"}


def test_its_example():
    assert doctest.testmod(cp) == (0, 3)


def test_nothing_is_imported_before_it_is_used():
    program = "import crowd_percussions, sys; print(*sys.modules)"
    made = python(program)
    heavy = {"numpy", "nscd", "analysis", "MDAnalysis", "importlib.metadata"}
    assert not heavy & set(made.stdout.split())


def test_one_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert cp.__version__ == metadata.version("crowd-percussions") == version
