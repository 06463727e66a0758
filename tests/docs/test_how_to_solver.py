"""docs/how_to/solver.md: its example compiles against the core, and its table names every file."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "how_to" / "solver.md").read_text()
METHOD, BRANCH = re.findall(r"^```cpp\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
# Of the core, but of no use to a solver.
BESIDE = {"arrays", "geometry", "levels", "soft", "team"}


def test_the_table_names_every_file():
    table = "\n".join(line for line in PAGE.splitlines() if line.startswith("|"))
    files = {path.stem for path in (ROOT / "nscd" / "core").glob("*.*")}
    assert set(re.findall(r"`(\w+)`", table)) == files - BESIDE


def test_the_example_compiles(tmp_path):
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    (tmp_path / "jacobi.hpp").write_text(METHOD)
    code = '#include "jacobi.hpp"\nint main() { return nscd::jacobi({}, 1e-8).sweeps - 1; }\n'
    (tmp_path / "one.cpp").write_text(code)
    core = ROOT / "nscd" / "core"
    words = [compiler, "-std=c++20", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{core}"]
    subprocess.run([*words, str(tmp_path / "one.cpp")], check=True)
    ladder = (core / "answer.cpp").read_text()
    assert BRANCH.splitlines()[0].split("==")[0] in ladder  # it stands among those that it names
