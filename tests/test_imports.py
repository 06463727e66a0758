"""Imports go one way: every folder has a rank, and nothing imports upwards or in a circle."""

import ast
import graphlib
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# From the ground up; folders of one rank know nothing of each other, and neither do two of one
# line.
RANKS = [
    ["nscd"],
    ["nscd/friction"],
    ["nscd/solve.py"],
    ["nscd/rivals.py", "nscd/stepping"],
    ["nscd/__init__.py"],
    ["nscd/indeterminacy"],
    ["nscd/continuum"],
    ["nscd/continuum/rivals"],
    ["analysis/__init__.py"],
    ["analysis/support"],
    ["analysis/lammps_process"],
    ["analysis/scene"],
    ["analysis/scene/real"],
    ["analysis/dumps"],
    ["analysis/engines"],
    ["analysis/percussions"],
    ["analysis/compare", "analysis/exchange"],
    ["analysis/pages"],
    ["analysis/exposure"],
    ["analysis/motion"],
    ["analysis/work_precision", "analysis/stability", "analysis/paper", "analysis/push"],
    ["analysis/advice", "analysis/film"],
    ["analysis/advice/people"],
    ["analysis/cli", "crowd_percussions"],
]  # fmt: skip


def modules():
    """Name and path of every module of the packages."""
    for package in ("nscd", "analysis", "crowd_percussions"):
        for path in (ROOT / package).rglob("*.py*"):
            if path.suffix not in (".py", ".pyi"):
                continue
            parts = path.relative_to(ROOT).with_suffix("").parts
            yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def imported(path, known):
    """The modules of the packages that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                if full in known:
                    yield full
                elif node.module in known:
                    yield node.module


def test_nscd_imports_no_files_and_no_engines():
    """Tables and pictures are imported when first asked for."""
    for path in (ROOT / "nscd").rglob("*.py"):
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            packages = {name.split(".")[0] for name in names}
            assert not packages & {"analysis", "MDAnalysis", "lammps", "yade", "pedpy"}, path
            assert node not in tree.body or not packages & {"matplotlib", "pandas"}, path


def place(path):
    """The rank of a file: of its own entry, or of the nearest folder above that has one."""
    name = path.relative_to(ROOT)
    for candidate in (name, *name.parents):
        for rank, places in enumerate(RANKS):
            if str(candidate) in places:
                return rank, str(candidate)
    raise AssertionError(f"{name}: its folder has no rank")


def test_nothing_imports_upwards():
    known = dict(modules())
    for path in known.values():
        rank, home = place(path)
        for module in imported(path, known):
            other, there = place(known[module])
            assert other < rank or there == home, f"{path.relative_to(ROOT)} imports {module}"


def test_nothing_imports_in_a_circle():
    known = dict(modules())
    graph = {name: set(imported(path, known)) - {name} for name, path in known.items()}
    list(graphlib.TopologicalSorter(graph).static_order())


def test_a_run_imports_little():
    """The parent of a run reads its scene, says its price and starts the engine."""
    program = (
        "import sys, analysis.cli.commands; few = 'rich' in sys.modules\n"
        "import analysis.advice.library, analysis.engines.run\n"
        "print(few, sorted(set(sys.modules) & set(sys.argv[1:])))"
    )
    heavy = ("MDAnalysis", "matplotlib", "pandas", "scipy.linalg", "scipy.optimize", "scipy.sparse")
    said = subprocess.run(
        [sys.executable, "-c", program, *heavy], capture_output=True, text=True, check=True
    )
    assert said.stdout == "False []\n"
