"""The page of the paper's discrete figures: its files, and itself in a real browser from a file://
address."""

import csv
import json

import pytest
from matplotlib.figure import Figure

from analysis.engines import PENALTY, RunRecord
from analysis.engines.run import Cost, EngineRun, run_ahead
from analysis.pages.html import write_pictures
from analysis.pages.section import Picture, Section
from analysis.scene.shipped_scenes import make
from analysis.studies.paper.page import errata
from tests.pages.browser import BROWSER, has_its_numbers, has_its_verdicts, opened

from tests.pages.browser import says_little_beside, works_by_keyboard  # isort: skip

PAGE_SECTIONS = "section[data-figure]"


@pytest.fixture
def built(percussions, tmp_path):
    """The figures that need the shortest engine runs."""
    chosen = "--figure", 3, "--figure", 1, "--runs", "runs"
    made = percussions("paper", "discrete", *chosen, timeout=600)
    assert made.returncode == 0, made.stderr
    return made, tmp_path / "paper"


@pytest.mark.long
def test_page_in_a_browser_and_the_files_beside_it(built, percussions, tmp_path):
    made, folder = built
    numbers = json.loads((folder / "numbers.json").read_text())
    assert list(numbers) == ["1", "3"]
    with (folder / "claims.csv").open(newline="") as file:
        claims = list(csv.DictReader(file))
    assert {claim["verdict"] for claim in claims} == {"holds", "holds in part", "does not hold"}
    pictures = ["fig_1_dissipation", "fig_1_velocities", "fig_3_accuracy", "fig_3_chains"]
    assert sorted(path.stem for path in (folder / "figures").glob("*.png")) == pictures
    for name in pictures:
        assert (folder / f"figures/{name}.pdf").read_bytes().startswith(b"%PDF")
    assert not list(folder.rglob("*.part"))
    if BROWSER is not None:
        _read(made.stdout.strip().splitlines()[-1], folder, numbers, claims)
    # a second build runs no engine again
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("run.json")}
    again = percussions("paper", "discrete", "--figure", 1, "--runs", "runs", timeout=600)
    assert again.returncode == 0, again.stderr
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("run.json")} == before
    second = json.loads((folder / "numbers.json").read_text())["1"]
    assert second["engine_runs"]["made"] == 0
    assert second["engine_runs"]["reused"] == len(before)
    assert second["cpu_seconds"]["engines"] == 0
    rows = (section["tables"][0]["rows"] for section in (numbers["1"], second))
    first, again = ([row for row in every if "hooke" in row[0]] for every in rows)
    assert len(first) == 4
    assert first == again


def _read(address, folder, numbers, claims):
    """The page loads without complaint, offline, and says what the files say."""
    with opened(address, 390) as page:
        works_by_keyboard(page)  # which unfolds everything
        assert page.locator(PAGE_SECTIONS).count() == len(numbers)
        for figure, content in numbers.items():
            section = page.locator(f"#fig-{figure}")
            has_its_numbers(section, content)
        has_its_verdicts(page, claims)
        says_little_beside(page, "beside")
        with (folder / page.locator("#errata a").get_attribute("href")).open(newline="") as file:
            sentences = [row["why"] for row in csv.DictReader(file)]
        assert sentences == [one.why for one in errata("Section 2")]
        names = "all => all.map(a => a.getAttribute('href'))"
        links = page.locator("a[href^='./figures/']").evaluate_all(names)
        # the picture itself, PNG and PDF
        assert len(links) == 3 * 4
        assert all((folder / link).is_file() for link in links)
        assert page.locator("img").count() == 4


def test_a_figure_that_the_section_does_not_have(percussions, tmp_path):
    for part, figure, known in (("discrete", 7, "1, 2, 3"), ("continuum", 6, "7, 3.2.1, 8")):
        made = percussions("paper", part, "--figure", figure)
        assert made.returncode == 1
        assert f"figure: {figure}. This part of the paper has {known}" in made.stderr
    assert not (tmp_path / "paper").exists()
    assert percussions("paper", "whole").returncode == 2


@pytest.mark.long
def test_a_missing_engine_is_a_warning_on_the_page(percussions, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "/nonexistent")
    made = percussions("paper", "discrete", "--figure", 1)
    assert made.returncode == 0, made.stderr
    assert "warning: Fig. 1: cradle_4_e1, yade" in made.stderr
    page = (tmp_path / "paper/index.html").read_text()
    assert "apt-get install --no-install-recommends yade" in page
    assert 'role="alert"' in page


def test_runs_made_ahead_are_made_once_and_failures_are_counted(tmp_path):
    engine = next((each.NAME for each in PENALTY if each.find() is not None), None)
    if engine is None:
        pytest.skip("no engine is installed")
    scenes = [make("jam", 20, seed).with_run(duration_s=0.2, frames=1) for seed in (1, 2)]
    requested = (0, engine, "run0"), (1, engine, "run1"), (0, engine, "run0"), (0, "missing", "failed")
    wanted = [EngineRun(scene=scenes[k], engine=by, folder=tmp_path / at) for k, by, at in requested]
    cells = []
    costs = run_ahead(wanted, lambda label, fraction: cells.append((label, fraction)), processes=2)
    assert cells[-1] == ("engine runs", pytest.approx(1.0))
    assert [cells[0], len(cells)] == [("engine runs", 0.0), 4]
    assert [costs[run.folder].made for run in wanted] == [1, 1, 1, 0]
    assert costs[wanted[3].folder] == Cost(failed=1)
    for run in wanted[:2]:
        assert costs[run.folder].cpu_seconds == RunRecord.read(run.folder).cpu_seconds > 0
    again = run_ahead(wanted[:2])
    assert sum(again.values(), Cost()) == Cost(reused=2)
    assert run_ahead([]) == {}


def test_errata_are_read_whole(tmp_path):
    page = tmp_path / "errata.md"
    head = "| where | printed | correct | why |\n|---|---|---|---|\n"
    text = f"# All\n\n## Section 2: disks\n\n{head}| (7) | u⁺ = *u* | `u` | \\|u\\| |\n\n"
    page.write_text(f"{text}## Section 3\n\n{head}| (9) | a | b |\n")
    (entry,) = errata("Section 2", page)
    assert entry == ("(7)", "u⁺ = *u*", "`u`", "|u|")
    with pytest.raises(ValueError, match=r"where, printed, correct, why: .*\(9\)"):
        errata("Section 3", page)
    with pytest.raises(ValueError, match="Section 4"):
        errata("Section 4", page)


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("u⁺ = *u* and  `u`", "u⁺ = *u* and `u`"),
        ("m u_d/τ in arch_masses", "m u~d~/τ in arch_masses"),
        ("λ^{i,i+1} = Σ_{j ≤ i} m_j", "λ^i,i+1^ = Σ~j\u00a0≤\u00a0i~ m~j~"),
        ("e^{−(l − x)/h}, ρ^γ", "e^−(l\u00a0−\u00a0x)/h^, ρ^γ^"),
    ],
)
def test_errata_in_the_markdown_of_pages(tmp_path, words, shown):
    page = tmp_path / "errata.md"
    page.write_text(f"## Section 2\n\n| a |\n|---|\n| (1) | {words} | b | c |\n")
    assert errata("Section 2", page)[0].printed == shown


def test_an_interrupted_picture_leaves_the_earlier_one(tmp_path):
    class Broken(Figure):
        def savefig(self, file, **kwargs):
            file.write(b"half")
            raise KeyboardInterrupt

    broken = Picture(name="p", caption="", figure=Broken())
    (tmp_path / "p.png").write_bytes(b"whole")
    with pytest.raises(KeyboardInterrupt):
        write_pictures([Section(number="1", title="", pictures=[broken])], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["p.png"]
    assert (tmp_path / "p.png").read_bytes() == b"whole"
