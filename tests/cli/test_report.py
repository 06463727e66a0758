"""The report, opened in a real browser from a file:// address."""

import json

import pytest
from browser import BROWSER, opened, rows_of

from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make


@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
def test_page_loads_offline_and_its_numbers_are_in_the_text(percussions, tmp_path):
    make("jam", 60).with_run(duration_s=2.0, frames=8).write(tmp_path)
    made = percussions(
        "report", "jam.toml", "--engine", "lammps", "--engine", "rigid", "--seeds", 3,
        "--stiffness", 1e6,
        "--out", "report", timeout=600,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    address = made.stdout.strip().splitlines()[-1]
    numbers = json.loads((tmp_path / "report/numbers.json").read_text())
    with opened(address, 390) as page:
        assert page.locator("body > section:not(#reproduce)").count() == 4
        moving = rows_of(page, "jam-in-motion", "Forces and flow")
        for row, found in zip(
            moving, next(iter(numbers["jam"]["in_motion"]["models"].values())).values(), strict=True
        ):
            if found["unit"] in ("N", "N/m"):
                text = row["LAMMPS, k = 10⁶ N/m"].split(" (")[0].replace("\u202f", "")
                assert float(text) == pytest.approx(found["median"], rel=0.06, abs=0.06)
        glance = page.locator("#jam-at-a-glance").inner_text()
        assert "Everybody pushes with 300 N" in glance
        assert "does not reduce to mechanical" in glance
        first = page.locator("body > section").first.get_attribute("id")
        assert first == "jam-at-a-glance"
        bearing = rows_of(page, "jam-at-a-glance", "People above each limit")
        model = "LAMMPS, k = 10⁶ N/m"
        named = numbers["jam"]["in_motion"]["exposure"][model]["above_asphyxia_minutes"]
        (row,) = (row for row in bearing if row["limit"] == "1\u202f112 N")
        assert float(row[model].split(" (")[0]) == pytest.approx(named["median"], abs=0.5)
        entries = page.locator("nav a").all_text_contents()
        assert entries == page.locator("body > section:not(#reproduce) h2").all_text_contents()
        said = page.locator("li").all_text_contents()
        assert len(set(said)) == len(said)
        for picture in page.locator("figure a[title]").all():
            file = tmp_path / "report" / picture.get_attribute("href")
            assert file.stat().st_size > 1000
            assert file.with_suffix(".pdf").stat().st_size > 1000
    for run in numbers["jam"]["runs"]:
        assert (
            (tmp_path / "report" / run["csv"])
            .read_text()
            .startswith("first,second,is_wall,nx,ny,gap_m,penalty_x_N")
        )


def test_a_real_crowd_says_what_was_done_to_it(percussions, tmp_path):
    made = percussions("report", "gate", "--engine", "lammps", "--stiffness", 1e6, "--seeds", 0)
    assert made.returncode == 0, made.stderr
    assert "Heads are not bodies" in (tmp_path / "report/index.html").read_text()


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
