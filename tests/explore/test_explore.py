"""The page that presses a crowd: in a browser, against the rigid engine itself, and what it saves."""

import copy
import json
import re

import numpy as np
import pytest
import tomli_w
from playwright.sync_api import sync_playwright
from scipy.optimize import linprog

from analysis.dumps import index_dump
from analysis.engines.programs import rigid
from analysis.engines.rigid import timing
from analysis.scene.distance import Distance
from analysis.scene.scene import SceneError, read_scene
from analysis.studies.explore.page import content_of, offered, write_explore
from analysis.studies.explore.page_input import rules
from tests.explore.mutants import PLAYED, cases, first_word, keeping
from tests.pages.browser import BROWSER, QUIET, works_by_keyboard
from tests.scene.test_bad_keys import PLACES, bad_values, full_scene

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
SCENE = "[run]\nduration_s = 1.0\nframes = 10\n[analysis]\nkind = 'driven'\n"
RING = "(0 0, 6 0, 6 4, 0 4, 0 0)"
# Steps of the page, and its frames as lists.
STEPPED = """steps => { for (let i = 0; i < steps; ++i) if (!explore.advance()) throw Error(explore.run.ended);
    return explore.run.frames.map(one => [[...one.x], [...one.contacts], one.over]); }"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("explore")
    scenes = [read_scene(name) for name in ("gate", "arch", "ell", "terrace")]
    return write_explore(scenes, folder, "percussions explore").as_uri()


@pytest.fixture(scope="module")
def page(address):
    """The page, still, in a browser that complains about nothing."""
    complaints = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=QUIET)
        page = browser.new_page(viewport={"width": 1300, "height": 844}, reduced_motion="reduce")
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(address)
        yield page
        browser.close()
    assert complaints == []


def at(page, address, name):
    """Open a scene of the page."""
    opened(page, f"{address}#{name}")
    assert page.evaluate("explore.scene.name") == name


def typed(page, name, value):
    page.locator(f"#live .{name}").fill(str(value))
    page.locator(f"#live .{name}").press("Enter")


def opened(page, link=None):
    """Open an address, or the link that the page gives."""
    if link is None:
        page.locator("#live .share").click()
        page.get_by_text("now holds this scene").wait_for()
    link = link or page.url
    page.goto("about:blank")
    page.goto(link)
    page.locator("#live .now").get_by_text("beyond the door.").wait_for()


def saved(page, kind, folder):
    """The files that a button saves, written into a folder."""
    files = page.evaluate(f"explore.saves.{kind}()")
    for name, text in files:
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name, _ in files]


def differences(scene, out, frames):
    """The largest differences (m, N) of frames of the page from the dumps of a run, and its largest
    force (N). Each has the same contacts."""
    bodies, index = index_dump(out / "bodies.dump"), index_dump(out / "contacts.dump", "ENTRIES")
    columns = [bodies.columns.index(name) for name in "xy"]
    assert len(bodies.steps) == len(frames)
    difference, force, largest = [], [], []
    for number, (x, contacts, over) in enumerate(frames):
        difference.append(np.abs(bodies.table(number)[:, columns].ravel() - x).max())
        rows = np.reshape(contacts, (-1, 8))
        wall, first, second = rows[:, 2] == 1, *rows[:, :2].astype(int).T
        others = np.where(wall, second + 1, scene.snapshot.ids[np.where(wall, 0, second)])
        ours = np.column_stack([scene.snapshot.ids[first], others, wall, rows[:, 6:] / (over or 1.0)])
        theirs = index.table(number)[:, [0, 1, 2, 6, 7]]
        ours, theirs = (part[np.lexsort(part[:, 2::-1].T)] for part in (ours, theirs))
        assert np.array_equal(ours[:, :3], theirs[:, :3])
        force.append(np.abs(ours[:, 3:] - theirs[:, 3:]).max(initial=0.0))
        largest.append(np.abs(theirs[:, 3:]).max(initial=0.0))
    return max(difference), max(force), max(largest)


@pytest.mark.parametrize(
    ("name", "friction", "read"),
    [("gate", 0.0, read_scene), ("gate", 0.3, read_scene), ("arch", 0.3, read_scene), ("ell", 0.0, read_scene),
     ("terrace", 0.3, read_scene), ("gate", 0.3, keeping), ("ell", 0.0, keeping)],
)  # fmt: skip
def test_a_second_is_that_of_the_rigid_engine(page, address, tmp_path, name, friction, read):
    """The same positions, bit by bit, and forces but for a division: from a scene's own start, or from files that are
    opened, round corners with a way, on a slope, and of people who keep their distance, jostle and turn."""
    scene = read(name)
    second = scene.run.frames / scene.run.duration_s
    scene = scene.with_run(duration_s=1.0, frames=round(second)).with_contact(friction=friction)
    path = scene.write(tmp_path)
    assert rigid.main([str(path), "--out", str(tmp_path)]) == 0
    at(page, address, name)
    if (name, read) != ("ell", read_scene):
        page.locator("#live .open").set_input_files([path, path.with_suffix(".data")])
        while page.evaluate("explore.scene.content.run.duration_s") != 1:
            page.wait_for_timeout(10)
    when = timing(scene)
    assert page.evaluate("explore.timing()") == [when.time_step, when.frame_interval]
    frames = page.evaluate(STEPPED, when.steps)
    difference, force, largest = differences(scene, tmp_path, frames)
    assert largest > 100
    assert difference == 0.0
    assert force < 1e-14 * largest


@pytest.mark.parametrize("crystal", [True, False])
def test_a_paused_page_bounds_contact_forces_as_linear_programs_do(page, address, crystal):
    """Of every 9th contact that stays closed: a crystal before the gate leaves most of them open, the
    crowd later none. The table shows them to the person."""
    at(page, address, "gate")
    row, column = np.divmod(np.arange(55), 11)
    position = np.column_stack([0.36 * column - 1.8 + 0.18 * (row % 2), 0.18 * (1 + np.sqrt(3) * row)])
    if crystal:
        page.evaluate("x => { explore.part('position').set(x); explore.core.begin(0); }", position.ravel().tolist())
    page.evaluate(STEPPED, 5 if crystal else 200)
    rows, ends = page.evaluate("""() => { explore.core.closed();
        const rows = [...explore.part("resting")], ends = [];
        for (let k = 0; k < rows.length / 8; k += 9) ends.push([k, ...[-1, 1].map((sign) => explore.core.extreme(k, sign))]);
        return [rows, ends]; }""")
    rows = np.reshape(rows, (-1, 8))
    first, second = rows[:, :2].astype(int).T
    k, pair = len(rows), rows[:, 2] == 0
    balance = np.zeros((max(first.max(), second[pair].max()) + 1, 2, k))
    balance[first, :, np.arange(k)] = rows[:, 3:5]
    balance[second[pair], :, np.flatnonzero(pair)] = -rows[pair, 3:5]
    balance, reaction = balance.reshape(-1, k), (rows[:, 3:5] * rows[:, 6:]).sum(1)
    widest = 0.0
    for number, low, high in ends:
        unit = np.eye(k)[int(number)]
        found = [linprog(s * unit, A_eq=balance, b_eq=balance @ reaction).fun for s in (1, -1)]
        assert (low, high) == pytest.approx((found[0], -found[1]), abs=1e-7 * reaction.max())
        widest = max(widest, high - low)
    assert (widest > 0.1 * reaction.max()) == crystal
    page.locator("#live .person").fill("29")
    cells = page.locator("#live .contacts td:nth-child(3)").all_inner_texts()
    assert any(" to " in cell for cell in cells) == crystal
    page.locator("#live .person").fill("")


def test_what_it_saves_is_taken(page, address, tmp_path, percussions):
    """The scene goes on in the rigid engine as in the page; `solve` takes the dump, `import` the
    CSV."""
    at(page, address, "ell")
    page.evaluate(STEPPED, 77)
    path, _ = saved(page, "scene", tmp_path)
    frames = page.evaluate(STEPPED, 22)
    scene, of = read_scene(path), read_scene("ell")
    assert [scene.drive, scene.walls, scene.contact] == [of.drive, of.walls, of.contact]
    short = scene.with_run(duration_s=0.2, frames=2).write(tmp_path / "short")
    assert rigid.main([str(short), "--out", str(tmp_path)]) == 0
    difference, force, largest = differences(scene, tmp_path, [[frames[-3][0], [], 0], *frames[-2:]])
    assert (difference < 1e-9, force < 1e-9 * largest, largest > 100) == (True, True, True)
    saved(page, "dump", tmp_path)
    solved = percussions("solve", "ell.dump", "--left-velocity", "desired", "--room", path)
    assert solved.returncode == 0, solved.stderr
    at(page, address, "gate")
    page.evaluate(STEPPED, 100)
    saved(page, "csv", tmp_path)
    how = ["--frame", 10, "--room", "scenes/rooms/gate.toml", "--radius", 0.18, "--name", "real"]
    imported = percussions("import", "gate.csv", *how, "--unit", "m")
    assert imported.returncode == 0, imported.stderr


def test_who_keeps_a_distance_does_not_press(page, address, tmp_path):
    """The slider from 1 to 0: forces fall, and the flow is one that was measured. Saved, linked and drawn again it stays;
    back at 1 the scene is what it was."""
    at(page, address, "arch")
    of, slide, cells = page.evaluate("explore.scene.content"), page.locator("#live .pushing"), {}
    for fraction in ("1", "0"):
        slide.fill(fraction)
        page.evaluate(STEPPED, 1000)
        page.locator("#live .step").click()
        words = page.locator("#live .crowd").inner_text().replace("\u202f", "")
        cells[fraction] = [*map(float, re.search(r"Flow ([\d.]+).* second (\d+) N", words).groups())]
        assert ("This one flows so" in words, "No measured crowd" in words) == (fraction == "0", fraction == "1"), words
    (fast, hard), (slow, soft) = cells["1"], cells["0"]
    assert (fast > 4, 1.2 <= slow <= 2.1, soft < 0.2 * hard) == (True, True, True), cells
    opened(page)
    assert slide.input_value() == "0"
    typed(page, "people", 60)
    drive = read_scene(saved(page, "scene", tmp_path)[0]).drive
    assert (drive.time_gap_s, drive.push_share) == (0.6, 0.0)
    at(page, address, "arch")
    for fraction in ("0.3", "1"):
        slide.fill(fraction)
    assert page.evaluate("explore.scene.content") == of


@pytest.mark.parametrize("seed", [0, 1, 4_000_000_000])
def test_the_same_people_push_as_in_the_product(page, seed):
    law, ids = Distance(time_gap_s=1.0, push_share=0.4, pushing_people=0.5, seed=seed), [*range(1, 200), 2**32, 2**53 - 1]
    message = page.evaluate("([law, ids]) => pushShares(law, ids)", [law.model_dump(), ids])
    assert message == law.push_shares(np.array(ids)).tolist()
    assert {*message} == {0.0, 0.4}


def test_doors_and_pillars_are_pulled_while_people_press(page, address, tmp_path):
    """An edge of the door comes at 1 m/s and nobody is left in a wall; a pillar is put into the room
    and pushes people before it."""
    at(page, address, "gate")
    typed(page, "door", 0.9)
    width = read_scene(saved(page, "scene", tmp_path)[0]).drive
    assert np.hypot(*np.subtract(*width.door)) == pytest.approx(0.9)
    page.evaluate(STEPPED, 30)
    typed(page, "door", 0.4)
    page.evaluate(STEPPED, 10)
    slow = np.subtract(*read_scene(saved(page, "scene", tmp_path)[0]).drive.door)
    assert np.hypot(*slow) == pytest.approx(0.9 - 2 * 10 * 0.01)
    page.evaluate(STEPPED, 40)
    scene = read_scene(saved(page, "scene", tmp_path)[0])
    assert np.hypot(*np.subtract(*scene.drive.door)) == pytest.approx(0.4)
    ends = {end for wall in scene.walls for end in (wall.start_m, wall.end_m)}
    assert set(scene.drive.door) <= ends


def test_a_crowd_that_is_slower_than_the_clock_says_so(page, address):
    """Where a step takes as long as a picture may, each picture has one, and how slow that is is said."""
    at(page, address, "gate")
    page.evaluate("performance.now = ((now) => () => now += 30)(performance.now())")
    page.locator("#live .play").click()
    page.get_by_text(re.compile(r"beyond the door\. Slowed to 0\.\d of real time")).wait_for()
    page.locator("#live .play").click()


def floor(page, path, text):
    path.write_text(text)
    page.locator("#live .open").set_input_files(path)
    page.get_by_text("Tap both ends").wait_for()


def clicked(page, *points):
    """Click at places (m)."""
    box = page.locator("#live canvas.canvas").bounding_box()
    for point in points:
        x, y = page.evaluate("point => explore.to(point)", point)
        page.mouse.click(box["x"] + x, box["y"] + y)


def pulled(page, corner, to, folder):
    """Pull a pillar of 1 m by its upper left corner to the left: it comes at 1 m/s, and people are
    pushed before it."""
    box = page.locator("#live canvas.canvas").bounding_box()
    points = [page.evaluate("point => explore.to(point)", list(one)) for one in (corner, to)]
    (x0, y0), (x1, y1) = ((box["x"] + x, box["y"] + y) for x, y in points)
    page.mouse.move(x0, y0)
    page.mouse.down()
    page.mouse.move(x1, y1)
    page.mouse.up()
    for seconds, moved in ((0.5, 0.5), (2.0, np.hypot(*np.subtract(to, corner)))):
        left = round((seconds - page.evaluate("explore.run.step * explore.timing()[0]")) / 0.01)
        page.evaluate(STEPPED, left)
        walls = read_scene(saved(page, "scene", folder)[0]).walls
        ends = np.array([wall.start_m for wall in walls[-4:]])
        low, high = ends.min(0), ends.max(0)
        assert [low[0], high[1]] == pytest.approx([corner[0] - moved, corner[1]], abs=0.02)
        assert high - low == pytest.approx(1.0)


def test_a_floor_of_wkt_with_a_door_and_a_link_to_it(page, address, tmp_path):
    at(page, address, "gate")
    floor(page, tmp_path / "hall.wkt", f"POLYGON ({RING}, (4 1, 5 1, 5 2, 4 2, 4 1))")
    clicked(page, (6, 1), (6, 2.2))
    page.get_by_text("hall, drawn").wait_for()
    typed(page, "people", 60)
    scene = read_scene(saved(page, "scene", tmp_path)[0])
    assert (len(scene.snapshot), len(scene.walls)) == (60, 9)
    assert np.sort(np.array(scene.drive.door)[:, 1]) == pytest.approx([1.0, 2.2], abs=0.02)
    assert scene.drive.outward == (1.0, 0.0)
    pulled(page, (4, 2), (2.8, 2), tmp_path)
    page.locator("#live .again").click()
    opened(page)
    page.get_by_text("hall: door of 1.2 m, 60 people").wait_for()
    again = read_scene(saved(page, "scene", tmp_path)[0])
    assert again.content() == scene.content()
    assert np.array_equal(again.snapshot.position, scene.snapshot.position)


def test_a_seed_is_a_crowd_and_a_link_holds_what_is_shown(page, address):
    """Also where the door was moved after they were placed, and the people of a film. A damaged
    address opens the first scene."""
    at(page, address, "gate")
    crowds = []
    for seed in (2, 1, 2):
        typed(page, "seed", seed)
        crowds.append(page.evaluate("explore.scene.disks"))
    assert crowds[0] == crowds[2] != crowds[1]
    typed(page, "door", 0.9)
    at_first = page.evaluate("[...explore.part('position')]")
    opened(page)
    assert page.evaluate("[...explore.part('position')]") == at_first
    film = "{ base: 'gate', from: { id: [3, 9], x: [0, 2, -0.5, 2] } }"
    opened(page, address + page.evaluate(f"hashOf({film})"))
    opened(page)
    assert page.evaluate("explore.scene.disks.x") == [0, 2, -0.5, 2]
    opened(page, f"{address}#%E0%A4%A")
    assert page.evaluate("explore.scene.name") == "gate"


def test_files_of_other_editors_and_rooms_that_are_small(page, address, tmp_path):
    """Lines end as Windows ends them, brackets stand in a title, a ring of WKT is not closed, and a
    room has no place for as many."""
    at(page, address, "arch")
    path = read_scene("gate").write(tmp_path)
    text = "# of Windows\n" + path.read_text().replace('title = "', 'title = "# [ a ')
    path.write_bytes(text.replace("\n", "\r\n").encode())
    page.locator("#live .open").set_input_files([path, path.with_suffix(".data")])
    page.get_by_text("# [ a A filmed crowd").wait_for()
    at(page, address, "arch")
    floor(page, tmp_path / "small.wkt", f"POLYGON ({RING})".replace(", 0 0)", ")"))
    clicked(page, (6, 1), (6, 2))
    page.get_by_text("Room for").wait_for()
    assert page.evaluate("explore.scene.content.walls.length") == 5
    assert 100 < page.evaluate("explore.scene.disks.id.length") < 200


def test_a_room_is_drawn_by_keys_and_given_up(page, address):
    """A cross at (0, 0), a room of 3 m by 2 m, a door in it; and a pillar that never is."""
    at(page, address, "gate")
    page.locator("#live .room").click()
    keys = dict(zip("+RULD", ("Enter", "ArrowRight", "ArrowUp", "ArrowLeft", "ArrowDown"), strict=True))
    for key in re.findall(r"\D\d*", "++R12+U8+L12+D8+R12U2+U4+"):
        for _ in range(int(key[1:] or 1)):
            page.keyboard.press(keys[key[0]])
    page.get_by_text("room, drawn").wait_for()
    door = page.evaluate("explore.scene.content.drive")
    assert (door["door_start_m"], door["door_end_m"]) == ([3, 0.5], [3, 1.5])
    page.locator("#live .pillar").click()
    page.locator("#live .step").click()
    clicked(page, page.evaluate("explore.run.frames.at(-1).x.slice(0, 2)"))
    assert page.locator("#live .person").input_value() == "1"


def test_a_saved_scene_leaves_out_doors_and_stops_of_those_who_left(page, address, tmp_path):
    scene = read_scene("gate")
    at(page, address, "gate")
    page.evaluate("""() => { const { drive } = explore.scene.content, people = [1, 5];
        drive.goals = [{ ...drive, people }];
        drive.stops = [{ people: [6, 9], time_s: 3 }, { people, time_s: 3 }];
        Object.assign(drive, { time_gap_s: 1, pushers: [{ people: [6, 9], push_share: 0.5 }, { people, push_share: 0.5 }] });
        explore.part("position").fill(-9, 0, 10); explore.run.step = 100; }""")
    path, _ = saved(page, "scene", tmp_path)
    drive = read_scene(path).drive
    assert (len(drive.goals), len(drive.stops), len(drive.pushers)) == (0, 1, 1)
    assert drive.stops[0].time_s == pytest.approx(3 - 100 * timing(scene).time_step)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.toml", "[drive\n", "line 1: [drive"),
        ("a.toml", 'title = "t"\n', "source, contact, run, analysis: Field required"),
        ("a.toml", f"{SCENE}title = 't'\n", "analysis.title: unknown key"),
        ("a.wkt", "nothing", "no TOML, and no WKT of one polygon"),
        ("a.wkt", "LINESTRING (0 0, 6 0, 6 4)", "no TOML, and no WKT of one polygon"),
        ("a.wkt", f"MULTIPOLYGON (({RING}), ({RING}))", "no TOML, and no WKT of one polygon"),
        ("a.wkt", f"POLYGON ({RING})".replace("6 ", "6e4 "), "coordinates in m within ±10000 are needed"),
    ],
)
def test_bad_files_are_refused_in_one_line(page, address, tmp_path, name, text, says):
    at(page, address, "gate")
    (tmp_path / name).write_text(text)
    page.locator("#live .open").set_input_files(tmp_path / name)
    page.get_by_text(f"Not opened: {says}.").wait_for()


def test_the_page_has_every_validator_of_the_schema_by_its_name(page):
    named = re.findall(r'"(_[a-z_]+)"', json.dumps(rules()))
    assert set(named) == set(page.evaluate("Object.keys(CHECKS)"))


def test_the_page_names_the_keys_that_the_product_names(page, address, tmp_path):
    """Every key of a scene, with values that cannot be meant."""
    at(page, address, "gate")
    gate = read_scene("gate").write(tmp_path)
    data, texts, output = gate.with_suffix(".data").read_text(), [], []
    for position, value in PLACES.items():
        for bad in (*bad_values(position[-1], value).values(), None):
            content = copy.deepcopy(full_scene())
            table = content
            for part in position[:-1]:
                table = table[part]
            if bad is None:
                table[f"{position[-1]}_ft"] = table.pop(position[-1])
            else:
                table[position[-1]] = bad
            texts.append(tomli_w.dumps(content))
            gate.write_text(texts[-1])
            with pytest.raises(SceneError) as refused:
                read_scene(gate)
            output.append(first_word(str(refused.value)))
    ours = page.evaluate("""([texts, data]) => texts.map((text) => {
        explore.openTexts([["gate.toml", text], ["gate.data", data]]);
        return document.querySelector("#live .said.quiet").textContent; })""", [texts, data])  # fmt: skip
    assert len(output) > 500
    assert [first_word(words) for words in ours] == output
    assert page.evaluate("[explore.scene.name, explore.run.step]") == ["gate", 0]


@pytest.mark.long
def test_damaged_links_and_files_are_refused_or_played_as_the_rigid_engine_does(page, address, tmp_path):
    """More of them: python -m tests.explore."""
    at(page, address, "gate")
    faults = [(number, fault) for number, _, fault in cases(page, tmp_path, range(240)) if fault]
    assert not faults


MANY = "{ title: 't', source: 's', walls: Array(20000).fill({ name: 'w', start_m: [0, 0], end_m: [1, 0] }) }"


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("{ base: 'gate', placed: { count: 1e9, radius: 0.2, seed: 1 } }", "placed.count"),
        (f"{{ base: 'gate', content: {{ ...explore.scene.content, ...{MANY} }} }}", "content.walls: 20000."),
        ("{ base: 'gate', disks: { id: Array(6000).fill(1) } }", "disks.id: 6000. This page takes at most 5000"),
        ("' '.repeat(2e8)", "link: more than 4 MB"),
        ("JSON.parse('{ \"base\": \"gate\", \"__proto__\": { \"x\": 1 } }')", "__proto__: unknown key"),
        ("{ base: 'nowhere' }", "base: this page has no scene nowhere"),
    ],
)
def test_a_link_that_asks_too_much_leaves_what_is_shown(page, address, message, words):
    at(page, address, "gate")
    page.evaluate(STEPPED, 3)
    made = page.evaluate(PLAYED, [None, page.evaluate(f"hashOf({message})"), 0])
    assert made["words"].startswith(f"Not opened: {words}")
    assert (made["played"], made["clean"]) == (False, True)
    assert page.evaluate("[explore.scene.name, explore.run.step, explore.advance()]") == ["gate", 3, True]


def test_the_core_refuses_parts_that_do_not_go_together(page, address):
    """The part is named by its number, and nothing is stepped."""
    at(page, address, "gate")
    names = ["position", "velocity", "spin", "radius", "mass", "goes", "stop", "share", "ids", "exits", "grid", "next", "corners"]
    names += ["onward", "walls", "law", "distance"]
    found = page.evaluate("""(names) => { const { core, part } = explore, bad = [];
        names.forEach((name, k) => { const old = part(name).slice();
            for (const values of [[...old, 1], [...old.slice(0, -1), NaN], [...old.slice(0, -1), -3]]) {
                core.room(k, values.length), part(name).set(values);
                bad.push([name, core.begin(0), core.step(), core.separate(), core.window()]);
            }
            core.room(k, old.length), part(name).set(old); });
        const others = [core.room(99, 1), core.room(0, -1), core.at(-5), core.size(77), core.extreme(1e6, 1)];
        return [bad, ...others, core.begin(0), core.step()]; }""", names)  # fmt: skip
    bad, *others = found
    assert others == [0, 0, 0, 0, np.inf, 0, 1]
    wrong = {name: [code for one, code, *_ in bad if one == name] for name in names}
    assert all(codes[1] == names.index(name) + 1 for name, codes in wrong.items())
    for name in {*names} - {"velocity", "next", "corners", "onward"}:
        assert wrong[name][0] > 0
    assert all(wrong[name][2] for name in ("radius", "mass", "goes", "law", "share", "ids", "distance"))
    assert all(step == -2 and difference == -1 for _, code, step, difference, _ in bad if code)
    page.evaluate("explore.part('velocity')[0] = NaN")
    assert not page.evaluate("explore.advance()")
    assert "at no finite place" in page.locator("#live .said.quiet").inner_text()


def test_a_title_says_what_is_shown(page, address, tmp_path):
    """After a door was pulled, or other people put before it, in the heading, the saved files and a link."""
    scene = read_scene("gate").model_copy(update={"title": "A door of 1.0 m", "name": "door_10"})
    path = scene.write(tmp_path)
    at(page, address, "arch")
    page.locator("#live .open").set_input_files([path, path.with_suffix(".data")])
    heading = page.locator("#live h2.title")
    page.get_by_text("A door of 1.0 m").wait_for()
    assert read_scene(saved(page, "scene", tmp_path)[0]).title == "A door of 1.0 m"
    typed(page, "door", 1.2)
    assert heading.inner_text() == "my scene: door of 1.2 m, 55 people, push 150 N"
    path, _ = saved(page, "scene", tmp_path)
    assert (path.name, read_scene(path).title) == ("my_scene_now.toml", heading.inner_text())
    typed(page, "people", 40)
    typed(page, "friction", 0.3)
    shown = heading.inner_text()
    assert shown == "my scene: door of 1.2 m, 40 people, push 150 N, friction 0.3"
    opened(page)
    assert heading.inner_text() == shown


def test_scenes_of_other_engines_are_refused():
    with pytest.raises(SceneError, match=r"rail: walls.mass_kg"):
        content_of(read_scene("rail"))
    with pytest.raises(SceneError, match=r"shoulders: disks.bodies"):
        content_of(read_scene("shoulders"))


def test_it_fits_on_a_telephone_and_needs_no_mouse(page, address):
    phone = page.context.browser.new_page(viewport={"width": 400, "height": 844})
    phone.goto(f"{address}#gate")
    canvas = phone.locator("#live canvas.canvas")
    assert canvas.bounding_box()["height"] > 150
    assert phone.evaluate("document.documentElement.scrollWidth") <= 400
    works_by_keyboard(phone)
    phone.locator("#live .again").click()
    canvas.focus()
    phone.keyboard.press("ArrowRight")
    assert phone.evaluate("[explore.run.step, explore.run.frames.length]") == [5, 2]
    phone.keyboard.press(" ")
    assert phone.locator("#live .play").inner_text() == "Pause"
    phone.close()


def test_a_picture_and_a_sentence_stand_without_webassembly(page, address):
    without = page.context.browser.new_page()
    without.add_init_script("delete window.WebAssembly")
    without.goto(address)
    assert without.locator("#live img").is_visible()
    assert without.get_by_text("needs a browser with scripts and WebAssembly").is_visible()
    assert not without.locator("#live canvas.canvas").is_visible()
    without.close()


def test_the_page_of_all_scenes_is_below_a_megabyte(tmp_path):
    scenes = offered()
    assert {"arch", "gate", "jam", "ell"} < {one.name for one in scenes}
    assert not {"rail", "shoulders", "pair"} & {one.name for one in scenes}
    assert write_explore(scenes, tmp_path, "percussions explore").stat().st_size < 1e6
