"""The report, opened in a real browser from a file:// address."""

import json
import re

import pytest

from analysis.engines.softness import known_bodies
from analysis.motion.report import in_motion, motion_of
from analysis.motion.study import MEASURES
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make
from tests.forked import as_program, in_fork
from tests.pages.browser import BROWSER, opened, rows_of

MINE = """
[[limit]]
name = "mine"
number = 500.0
unit = "N"
quantity = "contact_largest"
what = "my own"
population = "adults"
source = "my report, 2026"
read = "first-hand"
"""


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """A report of a small crowd, and the folder that it was made in."""
    folder = tmp_path_factory.mktemp("reported")
    make("arch", disks=20).with_run(duration_s=0.4, frames=4).write(folder)
    words = [
        "report", "arch.toml", "--engine", "lammps", "--engine", "rigid", "--seeds", "3",
        "--stiffness", "1e6", "--out", "report",
    ]  # fmt: skip
    status, said, printed = in_fork(lambda: as_program(words, folder), 600)
    assert status == 0, said
    return printed, folder


@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
def test_page_loads_offline_and_its_numbers_are_in_the_text(reported):
    printed, folder = reported
    address = printed.strip().splitlines()[-1]
    numbers = json.loads((folder / "report/numbers.json").read_text())
    with opened(address, 390) as page:
        assert page.locator("body > section:not(#reproduce)").count() == 4
        moving = rows_of(page, "arch-in-motion", "Forces and flow")
        for row, found in zip(
            moving,
            next(iter(numbers["arch"]["in_motion"]["models"].values())).values(),
            strict=True,
        ):
            if found["unit"] in ("N", "N/m"):
                text = row["LAMMPS, k = 10⁶ N/m"].split(" (")[0].replace("\u202f", "")
                assert float(text) == pytest.approx(found["mean"], rel=0.06, abs=0.06)
        glance = page.locator("#arch-at-a-glance").inner_text()
        assert "Everybody pushes with 300 N" in glance
        assert "does not reduce to mechanical" in glance
        first = page.locator("body > section").first.get_attribute("id")
        assert first == "arch-at-a-glance"
        bearing = rows_of(page, "arch-at-a-glance", "People above each limit")
        model = "LAMMPS, k = 10⁶ N/m"
        named = numbers["arch"]["in_motion"]["exposure"][model]["above_asphyxia_minutes"]
        (row,) = (row for row in bearing if row["limit"] == "1\u202f112 N")
        assert float(row[model].split(" (")[0]) == pytest.approx(named["mean"], abs=0.5)
        entries = page.locator("nav a").all_text_contents()
        assert entries == page.locator("body > section:not(#reproduce) h2").all_text_contents()
        said = page.locator("li").all_text_contents()
        assert len(set(said)) == len(said)
        for picture in page.locator("figure a[title]").all():
            file = folder / "report" / picture.get_attribute("href")
            assert file.stat().st_size > 1000
            assert file.with_suffix(".pdf").stat().st_size > 1000
    for run in numbers["arch"]["runs"]:
        assert (
            (folder / "report" / run["csv"])
            .read_text()
            .startswith("first,second,is_wall,nx,ny,gap_m,penalty_x_N")
        )


def test_a_section_compares_lammps_with_the_rigid_model_and_says_what_friction_changes(reported):
    _, folder = reported
    moving = motion_of(
        read_scene(folder / "arch.toml"), ["lammps", "rigid"], [1e6], 3, folder / "out"
    )
    assert all(run.is_finished() for runs in moving.runs.values() for run in runs)
    assert [len(every) for every in moving.runs.values()] == [3, 3]
    assert all("μ = 0.4" in name for name in moving.rough)
    own = folder / "mine.toml"
    own.write_text(MINE)
    made = in_motion(moving.scene, moving, 0.2, limits=(own,))
    assert not made.failures
    smooth, rough = made.sections
    for section in made.sections:
        (table,) = section.tables
        assert len(table.rows) == len(MEASURES)
    assert "300 N" in " ".join(smooth.introduction)
    first = made.first
    assert "Everybody pushes with **300 N**" in first.words[0]
    assert "Green Guide" in first.words[0]
    people, limits, ladder = first.tables
    for name, one in zip(ladder.head[1:], known_bodies().values(), strict=True):
        assert name.startswith(f"{one.words}, ")
    assert len(ladder.rows) == 6
    assert len(limits.rows) == 9
    assert "above_mine" in made.numbers["exposure"]["LAMMPS, k = 10⁶ N/m"]
    assert [row[-1] for row in limits.rows if "my own" in row[1]] == ["my report, 2026"]
    counts = [float(row[3].split(" ")[0]) for row in limits.rows[:7]]
    assert counts == sorted(counts, reverse=True)  # fewer people above a larger limit
    assert [row[0] for row in people.rows][-1] == "load on the worst metre of wall (kN/m)"
    said = " ".join(smooth.words)
    assert "rigid model" in said
    assert "Friction 0.4" not in said
    assert re.search("[Ff]riction 0.4", " ".join(rough.words))
    lammps = made.numbers["models"]["LAMMPS, k = 10⁶ N/m"]["contact_mean"]
    assert lammps["range_90"][0] <= lammps["mean"] <= lammps["range_90"][1]
    assert made.numbers["other_friction"]["friction"] == 0.4
    assert motion_of(read_scene("pair"), ["rigid"], [1e6], 3, folder) is None


def test_a_real_crowd_says_what_was_done_to_it(percussions, tmp_path):
    made = percussions("report", "gate", "--engine", "lammps", "--stiffness", 1e6, "--seeds", 0)
    assert made.returncode == 0, made.stderr
    page = (tmp_path / "report/index.html").read_text()
    assert "Heads are not bodies" in page
    # without replicates there is a first screen, which claims no interval
    assert page.index('<section id="gate-at-a-glance">') < page.index("<h2>Contents</h2>")
    assert "has no replicates" in page
    assert "Everybody pushes with" in page
    assert "stand above" not in re.sub(r"\s+", " ", page)
    assert "in_motion" not in json.loads((tmp_path / "report/numbers.json").read_text())["gate"]


def test_a_missing_engine_is_a_warning_and_the_rest_goes_on(percussions, tmp_path, monkeypatch):
    read_scene("pair").with_run(duration_s=0.03, frames=100).write(tmp_path)
    monkeypatch.setenv("PATH", "/nonexistent")
    engines = ("--engine", "lammps", "--engine", "yade")
    made = percussions("report", "pair.toml", *engines, "--stiffness", 1e6, "--seeds", 0)
    assert made.returncode == 0, made.stderr
    assert "yade" in made.stderr
    assert "apt-get install --no-install-recommends yade" in made.stderr
    assert (
        "apt-get install --no-install-recommends yade"
        in (tmp_path / "report/index.html").read_text()
    )
