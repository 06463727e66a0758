"""Small problems with several u⁺: `starts` finds all that enumeration of the states finds."""

import numpy as np

from nscd import ContactLaw, Contacts, solve
from tests.crowds import disks_at
from tests.friction.coulomb import Dense, all_answers

# Seeds of problems that enumeration finds several answers of, and of those of which u⁻ is one.
SEEDS = (
    6, 21, 28, 30, 38, 40, 41, 42, 47, 48, 56, 62, 64, 81, 87, 90, 93, 98, 105, 108, 109, 110,
    115, 119, 123, 144, 147, 149, 153, 155, 157, 180, 186, 219, 221, 227, 231, 249, 251, 264,
    272, 288, 290, 301, 310, 312, 313, 331, 333, 336, 366, 372, 378, 381, 405, 409, 410, 421,
    423, 433, 442, 467, 469, 472, 474, 480, 495, 503, 515, 516, 523, 531, 538, 543, 547,
)  # fmt: skip
ADMISSIBLE = (
    14, 34, 51, 68, 69, 74, 79, 106, 112, 154, 165, 291, 296, 345, 348, 422, 486, 537, 539, 574,
    581, 583, 603, 647, 661, 670, 700, 729,
)  # fmt: skip
SAME = 1e-6  # m/s, of speeds about 1


def drawn(seed):
    """A cluster of up to three disks that touches walls, and μ."""
    random = np.random.default_rng(seed)
    n, k = random.integers(1, 4), random.integers(2, 5)
    radius = random.uniform(0.5, 1.5, n)
    way = random.uniform(0.0, 2.0 * np.pi, k)
    normal = np.column_stack([np.cos(way), np.sin(way)])
    position = np.zeros((n, 2))
    walls = np.arange(k) >= n - 1
    first = np.where(walls, random.integers(0, n, k), 0)
    second = np.arange(1, k + 1)
    for c in np.flatnonzero(~walls):
        first[c] = random.integers(0, c + 1)
        reach = radius[first[c]] + radius[second[c]]
        position[second[c]] = position[first[c]] + reach * normal[c]
    snapshot = disks_at(
        position,
        random.normal(size=(n, 2)),
        radius,
        random.uniform(30.0, 120.0, n),
        spin=random.normal(size=n),
    )
    contacts = Contacts(
        first=first,
        second=second,
        is_wall=walls,
        normal=normal,
        gap=np.zeros(k),
        point=position[first] + radius[first, None] * normal,
    )
    return snapshot, contacts, random.choice([0.3, 0.5, 0.8, 1.2, 2.0, 3.0])


def spread_of_all(snapshot, contacts, friction):
    """How far apart the u⁺ of all states of the contacts are (m/s), and whether u⁻ is one."""
    dense = Dense(snapshot, contacts, snapshot.velocity)
    answers, _ = all_answers(dense, np.full(len(contacts), friction))
    scaled = np.array(answers).reshape(len(answers), -1, 3)
    scaled[:, :, 2] *= snapshot.radius
    return np.ptp(scaled, axis=0).max(), bool((dense.N @ dense.left <= 0.0).all())


def test_the_spread_is_that_of_all_answers():
    admissible = 0
    for seed in (*SEEDS, *ADMISSIBLE):
        snapshot, contacts, friction = drawn(seed)
        there, rests = spread_of_all(snapshot, contacts, friction)
        assert there > SAME, seed
        found = solve(
            snapshot, contacts, law=ContactLaw(friction=friction), tolerance=1e-10, starts=5
        )
        assert found.status == "solved"
        assert found.friction.spread > (1.0 - SAME) * there, (seed, rests)
        admissible += rests
    assert admissible == len(ADMISSIBLE)


def test_one_answer_has_no_spread():
    snapshot, contacts, friction = drawn(1)
    there, _ = spread_of_all(snapshot, contacts, friction)
    found = solve(snapshot, contacts, law=ContactLaw(friction=friction), starts=4)
    assert there < SAME
    assert found.friction.spread < SAME
