"""The page of the paper's continuum figures: its files, itself in a real browser, and verdicts that
follow the numbers."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from analysis.pages.drawing import panels
from analysis.pages.fields import rounded
from analysis.pages.html import drawn
from analysis.pages.section import Claim, Picture, Section, Table, Verdict
from analysis.studies.paper import page as building
from analysis.studies.paper.continuum import (
    fig7_border,
    fig10_density,
    fig11_left_velocities,
    solid_chain,
)
from analysis.studies.paper.continuum import fig8_turbulence as turbulence
from analysis.studies.paper.continuum import fig9_exit_pressure as exit_pressure
from analysis.studies.paper.continuum.exit_room import map_of
from analysis.studies.paper.continuum.fig8_turbulence import (
    CHECKED,
    Case,
    Pair,
    StepSetting,
    Tried,
    readings,
)
from analysis.studies.paper.page import (
    CONTINUUM,
    Built,
    build,
    edition,
    keep,
    label,
    stored_section,
    write_pages,
)
from nscd.continuum.closed_forms import point_sink
from tests.pages.browser import BROWSER, has_its_numbers, has_its_verdicts, opened, says_little

from tests.pages.browser import says_little_beside, works_by_keyboard  # isort: skip

COARSE = 0.8  # m
CHOSEN = ("3.2.1", "11")


@pytest.fixture
def built(percussions, tmp_path):
    """The two figures that cost least."""
    words = [word for number in CHOSEN for word in ("--figure", number)]
    made = percussions("paper", "continuum", *words, "--runs", "runs", timeout=600)
    assert made.returncode == 0, made.stderr
    return made, tmp_path / "paper"


@pytest.mark.long
def test_page_in_a_browser_and_the_files_beside_it(built, tmp_path, monkeypatch):
    made, folder = built
    numbers = json.loads((folder / "continuum_numbers.json").read_text())
    assert list(numbers) == list(CHOSEN)
    with (folder / "continuum_claims.csv").open(newline="") as file:
        claims = list(csv.DictReader(file))
    assert {claim["figure"] for claim in claims} == set(CHOSEN)
    assert {claim["verdict"] for claim in claims} == {"holds", "holds in part", "does not hold"}
    for name in ("fig_3_2_1_chain", "fig_11_left_velocities"):
        assert (folder / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (folder / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    assert not list(tmp_path.rglob("*.part"))
    if BROWSER is not None:
        _read(made.stdout.strip().splitlines()[-1], folder, numbers, claims)
    # the next build of the same product takes what is kept
    runs = tmp_path / "runs"
    (made_by,) = {json.loads(path.read_text())["key"] for path in runs.rglob("section.json")}
    monkeypatch.setattr(building, "edition", lambda: made_by)
    (again,) = build(CONTINUUM, runs, ["11"])
    assert again.reused
    rows = [list(map(list, table.rows)) for table in again.section.tables]
    assert rows == [table["rows"] for table in numbers["11"]["tables"]]


def _read(address, folder, numbers, claims):
    """The page loads without complaint, offline, on a phone and on a desk, and says what the files
    say."""
    assert address.endswith("/continuum.html")
    with opened(address, 400) as page:
        works_by_keyboard(page)  # which unfolds everything
        assert page.locator("section[data-figure]").count() == len(numbers)
        for anchor, (figure, content) in zip(("fig-3-2-1", "fig-11"), numbers.items(), strict=True):
            section = page.locator(f"#{anchor}")
            assert section.locator("h2").inner_text().startswith(label(figure))
            has_its_numbers(section, content)
        has_its_verdicts(page, claims)
        says_little_beside(page, "beside the continuum")
        names = "all => all.map(a => a.getAttribute('href'))"
        positions = "a[href^='./figures/'], a[href^='continuum_']"
        links = page.locator(positions).evaluate_all(names)
        assert len(links) == 3 + 3 * len(numbers)  # three files, and of a picture: large, PNG, PDF
        assert all((folder / link).is_file() for link in links)
        positions = "nav a[href^='#'], #claims [data-verdict] a"
        inner = page.locator(positions).evaluate_all(names)
        assert all(page.locator(f"[id='{link[1:]}']").count() == 1 for link in inner)
        # the other page is not there
        assert page.locator("a.other").count() == 0
        assert page.locator("img").count() == len(CHOSEN)
        for width in (400, 1280):
            page.set_viewport_size({"width": width, "height": 844})
            assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    ("module", "number", "unsettled"),
    [
        (fig7_border, "7", False), (solid_chain, "3.2.1", False), (exit_pressure, "9", True),
        (fig10_density, "10", False), (fig11_left_velocities, "11", False), ],
)
def test_sections_on_a_coarse_mesh(module, number, unsettled, tmp_path):
    """Every claim has a verdict and numbers for it; a mesh too coarse for the means over a body is
    a warning."""
    section = module.build(mesh=COARSE)
    assert section.number == number
    assert section.claims
    says_little(section, tmp_path)
    for claim in section.claims:
        assert isinstance(claim.verdict, Verdict)
        assert any(letter.isdigit() for letter in claim.reason)
    for table in section.tables:
        assert all(len(row) == len(table.head) for row in table.rows)
    assert len(section.warnings) == unsettled


def test_pressure_of_a_point_exit():
    """The closed form against the boundary-value problem k_v(f″ + f′/r − f/r²) = ρ(f + 2U), and its
    two limits."""
    speed, density, volume = 1.7, 525.0, 675.0

    def slopes(r, y):
        return np.stack([y[1], y[0] / r**2 - y[1] / r + density / volume * (y[0] + 2 * speed)])

    def ends(a, b):
        return np.array([a[0] - 1e-3 * a[1], b[0] + 2 * speed * (1 - volume / density / 30.0**2)])

    r = np.geomspace(1e-3, 30.0, 400)
    start = np.stack([-2 * speed * np.tanh(r), -0 * r])
    found = solve_bvp(slopes, ends, r, start, tol=1e-8, max_nodes=20_000)
    assert found.success
    at = np.array([0.01, 0.1, 0.5, 1.0, 2.0, 4.0])
    f, rate = found.sol(at)
    crowd = speed, density, volume
    np.testing.assert_allclose(point_sink(at, *crowd), -0.5 * volume * (rate + f / at), rtol=2e-3)
    middle = 0.5 * np.pi * speed * np.sqrt(volume * density)
    assert point_sink(0.0, *crowd) == pytest.approx(middle)
    assert point_sink(15.0, *crowd) == pytest.approx(volume * speed / 15.0, rel=0.02)


def test_a_gaussian_pressure_would_be_called_one():
    proposed, first_order = exit_pressure.solve_room(COARSE)
    others = list(first_order.values())
    assert exit_pressure.verdicts(proposed, *others)["gaussian"] == Verdict.FAILS
    r = np.hypot(*map_of().points.T)
    bell = proposed._replace(pressure=900 * np.exp(-(r**2) / (2 * 1.5**2)))
    fit = exit_pressure.gaussian(bell.pressure)
    assert (fit.height, abs(fit.width), fit.explained) == pytest.approx((900, 1.5, 1.0))
    assert exit_pressure.verdicts(bell, *others)["gaussian"] == Verdict.HOLDS


def test_readings_of_the_forces():
    """In people or in kilograms the error is the same; the mean over the largest force in any
    triangle is the mesh's."""
    plain = StepSetting(mesh=COARSE)
    found = {}
    for name, setting in (
        ("plain", plain),
        ("people", replace(plain, person=1.0)),
        ("fine", replace(plain, mesh=0.5 * COARSE)),
    ):
        pair = Pair(Case.UNIFORM, setting, 9.0)
        assert pair.solution.status == pair.turbulence.status == "solved"
        errors = turbulence.in_l2(pair), turbulence.in_any_triangle(pair), pair.bodies().in_l2()
        found[name] = errors
    assert found["people"] == pytest.approx(found["plain"], rel=1e-4)
    assert found["fine"][0] == pytest.approx(found["plain"][0], rel=0.1)
    assert found["fine"][1] < 0.6 * found["plain"][1]


def test_the_verdict_on_the_error_follows_the_errors():
    every = readings(COARSE)

    def tried(at, half):
        errors = np.broadcast_to(np.asarray(at, dtype=float), (2, len(CHECKED)))
        return [Tried(r, errors, np.full(2, half)) for r in every]

    assert turbulence.error_verdict(tried(0.5, 0.5)) == Verdict.FAILS
    assert turbulence.error_verdict(tried(0.01, 0.01)) == Verdict.HOLDS
    # small, but the mesh's
    unsound = tried(0.01, 0.005)
    assert turbulence.error_verdict([*tried(0.5, 0.5), *unsound[1:]]) == Verdict.FAILS
    assert turbulence.error_verdict(tried([0.5, 0.01, 0.5, 0.5], 0.01)) == Verdict.PARTLY


def test_figure_8_with_few_readings(monkeypatch, tmp_path):
    monkeypatch.setattr(turbulence, "readings", lambda mesh: readings(mesh)[:6])
    monkeypatch.setattr(turbulence, "VOLUMES", (4.0, 25.0, 100.0))
    section = turbulence.build(mesh=COARSE)
    verdicts = [claim.verdict for claim in section.claims]
    assert verdicts == ["does not hold", "holds", "holds in part"]
    assert len(section.tables[0].rows) == 6
    says_little(section, tmp_path)
    assert not section.warnings


def test_a_section_is_kept_whole_or_not_taken(tmp_path, monkeypatch):
    rows = [["x", np.float64(0.1)], ["y", np.int64(3)]]
    section = Section(
        number="3.2.1", title="t", words=["w"], differs=[], warnings=["careful"],
        pictures=[Picture(name="p", caption="c", figure=panels(4.0, 3.0)[0])],
        tables=[Table(caption="c", head=["a", "b"], rows=rows)],
        claims=[Claim(where="(1)", statement="s", verdict=Verdict.PARTLY, reason="r")],
    )  # fmt: skip
    section = replace(section, pictures=[drawn(picture) for picture in section.pictures])
    built = Built(section=section, cpu_seconds=1.5)
    assert stored_section(tmp_path) is None
    keep(built, tmp_path, edition())
    found = stored_section(tmp_path)
    section = found.section
    assert (found.cpu_seconds, found.reused) == (1.5, True)
    assert section.claims == built.section.claims
    assert section.tables == [replace(built.section.tables[0], rows=[["x", 0.1], ["y", 3]])]
    assert (section.number, section.words, section.warnings) == ("3.2.1", ["w"], ["careful"])
    assert section.pictures[0].pdf.startswith(b"%PDF")
    assert section.pictures[0].png == built.section.pictures[0].png
    file = tmp_path / "section.json"
    text = file.read_text()
    file.write_text(text[: len(text) // 2])
    assert stored_section(tmp_path) is None
    file.write_text(text)
    assert stored_section(tmp_path) is not None
    monkeypatch.setattr(building, "edition", lambda: "another")
    assert stored_section(tmp_path) is None


@pytest.mark.long
def test_pages_link_to_each_other_where_both_are(tmp_path):
    """Built together they link; built alone there is no link; later the second finds the first."""
    runs, chosen = tmp_path / "runs", ["3", "3.2.1"]
    both = ["discrete", "continuum"]
    written, warnings = write_pages(both, tmp_path / "both", runs, "both", chosen)
    assert [path.name for path in written] == ["index.html", "continuum.html"]
    assert not warnings
    for path, other in zip(written, ("continuum.html", "index.html"), strict=True):
        assert f'class="other" href="{other}"' in path.read_text()
    alone, _ = write_pages(["continuum"], tmp_path / "one", runs, "one", ["3.2.1"])
    assert 'class="other"' not in alone[0].read_text()
    second, _ = write_pages(["discrete"], tmp_path / "one", runs, "two", ["3"])
    assert 'class="other" href="continuum.html"' in second[0].read_text()


@pytest.mark.parametrize(("top", "band"), [(1.0, 0.1), (1797.0, 150.0), (12.0, 1.0), (12.1, 1.2)])
def test_colours_end_at_a_round_number(top, band):
    assert rounded(top) == pytest.approx(12 * band)
