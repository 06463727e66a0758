"""The report, opened in a real browser from a file:// address."""

import json

import pytest
from browser import BROWSER, opened

from analysis.scene.shipped_scenes import make


@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
def test_page_loads_offline_and_its_numbers_are_in_the_text(percussions, tmp_path):
    make("jam", 60).with_run(duration_s=4.0, frames=8).write(tmp_path)
    made = percussions(
        "report", "jam.toml", "gate", "--engine", "lammps", "--out", "report", timeout=300
    )
    assert made.returncode == 0, made.stderr
    address = made.stdout.strip().splitlines()[-1]
    numbers = json.loads((tmp_path / "report/numbers.json").read_text())
    with opened(address, 390) as page:
        assert page.locator("section[data-scene]").count() == 2
        for run in numbers["jam"]["runs"]:
            row = page.locator(f"tr[data-run='jam/lammps/{run['stiffness']:g}']")
            assert row.locator("[data-key=status]").inner_text() == "solved"
            assert row.locator("[data-key=contacts_both]").inner_text() == str(
                run["statistics"]["contacts_both"]
            )
            shown = float(row.locator("[data-key=contact_correlation]").inner_text())
            assert shown == pytest.approx(run["statistics"]["contact_correlation"], abs=1e-4)
        assert "Heads are not bodies" in page.locator("#gate").inner_text()
    for run in numbers["jam"]["runs"]:
        assert (
            (tmp_path / "report" / run["csv"])
            .read_text()
            .startswith("first,second,is_wall,nx,ny,gap_m,penalty_x_N")
        )


def test_a_missing_engine_is_a_warning_and_the_rest_goes_on(percussions, tmp_path, monkeypatch):
    make("jam", 20).with_run(duration_s=1.0, frames=2).write(tmp_path)
    monkeypatch.setenv("PATH", "/nonexistent")
    made = percussions("report", "jam.toml", "--stiffness", 1e6, timeout=120)
    assert made.returncode == 0, made.stderr
    assert "yade" in made.stderr
    assert "apt-get install yade" in made.stderr
    assert "apt-get install yade" in (tmp_path / "report/index.html").read_text()
