"""What the how-to pages say is done, word for word. docs/how_to/solver.md: its example compiles
against the core, and its table names every file."""

import csv
import doctest
import importlib.util
import re
import shutil
import subprocess

import numpy as np
import pytest

from analysis import engines
from analysis.compare.comparison import compare_run, write_contacts
from analysis.dumps import open_bodies, read_contacts, snapshot_of
from analysis.engines.run import simulate
from analysis.scene import law
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from analysis.studies.paper import page
from analysis.studies.work_precision.soft import leapfrog
from tests.docs.documented import ROOT, blocks, columns, write_files
from tests.engines.at_hand import require
from tests.engines.laws.test_law import few
from tests.forked import PROGRAM, python


def test_a_scene_by_hand(tmp_path):
    require("lammps")
    write_files("docs/how_to/scene.md", tmp_path)
    (commands,) = (b.text for b in blocks("docs/how_to/scene.md") if b.language == "bash")
    for line in commands.splitlines():
        words = line.split()
        assert words[0] == "percussions"
        made = python(PROGRAM, *words[1:], cwd=tmp_path)
        assert made.returncode == 0, made.stderr
    compared = compare_run(tmp_path / "out/corner/lammps_hooke_k1e+06")
    table = (tmp_path / "out/corner/lammps_hooke_k1e+06/comparison.csv").read_text()
    assert set(table.splitlines()[0].split(",")) <= columns()
    # what the scene's comment predicts
    for sums in compared.disk_sums():
        assert sums == pytest.approx([450 + 300, 300 + 150, 150], rel=1e-9)


def test_a_scene_in_python():
    page = str(ROOT / "docs/how_to/scene.md")
    assert doctest.testfile(page, module_relative=False) == (0, 11)


def test_an_engine_of_your_own(tmp_path, monkeypatch):
    write_files("docs/how_to/engine.md", tmp_path)
    monkeypatch.chdir(tmp_path)
    spec = importlib.util.spec_from_file_location("adapter", tmp_path / "adapter.py")
    adapter = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(adapter)
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, adapter.Springs()))
    scene = make("pair").with_run(duration_s=0.05, frames=500, time_step_s=2e-6)
    record = simulate(scene, "springs", tmp_path / "pair")
    assert (record.exit_state, record.engine) == ("finished", "springs")
    compared = compare_run(tmp_path / "pair")
    penalty, rigid = compared.disk_sums()
    # m_eff (1 + e) U
    assert penalty == pytest.approx([75 * 1.01] * 2, rel=2e-3)
    assert rigid == pytest.approx([75 * 1.01] * 2, rel=1e-9)
    write_contacts(tmp_path / "pair.csv", compared)
    assert set((tmp_path / "pair.csv").read_text().splitlines()[0].split(",")) <= columns()
    frames = list(read_contacts(tmp_path / "pair/contacts.dump"))
    assert max(len(frame) for frame in frames) == 1
    with pytest.raises(engines.EngineError, match="knows no walls"):
        simulate(read_scene("arch"), "springs", tmp_path / "arch")


def test_a_figure_of_your_own(tmp_path, monkeypatch):
    write_files("docs/how_to/figure.md", tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    fig0 = importlib.import_module("fig0_pair")
    part = page.Part(number="0", seconds=1, build=fig0.build)
    monkeypatch.setattr(page, "DISCRETE", (*page.DISCRETE, part))
    discrete = page.PAGES["discrete"]._replace(parts=page.DISCRETE)
    monkeypatch.setitem(page.PAGES, "discrete", discrete)
    positions = tmp_path / "paper", tmp_path / "runs"
    pages, warnings = page.write_pages(["discrete"], *positions, "percussions paper", ["0"])
    assert warnings == []
    text = pages[0].read_text(encoding="utf-8")
    assert "Two people of 75\xa0kg touch. One wants to walk at 2\xa0m/s" in text
    assert "the percussion is 75" in text
    rows = (tmp_path / "paper/claims.csv").read_text(encoding="utf-8").splitlines()
    (claim,) = csv.DictReader(rows)
    assert (claim["figure"], claim["verdict"]) == ("0", "holds")
    assert claim["reason"] == "p/(mU) = 0.500"
    for suffix in ("png", "pdf"):
        assert (tmp_path / f"paper/figures/fig_pair.{suffix}").stat().st_size > 1000


def test_a_law_of_your_own(tmp_path, monkeypatch):
    """LAMMPS, YADE and the reference with the law of the page agree to rounding."""
    require("lammps")
    written = {block.file: block.text for block in blocks("docs/how_to/law.md") if block.file}
    for folder, name in (("lammps_inputs", "law.in"), ("yade_scripts", "scene_file.py")):
        shutil.copytree(ROOT / folder, tmp_path / folder)
        path = tmp_path / folder / name
        before, squared, after = path.read_text().partition('if "${apart} == yes" then "variable')
        path.write_text(before + written[name] + squared + after)
    exec(written["law.py"], vars(law))
    for one in engines.PENALTY:
        monkeypatch.setattr(one, "DECKS", str(tmp_path / one.DECKS))
    try:
        scene = few("square", None)
        for name in [each.NAME for each in engines.PENALTY if each.find()]:
            simulate(scene, name, tmp_path / name)
            last = snapshot_of(open_bodies(tmp_path / name / "bodies.dump").trajectory[-1])
            moved = last.position - scene.snapshot.position
            np.testing.assert_allclose(moved, leapfrog(scene).displacement[1], rtol=0, atol=1e-11)
    finally:
        del law.LAWS["square"]


PAGE = (ROOT / "docs" / "how_to" / "solver.md").read_text()
METHOD, BRANCH = re.findall(r"^```cpp\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
# Of the core, but of no use to a solver.
BESIDE = {"arrays", "drive", "geometry", "levels", "soft", "team"}


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
    ladder = (core / "impact_solver.cpp").read_text()
    assert BRANCH.splitlines()[0].split("==")[0] in ladder  # it stands among those that it names
