"""Differences of designs: intervals by scipy, looks that may stop early, the rule of sim-tools on the
same series, and the numbers of runs made by hand."""

import csv
from itertools import pairwise, takewhile

import numpy as np
import pytest
from scipy.stats import ttest_ind, ttest_rel

from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import read_scene
from analysis.studies.exposure.loads import RunLoads, walls_beside
from analysis.studies.motion.design_differences import (
    QUANTITIES,
    Outcome,
    Table,
    Target,
    difference,
    interim_levels,
    needed,
    outcome_of,
    table_of,
)
from analysis.studies.report.designs_page import designs_of

ALPHA = 0.05


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("paired", [False, True])
def test_an_interval_is_that_of_scipy(seed, paired):
    random = np.random.default_rng(seed)
    base, mine = random.normal(3, 1, 7), random.normal(4, 0.3 + seed, 7)
    test = ttest_rel(mine, base) if paired else ttest_ind(mine, base, equal_var=False)
    right = test.confidence_interval(1 - ALPHA)
    found = difference(mine, base, ALPHA, paired=paired)
    assert found.ends == pytest.approx((right.low, right.high), rel=1e-9)
    assert found.significant == (test.pvalue < ALPHA)


def test_cliffs_delta_by_hand_and_replicates_that_are_alike():
    # of nine pairs 1 > 0, 3 > 0 twice, 3 > 2; 0 < 1 … : five above, three below, one equal
    found = difference(np.array([1.0, 3, 0]), np.array([0.0, 0.5, 2]), ALPHA, paired=False)
    assert found.delta == pytest.approx((5 - 3) / 9)
    same = difference(np.full(4, 0.1), np.full(4, 0.3) - 0.2, ALPHA, paired=False)
    assert (same.value, same.half, same.significant) == (0.0, np.inf, False)


def test_looks_together_spend_ten_per_cent_and_no_more():
    some = list(takewhile(lambda style: style[0] < 10**6, interim_levels(5)))
    assert [size for size, _ in some][:4] == [5, 8, 12, 18]
    assert all(b > a for (a, _), (b, _) in pairwise(some))
    assert 0.09 < sum(alpha for _, alpha in some) < 0.1


def stopped(mine, base, schedule):
    """The first look at which a paired difference excludes zero."""
    found = ((n, difference(mine[:n], base[:n], alpha, paired=True)) for n, alpha in schedule)
    return next((n for n, one in found if one.significant), None)


def test_stopping_early_finds_no_difference_too_often():
    random, plan = np.random.default_rng(1), list(takewhile(lambda style: style[0] < 80, interim_levels(5)))
    series = random.normal(size=(2, 500, 80))
    wrong = [
        sum(stopped(*both, schedule) is not None for both in series.swapaxes(0, 1))
        for schedule in (plan, [(n, 0.1) for n, _ in plan])
    ]
    # of 500: 10 % and three standard errors of that; looked at with 10 % each time it is twice that
    assert wrong[0] <= 70
    assert wrong[1] > 100


@pytest.mark.parametrize("seed", range(8))
def test_the_rule_that_stops_is_that_of_sim_tools(seed):
    tools = pytest.importorskip("sim_tools.output_analysis", reason="no sim-tools")
    random = np.random.default_rng(seed)
    base = random.normal(2.0, 1.5, 400)

    class Model:
        def single_run(self, number):
            return {"difference": base[number]}

    def theirs(precision):
        rule = tools.ReplicationsAlgorithm(
            alpha=ALPHA, half_width_precision=precision, initial_replications=3, look_ahead=0
        )
        return rule.select(Model(), ["difference"])[0]["difference"]

    # twice the first design less the first design is the series itself
    every = [(n, difference(2 * base[:n], base[:n], ALPHA, paired=True)) for n in range(3, 400)]
    assert next(n for n, one in every if one.significant) == theirs(1.0)
    narrow = Target(fraction=0.2)
    assert next(n for n, one in every if one.half <= narrow.width(one)) == theirs(0.2)


def test_what_is_foretold_is_what_is_needed_if_the_spread_stays():
    random = np.random.default_rng(3)
    base, noise = random.normal(size=5), random.normal(size=5)
    found = difference(base + noise, base, ALPHA, paired=True)
    target = Target(number=0.25 * found.half, unit="N")
    size = needed(found, target, (5, 5, 1000), 9)
    halves = {n: found.half_at(n / 5, alpha / 9) for n, alpha in takewhile(lambda x: x[0] < 999, interim_levels(5))}
    assert next(n for n, half in halves.items() if half <= target.number) == size
    assert needed(found, target, (5, 5, size - 1), 9) == 0


@pytest.mark.parametrize(
    "text", ["", "decide", "0.2", "-1 N", "0 N", "nan N", "1e999 N", "0.2 kN", "1..2 N", "10 %%", "inf%"]
)
def test_what_is_asked_for_in_other_words_is_refused(text):
    with pytest.raises(ValueError, match=r"--until .*: decided, a share"):
        Target.parse(text)


def test_what_is_asked_for():
    assert Target.parse("decided") == Target()
    assert Target.parse("decided kN/m") == Target(unit="kN/m")
    assert Target.parse("10%") == Target.parse(" 10 % ") == Target(fraction=0.1)
    assert Target.parse("0.2 per s") == Target.parse("2e-1 1/s") == Target(number=0.2, unit="1/s")
    assert [key for key in QUANTITIES if Target.parse("0.1 1/m2").of(key)] == ["density_door"]


def made(name, door, *, people=6, outward=True):
    scene = room(name, 4.0, 3.0, door, Crowd(people=people, does="pressing"), 1.0)
    drive = scene.drive
    turned = {"door_start_m": drive.door_end_m, "door_end_m": drive.door_start_m}
    return scene if outward else scene.with_drive(**turned)


@pytest.mark.parametrize("outward", [True, False])
def test_left_and_right_are_those_of_who_leaves(outward):
    # who leaves along +x has the wall at y > 0 at the left, whichever end of the door is its start
    scene = made("one", 0.8, outward=outward)
    sides = [[scene.walls[n - 1] for n in side] for side in walls_beside(scene)]
    middle = [[0.5 * (wall.start_m[1] + wall.end_m[1]) for wall in side] for side in sides]
    assert [len(side) for side in middle] == [1, 1]
    assert middle[0][0] > 0 > middle[1][0]


def test_numbers_of_a_run_are_from_the_first_who_leaves_to_the_last():
    scene, end = made("one", 0.8), 0.1 * np.arange(1, 11)
    # two leave at 0.3 s, one steps back at 0.4 s and leaves again at 0.5 s, the fourth at 0.8 s
    gone = np.array([0, 0, 2, 1, 2, 2, 2, 4, 4, 4])
    load = np.zeros((10, len(scene.walls)))
    left, right = (side[0] - 1 for side in walls_beside(scene))
    load[:, left], load[5, right], load[0, right] = 2.0, 6.0, 100.0
    values = {key: end for key in ("contact_largest", "contact_mean", "density_door", "speed_door")}
    run = RunLoads(
        scene=scene, ids=range(6), time=end, duration=np.full(10, 0.1),
        loads={"wall_line_load": load},
        values=values | {"flow": np.diff(gone, prepend=0) / 0.1, "wall_line_load": load.max(1)},
    )  # fmt: skip
    found = outcome_of(run)
    right_ones = {
        "wall_left": 2.0, "wall_right": 1.0, "metre_largest": 6.0, "contact_largest": 0.8,
        "contact_mean": 0.55, "flow": 2 / 0.5, "density_door": 0.55, "speed_door": 0.55,
    }  # fmt: skip
    assert {key: found.values[key] for key in right_ones} == pytest.approx(right_ones)
    assert found.left.tolist() == pytest.approx([0.3, 0.3, 0.8, 0.8])
    table = table_of([[found] * 3, [found] * 3])
    # seven tenths of six people are four
    assert (table.reached, table.values[0]["time_until"][0]) == (4, pytest.approx(0.8))


def test_a_quantity_that_one_design_has_not_is_left_out_of_all():
    def outcome(**more):
        return Outcome(values={key: 1.0 for key in QUANTITIES} | more, left=np.zeros(0), people=2)

    table = table_of([[outcome()] * 3, [outcome(wall_left=np.nan)] * 3])
    assert set(QUANTITIES) - {"wall_left"} == set(table.values[1])


def test_intervals_hold_jointly_for_all_quantities_and_designs():
    random = np.random.default_rng(0)
    values = [{key: random.normal(size=6) for key in QUANTITIES} for _ in range(3)]
    alone = difference(values[2]["flow"], values[0]["flow"], 0.1 / 18, paired=False)
    assert Table(values=values, reached=0).differences(0.1)[1]["flow"] == alone


def test_people_of_all_designs_stand_where_those_of_the_first_do():
    first, *others = designs_of([made("one", 0.6), made("two", 1.0), made("three", 1.4)])
    for other in others:
        assert other.scene.name != other.name
        assert (other.scene.snapshot.position == first.scene.snapshot.position).all()
    arch = read_scene("arch")
    assert designs_of([arch, arch.model_copy(update={"name": "other"})])[1].scene.name == "other"


def test_a_design_is_compared_on_a_page_and_what_is_open_is_said(percussions, tmp_path):
    made("one", 0.8).write(tmp_path)
    text = (tmp_path / "one.toml").read_text(encoding="utf-8")
    (tmp_path / "same.toml").write_text(text, encoding="utf-8")
    done = percussions("report", "one.toml", "same.toml", "--compare", "--seeds", 3)
    assert done.returncode == 0, done.stderr
    assert "same against one: no difference is seen." in done.stdout
    with (tmp_path / "report/differences.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    # the same people in the same room
    assert {row["difference"] for row in rows} == {"0.0"}
    page = (tmp_path / "report/index.html").read_text(encoding="utf-8")
    assert page.count('class="ranges versus"') == len(rows) >= 6
    made("wide", 1.4).write(tmp_path)
    requested = ("--until", "0.000001 N", "--minutes", 0.01)
    done = percussions("report", "one.toml", "wide.toml", "--compare", "--seeds", 3, *requested)
    assert done.returncode == 1
    assert "largest contact force: no number of replicates in" in done.stderr
    assert "Open:" in (tmp_path / "report/index.html").read_text(encoding="utf-8")
