"""People who keep their distance: what they want, from closed forms and symmetries."""

import numpy as np
import pytest

from analysis.scene import SceneError
from analysis.scene.drive import Drive
from nscd import Walls

SPEED, GAP_S, RADIUS = 1.4, 0.8, 0.2
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def drive(walls=None, **keys):
    door = {"door_start_m": (0, -1), "door_end_m": (0, 1), "outward": (1, 0)}
    arguments = {
        "speed_m_per_s": SPEED,
        "relaxation_time_s": 0.5,
        "time_gap_s": GAP_S,
        "push_share": 0.0,
    }
    made = Drive.model_validate(door | arguments | keys)
    ends = np.array([] if walls is None else walls, dtype=float).reshape(-1, 4)
    return made.routed(Walls(start=ends[:, :2], end=ends[:, 2:]), RADIUS)


def wanted(of, *arguments, time=0.0, ids=None):
    position = np.array(arguments, dtype=float)
    who = np.arange(1, 1 + len(position)) if ids is None else ids
    return of.desired_velocity(position, who, time, np.full(len(position), RADIUS))


def test_somebody_alone_walks_as_fast_as_wished_to_a_place_clear_of_the_posts():
    assert wanted(drive(), (-3, 0)) == pytest.approx(np.array([[SPEED, 0]]), abs=1e-15)
    to_post = np.array([3.0 - 1.2, 0.8 - 2.0]) / np.hypot(1.8, 1.2)
    assert wanted(drive(), (-3, 2)) == pytest.approx(SPEED * to_post[None], rel=1e-14)
    assert wanted(drive(), (0.5, 0.9))[0].tolist() == [SPEED, 0]


@pytest.mark.parametrize("gap", [0.0, 0.05, 0.3, 1.0, 3.0])
def test_the_one_behind_keeps_the_time_gap_and_the_first_walks(gap):
    behind, first = wanted(drive(), (-3 - 2 * RADIUS - gap, 0), (-3, 0))
    repulsion = 5 * np.exp(-gap / 0.1)
    forward = min(SPEED, gap / GAP_S) * (repulsion < 1)
    assert behind == pytest.approx([forward, 0], abs=1e-13)
    assert first.tolist() == [SPEED, 0]


def test_two_abreast_before_a_door_both_walk_and_turn_apart():
    gap = 0.15
    both = wanted(drive(), (-1, RADIUS + gap / 2), (-1, -RADIUS - gap / 2))
    side = 5 * np.exp(-gap / 0.1)
    along = 1 / np.hypot(1, side)
    expected = SPEED * along * np.array([along, along * side])
    assert both == pytest.approx(np.stack([expected, expected * [1, -1]]), rel=1e-12)


def test_a_wall_turns_nobody_back_and_hides_who_is_behind_it():
    wall = (-2.0, -5.0, -2.0, 5.0)
    before, behind = (-2.5, 0), (-2.5 + 2 * RADIUS + 0.15, 0)
    assert wanted(drive(), before, behind)[0, 0] < 0.15 / GAP_S + 1e-12
    assert wanted(drive([wall]), before, behind)[0] == pytest.approx([0.3 / GAP_S, 0], abs=1e-13)
    corridor = drive([(-5, 0.25, 5, 0.25)])
    along, away = wanted(corridor, (-3, 0))[0]
    assert along > 0 > away


def test_a_push_of_one_is_todays_drive_to_the_last_bit_and_shares_mix_both():
    crowd = np.random.default_rng(1).uniform((-4, -2), (0.5, 2), (40, 2))
    today = drive(time_gap_s=None, push_share=1.0)
    for_ever, never, half = (wanted(drive(push_share=p), *crowd) for p in (1.0, 0.0, 0.5))
    pushing = today.desired_velocity(crowd, np.arange(1, 41))
    assert np.array_equal(for_ever, pushing)
    assert half == pytest.approx((never + pushing) / 2, abs=1e-14)
    some = drive(pushers=[{"people": (3, 5), "push_share": 1.0}])
    mixed = wanted(some, *crowd)
    assert np.array_equal(mixed[2:5], pushing[2:5])
    assert np.array_equal(mixed[6:], never[6:])
    fraction = drive(push_share=0.4, pushing_people=0.3).push_shares(np.arange(2000))
    assert set(fraction) == {0.0, 0.4}
    assert np.mean(fraction > 0) == pytest.approx(0.3, abs=0.04)


def test_the_law_knows_no_direction_of_its_own_and_no_one_out_of_reach():
    crowd = np.random.default_rng(2).uniform((-4, -2), (0.5, 2), (60, 2))
    walls = np.array([[-6, -3, 0, -1], [0, 1, -6, 3], [-2, -0.2, -1.5, 0.2]])
    here = wanted(drive(walls), *crowd)
    turned = {key: tuple(TURN @ at) for key, at in
              {"door_start_m": (0, -1), "door_end_m": (0, 1), "outward": (1, 0)}.items()}  # fmt: skip
    of = drive((walls.reshape(-1, 2) @ TURN.T).reshape(-1, 4), **turned)
    assert wanted(of, *(crowd @ TURN.T)) == pytest.approx(here @ TURN.T, abs=1e-12)
    far = wanted(drive(walls), *crowd, (-40, 0), (30, 5))
    assert np.array_equal(far[:60], here)


BACK = {"people": (2, 2), "door_start_m": (-9, -1), "door_end_m": (-9, 1), "outward": (-1, 0)}


@pytest.mark.parametrize(
    ("gap", "off", "speeds"),
    [(0.5, 0.0, ()), (0.5, 0.3, ()), (0.5, -0.3, ()), (2.4, 0.1, ()), (2.999, 0.0, ()),
     (3.01, 0.0, ()), (1.0, 1.01, ()), (0.1, 0.4, (0.1 / GAP_S, 0.2 / GAP_S))],
)  # fmt: skip
def test_who_sees_people_come_keeps_to_the_right_and_the_longer_way_waits(gap, off, speeds):
    distance = np.sqrt((2 * RADIUS + gap) ** 2 - off**2)
    positions = (-5, off / 2), (-5 + distance, -off / 2)
    both = wanted(drive(goals=[BACK]), *positions)
    right = 2 * (1 - gap / 3) if gap < 3 and abs(off) < 1 else 0.0
    expected = np.array([[1, -right], [-1, right]]) / np.hypot(1, right)
    assert both == pytest.approx(expected * np.reshape(speeds or [SPEED] * 2, (2, 1)), rel=1e-12)
    between = drive([(-4.9, -3, -4.9, 3)], goals=[BACK])  # a wall that hides them from each other
    alone = [wanted(between, index, ids=np.array([k + 1]))[0] for k, index in enumerate(positions)]
    assert wanted(between, *positions) == pytest.approx(np.array(alone), abs=1e-13)


@pytest.mark.parametrize("side", [6.0, 2.5, 1.4])
@pytest.mark.parametrize("keys", [{}, {"goals": [BACK | {"people": (60, 120)}]},
                                  {"stops": [{"people": (1, 30), "time_s": 1.0}]}])  # fmt: skip
def test_what_somebody_wants_is_to_the_last_bit_what_those_within_reach_make_of_it(side, keys):
    random = np.random.default_rng(7)
    position = random.uniform((-side, -side / 2), (0.3, side / 2), (180, 2))
    position[3, 0], position[5] = position[2, 0], (40.0, -900.0)
    of = drive([(0, -4, 0, -1), (0, 1, 0, 4), (-0.8, 0.1, -0.5, 0.2)], jostling_m_per_s=0.1, **keys)
    ids, radius = np.arange(1, 181), random.uniform(0.1, 0.3, 180)
    of_all = of.desired_velocity(position, ids, 2.0, radius)
    for one in range(0, len(ids), 7):
        near = np.hypot(*(position - position[one]).T) < 3.7
        of_near = of.desired_velocity(position[near], ids[near], 2.0, radius[near])
        assert np.array_equal(of_near[near[:one].sum()], of_all[one])


def test_many_who_come_turn_nobody_by_more_than_two_of_the_way():
    crowd = [(-5, 0), *((-5 + 0.9 + 0.5 * k, 0.0) for k in range(4))]
    first = wanted(drive(goals=[BACK | {"people": (2, 5)}]), *crowd)[0]
    assert first == pytest.approx(SPEED * np.array([1, -2]) / np.sqrt(5), rel=1e-12)


def test_headings_have_their_spread_and_are_held_by_everybody_from_another_instant_on():
    of, positions = (
        drive(heading_sd_rad=0.2, heading_hold_s=0.5, seed=3),
        [(-3 - 5 * k, 0) for k in range(400)],
    )
    ids = np.arange(7, 407)
    angles = np.array(
        [
            np.arctan2(*wanted(of, *positions, time=t, ids=ids)[:, ::-1].T)
            for t in np.arange(0, 3, 0.05)
        ]
    )
    assert angles.mean() == pytest.approx(0, abs=0.02)
    assert angles.std() == pytest.approx(0.2, rel=0.05)
    changes = (np.diff(angles, axis=0) != 0).mean()
    assert changes == pytest.approx(0.05 / 0.5, rel=0.05)
    one = wanted(of, positions[9], time=0.7, ids=ids[9:10])
    assert np.array_equal(one, wanted(of, *positions, time=0.7, ids=ids)[9:10])


def test_jostling_has_its_size_length_and_period_and_ends_at_the_door():
    of = drive(
        jostling_m_per_s=0.06, jostling_length_m=0.9, jostling_period_s=3.0, push_share=1.0, seed=5
    )
    grid = np.stack(np.meshgrid(-np.arange(1, 60, 0.9), np.arange(-30, 30, 0.9)), -1).reshape(-1, 2)
    added, further, later = (
        wanted(of, *(grid + by), time=t) - wanted(drive(push_share=1.0), *(grid + by))
        for by, t in ((0.0, 0.0), ((0.0, 0.9), 0.0), (0.0, 3.0 / (2 * np.pi)))
    )
    assert added.std() == pytest.approx(0.06, rel=0.1)
    # of Gaussian waves: exp(−½) after a length, and after a period over 2π
    for other in (further, later):
        assert (added * other).mean() / added.var() == pytest.approx(np.exp(-0.5), abs=0.12)
    assert wanted(of, (0.2, 0.0))[0].tolist() == [SPEED, 0]


@pytest.mark.parametrize(
    ("keys", "message"),
    [({"push_share": 1.2}, "push_share"), ({"time_gap_s": 0.0}, "time_gap_s"),
     ({"time_gap_s": None, "push_share": 0.3}, "Give time_gap_s"), ({"heading_hold_s": 0}, "heading_hold_s"),
     ({"pushers": [{"people": (1, 3), "push_share": 0}, {"people": (3, 4), "push_share": 1}]}, "person 3 has two")],
)  # fmt: skip
def test_bad_keys_are_refused_by_name(keys, message):
    with pytest.raises((SceneError, ValueError), match=message):
        drive(**keys)


def test_who_is_where_and_when_must_be_known():
    with pytest.raises(ValueError, match="radii"):
        drive().desired_velocity(np.zeros((1, 2)), np.array([1]))
    with pytest.raises(ValueError, match="time of the frame"):
        wanted(drive(jostling_m_per_s=0.1), (-1, 0), time=np.nan)
