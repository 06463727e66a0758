"""Small problems with several u⁺: `starts` finds all that enumeration of the states finds.
Admissible intervals with friction against closed forms, and their dimension against a dense
rank."""

import numpy as np
import pytest

from nscd import ContactLaw, Contacts, Walls, find_contacts, solve
from nscd.indeterminacy.determinacy import determinacy_of
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import Intervals, weights_of_contacts
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
    velocity, mass = random.normal(size=(n, 2)), random.uniform(30.0, 120.0, n)
    snapshot = disks_at(position, velocity, radius, mass, spin=random.normal(size=n))
    location = {"normal": normal, "point": position[first] + radius[first, None] * normal}
    contacts = Contacts(first=first, second=second, is_wall=walls, gap=np.zeros(k), **location)
    return snapshot, contacts, random.choice([0.3, 0.5, 0.8, 1.2, 2.0, 3.0])


def spread_of_all(snapshot, contacts, friction):
    """How far apart the u⁺ of all states of the contacts are (m/s), and whether u⁻ is one."""
    dense = Dense(snapshot, contacts, snapshot.velocity)
    solutions, _ = all_answers(dense, np.full(len(contacts), friction))
    scaled = np.array(solutions).reshape(len(solutions), -1, 3)
    scaled[:, :, 2] *= snapshot.radius
    return np.ptp(scaled, axis=0).max(), bool((dense.N @ dense.left <= 0.0).all())


def test_the_spread_is_that_of_all_answers():
    admissible = 0
    for seed in (*SEEDS, *ADMISSIBLE):
        snapshot, contacts, friction = drawn(seed)
        there, rests = spread_of_all(snapshot, contacts, friction)
        assert there > SAME, seed
        law = ContactLaw(friction=friction)
        found = solve(snapshot, contacts, law=law, tolerance=1e-10, starts=5)
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


def disk_in_a_wedge(alpha):
    """A disk of 75 kg that falls at 1 m/s into a wedge whose walls it touches at α from below."""
    normal = np.array([[np.sin(alpha), -np.cos(alpha)], [-np.sin(alpha), -np.cos(alpha)]])
    walls = {"first": [0, 0], "second": [0, 1], "is_wall": [True, True], "gap": [0, 0]}
    return disks_at([[0.0, 0.0]], [0.0, -1.0], 1.0), Contacts(**walls, normal=normal, point=normal)


def ends_of(constrained, row, **which):
    found = Intervals(constrained).of(weights_of_contacts(constrained.contacts, row), **which)
    return found.lower, found.upper


@pytest.mark.parametrize(("degrees", "mu"), [(40.0, 0.3), (60.0, 0.2), (60.0, 1.0)])
def test_the_walls_of_a_wedge_press_harder_where_friction_holds_against_them(degrees, mu):
    alpha = np.radians(degrees)
    snapshot, contacts = disk_in_a_wedge(alpha)
    solution = solve(snapshot, contacts, law=ContactLaw(friction=mu), tolerance=1e-12)
    equilibrium = Equilibrium.with_friction(contacts, solution)
    # λ cos α − T sin α = ½ m u with |T| ≤ μλ
    ends = [37.5 / (np.cos(alpha) + way * mu * np.sin(alpha)) for way in (1.0, -1.0)]
    locked = mu >= 1 / np.tan(alpha)
    largest = np.inf if locked else ends[1]
    for row in (0, 1):
        assert ends_of(equilibrium, row) == pytest.approx((ends[0], largest), rel=1e-7)
    if not locked:
        one, other = (ends_of(equilibrium, row, tangential=True) for row in (0, 1))
        assert sorted(np.abs(one)) == pytest.approx(sorted(mu * np.array(ends)), rel=1e-7)
        assert np.sign(one[0]) == -np.sign(one[1])
        assert other == pytest.approx((-one[1], -one[0]), rel=1e-7)
    found = determinacy_of(equilibrium)
    assert (found.rank, found.redundant) == (3, 1)
    assert not found.normal.any()
    assert not found.tangential.any()


def test_a_disk_that_slides_is_determined():
    snapshot, contacts = disk_in_a_wedge(np.radians(40.0))
    one = contacts.select([0])
    solution = solve(snapshot, one, law=ContactLaw(friction=0.05), tolerance=1e-12)
    equilibrium = Equilibrium.with_friction(one, solution)
    found = determinacy_of(equilibrium)
    assert (found.rank, found.redundant) == (1, 0)
    assert found.normal.all()
    assert found.tangential.all()
    assert ends_of(equilibrium, 0) == (solution.reaction[0], solution.reaction[0])


def test_the_dimension_is_that_of_the_dense_null_space_of_a_pile_that_sticks():
    rows = 4
    positions = [(2.0 * i + j, 1.0 + np.sqrt(3.0) * j) for j in range(rows) for i in range(rows - j)]
    snapshot = disks_at(positions, [0.0, -1.0], 1.0, 1.0)
    floor = Walls(start=[[-9.0, 0.0]], end=[[19.0, 0.0]])
    contacts = find_contacts(snapshot, floor, tolerance=1e-9)
    solution = solve(snapshot, contacts, law=ContactLaw(friction=0.5), tolerance=1e-12)
    assert np.abs(solution.right_velocity).max() < 1e-12  # all stick
    dense = Dense(snapshot, contacts, snapshot.velocity)
    rank = np.linalg.matrix_rank(np.vstack([dense.N, dense.T]))
    equilibrium = Equilibrium.with_friction(contacts, solution)
    found = determinacy_of(equilibrium)
    assert found.rank == rank
    assert found.redundant == 2 * len(contacts) - rank > 0
    for row in (0, len(contacts) - 1):
        lower, upper = ends_of(equilibrium, row)
        assert lower - 1e-9 <= solution.reaction[row] <= upper + 1e-9


def test_what_the_intervals_are_not_for_is_refused():
    snapshot, contacts = disk_in_a_wedge(0.7)
    smooth = solve(snapshot, contacts)
    frictional = solve(snapshot, contacts, law=ContactLaw(friction=0.1))
    soft = solve(snapshot, contacts, law=ContactLaw(friction=0.1, restitution=0.5))
    for solution in (smooth, soft):
        with pytest.raises(ValueError, match=r"^solution:"):
            Equilibrium.with_friction(contacts, solution)
    with pytest.raises(ValueError, match=r"^solution: it has friction"):
        Equilibrium.of(contacts, frictional)
