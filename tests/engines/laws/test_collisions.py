"""Both engines against closed forms: the spring-dashpot collision, momentum, walls, rotation."""

import functools

import numpy as np
import pytest
from scipy.optimize import brentq

from analysis.scene.scene import Run, read_scene
from nscd import Snapshot
from tests.crowds import disks_at, scene_at

ENGINES = ["lammps", "yade"]
K = 1e6


def collision(mass, stiffness, damping, speed):
    """Peak force, duration and restitution of max(0, k x + c x') with effective mass `mass`, from
    the exact x(t)."""
    roots = np.roots([mass, damping, stiffness]).astype(complex)
    size = speed / (roots[0] - roots[1])

    def velocity(t):
        return (size * (roots[0] * np.exp(roots[0] * t) - roots[1] * np.exp(roots[1] * t))).real

    def force(t):
        overlap = (size * (np.exp(roots[0] * t) - np.exp(roots[1] * t))).real
        return stiffness * overlap + damping * velocity(t)

    longest = 12 * np.sqrt(mass / stiffness) * max(1, damping / np.sqrt(mass * stiffness))
    time = np.linspace(0.0, longest, 5001)
    end = int(np.argmax(force(time[1:]) <= 0)) + 1
    duration = brentq(force, time[end - 1], time[end]) if force(time[end]) < 0 else time[end]
    return force(time[:end]).max(), duration, -velocity(duration) / speed


@functools.cache
def dashpot(restitution, mass):
    """The damping constant with which `collision` gives this restitution."""
    missed = lambda damping: collision(mass, K, damping, 1.0)[2] - restitution  # noqa: E731
    return brentq(missed, 1e-3, 40 * np.sqrt(K * mass))


def approach_speed(simulation, speed, first=0, second=1):
    """Peak force, duration and restitution of a head-on collision along x, as simulated with a
    frame a step."""
    sizes = [np.hypot(*one.force[0]) if len(one) else 0.0 for one in simulation.contacts]
    force, v = np.array(sizes), simulation["vx"][-1]
    duration = (force > 0).sum() * simulation.frame_interval
    return force.max(), duration, (v[second] - v[first]) / speed


@pytest.mark.parametrize(("name", "restitution"), [("lammps", 0.1), ("yade", 0.5)])
def test_a_collision_converges_to_the_closed_form(simulate, impact, name, restitution):
    """First order in the time step: halving it halves the error."""
    closed = collision(37.5, K, dashpot(restitution, 37.5), 2.0)
    assert closed[2] == pytest.approx(restitution, abs=1e-9)
    errors = []
    for time_step in (1e-4, 5e-5, 2.5e-5):
        contact = {"restitution": restitution, "stiffness_N_per_m": K}
        scene = impact("pair", time_step, 0.03, every=1, **contact)
        peak, duration, rebound = approach_speed(simulate(name, scene), 2.0)
        errors.append([abs(peak / closed[0] - 1), abs(rebound - restitution)])
        assert duration == pytest.approx(closed[1], abs=4 * time_step)
    errors = np.array(errors)
    assert (errors[-1] < 0.01).all()
    np.testing.assert_allclose(errors[1:] / errors[:-1], 0.5, atol=0.1)


@pytest.mark.long
@pytest.mark.parametrize("name", ENGINES)
def test_unequal_masses_share_one_dashpot(simulate, name):
    mass = np.array([50.0, 100.0])
    snapshot = disks_at([[0, 0], [0.5, 0]], [[2, 0], [0, 0]], mass=mass)
    run = Run(duration_s=0.03, frames=3000, time_step_s=1e-5)
    scene = read_scene("pair").model_copy(update={"snapshot": snapshot, "run": run})
    simulation = simulate(name, scene.with_contact(restitution=0.3))
    # 50 kg: the effective mass of two of the heaviest
    closed = collision(50 * 100 / 150, K, dashpot(0.3, 50.0), 2.0)
    peak, _, rebound = approach_speed(simulation, 2.0)
    assert peak == pytest.approx(closed[0], rel=2e-3)
    assert rebound == pytest.approx(closed[2], abs=2e-3)
    assert simulation.record.restitution_least < rebound < 0.3
    assert mass @ simulation["vx"][-1] == pytest.approx(100.0, rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(("name", "turn"), [("lammps", 37.0), ("lammps", 90.0), ("yade", 200.0)])
def test_a_wall_in_any_direction_rebounds_and_carries_the_momentum(simulate, name, turn):
    angle = np.deg2rad(turn)
    along = np.array([np.cos(angle), np.sin(angle)])
    normal = along[::-1] * [-1, 1]
    velocity = 2.0 * normal + 0.7 * along
    disk = Snapshot(position=[-0.301 * normal], velocity=[velocity], radius=[0.3], mass=[80.0])
    contact = {"stiffness_N_per_m": K, "restitution": 0.4}
    run = {"duration_s": 0.04, "frames": 2000, "time_step_s": 2e-5}
    scene = scene_at(disk, [(-along, 2 * along)], contact=contact, run=run)
    simulation = simulate(name, scene)
    after = np.array([simulation["vx"][-1, 0], simulation["vy"][-1, 0]])
    closed = collision(80.0, K, dashpot(0.4, 80.0), 2.0)
    assert after @ along == pytest.approx(0.7, abs=1e-12)
    assert after @ normal == pytest.approx(-0.4 * 2.0, abs=4e-3)
    in_contact = [contacts for contacts in simulation.contacts if len(contacts)]
    force = np.array([contacts.force[0] for contacts in in_contact])
    assert np.hypot(*force.T).max() == pytest.approx(closed[0], rel=3e-3)
    np.testing.assert_allclose(force.sum(0) * 2e-5, 80.0 * (velocity - after), rtol=0, atol=1e-9)
    for contacts in in_contact:
        assert contacts.is_wall.tolist() == [True]
        assert (contacts.first.tolist(), contacts.second.tolist()) == ([1], [1])
        np.testing.assert_allclose(contacts.normal[0], normal, atol=1e-12)


@pytest.mark.parametrize("name", ENGINES)
def test_friction_turns_disks_of_inertia_half_m_r_squared(simulate, impact, name):
    """The angular momentum about the origin, 0 at the start, stays 0 only with that inertia."""
    simulation = simulate(name, impact("pair_oblique", 1e-5, 0.05, friction=0.5))
    last = {column: simulation[column][-1] for column in ("x", "y", "vx", "vy", "omegaz")}
    orbital = 75.0 * (last["x"] * last["vy"] - last["y"] * last["vx"])
    spin = 0.5 * 75.0 * 0.25**2 * last["omegaz"]
    assert last["omegaz"][0] == pytest.approx(last["omegaz"][1], rel=1e-9)
    assert abs(spin.sum()) > 0.1
    assert orbital.sum() + spin.sum() == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("name", ENGINES)
def test_contact_forces_add_up_to_the_force_that_moves_a_disk(simulate, impact, name):
    simulation = simulate(name, impact("corridor"))
    n = simulation["fx"].shape[1]
    for frame, contacts in enumerate(simulation.contacts):
        total = np.zeros((n, 2))
        pair = ~contacts.is_wall
        np.add.at(total, contacts.first - 1, -contacts.force)
        np.add.at(total, contacts.second[pair] - 1, contacts.force[pair])
        felt = np.column_stack([simulation["fx"][frame], simulation["fy"][frame]])
        np.testing.assert_allclose(total, felt, rtol=0, atol=1e-6)
        assert ((contacts.force * contacts.normal).sum(1) >= 0).all()


@pytest.mark.long
@pytest.mark.parametrize("restitution", [0.01, 0.3, 1.0])
def test_hertz_contacts_honour_the_restitution_too(simulate, impact, restitution):
    """Only in LAMMPS; without pulling."""
    scene = impact("pair", 5e-6, 0.12, every=20, restitution=restitution, law="hertz")
    simulation = simulate("lammps", scene)
    v = simulation["vx"][-1]
    assert (v[1] - v[0]) / 2.0 == pytest.approx(restitution, abs=1e-3)
    assert not len(simulation.contacts[-1])
    assert min(contacts.force[:, 0].min(initial=0) for contacts in simulation.contacts) >= 0
