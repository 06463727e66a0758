"""Each judgement on tracks that are made up, one that passes and one that fails; standards, words and
scenes belong together."""

import numpy as np
import pytest

from analysis.pages.words import Words
from analysis.studies.standards.cases import (
    AGAINST,
    CASES,
    DENSITIES,
    How,
    Judged,
    Track,
    judged_together,
)

SCENES = {}


def scene(name, number=0):
    if name not in SCENES:
        SCENES[name] = CASES[name].scenes(How())
    return SCENES[name][number]


def track(one, *arguments, every=1.0):
    """Of all people at the same place in each frame, or at places (n,2) m."""
    n = len(one.snapshot)
    position = np.array([np.broadcast_to(np.asarray(at, float), (n, 2)) for at in arguments])
    return Track(scene=one, time=every * np.arange(len(arguments)), position=position)


def leaving(one, times, inside=(-4.0, 2.5), outside=(1.0, 2.5)):
    """People who leave at these times (s, one each), in frames of 0.1 s until one after the last
    that is finite."""
    times = np.asarray(times, float)
    time = np.arange(0.0, 2.0 + 2.0 * times[np.isfinite(times)].max(initial=0.0), 0.1)
    gone = time[:, None] >= times - 1e-9
    position = np.where(gone[..., None], outside, inside)
    return Track(scene=one, time=time, position=position)


def walk(speed):
    x = np.arange(0.0, 60.0, 1.0)
    return track(scene("corridor"), *zip(x, np.ones_like(x), strict=True), every=1.0 / speed)


@pytest.mark.parametrize(
    ("name", "speed", "passed"),
    [
        ("corridor", 1.04, True), ("corridor", 0.94, False), ("corridor", 1.06, False),
        ("corridor_fast", 40 / 33.9, True), ("corridor_fast", 40 / 34.2, False),
        ("corridor_fast", 40 / 25.8, False),
    ],
)  # fmt: skip
def test_walks(name, speed, passed):
    assert CASES[name].judge(walk(speed)).passed == passed


def test_who_stays_in_the_corridor_fails():
    still = track(scene("corridor"), (1.0, 1.0), (30.0, 1.0))
    assert not CASES["corridor"].judge(still).passed
    assert not CASES["corridor_fast"].judge(still).passed


@pytest.mark.parametrize(
    ("positions", "passed"),
    [
        (((1, 1), (11, 1), (11, 13)), True),
        (((1, 1), (11, 13)), False),  # across the corner
        (((1, 1), (11, 1), (11, 11)), False),  # not out
    ],
)
def test_corner(positions, passed):
    assert CASES["corner"].judge(track(scene("corner"), *positions)).passed == passed


def counterflow(*times):
    """The 100 cross at these times (s) against 0, 10, 50 and 100."""
    tracks = [
        leaving(scene("counterflow", i), np.full(100 + n, time), (2.0, 5.0), (25.0, 5.0))
        for i, (n, time) in enumerate(zip(AGAINST, times, strict=True))
    ]
    return CASES["counterflow"].judge(*tracks)


def test_counterflow():
    assert counterflow(1.0, 1.2, 1.5, 2.0).passed
    assert not counterflow(1.0, 1.2, 1.2, 2.0).passed
    stuck = counterflow(1.0, 1.2, 1.5, np.inf)
    assert not stuck.passed
    assert stuck.numbers["crossed"] == {0: 100, 10: 100, 50: 100, 100: 0}


@pytest.mark.parametrize(("position", "passed"), [((4.0, 5.0), True), ((4.0, 9.0), False)])
def test_congestion(position, passed):
    judged = CASES["congestion"].judge(track(scene("congestion"), position))
    assert judged.passed == passed
    assert sorted(judged.numbers.values()) == [0.0, 50.0 if passed else 25.0]


@pytest.mark.parametrize(("rate", "passed"), [(1.30, True), (1.40, False)])
def test_flow(rate, passed):
    judged = CASES["flow"].judge(leaving(scene("flow"), 1.0 + np.arange(100) / rate))
    assert judged.passed == passed
    assert judged.numbers["flow_per_m_s"] == pytest.approx(rate, rel=0.01)


def test_flow_of_a_room_that_stays_full():
    times = np.where(np.arange(100) < 50, 1.0 + np.arange(100), np.inf)
    assert not CASES["flow"].judge(leaving(scene("flow"), times)).passed


@pytest.mark.parametrize(("falls", "passed"), [(0.1, True), (0.0, False), (-0.1, False)])
def test_density(falls, passed):
    tracks = [
        track(scene("density", i), (0, 2), *((3 + (1 - falls * i) * t, 2) for t in range(1, 9)))
        for i in range(len(DENSITIES))
    ]
    assert CASES["density"].judge(*tracks).passed == passed


def test_clogging():
    one = scene("clogging")
    some = np.where(np.arange(60) < 4, 1.0, np.inf)
    blocked = CASES["clogging"].judge(leaving(one, some))
    assert blocked.passed
    assert blocked.numbers["inside"] == 56
    assert not CASES["clogging"].judge(leaving(one, np.full(60, 1.0))).passed
    # one leaves late
    some[0], some[1] = 3.9, 4.0
    late = leaving(one, some)
    half = late.time <= 5.0
    late = Track(scene=one, time=late.time[half], position=late.position[half])
    assert not CASES["clogging"].judge(late).passed


def test_several_seeds_have_the_least_and_the_largest_number_and_pass_together():
    both = [
        Judged(True, {"out": 2, "last_s": {0: 3.0}}),
        Judged(False, {"out": 1, "last_s": {0: 4.0}}),
    ]
    assert judged_together(both) == Judged(False, {"out": (1, 2), "last_s": {0: (3.0, 4.0)}})
    assert judged_together(both[:1]).passed


def test_each_has_its_words():
    words = Words("analysis.studies.standards.cases")
    assert set(words.blocks) == set(CASES)
    for block in words.blocks.values():
        assert [line[2:].split(":")[0] for line in block.splitlines() if line.startswith("- ")] == [
            "title", "tests", "asks", "found",
        ]  # fmt: skip
