"""The rigid crowd in motion with friction, against closed forms of a solid disk (I = m r²/2)."""

import numpy as np
import pytest

import nscd.friction
from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push, StepError, WindowSums
from tests.crowds import disks_at

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
    motion = Motion(
        disk(speed), floor(), step=step, friction=friction, push=Push(acceleration=(0.0, -GRAVITY))
    )
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


@pytest.mark.parametrize(("field", "value"), [("friction", -0.1), ("friction", np.nan)])
def test_nonsense_is_named(field, value):
    with pytest.raises(ValueError, match=field):
        Motion(disk(), floor(), step=1e-3, **{field: value})


@pytest.mark.parametrize("push", [{"acceleration": (0, np.inf)}, {"desired": len}])
def test_a_push_without_end_is_named(push):
    with pytest.raises(ValueError, match=r"acceleration|relaxation_time"):
        Push(**push)


def rubbing_pair():
    """A disk that slides into one that lies on the floor."""
    pair = disks_at([[0, RADIUS], [0.51, RADIUS]], [[2.0, 0], [0, 0]], RADIUS)
    gravity = Push(acceleration=(0.0, -GRAVITY))
    return Motion(pair, floor(), step=8e-3, friction=0.3, push=gravity)


def failing(monkeypatch, motion, longest):
    """Let no solver solve a step that is longer."""
    solve = nscd.friction.solve_step

    def pretended(*given):
        found = solve(*given)
        return found._replace(error=1.0) if motion.step > longest else found

    monkeypatch.setattr(nscd.friction, "solve_step", pretended)


def test_a_step_that_is_not_solved_is_made_in_halves(monkeypatch):
    whole, fine = rubbing_pair(), rubbing_pair()
    fine.step, fine._gain = 2e-3, whole._gain / 4
    sums = [fine.advance().reaction.sum() for _ in range(4)]
    failing(monkeypatch, whole, 2e-3)
    report = whole.advance()
    for name in ("position", "velocity", "spin"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(fine, name))
    assert report.reaction.sum() == pytest.approx(sum(sums), rel=1e-14)
    assert len(report.neighbours.first) == len(report.reaction) == len(report.friction)
    assert (whole.step, whole.time) == (8e-3, pytest.approx(8e-3))


def test_a_step_that_no_half_solves_leaves_the_state(monkeypatch):
    motion = rubbing_pair()
    motion.advance()
    failing(monkeypatch, motion, 0.0)
    state = motion.position.copy(), motion.velocity.copy(), motion.spin.copy(), motion.time
    with pytest.raises(StepError, match="not solved"):
        motion.advance()
    for now, before in zip((motion.position, motion.velocity, motion.spin), state, strict=False):
        np.testing.assert_array_equal(now, before)
    assert (motion.time, motion.step) == (state[3], 8e-3)
