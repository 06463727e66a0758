"""The report, opened in a real browser from a file:// address."""

import json
import shutil

import pytest
from playwright.sync_api import sync_playwright

from analysis.making import make

BROWSER = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
QUIET = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
def test_page_loads_offline_and_its_numbers_are_in_the_text(percussions, tmp_path):
    make("jam", 60).with_run(duration_s=4.0, frames=8).write(tmp_path)
    made = percussions("report", "jam.toml", "gate", "--engine", "lammps", "--out", "report", timeout=300)
    assert made.returncode == 0, made.stderr
    address = made.stdout.strip().splitlines()[-1]
    assert address.startswith("file://")
    numbers = json.loads((tmp_path / "report/numbers.json").read_text())
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=QUIET)
        page = browser.new_page(viewport={"width": 390, "height": 844})
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request",
            lambda request: (
                None if request.url.startswith(("file:", "data:")) else complaints.append(request.url)
            ),
        )
        page.goto(address)
        assert page.locator("section[data-scene]").count() == 2
        for run in numbers["jam"]["runs"]:
            row = page.locator(f"tr[data-run='jam/lammps/{run['stiffness']:g}']")
            assert row.locator("[data-key=status]").inner_text() == "solved"
            assert row.locator("[data-key=contacts_both]").inner_text() == str(
                run["statistics"]["contacts_both"]
            )
            shown = float(row.locator("[data-key=contact_correlation]").inner_text())
            assert shown == pytest.approx(run["statistics"]["contact_correlation"], abs=1e-4)
        broken = page.evaluate("[...document.images].filter(i => !i.complete || !i.naturalWidth).length")
        assert broken == 0
        # on a phone only the tables scroll sideways, not the page
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        assert "Heads are not bodies" in page.locator("#gate").inner_text()
        browser.close()
    assert complaints == []
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
