"""docs/how_to/solver.md, done as it says in a copy of nscd: the file, the line, the example."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "how_to" / "solver.md").read_text()
SOLVER, EXAMPLE = re.findall(r"^```python\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
BY_NAME, RUNG = re.findall(r"^```diff\n\+(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
PRINTED = re.search(r"^prints\n\n```\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE).group(1)


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """A folder with a copy of nscd, where somebody has followed the page."""
    folder = tmp_path_factory.mktemp("solver")
    shutil.copytree(ROOT / "nscd", folder / "nscd")  # with the compiled kernels
    (folder / "nscd" / "solvers" / "jacobi.py").write_text(SOLVER)
    ladder = folder / "nscd" / "solvers" / "ladder.py"
    text = ladder.read_text()
    for before, line in (
        ("from nscd.solvers.task import", "from nscd.solvers.jacobi import jacobi\n"),
        ('    "interior_point": interior_point,\n', BY_NAME),
        ("    UNEVEN,\n", RUNG),
    ):
        assert text.count(before) == 1
        text = text.replace(before, line + before)
    ladder.write_text(text)
    return folder


def run(folder, code):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def test_the_example_prints_what_the_page_says(followed):
    assert run(followed, EXAMPLE) == PRINTED


def test_the_rung_is_climbed_and_the_next_one_where_it_does_not_reach_the_tolerance(followed):
    crowd = """
import numpy as np
from nscd import Snapshot, find_contacts, solve
from nscd.solvers import jacobi

grid = 0.5 * np.array([(i, j) for i in range(4) for j in range(4)], dtype=float)
crowd = Snapshot(position=grid, velocity=1.0 - grid, radius=np.full(16, 0.25), mass=np.full(16, 75.0))
contacts = find_contacts(crowd, tolerance=1e-9)
for most in (jacobi.MOST_SWEEPS, 1):
    jacobi.MOST_SWEEPS = most
    answer = solve(crowd, contacts)
    print(answer.status, answer.solver, answer.choice)
"""
    first, second = run(followed, crowd).splitlines()
    assert first == "solved jacobi 16 disks of even masses: Jacobi"
    assert second.startswith("solved active_set")
