"""The rigid crowd in motion against closed forms: chains, rebounds, energy, overlap, windows. The
rigid crowd in motion with friction, against closed forms of a solid disk (I = m r²/2)."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscd import Snapshot, Walls, find_contacts
from nscd.stepping import Motion, Push, StepError, WindowSums
from nscd.stepping.arms import neighbours
from nscd.stepping.motion import segments_of
from tests.crowds import disks_at

MASS, SPEED, TAU = 75.0, 2.0, 0.5


def row(n, gap=0.0, velocity=(0.0, 0.0)):
    """n disks of radius 0.25 m along x, the last one `gap` before a wall at x = 0."""
    x = -0.25 - gap - (0.5 + gap) * np.arange(n)[::-1]
    return disks_at(np.column_stack([x, np.zeros(n)]), velocity, mass=MASS)


def wall():
    return Walls(start=[[0.0, -1.0]], end=[[0.0, 1.0]])


def rightwards(position):
    return np.tile([SPEED, 0.0], (len(position), 1))


@pytest.mark.parametrize("step", [1e-3, 1e-2, 2e-2])
@pytest.mark.parametrize("gap", [0.0, 0.05])
def test_a_pressed_row_pushes_each_neighbour_with_the_drive_of_all_behind(step, gap):
    push = Push(desired=rightwards, relaxation_time=TAU)
    motion = Motion(row(10, gap), wall(), step=step, push=push, tolerance=1e-12)
    for _ in range(round(3.0 / step)):
        report = motion.advance()
    neighbours = report.neighbours
    force = np.zeros(10)
    for c, first in enumerate(neighbours.first):
        disk = first if neighbours.second[c] < 0 else min(first, neighbours.second[c])
        force[disk] += report.reaction[c] / step
    assert force == pytest.approx(MASS * SPEED / TAU * np.arange(1, 11), rel=1e-9)
    assert np.abs(motion.velocity).max() < 1e-9
    assert motion.overlap < 1e-12


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 1.0])
def test_two_disks_rebound_with_the_restitution_asked(restitution):
    pair = disks_at([[0.0, 0.0], [0.61, 0.0]], [[2.0, 0.0], [0.0, 0.0]], mass=[75.0, 25.0])
    motion = Motion(pair, step=0.01, restitution=restitution)
    for _ in range(20):
        motion.advance()
    wanted = 75.0 * 2.0 / 100.0 + 2.0 * restitution * np.array([-0.25, 0.75])
    assert motion.velocity[:, 0] == pytest.approx(wanted, abs=1e-9)


def crowd(seed, n=40, speed=2.0):
    """Disks of different sizes on a jittered lattice, in random motion."""
    random = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(n)))
    lattice = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)[:n]
    anchor = 0.6 * lattice + random.uniform(-0.05, 0.05, (n, 2))
    velocity, radius = random.normal(0.0, speed, (n, 2)), random.uniform(0.15, 0.24, n)
    return disks_at(anchor, velocity, radius, random.uniform(50.0, 100.0, n))


def box(low, high):
    corners = np.array([[low, low], [high, low], [high, high], [low, high]])
    return Walls(start=corners, end=np.roll(corners, -1, axis=0))


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    step=st.sampled_from([1e-3, 5e-3, 2e-2]),
    restitution=st.sampled_from([0.0, 0.5]),
    pull=st.sampled_from([(0.0, 0.0), (1.5, -9.81)]),
)
def test_no_overlap_and_no_energy_gained(seed, step, restitution, pull):
    def energy():
        speed2, height = (motion.velocity**2).sum(1), -motion.position @ pull
        return float(motion.mass @ (0.5 * speed2 + height))

    push = Push(acceleration=pull)
    motion = Motion(crowd(seed), box(-0.6, 4.2), step=step, restitution=restitution, push=push)
    before = energy()
    for _ in range(60):
        motion.advance()
        now = energy()
        assert now <= before + 1e-9 * abs(before)
        before = now
    assert motion.overlap <= 1e-9


@pytest.mark.parametrize("step", [5e-3, 0.02])
def test_free_flight_is_a_parabola(step):
    """Of disks close to each other too, and of one that slides on a slope: x₀ + u T + g T²/2."""
    pull = np.array([3.0, -9.81])
    start = np.array([[0.0, 30.0], [0.3, 30.42], [0.0, 0.25]])
    velocity = np.array([[1.0, 2.0], [1.0, 2.0], [-1.0, 0.0]])
    three = Snapshot(position=start, velocity=velocity, radius=[0.25] * 3, mass=[75.0] * 3)
    floor = Walls(start=[[-100.0, 0.0]], end=[[100.0, 0.0]])
    motion = Motion(three, floor, step=step, push=Push(acceleration=(3.0, -9.81)))
    for _ in range(round(1.0 / step)):
        done = motion.advance()
    goes = np.array([pull, pull, [3.0, 0.0]])
    np.testing.assert_allclose(motion.position, start + velocity + 0.5 * goes, rtol=0, atol=1e-10)
    np.testing.assert_allclose(motion.velocity, velocity + goes, rtol=0, atol=1e-10)
    assert done.reaction.max() == pytest.approx(75.0 * 9.81 * step, rel=1e-9)


@pytest.mark.parametrize(
    ("where", "contacts"),
    [((-0.3, -0.3), 1), ((0.3, -0.3), 1), ((0.3, 0.3), 2), ((-0.3, 0.2), 1), ((2.0, 0.3), 1)],
)
def test_a_corner_of_walls_is_one_contact_from_outside_and_two_from_inside(where, contacts):
    # an L of two walls that meet at the origin: along x > 0 and along y > 0, and on along x
    walls = Walls(start=[[0, 0], [0, 0], [2, 0]], end=[[2, 0], [0, 2], [4, 0]])
    reachable = neighbours(np.array([where]), np.array([0.25]), segments_of(walls), 0.3)
    assert len(reachable.gap) == contacts


def test_windows_add_up_to_the_momentum_that_the_wall_took():
    motion = Motion(row(5, 0.1, (2.0, 0.0)), wall(), step=5e-3)
    sums = WindowSums(5)
    for _ in range(200):
        report = motion.advance()
        sums.add(report.neighbours, report.reaction)
    window = sums.close(motion.time)
    assert window.duration == pytest.approx(1.0)
    assert window.impulse[window.is_wall].sum(0) == pytest.approx([5 * MASS * 2.0, 0.0])
    assert len(window.first) == 5
    assert sums.close(motion.time).duration == 0.0


def test_overlapping_disks_are_pushed_apart_and_stay_apart():
    snapshot = disks_at([[0.0, 0.0], [0.4, 0.1], [0.7, -0.1]], mass=[50.0, 75.0, 100.0])
    motion = Motion(snapshot, step=5e-3)
    assert motion.overlap > 0.08
    moved = motion.separate()
    assert 0.05 < moved < 0.2
    assert motion.overlap < 1e-12
    # nobody pushes from outside, so the centre of mass stays
    assert snapshot.mass @ (motion.position - snapshot.position) == pytest.approx(0.0, abs=1e-9)
    motion.advance()
    assert np.abs(motion.velocity).max() < 1e-9


def test_disks_that_do_not_fit_are_refused():
    snapshot = Snapshot(position=[[0.0, 0.0]], velocity=[[0, 0]], radius=[0.3], mass=[75])
    slot = Walls(start=[[-1, -0.25], [-1, 0.25]], end=[[1, -0.25], [1, 0.25]])
    with pytest.raises(StepError, match="do not fit"):
        Motion(snapshot, slot, step=5e-3).separate()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("step", 0.0), ("step", np.nan), ("restitution", 1.5), ("tolerance", 0.0),
        ("friction", -0.1), ("friction", np.nan),
    ],
)  # fmt: skip
def test_nonsense_is_refused_by_name(field, value):
    with pytest.raises(ValueError, match=field):
        Motion(row(2), **{"step": 5e-3} | {field: value})


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), margin=st.sampled_from([0.0, 0.02, 0.3]))
def test_neighbours_are_those_of_the_contact_search(seed, margin):
    snapshot, walls = crowd(seed), box(-0.3, 4.0)
    disks = np.array(snapshot.position), np.array(snapshot.radius)
    reachable = neighbours(*disks, segments_of(walls), margin)
    contacts = find_contacts(snapshot, walls, tolerance=margin)
    every = contacts.first, contacts.second, contacts.is_wall, contacts.gap
    searched = {(a, b, wall): gap for a, b, wall, gap in zip(*every, strict=True)}
    pairs = {key[:2] for key in searched if not key[2]}
    assert pairs == set(zip(reachable.first[reachable.wall < 0], reachable.second[reachable.wall < 0], strict=True))
    for a, wall, gap in zip(reachable.first, reachable.wall, reachable.gap, strict=True):
        assert wall < 0 or searched[a, wall, True] == pytest.approx(gap)


RADIUS, GRAVITY = 0.25, 9.81


def disk(speed=0.0):
    """A disk at rest on the floor y = 0, or sliding along it without spin."""
    return Snapshot(position=[[0, RADIUS]], velocity=[[speed, 0]], radius=[RADIUS], mass=[75])


def floor():
    return Walls(start=[[-100.0, 0.0]], end=[[100.0, 0.0]])


@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_a_sliding_disk_comes_to_roll_at_two_thirds_of_its_speed(friction):
    speed = 2.0
    rolls_at = speed / (3 * friction * GRAVITY)
    step = rolls_at / 50
    push = Push(acceleration=(0.0, -GRAVITY))
    motion = Motion(disk(speed), floor(), step=step, friction=friction, push=push)
    for _ in range(25):
        motion.advance()
    assert motion.velocity[0, 0] == pytest.approx(speed - friction * GRAVITY * 25 * step, rel=1e-6)
    for _ in range(50):
        motion.advance()
    assert motion.velocity[0, 0] == pytest.approx(2 / 3 * speed, rel=1e-6)
    assert motion.spin[0] == pytest.approx(-motion.velocity[0, 0] / RADIUS, rel=1e-6)


@pytest.mark.parametrize(("slope", "friction"), [(0.3, 0.2), (0.3, 0.05), (0.8, 0.3)])
def test_a_disk_on_an_incline_rolls_or_slides(slope, friction):
    pull = GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope)
    motion = Motion(disk(), floor(), step=2e-3, friction=friction, push=Push(acceleration=pull))
    for _ in range(200):
        report = motion.advance()
    rolls = np.tan(slope) <= 3 * friction
    gained = 2 / 3 * pull[0] if rolls else pull[0] + friction * pull[1]
    assert motion.velocity[0, 0] == pytest.approx(gained * motion.time, rel=1e-6)
    assert report.reaction[0] == pytest.approx(-75 * pull[1] * 2e-3, rel=1e-6)
    assert abs(report.friction[0]) <= friction * report.reaction[0] * (1 + 1e-6)


def test_momentum_and_spin_of_a_rubbing_pair_are_kept():
    """Two disks that graze: the impulse that turns both is what their windows say."""
    pair = disks_at([[0, 0], [0.55, 0.2]], [[2, 0], [0, 0]], [0.25, 0.3], [70, 90])
    motion, sums = Motion(pair, step=5e-3, friction=0.4), WindowSums(2)
    for _ in range(60):
        done = motion.advance()
        sums.add(done.neighbours, done.reaction, done.friction)
    window = sums.close(motion.time)
    momentum = motion.mass[:, None] * (motion.velocity - pair.velocity)
    assert window.impulse.sum(0) == pytest.approx(momentum[1], rel=1e-6)
    assert momentum.sum(0) == pytest.approx([0, 0], abs=1e-6)
    # Coulomb: the pair slides, and both turn the same way
    assert motion.spin[0] * motion.spin[1] > 0
    inertia = 0.5 * pair.mass * pair.radius**2
    turned = inertia * motion.spin / pair.radius
    assert turned[0] == pytest.approx(turned[1], rel=1e-6)
    energy = 0.5 * (pair.mass @ (motion.velocity**2).sum(1) + inertia @ motion.spin**2)
    assert energy < 0.5 * 70 * 4


@pytest.mark.parametrize("push", [{"acceleration": (0, np.inf)}, {"desired": len}])
def test_a_push_without_end_is_named(push):
    with pytest.raises(ValueError, match=r"acceleration|relaxation_time"):
        Push(**push)


def rubbing_pair(step=8e-3, unsolved=()):
    """A disk that slides into one that lies on the floor; no solver solves the steps, halves and
    quarters of these numbers."""
    pair = disks_at([[0, RADIUS], [0.51, RADIUS]], [[2.0, 0], [0, 0]], RADIUS)
    tried = itertools.count(1)

    def still(position):
        motion._core.stalled = -1.0 if next(tried) in unsolved else 10.0
        return np.zeros_like(position)

    push = Push(desired=still, relaxation_time=0.5, acceleration=(0.0, -GRAVITY))
    return (motion := Motion(pair, floor(), step=step, friction=0.3, push=push))


def test_a_step_that_is_not_solved_is_made_in_halves():
    """Neither the whole nor its halves are solved: it is made in quarters."""
    full, fine = rubbing_pair(unsolved=(1, 2, 5)), rubbing_pair(2e-3)
    sums = [fine.advance().reaction.sum() for _ in range(4)]
    report = full.advance()
    for name in ("position", "velocity", "spin"):
        np.testing.assert_array_equal(getattr(full, name), getattr(fine, name))
    assert report.reaction.sum() == pytest.approx(sum(sums), rel=1e-14)
    assert len(report.neighbours.first) == len(report.reaction) == len(report.friction)
    assert abs(report.energy.error) < 1e-12 < report.energy.friction.sum()
    assert (full.step, full.time) == (8e-3, pytest.approx(8e-3))


def test_a_step_that_no_half_solves_leaves_the_state():
    motion = rubbing_pair(unsolved=range(2, 99))
    motion.advance()
    state = motion.position.copy(), motion.velocity.copy(), motion.spin.copy(), motion.time
    with pytest.raises(StepError, match=r"t = 0.008 s: the contacts are not solved"):
        motion.advance()
    for now, before in zip((motion.position, motion.velocity, motion.spin), state, strict=False):
        np.testing.assert_array_equal(now, before)
    assert (motion.time, motion.step) == (state[3], 8e-3)


@pytest.mark.parametrize("aside", [0.0, 0.1])
def test_who_is_as_wide_as_a_passage_walks_through_it(aside):
    """Nearer and nearer to its mouth the percussions that hold back would grow without bound."""
    corners = np.array([[0, -1], [0, -0.25], [2, -0.25], [2, 0.25], [0, 0.25], [0, 1]])
    walls = Walls(start=corners[[0, 1, 3, 4]], end=corners[[1, 2, 4, 5]])

    def through(position):
        way = [0.5, 0.0] - position if position[0, 0] < 0 else np.array([[1.0, 0.0]])
        return SPEED * way / np.hypot(*way.T)

    push = Push(desired=through, relaxation_time=TAU)
    motion = Motion(disks_at([[-0.6, aside]]), walls, step=5e-3, push=push)
    for _ in range(400):
        motion.advance()
    assert 1.0 < motion.position[0, 0] < 2.0
    assert motion.overlap < 1e-8


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("half", [0.2, 0.24, 0.2499, 0.24999])
def test_a_disk_that_rebounds_in_a_narrow_mouth_gains_no_energy(half, mu):
    # one jaw asks for a rebound that the other allows only upwards, the faster the steeper it is
    mouth = Walls(start=[[-half, 0], [half, 0]], end=[[-3, 0], [3, 0]])
    disk = disks_at([[0.0, np.sqrt(0.25**2 - half**2)]], [[-1.0, 0.0]], [0.25], [80.0])
    motion = Motion(disk, mouth, step=1e-3, restitution=0.5, friction=mu)
    for _ in range(20):
        assert motion.advance().residual <= 1e-8
        assert (motion.velocity**2).sum() + 0.5 * (0.25 * motion.spin[0]) ** 2 <= 1.0
    assert motion.overlap <= 1e-12


def to_the_corner(position):
    return -SPEED * position / np.linalg.norm(position, axis=1)[:, None]


def pressed(start, threads=1):
    """A crowd that goes to a corner of walls."""
    push = Push(desired=to_the_corner, relaxation_time=TAU)
    motion = Motion(start, box(-0.5, 200.0), step=0.01, push=push, tolerance=1e-10)
    motion.threads = threads
    return motion


def compressed(n):
    """It after some steps, in which most come to press."""
    loose = crowd(3, n, 0.5)
    motion = pressed(dataclasses.replace(loose, position=0.64 * loose.position), threads=2)
    motion.separate()
    for _ in range(4):
        motion.advance()
    return motion.snapshot()


def test_steps_that_keep_what_they_know_are_those_of_who_knows_nothing():
    """λ is held against its law alone: u⁺ from it, and from that the gaps."""
    start = compressed(2500)
    motion = pressed(start)
    mass = start.mass * (1 + motion.step / TAU)
    for _ in range(8):
        before = motion.snapshot()
        wanted = to_the_corner(before.position)
        free = (before.velocity + motion.step / TAU * wanted) / (1 + motion.step / TAU)
        anew, report = pressed(before), motion.advance()
        anew.advance()
        np.testing.assert_allclose(motion.velocity, anew.velocity, rtol=0, atol=1e-9 * SPEED)
        of, inverse, moved = report.neighbours, 1 / mass, free.copy()
        pushes = report.reaction[:, None] * of.normal
        pair = of.second >= 0
        np.subtract.at(moved, of.first, pushes * inverse[of.first, None])
        np.add.at(moved, of.second[pair], (pushes * inverse[of.second, None])[pair])
        closing = np.sum(of.normal * (moved[of.first] - pair[:, None] * moved[of.second]), axis=1)
        push = report.reaction * (inverse[of.first] + pair * inverse[of.second])
        residual = np.abs(np.minimum(push, of.gap / motion.step - closing)).max()
        assert residual <= 1e-9 * np.abs(free).max()
        assert np.count_nonzero(report.reaction) > 2000


def test_threads_change_no_bit():
    start = compressed(12_000)
    motions = [pressed(start, threads=threads) for threads in (1, 2, 3)]
    for motion in motions:
        assert max(motion.advance().iterations for _ in range(2)) > 1
    for other in motions[1:]:
        for name in ("position", "velocity"):
            np.testing.assert_array_equal(getattr(other, name), getattr(motions[0], name))
    with pytest.raises(ValueError, match=r"threads: 0\. 1 or more"):
        pressed(start, threads=0).advance()
