"""Every key of a scene file and of a file of limits, with values that cannot be meant: one line that
names the file and the key."""

import copy
import math
import shutil
import tomllib

import pytest
import tomli_w

from analysis.scene.scene import SceneError, read_scene
from analysis.studies.exposure.limits import LimitError, known_limits
from analysis.support.files import shipped

GOAL = {
    "people": [1, 3],
    "outward": [1.0, 0.0],
    "door_start_m": [9.0, 0.0],
    "door_end_m": [9.0, 1.0],
}
# Keys that the shipped scene leaves out.
MORE = {
    "drive": {
        "goals": [GOAL], "aim": "nearest", "clearance_m": 0.1, "time_gap_s": 0.6, "push_share": 0.5,
        "pushing_people": 0.5, "pushers": [{"people": [1, 3], "push_share": 0.2}], "seed": 2,
        "heading_sd_rad": 0.2, "heading_hold_s": 0.4, "jostling_m_per_s": 0.06,
        "jostling_length_m": 1.0, "jostling_period_s": 4.0,
    },
    "body_force": {"acceleration_m_per_s2": [0.0, -1.0]},
    "contact": {
        "law": "hooke", "friction": 0.2, "wall_stiffness_N_per_m": 1e6, "tangential_ratio": 0.3,
    },
    "run": {
        "time_step_s": 1e-5, "drive_interval_steps": 10, "rigid_step_s": 0.01, "impulses": True,
        "rigid_tolerance": 1e-8,
    },
    "analysis": {"contact_tolerance_m": 1e-6},
    "disks": {"people": "ANSUR II", "people_seed": 1},
    "reconciliation": {"radius_sd_m": 0.01},
    "other_frames": {"refused": [3]},
}  # fmt: skip
NO_NUMBER = {"text": "1.0", "true": True, "nan": math.nan, "inf": math.inf, "list": [], "table": {}}
NO_TEXT = {"number": 1.0, "true": True, "list": [], "table": {}}
# Of keys that are no coordinates: below what any of them takes.
TOO_SMALL = {"negative": -1.0, "underflow": 1e-300}
SIGNED = {"frame", "frames", "after_s", "refused", "moved_mean_x_m", "moved_mean_y_m"}
# What is out of range by size alone.
HUGE = {
    "restitution": 1.1, "friction": 11.0, "tangential_ratio": 1.1, "rigid_tolerance": 1.0,
    "moved_share_over_1_cm": 1.1, "start_m": [1e31, 0.0], "end_m": [1e31, 0.0],
    "door_start_m": [1e31, 0.0], "outward": [2.0, 0.0], "acceleration_m_per_s2": [1e31, 0.0],
    "push_share": 1.1, "pushing_people": 1.1, "heading_sd_rad": 4.0, "jostling_m_per_s": 11.0,
    "name": "x" * 101, "data": "../gate.data", "people": [3, 1],
}  # fmt: skip


def full_scene():
    """The content of a scene that has every key."""
    content = tomllib.loads((shipped("scenes") / "gate.toml").read_text(encoding="utf-8"))
    for key, more in MORE.items():
        content[key] = content.get(key, {}) | more
    content["walls"][0] |= {"mass_kg": 10.0, "stiffness_N_per_m": 1e4, "damping_N_s_per_m": 1.0}
    return content


def leaves(table, position=()):
    """The place of each key, the first row of lists of tables."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, (*position, key))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            yield from leaves(value[0], (*position, key, 0))
        else:
            yield (*position, key), value


def bad_values(key, value):
    """What a key does not take, by kind."""
    if isinstance(value, str):
        bad = dict(NO_TEXT)
    elif isinstance(value, bool):
        bad = {"text": "true", "number": 1, "list": []}
    elif isinstance(value, list):
        odd = NO_NUMBER if not isinstance(value[0], str) else NO_TEXT
        bad = {name: [one, *value[1:]] for name, one in odd.items()} | {"table": {}, "number": 1.0}
    else:
        bad = dict(NO_NUMBER)
        bad |= {} if key in SIGNED else TOO_SMALL
        bad |= {"fraction": 1.5} if isinstance(value, int) and key != "analysis" else {}
    return bad | ({"huge": HUGE[key]} if key in HUGE else {})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    here = tmp_path_factory.mktemp("keys")
    for path in shipped("scenes").glob("gate*.data"):
        shutil.copy(path, here)
    return here


PLACES = dict(leaves(full_scene()))


def named(position):
    return ".".join(str(part + 1 if isinstance(part, int) else part) for part in position)


@pytest.mark.parametrize("target", PLACES, ids=named)
def test_every_key_of_a_scene(folder, target):
    key, value = target[-1], PLACES[target]
    cases = bad_values(key, value)
    for name, bad in {**cases, "unknown": None}.items():
        content = copy.deepcopy(full_scene())
        table = content
        for part in target[:-1]:
            table = table[part]
        if name == "unknown":  # another unit, or a slip
            table[f"{key}_ft"] = table.pop(key)
        else:
            table[key] = bad
        path = folder / "gate.toml"
        path.write_text(tomli_w.dumps(content), encoding="utf-8")
        with pytest.raises(SceneError) as refused:
            read_scene(path)
        message = str(refused.value)
        assert message.startswith(str(path)), (name, message)
        assert key in message, (name, message)
        assert "\n" not in message, (name, message)


LIMIT = {
    "name": "mine", "number": 1500.0, "unit": "N", "quantity": "contact_largest", "what": "a force",
    "population": "adults", "source": "a test", "read": "second-hand", "quoted_by": "a test",
    "duration_s": 1.0, "duration_most_s": 2.0,
}  # fmt: skip


@pytest.mark.parametrize("key", LIMIT)
def test_every_key_of_a_limit(tmp_path, key):
    path = tmp_path / "mine.toml"
    bad = dict(
        NO_TEXT if isinstance(LIMIT[key], str) else NO_NUMBER | {"negative": -1.0, "zero": 0.0}
    )
    bad |= {"empty": "", "lines": "a\nb"} if isinstance(LIMIT[key], str) else {"huge": 1e300}
    bad |= {"unit": {"unit": "kN"}, "quantity": {"other": "mass"}}.get(key, {})
    for name, value in {**bad, "unknown": None}.items():
        limit = LIMIT | {key: value}
        if name == "unknown":
            limit[f"{key}_ft"] = limit.pop(key)
            limit[f"{key}_ft"] = LIMIT[key]
        path.write_text(tomli_w.dumps({"limit": [limit]}), encoding="utf-8")
        with pytest.raises(LimitError) as refused:
            known_limits([path])
        message = str(refused.value)
        assert message.startswith(f"{path}: limit"), (name, message)
        assert key in message, (name, message)
        assert "\n" not in message, (name, message)


@pytest.mark.parametrize(
    "text", ["limit = 3", "[limit]\nname = 1", "limit = [1]", "", "x = 1", "[["]
)
def test_a_file_of_no_limits(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(LimitError, match=r"^[^\n]*mine\.toml: "):
        known_limits([tmp_path / "mine.toml"])
