"""The film of runs and of a filmed crowd, as a command, and its page in a real browser."""

import csv
import itertools
import os
import xml.etree.ElementTree as ET

import MDAnalysis
import numpy as np
import pytest

from analysis.dumps import read_contacts
from analysis.support.files import shipped
from tests.crowds import room_text
from tests.docs.documented import write_files
from tests.pages.browser import BROWSER, HEIGHT, opened, works_by_keyboard

EXCERPT = shipped("scenes") / "gate_excerpt.txt"
GATE = shipped("scenes") / "rooms" / "gate.toml"
ROOM = room_text("door_start_m = [-0.25, 0.0]\ndoor_end_m = [0.25, 0.0]")


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.fixture
def filmed(percussions, tmp_path):
    """A film of two engines: a fiftieth of a second of a crowd, three frames."""
    for engine in ("lammps", "rigid"):
        made = percussions("run", "gate", "--engine", engine, "--duration", 0.02)
        assert made.returncode == 0, made.stderr
    runs = sorted((tmp_path / "out" / "gate").iterdir())
    words = ("--frames", "20:40:10", "--export", "vtk", "--export", "ovito")
    made = percussions("film", *runs, *words)
    assert made.returncode == 0, made.stderr
    assert "Warning" not in made.stderr
    return tmp_path / "film"


@pytest.mark.long
def test_a_film_of_runs_in_its_page_and_for_other_programs(filmed):
    rows = rows_of(filmed / "film.csv")
    models = ("lammps", "percussions", "rigid")
    assert [(row["frame"], row["model"]) for row in rows] == [
        *((frame, model) for frame in ("20", "30", "40") for model in models[:2]),
        *((frame, "rigid") for frame in ("20", "30", "40")),
    ]
    largest = {(row["model"], row["frame"]): float(row["contact_largest_N"]) for row in rows}
    assert largest["lammps", "40"] > 0
    check_ovito(filmed / "ovito" / "LAMMPS", largest)
    check_vtk(filmed / "vtk" / "LAMMPS", largest)
    if BROWSER is not None:
        check_page((filmed / "film.html").as_uri(), largest)


def check_ovito(folder, largest):
    """MDAnalysis' own reader of LAMMPS' dumps finds the people, ours the contacts."""
    universe = MDAnalysis.Universe(folder / "bodies.dump", format="LAMMPSDUMP", dt=1.0)
    assert (universe.atoms.n_atoms, universe.trajectory.n_frames) == (55, 3)
    universe.trajectory.close()
    lines = (folder / "bodies.dump").read_text().splitlines()
    head, *last = lines[-56:]
    column = head.split()[2:].index("lammps_contact_largest_N")
    borne = [float(line.split()[column]) for line in last]
    assert max(borne) == pytest.approx(largest["lammps", "40"])
    for name in ("lammps", "percussions"):
        *_, contacts = read_contacts(folder / f"{name}_contacts.dump")
        assert np.hypot(*contacts.force.T).max() == pytest.approx(largest[name, "40"])


def check_vtk(folder, largest):
    """Every frame of the series is there, and its lines carry the forces of the contacts."""
    series = ET.parse(folder / "film.pvd").getroot().iter("DataSet")
    files = {float(one.get("timestep")): one.get("file") for one in series}
    assert sorted(files) == pytest.approx([0.01, 0.015, 0.02])
    piece = ET.parse(folder / files[max(files)]).getroot().find("PolyData/Piece")
    arrays = {
        one.get("Name"): np.array((one.text or "").split(), dtype=float)
        for one in piece.iter("DataArray")
    }
    lines, points = int(piece.get("NumberOfLines")), int(piece.get("NumberOfPoints"))
    assert len(arrays["connectivity"]) == 2 * lines
    assert len(arrays["places"]) == 3 * points
    assert arrays["connectivity"].max() < points
    positions = arrays["places"].reshape(-1, 3)
    first, second = positions[arrays["connectivity"].astype(int).reshape(-1, 2)].transpose(1, 0, 2)
    distance = np.hypot(*(second - first)[:, :2].T)
    expected = np.where(arrays["is_wall"] == 1, 0.18, 0.36)
    np.testing.assert_allclose(distance, expected, atol=0.02)
    for name in ("lammps", "percussions"):
        normal, across = arrays[f"{name}_fn_N"], arrays[f"{name}_ft_N"]
        assert len(normal) == lines
        assert np.hypot(normal, across).max() == pytest.approx(largest[name, "40"])
        # no friction here
        assert np.abs(across).max() < 1e-6 * normal.max()


def check_page(address, largest):
    with opened(address, 1300) as page:
        page.wait_for_function("document.querySelector('.now').textContent.includes(' s:')")
        drawn = page.locator(".glance .mark").count() > 0
        assert ("Red: limits" in page.locator(".glance").inner_text()) == drawn
        order = sorted((key for key in largest if key[0] == "lammps"), key=largest.get)
        assert f"Frame {order[len(order) // 2][1]}." in page.locator(".contacts").text_content()
        page.locator(".canvas").focus()
        page.keyboard.press("End")
        message = page.locator(".now").inner_text()
        assert message.startswith("0.02 s: largest force")
        number = float(message.split("force")[1].split("N")[0].replace("\u202f", ""))
        assert number == float(f"{largest['lammps', '40']:.2g}")
        titles = page.locator(".view option").all_inner_texts()
        assert [title.split(",")[0] for title in titles] == [
            "stiff (LAMMPS)", "rigid (percussions)", "stiff − rigid", "rigid",
        ]  # fmt: skip
        page.keyboard.press("m")
        assert ", solved" in page.locator(".now").inner_text()
        page.locator(".film summary").click()
        page.locator(".person").fill("4")
        table = page.locator(".contacts table")
        assert table.locator("caption").inner_text().startswith("Person 4: contacts ")
        assert table.locator("th").all_inner_texts() == ["with", "force", "can be", "determined"]
        box = page.locator(".canvas").bounding_box()
        visited = set()
        for x in range(8):  # whom the pointer meets on its way
            page.mouse.move(box["x"] + box["width"] * (0.3 + x / 20), box["y"] + box["height"] / 2)
            visited.add(page.locator(".person").input_value())
        assert len(visited) > 2
        page.emulate_media(reduced_motion="reduce")
        page.locator(".canvas").press("Home")
        page.locator(".canvas").press(" ")
        assert page.locator(".play").inner_text() == "Pause"
        page.wait_for_timeout(300)  # with less motion a frame stands for a second
        assert page.locator(".frame").input_value() == "0"
        page.locator(".play").click()
        plain = page.context.browser.new_page(java_script_enabled=False)
        plain.goto(address)
        assert plain.locator("#viewer img").first.is_visible()
        assert not plain.locator(".film").is_visible()
        old = page.context.browser.new_page()
        old.add_init_script("delete window.DecompressionStream")
        old.goto(address)  # what cannot unpack the film shows the picture
        assert old.locator("#viewer img").first.is_visible()
    with opened(address, 390) as page:
        page.wait_for_function("document.querySelector('.now').textContent.includes(' s:')")
        assert page.locator(".canvas").bounding_box()["width"] <= 390
        assert "gate: forces computed, not measured" in page.title()
        visited = page.locator(".canvas, .ranges").evaluate_all(
            "all => all.map(one => one.getBoundingClientRect().bottom)"
        )
        assert max(visited) <= HEIGHT
        works_by_keyboard(page)


def test_a_frame_that_is_not_solved_is_said_everywhere(percussions, tmp_path):
    """Where people do not fit, the frame has failed; the others stand."""
    few = [(x, y) for x in (-0.3, 0.3) for y in (0.2, 0.8)]
    many = [(x, y) for x in (-0.3, 0.0, 0.3) for y in (0.2, 0.5, 0.8)]
    lines = [
        f"{one}\t{frame}\t{x}\t{y}\t1.7\n"
        for frame in range(6)
        for one, (x, y) in enumerate(many if frame == 3 else few, start=1)
    ]
    head = "# framerate: 10 fps\n# id frame x/m y/m z/m\n"
    (tmp_path / "box.txt").write_text(head + "".join(lines))
    corners = [(-0.25, 0), (-0.5, 0), (-0.5, 1), (0.5, 1), (0.5, 0), (0.25, 0)]
    walls = "".join(
        f'[[walls]]\nname = "w{n}"\nstart_m = {list(map(float, a))}\nend_m = {list(map(float, b))}\n\n'
        for n, (a, b) in enumerate(itertools.pairwise(corners))
    )
    (tmp_path / "room.toml").write_text(ROOM.replace("[drive]", f"{walls}[drive]"))
    made = percussions("film", "box.txt", "--room", "room.toml", "--radius", "0.2")
    assert made.returncode == 1, made.stdout
    assert "failed: 1 of 6 frames. The first is frame 3 of radius 0.2 m: " in made.stderr
    status = [row["status"] for row in rows_of(tmp_path / "film" / "film.csv")]
    assert status == ["solved"] * 3 + ["failed"] + ["solved"] * 2
    page = (tmp_path / "film" / "film.html").read_text()
    assert "1 of 6 frames have no solved percussions. They count in no interval." in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--frames", "0:5"], "has frames 400 to 410"),
        (["--frames", "5:a"], "--frames: 5:a. Write first:last:step"),
        (["--frames", "410:400"], "--frames: 410:400. Write first to last"),
        (["--radius", "nan"], "--radius: nan: a finite number above 0 is needed"),
        (["--radius", "3"], "radius: 3 m. Between 0.05 and 0.5 m is needed"),
        (["--unit", "cm", "--frames", "405"], "--unit cm: the file states m"),
        (["--export", "blender"], "--export"),
    ],
)
def test_what_no_film_can_be_made_of_is_one_line(refused, words, message):
    assert message in refused("film", EXCERPT, "--room", GATE, *words)


def test_a_film_of_your_own_table_as_in_the_docs(percussions, refused, tmp_path):
    """A room of walls, door and drive is enough; what the table does not state is said at once."""
    write_files("docs/cases/trajectory.md", tmp_path)
    words = ("heads.csv", "--room", "hall.toml")
    assert "Give --unit m or --unit cm and --frame-rate" in refused("film", *words)
    words += ("--unit", "m", "--frame-rate", 25)
    message = refused("import", *words, "--frame", 0, "--name", "mine")
    assert "title, source, contact, run, analysis: Field required" in message
    assert percussions("film", *words).returncode == 0
    assert "<title>heads.csv: positions filmed, " in (tmp_path / "film/film.html").read_text()
    assert max(float(row["contact_largest_N"]) for row in rows_of(tmp_path / "film/film.csv")) > 0


def test_files_that_hold_no_film(refused, tmp_path):
    (tmp_path / "nobody.txt").write_text("# framerate: 25 fps\n# id frame x/m y/m z/m\n")
    (tmp_path / "cut.txt").write_text(EXCERPT.read_text()[:-12])
    (tmp_path / "film").mkdir()
    (tmp_path / "film" / "film.csv").write_text("earlier")
    for words, message in (
        (["nobody.txt", "--room", GATE], "nobody.txt"),
        (["cut.txt", "--room", GATE], "cut.txt, line"),
        (["cut.txt"], "cut.txt, line"),
        (["gone"], "percussions: gone: no such file or folder"),
        ([tmp_path / "film"], "run.json"),
        ([EXCERPT, EXCERPT], "One file is read"),
        ([tmp_path / "film", "--radius", "0.2"], "--radius: only of a dump or a trajectory"),
        ([tmp_path / "film", "--time-step", "1"], "--time-step: only of a dump or a trajectory"),
    ):
        assert message in refused("film", *words)
    assert (tmp_path / "film" / "film.csv").read_text() == "earlier"


def test_a_folder_that_holds_no_run_is_one_line(percussions, tmp_path):
    """A run whose dump is a pipe, which would be waited for."""
    assert percussions("run", "pair", "--engine", "rigid").returncode == 0
    (run,) = (tmp_path / "out" / "pair").iterdir()
    (run / "bodies.dump").unlink()
    os.mkfifo(run / "bodies.dump")
    made = percussions("film", run, timeout=30)
    assert made.returncode == 1
    (line,) = made.stderr.strip().splitlines()
    assert line.endswith("bodies.dump: not a regular file. The folder holds no whole run")
