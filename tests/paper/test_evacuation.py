"""The evacuation by the social force model: its steps against the model's own forces, and rest."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.pages.words import Words
from analysis.paper.discrete import fig6_rivals
from analysis.paper.discrete.fig6_rivals import (
    EVACUATED_KG,
    GONE_M,
    REACH_M,
    STEP_S,
    TIME_S,
    advance,
    evacuate,
    gap_that_carries,
    placed,
    room,
)
from nscd import Walls, find_contacts
from nscd.rivals import SocialForceLaw, social_force
from tests.crowds import disks_at

WORDS = Words("analysis.paper.discrete.fig6_rivals")


def test_a_step_is_that_of_the_models_forces():
    """m Δu/Δt = m (u_d − u)/τ + Σ of the forces that `social_force` gives, overlaps, friction and
    walls included; who is far beyond the exit pushes nobody."""
    walls, drive = room()
    drive = drive.model_copy(update={"speed_m_per_s": 1.5})
    random = np.random.default_rng(0)
    crowd = placed(40, 1)
    crowd = replace(
        crowd,
        position=crowd.position * 0.35 - [0.02, 0.0],
        velocity=random.normal(0, 1, (40, 2)),
    )
    assert find_contacts(crowd, tolerance=0.0).gap.min() < -0.05
    gone = np.vstack([crowd.position, [GONE_M + 0.1, 0.0]])
    crowd = disks_at(
        gone,
        np.vstack([crowd.velocity, [1.5, 0.0]]),
        np.append(crowd.radius, 0.3),
        np.append(crowd.mass, EVACUATED_KG),
    )
    moved = advance(crowd, walls, drive, 1)
    inside = replace(
        crowd,
        position=gone[:-1],
        velocity=crowd.velocity[:-1],
        radius=crowd.radius[:-1],
        mass=crowd.mass[:-1],
        ids=crowd.ids[:-1],
        spin=crowd.spin[:-1],
    )
    forces = social_force(inside, find_contacts(inside, walls, tolerance=REACH_M)).resultant()
    wish = (drive.desired_velocity(inside.position) - inside.velocity) / TIME_S
    velocity = inside.velocity + STEP_S * (wish + forces / EVACUATED_KG)
    np.testing.assert_allclose(moved.velocity[:-1], velocity, atol=1e-10)
    np.testing.assert_allclose(moved.position[:-1], gone[:-1] + STEP_S * velocity, atol=1e-10)
    np.testing.assert_allclose(moved.velocity[-1], [1.5, 0.0], atol=1e-12)


@pytest.mark.parametrize("speed", [1.0, 14.0])
def test_one_person_before_a_closed_door_stands_where_the_forces_balance(speed):
    """A exp(−g/B) + ϱ max(−g, 0) = m u_d/τ: a gap of 0.2 m at 1 m/s, an overlap at 14 m/s."""
    _, drive = room()
    drive = drive.model_copy(update={"speed_m_per_s": speed})
    closed = Walls(start=np.array([[0.0, -9.0]]), end=np.array([[0.0, 9.0]]))
    person = disks_at([[-1.0, 0.0]], radius=0.3, mass=[EVACUATED_KG])
    there = advance(person, closed, drive, 25_000)
    gap = gap_that_carries(EVACUATED_KG * speed / TIME_S, SocialForceLaw())
    assert there.position[0, 0] == pytest.approx(-0.3 - gap, abs=1e-6)
    assert np.hypot(*there.velocity[0]) < 1e-6


def test_people_leave_and_are_looked_at():
    found = evacuate(2.0, 1, people=12, until=20.0)
    assert found.left == 12
    assert len(found.looks) == 41
    assert found.forces.size == 0
    np.testing.assert_array_equal(found.deepest, 0.0)


@pytest.mark.parametrize(
    ("slow", "fast", "verdict"),
    [(1e-3, 5e-3, "holds"), (1e-3, 0.05, "holds in part"), (0.02, 0.05, "does not hold")],
)
def test_the_verdict_on_overlaps_depends_on_the_speed(slow, fast, verdict):
    made_up = [
        SimpleNamespace(speed=speed, deepest=np.full(4, deepest), forces=np.array([2500.0]))
        for speed, deepest in ((1.0, slow), (1.0, slow), (4.0, fast))
    ]
    claim = fig6_rivals.no_overlap(WORDS, made_up)
    assert claim.verdict == verdict
    assert f"{1e3 * fast:.1f} mm" in claim.reason
