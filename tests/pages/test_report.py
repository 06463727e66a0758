"""The report, opened in a real browser from a file:// address."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from analysis.engines.softness import softness
from analysis.pages.numbers import between, two
from analysis.pages.ranges import Chart
from analysis.scene.named_crowds import CROWDS
from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import read_scene
from analysis.scene.shipped_scenes import make, with_push
from analysis.studies.exposure.loads import RunLoads
from analysis.studies.motion.study import MEASURES, Model, study_motion
from analysis.studies.report.page import (
    _flow,
    crowds_table,
    four,
    lead,
    limits_table,
    marks_of,
    notes,
    range_of,
    verdicts,
)  # fmt: skip
from analysis.studies.report.runs import motion_of
from tests.crowds import OWN_LIMIT
from tests.forked import as_program, in_fork
from tests.pages.browser import BROWSER, opened, rows_of, words, works_by_keyboard

EVER = CROWDS["pushing"].label


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """A report of a small crowd, and the folder that it was made in."""
    folder = tmp_path_factory.mktemp("reported")
    make("arch", disks=20).with_run(duration_s=0.4, frames=4).write(folder)
    words = [
        "report", "arch.toml", "--engine", "lammps", "--engine", "rigid", "--seeds", "3",
        "--stiffness", "1e6", "--out", "report", "--sheet",
    ]  # fmt: skip
    status, message, printed = in_fork(lambda: as_program(words, folder), 600)
    assert status == 0, message
    return printed, folder


@pytest.mark.long
@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
def test_the_film_goes_on_live(reported):
    """From the frame that is shown, with the people where they are, at rest."""
    with opened(reported[0].strip().splitlines()[-1], 1300) as page:
        page.wait_for_function("document.querySelector('.now').textContent.includes(' s:')")
        first = page.locator(".film").first
        first.locator("summary").click()
        first.locator("button.live").click()
        page.locator("#live canvas.canvas").wait_for()
        while page.evaluate("explore.run.step") < 5:
            page.wait_for_timeout(20)
        assert page.evaluate("[explore.scene.name, explore.scene.disks.id.length]") == ["arch", 20]
        x = page.evaluate("explore.scene.disks.x")
        start = page.evaluate("explore.run.began.disks.u")
        assert (set(start), len(set(x)) > 20) == ({0}, True)


@pytest.mark.skipif(BROWSER is None, reason="no Chromium (apt-get install chromium)")
@pytest.mark.parametrize("width", [1300, 400])
def test_the_first_screen_has_the_film_and_four_ranges_without_scrolling(reported, width):
    printed, folder = reported
    address = printed.strip().splitlines()[-1]
    motion = json.loads((folder / "report/numbers.json").read_text())["arch"]["in_motion"]
    with opened(address, width) as page:
        page.wait_for_function("document.querySelector('.now').textContent.includes(' s:')")
        first = page.locator("main > section").first
        assert first.get_attribute("id") == "arch-at-a-glance"
        observed = page.locator(".glance .ranges, .glance canvas, .glance .quiet:visible")
        ends = observed.evaluate_all("all => all.map(one => one.getBoundingClientRect().bottom)")
        assert len(ends) > 6
        assert max(ends) <= 844
        titles = page.locator(".view option").all_text_contents()
        assert titles[:2] == ["rigid", "stiff (LAMMPS)"]  # first what the bars are of
        # what is not chosen is not seen, and the numbers of an axis are a picture
        unseen = "document.querySelectorAll('option:not(:checked), .axis').forEach(o => o.remove())"
        page.evaluate(unseen)
        message = " ".join(first.locator("h2, .lead, .glance").all_inner_texts())
        assert words(message) <= 150
        assert ("Red: limits" in message) == (page.locator(".glance .mark").count() > 0)
        assert "each always pushes with 300\xa0N (assumed): no measured crowd does." in message
        assert "6\u202f227\xa0N in 15\xa0s. Simulated: 0.4\xa0s, peak" in message
        values = page.locator(".glance .value").all_inner_texts()
        for text, found in zip(values, motion["four"].values(), strict=True):
            ends = [float(end) for end in text.split(" ")[0].replace("\u202f", "").split("–")]
            counts = found["unit"].startswith("of ")  # of people, who are whole
            near = 0.5 if counts else 0.06
            assert [ends[0], ends[-1]] == pytest.approx(found["range"], rel=0.06, abs=near)
            assert not counts or "." not in text
        models = next(iter(motion["models"].values()))
        *rows, deepest = rows_of(page, "arch-numbers", "Mean, and in brackets 90")
        assert deepest["quantity"].startswith("largest overlap")
        for row in rows:
            (found,) = (
                models[key]
                for key, one in MEASURES.items()
                if row["quantity"].replace("\xa0", " ") == f"{one.title} ({one.unit})"
            )
            if found["unit"] in ("N", "N/m"):
                shown = float(row["rigid"].split(" ")[0].replace("\u202f", ""))
                assert shown == pytest.approx(found["mean"], rel=0.06, abs=0.06)
        works_by_keyboard(page)  # which unfolds everything
        message = page.locator("li").all_text_contents()
        assert len(set(message)) == len(message)
        # with everything unfolded, tables and captions counted
        assert words(first.inner_text()) <= 1530
        assumed = page.locator("#arch-assumptions").inner_text()
        assert "does not reduce to mechanical" in assumed
        assert "Soft: s = N F/(k r) is below 6" in assumed
        for picture in page.locator("figure a[title]").all():
            file = folder / "report" / picture.get_attribute("href")
            assert min(file.with_suffix(e).stat().st_size for e in (".png", ".pdf")) > 1000


def test_the_energy_of_the_first_run_is_drawn_and_sums_up(reported):
    _, folder = reported
    rows = np.genfromtxt(folder / "report/arch-energy.csv", delimiter=",", names=True)
    lost, drive = rows["impact_J"].sum(), rows["drive_J"].sum()
    assert drive > 100
    assert rows["kinetic_J"][-1] == pytest.approx(drive - lost, rel=1e-10)
    assert "Energy, error " in (folder / "report/index.html").read_text()
    assert (folder / "report/figures/arch-energy.png").stat().st_size > 1000


def test_the_sheet_is_one_page_for_a_safety_file(reported):
    _, folder = reported
    sheet = (folder / "report/arch-sheet.pdf").read_bytes()
    assert sheet.startswith(b"%PDF")
    assert re.findall(rb"/Type /Page\b", sheet) == [b"/Type /Page"]
    assert b"/MediaBox [ 0 0 595.44 841.68 ]" in sheet


def test_what_nobody_knows_is_varied_one_thing_at_a_time(reported):
    _, folder = reported
    scene = read_scene(folder / "arch.toml")
    models = motion_of(scene, ["lammps", "rigid"], [1e6], 3, folder / "out")
    assert all(run.is_finished() for model in models for run in model.runs)
    cells = ["rigid", "stiff, 1\u202f000 kN/m", "soft, 5.8 kN/m", "chest, 3.2 kN/m, not valid",
            "friction 0.4", "push 100 N"]  # fmt: skip
    assert [one.label for one in models] == [*cells, "radius − 1 cm", "radius + 1 cm"]
    assert [one.factor for one in models[1::2]] == ["bodies", "bodies", "push", "radius"]
    gentle = motion_of(with_push(scene, 100.0), ["rigid"], [], 3, folder / "out")
    assert [one.label for one in gentle if one.factor == "push"] == ["push 200 N"]
    base, *varied = ([run.scene for run in model.runs] for model in models)
    mean = [float(one[0].snapshot.radius.mean()) for one in (base, *varied[-2:])]
    assert mean[1:] == pytest.approx([mean[0] - 0.01, mean[0] + 0.01])
    pushed = varied[4][0]
    assert pushed.drive.push(75.0) == pytest.approx(100.0)
    assert pushed.drive.speed_m_per_s == base[0].drive.speed_m_per_s
    assert 5.9 < softness(varied[1][0]) < 6.0  # the softest that is valid
    masses = replace(scene.snapshot, mass=scene.snapshot.mass * np.linspace(0.5, 1.5, 20))
    assert "about **300 N** (assumed)" in lead(scene.model_copy(update={"snapshot": masses}))
    own = folder / "mine.toml"
    own.write_text(OWN_LIMIT)
    study = study_motion(scene, models, 0.2, limits=(own,))
    assert not study.failures
    for key in four(study):
        found = range_of(study, key)
        for one in (one for one in study.models if one.valid):
            interval = one.interval(key)
            assert found.low <= interval.low <= interval.mean <= interval.high <= found.high
        minimum, maximum = found.factors["push"]
        means = sorted(study.models[k].interval(key).mean for k in (0, 5))
        assert [minimum, maximum] == means
    bars, matters, done = notes(study, [])
    maximum = max(one.values["contact_largest"].max() for one in study.models[0].series)
    assert f"Simulated: 0.4 s, peak {two(maximum)} N of 3 rigid runs." in done
    assert "s, 3 starts. Pale: also with other stiffness, friction, push, radius, one at a time." in " ".join(bars.split())
    fewer, *_ = notes(replace(study, models=study.models[:5]), [])
    assert "Pale: also with other stiffness, friction, one at a time." in " ".join(fewer.split())
    widest = between(*next(iter(range_of(study, "contact_largest").factors.values())))
    assert f"** matters most (mean largest force {widest} N), then" in matters
    table = limits_table([study], (own,))
    assert [row[-1] for row in table.rows if "my own" in row[2]] == ["my report, 2026"]
    forces = [row for row in table.rows if row[1] == "largest contact force"]
    counts = [float(row[3].split(" ")[0]) for row in forces]
    assert counts == sorted(counts, reverse=True)  # fewer people above a larger limit
    walls = [row for row in table.rows if row[1] == "largest load on any metre of walls"]
    assert [row[0] for row in walls] == ["2 kN/m", "5 kN/m"]
    assert "resultant of a person's contact forces" in [row[1] for row in table.rows]
    message = " ".join(verdicts(study))
    assert "**Friction 0.4**:" in message
    assert "**Soft, 5.8 kN/m**:" in message  # units keep their capitals
    assert 500.0 in marks_of(study, "contact_largest")
    assert motion_of(read_scene("pair"), ["rigid"], [1e6], 3, folder) == []


def test_labels_of_limits_lie_beside_each_other():
    chart = Chart("", "N", {"": (1.0, 0.0, 1.0)}, marks=(623.0, 1112.0, 6227.0))
    tops = (8e3, 4e4, 6.3e3)
    far, near, late = ([one[1:] for one in replace(chart, most=top).labelled] for top in tops)
    assert far == [("623, 1\u202f112\u202fN", False), ("6\u202f227\u202fN", False)]
    assert near == [("623, 1\u202f112, 6\u202f227\u202fN", False)]
    assert late[-1] == ("6\u202f227\u202fN", True)  # it would leave the page
    # beside names the axis is shorter, and beyond its end is room
    many = replace(chart, found={"a": (1.0, 0.0, 8e3), "b": (1.0, 0.0, 1.0)})
    assert [one[1:] for one in many.labelled] == far
    wider = replace(many, found=many.found | {"a": (1.0, 0.0, 1e4)})
    assert [one[1:] for one in wider.labelled] == near
    # a mean at an end of the axis stands there instead of the end
    ticks = [replace(chart, found={"": (mean, 0.0, 8e3)}, marks=()).ticks for mean in (9.0, 7.9e3)]
    assert ticks == [[(9.0, "9"), (8e3, "8\u202f000")], [(0.0, "0"), (7.9e3, "7\u202f900")]]


def test_a_real_crowd_says_what_was_done_to_it(percussions, tmp_path):
    read_scene("terrace").with_run(duration_s=0.4, frames=4).write(tmp_path)
    some = ("--engine", "lammps", "--stiffness", 1e6, "--seeds", 0)
    made = percussions("report", "gate", "terrace.toml", *some)
    assert made.returncode == 0, made.stderr
    page, _, slope = (tmp_path / "report/index.html").read_text().partition('id="terrace-at-a-')
    # without a door nothing but the frames of a crowd varies, and the bars are theirs
    assert slope.count('class="ranges many"') == 3
    assert "median of 5 frames" in slope
    assert "Heads are not bodies" in page
    # without replicates there is a first screen, which claims no interval
    assert "has no replicates" in page
    assert "Start filmed, rest computed: each always pushes with" in page
    assert 'class="ranges' not in page
    assert "in_motion" not in json.loads((tmp_path / "report/numbers.json").read_text())["gate"]


@pytest.mark.long
def test_a_room_that_has_emptied_has_its_film_and_its_bars(percussions, tmp_path):
    room = ("--room", "3x3", "--door", 1.2, "--people", 3, "--push", 100, "--duration", 6)
    assert percussions("new", "room", *room).returncode == 0
    engines = ("--engine", "lammps", "--engine", "rigid", "--stiffness", 1e5)
    made = percussions("report", "room.toml", *engines, "--seeds", 1)
    assert (made.returncode, "no contact at all at 6 s" in made.stderr) == (0, True), made.stderr
    page = (tmp_path / "report/index.html").read_text()
    assert "there is nothing to compare" in page
    assert page.count('class="packed"') == page.count(", peak ") == 1


@pytest.mark.long
def test_a_missing_engine_is_a_warning_and_the_rest_goes_on(percussions, tmp_path, monkeypatch):
    read_scene("pair").with_run(duration_s=0.03, frames=100).write(tmp_path)
    monkeypatch.setenv("PATH", "/nonexistent")
    engines = ("--engine", "lammps", "--engine", "yade")
    made = percussions("report", "pair.toml", *engines, "--stiffness", 1e6, "--seeds", 0)
    assert made.returncode == 0, made.stderr
    needed = "apt-get install --no-install-recommends yade"
    assert needed in made.stderr
    assert needed in (tmp_path / "report/index.html").read_text()


def test_an_own_room_shows_three_crowds(tmp_path):
    scene = room("own", 4.0, 3.0, 0.8, Crowd(people=12, mass=80.0), duration=0.4)
    models = motion_of(scene, ["rigid"], [], 2, tmp_path)
    crowds = ["waiting", "pressing, p = 0.1", "pressing, p = 0.4"]
    assert [one.label for one in models if one.factor == "crowd"] == crowds
    assert not [one for one in models if one.factor == "push"]
    seeds = [[run.scene.drive.seed for run in one.runs] for one in models if one.label in crowds]
    assert seeds == [[1, 2]] * 3
    study = study_motion(scene, models, 0.2)
    assert not study.failures
    assert "how hard 12 people push is assumed" in lead(scene, study)
    rows = crowds_table(study).rows
    assert [row[0].partition(":")[0] for row in rows] == [*crowds[:1], "pressing", EVER]
    # 80 kg · p · 1.34 m/s / 0.3 s
    assert [row[1] for row in rows] == ["0", "36–140", "150"]
    assert notes(study, [])[0].startswith(f"Dot: mean, {EVER}, rigid.")


@pytest.mark.parametrize(
    ("flows", "says"),
    [
        ([[1.5, 1.6]], "1.5–1.6"),
        ([[1.1, 1.4]], "1.1–1.4"),
        ([[1.7, 2.2]], "1.7–2.2"),
        ([[2.0, 2.2]], "**2–2.2: no measured crowd**"),
        ([[1.5], [2.5]], "**1.5–2.5: in part no measured crowd**"),
        ([[0.5, 0.7]], "**0.5–0.7: no measured crowd**"),
        ([[], []], "nobody leaves"),
    ],
)
def test_a_flow_that_no_measured_crowd_has_is_said(flows, says):
    assert _flow(flows) == says


def test_a_flow_is_from_the_first_who_leaves_to_the_last():
    """One every 0.5 s by 0.8 m, for 3 s in a run of 5 s; two people are no flow."""
    series = [RunLoads(scene=None, ids=(), time=np.array([5.0]), duration=np.array([5.0]), loads={}, values={},
                       out=np.append(1.0 + 0.5 * np.arange(n), np.inf)) for n in (7, 2)]  # fmt: skip
    assert Model(title="", series=series).flows(0.8) == pytest.approx([2 / 0.8])
