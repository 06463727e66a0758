"""Scenes that cannot be meant, as files and as links: what the product says of them, and the page."""

import base64
import copy
import gzip
import json
import random
import re
import tomllib

import numpy as np
import tomli_w

from analysis.engines.programs.rigid import motion_of
from analysis.engines.record import EngineError
from analysis.engines.rigid import Rigid
from analysis.scene.drive import Drive
from analysis.scene.scene import Scene, SceneError, first_problem, read_scene
from analysis.studies.explore.page import content_of
from analysis.studies.explore.page_input import Link
from nscd import Snapshot
from nscd.stepping import StepError
from tests.fuzz.mutations import damage

SCENES, KEEPING, STEPS = ("gate", "two_way", "faint", "terrace", "arms"), {"two_way", "faint"}, 3
# What only the page refuses says so, as do lines of TOML that it does not read.
OF_THE_PAGE = re.compile(r"[Tt]his page|line \d+: |before a door|do not fit|open it together")
VALUES = (
    None, True, 0, -1, 1, 0.5, -0.5, 2, 1e9, 1e-9, 1e30, -1e30, 1e300, 1e-300, "", "x", "1.0", [], {}, [0, 0],
    [1.0, 0.0], [3.0, 4.0], [1, 0, 0], [[0, 0], [1, 1]], {"__proto__": 1}, "__proto__", [3, 1], [1, 5],
)  # fmt: skip
# Open files, or an address; then a few steps.
PLAYED = """async ([texts, hash, steps]) => { const from = performance.now();
    const said = () => document.querySelector("#live .said.quiet").textContent, old = explore.run;
    if (texts) explore.openTexts(texts);
    else { history.replaceState(null, "", hash); await explore.fromAddress(); }
    const played = explore.run !== old, words = said();
    let made = 0;
    while (played && made < steps && explore.advance()) ++made;
    const x = [...explore.part("position")], clean = Reflect.ownKeys(Object.prototype).length === 12 && x.every(Number.isFinite);
    const { ended, frames } = explore.run, forces = frames.every(({ f }) => f.every(Number.isFinite));
    return { played, words, made, x, ended, clean: clean && forces, ms: performance.now() - from };
}"""


def keeping(name):
    """A scene whose people keep their distance, each noise and each way to name who pushes in use."""
    noise = {"heading_sd_rad": 0.3, "heading_hold_s": 0.2, "jostling_m_per_s": 0.1, "seed": 7}
    keeps = {"time_gap_s": 0.6, "push_share": 0.7, "pushing_people": 0.6, **noise}
    scene = read_scene(name)
    drive = scene.drive.model_dump() | {"pushers": [{"people": [2, 9], "push_share": 0.3}]} | keeps
    return scene.model_copy(update={"drive": Drive.model_validate(drive)}).rerouted()


def chosen(dice):
    name = dice.choice(SCENES)
    return keeping(name) if name in KEEPING else read_scene(name)


def positions_in(tree, path=()):
    """The path of everything in a tree of tables and lists, of long lists the first entries."""
    if path:
        yield path
    if isinstance(tree, dict | list):
        for key in list(tree) if isinstance(tree, dict) else range(min(len(tree), 3)):
            yield from positions_in(tree[key], (*path, key))


def mutated(dice, tree):
    """A tree with one or two values that are changed, scaled, taken out, doubled or added."""
    tree = copy.deepcopy(tree)
    for _ in range(dice.choice((1, 1, 2))):
        *path, key = dice.choice(list(positions_in(tree)))
        table = tree
        for part in path:
            table = table[part]
        kind, value = dice.randrange(6), table[key]
        if kind == 0 and isinstance(value, int | float):
            table[key] = value * dice.choice((-1, 0, 1e-3, 0.5, 2, 10, 1e3, 1e9, 1e200))
        elif kind == 1:
            del table[key]
        elif kind == 2 and isinstance(table, list):
            table.append(copy.deepcopy(value))
        elif kind == 3 and isinstance(table, dict):
            table[dice.choice(("__proto__", "constructor", "toString", "speed", f"{key}_ft"))] = value
        elif kind == 4:
            *other, last = dice.choice(list(positions_in(tree)))
            found = tree
            for part in (*other, last):
                found = found[part]
            table[key] = copy.deepcopy(found)
        else:
            table[key] = copy.deepcopy(dice.choice(VALUES))
    return tree


def without_none(tree):
    if isinstance(tree, list):
        return [without_none(one) for one in tree if one is not None]
    if isinstance(tree, dict):
        return {key: without_none(one) for key, one in tree.items() if one is not None}
    return tree


def as_javascript(tree):
    """The same tree, whole numbers as JavaScript writes them, which knows one kind of number."""
    if isinstance(tree, dict):
        return {key: as_javascript(one) for key, one in tree.items()}
    if isinstance(tree, list):
        return [as_javascript(one) for one in tree]
    return int(tree) if isinstance(tree, float) and tree.is_integer() and abs(tree) < 1e21 else tree


def files(dice, folder):
    """Name → text of a damaged scene file and its data file."""
    scene = chosen(dice)
    name, path = scene.name, scene.write(folder)
    data, kind = path.with_suffix(".data").read_bytes(), dice.randrange(4)
    text = path.read_bytes()
    if kind < 2:
        text = tomli_w.dumps(without_none(mutated(dice, tomllib.loads(text.decode())))).encode()
    elif kind == 2:
        text = damage(dice, text)
    else:
        data = damage(dice, data)
    return {
        path.name: text.decode("utf-8", "replace"),
        f"{name}.data": data.decode("utf-8", "replace"),
    }


def link(dice):
    """The text of a damaged link to a scene of its own."""
    found = content_of(chosen(dice))
    stated = {
        "base": "",
        "placed": None,
        "content": found["content"],
        "disks": found["disks"],
        "from": None,
    }
    return json.dumps(as_javascript(mutated(dice, json.loads(json.dumps(stated)))))


def hash_of(text):
    return "#s=" + base64.urlsafe_b64encode(gzip.compress(text.encode())).decode().rstrip("=")


def scene_of_files(folder, texts):
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="")
    return read_scene(folder / next(iter(texts)))


def scene_of_link(text):
    """The scene of a link. Raises SceneError or ValueError as the product does."""
    message = json.loads(text)
    disks = message.get("disks") if isinstance(message, dict) else None

    def means():
        return float(np.mean(disks["r"])), float(np.mean(disks["m"]))

    try:
        made = Link.model_validate(message, context={"means": means})
    except (TypeError, KeyError):
        raise SceneError("disks: none") from None
    except ValueError as error:
        raise SceneError(first_problem(error)) from None
    crowd = made.disks
    position, velocity = (np.reshape(part, (-1, 2)) for part in (crowd.x, crowd.u))
    of = {"radius": crowd.r, "mass": crowd.m, "spin": crowd.w, "ids": crowd.id}
    scene = Scene.of(
        made.content, name="linked", snapshot=Snapshot(position=position, velocity=velocity, **of)
    )
    scene.check("linked")
    return scene


def solution_of(make, *inputs):
    """What the product makes of a scene: places (n·2) m after a few steps, "" where a step has no
    answer, or why it is refused."""
    try:
        scene = make(*inputs)
        Rigid().check(scene)
        motion = motion_of(scene, scene.snapshot)
    except (ValueError, EngineError) as error:
        return None, str(error)
    try:
        motion.separate()
        for _ in range(STEPS):
            motion.advance()
    except (StepError, ValueError) as error:
        return None, f"stops: {error}"
    return motion.position.ravel().tolist(), ""


def first_word(words):
    """The key, or file, that a refusal begins with."""
    words = re.sub(
        r"^(Not opened|linked|\S+\.toml|\S+/(?=\w+\.data)|\w+(?=: (run|walls)\.))[:,]? *|^\S*/",
        "",
        words,
    )
    words = re.sub(r"^.*\(at (line|end)|^line.*", "TOML", words)
    return re.match(r"[\w.\-]*", words)[0].rstrip(".")


def fault(page, product):
    """What is wrong with what the page made of a scene, where the product answers so; or nothing."""
    positions, refusal = product
    if not page["clean"] or page["ms"] > 2000:
        return f"clean: {page['clean']}, {page['ms']:.0f} ms"
    if refusal.startswith("stops"):
        return "" if page["ended"] or not page["played"] else "plays on"
    if not page["played"]:
        words = page["words"]
        if not words.startswith("Not opened: ") or "undefined" in words:
            return f"no refusal: {words}"
        if not refusal:
            return "" if OF_THE_PAGE.search(words) else f"refused: {words}"
        same = (
            "coincide" in refusal
            or first_word(words) == first_word(refusal)
            or OF_THE_PAGE.search(words)
        )
        return "" if same else f"other key: {words} | {refusal}"
    # a room, in which the page puts people, and frames that it does not use
    if refusal.endswith(("disks: Field required", "no such file")):
        return ""
    if refusal:
        return f"played: {refusal}"
    return "" if page["x"] == positions else f"other places, after {page['made']} steps: {page['ended']}"


def cases(page, folder, numbers):
    """Number, what the page made of it, and what is wrong with that: files, and every other time a link."""
    for number in numbers:
        dice = random.Random(number)
        if number % 2:
            inputs = files(dice, folder)
            made = page.evaluate(PLAYED, [list(inputs.items()), None, STEPS])
            product = solution_of(scene_of_files, folder, inputs)
        else:
            inputs = link(dice)
            made = page.evaluate(PLAYED, [None, hash_of(inputs), STEPS])
            product = solution_of(scene_of_link, inputs)
        yield number, made, fault(made, product)
