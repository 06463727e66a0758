"""Rigid bodies of several disks: impacts by closed forms, statics, crowds against other solvers, and
what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog, nnls
from scipy.sparse import csr_array

from analysis.studies.exchange.problem import GlobalProblem
from nscd import ContactLaw, Walls, find_contacts, solve
from nscd.friction.planar import natural_map
from nscd.indeterminacy import determinacy, equilibrium, intervals, nearest
from nscd.rivals import first_order
from nscd.stress import Kernel, coarse_grain, stress_field
from tests.crowds import disks_at, lattice

FLOOR = Walls(start=[[-9, 0]], end=[[9, 0]])


def percussions(crowd, walls=None, tolerance=1e-9, **law):
    contacts = find_contacts(crowd, walls, tolerance=tolerance)
    found = solve(crowd, contacts, law=ContactLaw(**law), tolerance=1e-10)
    assert found.status == "solved", found.reason
    return contacts, found


def rod(centre, angle, radii, difference, body, mass=15.0):
    """Disks in a row about a centre, as position, radius, mass and body."""
    along = difference * (np.arange(len(radii)) - 0.5 * (len(radii) - 1))
    way = np.array([np.cos(angle), np.sin(angle)])
    return (
        centre + along[:, None] * way,
        radii,
        np.full(len(radii), mass),
        np.full(len(radii), body),
    )


def crowd_of(*rods, velocity=(0.0, 0.0), **others):
    position, radius, mass, body = (np.concatenate(part) for part in zip(*rods, strict=True))
    return disks_at(position, velocity, radius, mass, **others).joined(body)


def some_bodies(seed, side=4, gap=0.1):
    """Bodies of one to five disks in a square, turned at random and moving into a corner."""
    rng = np.random.default_rng(seed)
    rods = []
    for at in np.ndindex(side, side):
        disks = int(rng.integers(1, 6))
        radii = rng.uniform(0.09, 0.11, disks)
        rods.append(rod(0.42 * np.array(at), rng.uniform(0, np.pi), radii, 0.08, len(rods)))
    position, body = np.concatenate([one[0] for one in rods]), np.concatenate([r[3] for r in rods])
    velocity = 0.5 * rng.normal(size=(side**2, 2))[body] - (position - position.min(0))
    spin = rng.normal(size=side**2)[body]
    crowd = crowd_of(*rods, velocity=velocity, spin=spin)
    corner = position.min(0) - 0.1
    walls = Walls(start=[corner, corner], end=corner + np.diag([3.0, 3.0]))
    return crowd, find_contacts(crowd, walls, tolerance=gap)


def rows_of(crowd, contacts):
    """N and T (k,3b) of the bodies, from where the contacts are; masses and u⁻ (3b,)."""
    bodies = crowd.bodies
    normal, tangential = np.zeros((2, len(contacts), 3 * len(bodies)))
    for c, n in enumerate(contacts.normal):
        t = np.array([-n[1], n[0]])
        ends = [(contacts.first[c], 1.0, 0.0)]
        if not contacts.is_wall[c]:
            ends.append((contacts.second[c], -1.0, contacts.gap[c]))
        for disk, sign, beyond in ends:
            b = bodies.number[disk]
            x, y = contacts.point[c] + beyond * n - bodies.centre[b]
            for rows, way in ((normal, n), (tangential, t)):
                rows[c, 3 * b : 3 * b + 3] = sign * np.array([*way, x * way[1] - y * way[0]])
    mass = np.column_stack([bodies.mass, bodies.mass, bodies.inertia]).ravel()
    return normal, tangential, mass, bodies.motion(crowd, crowd.velocity).ravel()


def after(crowd, found):
    """u⁺ (3b,) of the bodies of an answer."""
    return crowd.bodies.motion(replace(crowd, spin=found.right_spin), found.right_velocity).ravel()


@pytest.mark.parametrize("e", [0.0, 0.5, 0.99])
def test_an_off_centre_blow(e):
    """A disk hits one end of a free dumbbell: p = (1+e) v/w, 1/w with the lever 0.2 m; energy falls by
    p v (1−e)/2, the angular momentum stays."""
    dumbbell = rod(np.zeros(2), np.pi / 2, [0.2, 0.2], 0.4, 1, mass=40.0)
    crowd = crowd_of(dumbbell, rod(np.array([-0.4, 0.2]), 0.0, [0.2], 1.0, 2, mass=70.0))
    crowd = replace(crowd, velocity=[[0, 0], [0, 0], [2, 0]])
    _, found = percussions(crowd, restitution=e)
    inertia = 2 * (40 * 0.02 + 40 * 0.04)
    p = (1 + e) * 2.0 / (1 / 80 + 1 / 70 + 0.04 / inertia)
    np.testing.assert_allclose(found.impulse, [[-p, 0]], rtol=1e-8)
    np.testing.assert_allclose(found.right_spin, [-0.2 * p / inertia] * 2 + [0], rtol=1e-8)
    centre, spin = p / 80, -0.2 * p / inertia
    wanted = [[centre + 0.2 * spin, 0], [centre - 0.2 * spin, 0], [2 - p / 70, 0]]
    np.testing.assert_allclose(found.right_velocity, wanted, rtol=1e-8, atol=1e-9)
    assert found.energy_change == pytest.approx(-0.5 * (1 - e) * p * 2.0, rel=1e-8)
    assert inertia * spin - 0.2 * 70 * (2 - p / 70) == pytest.approx(-0.2 * 70 * 2)


def test_a_rod_between_walls():
    """A turning rod is stopped by a couple, 2 λ L = I ω; two feet carry a rod as the lever says."""
    turning = crowd_of(rod(np.zeros(2), 0.0, [0.1] * 5, 0.2, 1), spin=np.full(5, 3.0))
    walls = Walls(start=[[0.3, 0.1], [-0.6, -0.1]], end=[[0.6, 0.1], [-0.3, -0.1]])
    _, found = percussions(turning, walls)
    inertia, *_ = turning.bodies.inertia
    pressed = np.sort(found.reaction)[-2:]
    np.testing.assert_allclose(pressed, inertia * 3.0 / 0.8, rtol=1e-9)
    np.testing.assert_allclose(found.right_spin, 0, atol=1e-12)

    feet = rod(np.array([0.0, 0.12]), 0.0, [0.12, 0.1, 0.1, 0.1, 0.12], 0.2, 1)
    ball = rod(np.array([0.2, 0.12 + 0.2]), 0.0, [0.1], 1.0, 2, mass=60.0)
    crowd = crowd_of(feet, ball, velocity=(0.0, -2.0))
    contacts, found = percussions(crowd, FLOOR)
    carried = dict(zip(contacts.first.tolist(), found.reaction.tolist(), strict=True))
    assert carried[0] == pytest.approx(75 + 60 * 2 * 0.2 / 0.8)
    assert carried[4] == pytest.approx(75 + 60 * 2 * 0.6 / 0.8)


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.8])
def test_a_dumbbell_on_an_incline(mu):
    """Both feet share the weight, the lower one more by the moment of friction: N = Mgh/2 (cos θ ± f r/a)
    with f = min(tan θ, μ) cos θ; for r = a."""
    angle, push = np.deg2rad(25), 2.0
    pull = push * np.array([np.sin(angle), -np.cos(angle)])
    crowd = crowd_of(rod(np.array([0.0, 0.2]), 0.0, [0.2, 0.2], 0.4, 1, mass=40.0), velocity=pull)
    _, found = percussions(crowd, FLOOR, friction=mu)
    fraction = min(np.tan(angle), mu) * np.cos(angle)
    wanted = 40 * push * np.array([np.cos(angle) - fraction, np.cos(angle) + fraction])
    np.testing.assert_allclose(found.reaction, wanted, rtol=1e-9)
    slides = push * (np.sin(angle) - fraction)
    np.testing.assert_allclose(found.right_velocity, [[slides, 0]] * 2, atol=1e-10)
    np.testing.assert_allclose(found.right_spin, 0, atol=1e-10)


@pytest.mark.parametrize("law", [{}, {"restitution": 0.5}, {"friction": 0.4}])
def test_bodies_of_one_disk_are_the_disks_to_the_bit(law):
    crowd = lattice(3)
    alone = crowd.joined(np.arange(len(crowd), 0, -1))
    (_, one), (_, other) = percussions(crowd, FLOOR, **law), percussions(alone, FLOOR, **law)
    for name in ("reaction", "impulse", "right_velocity", "right_spin"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    # through the rows of bodies it is the same to rounding
    width = replace(alone, bodies=replace(alone.bodies, inertia=alone.bodies.inertia * (1 + 1e-15)))
    _, through = percussions(width, FLOOR, **law)
    if "friction" not in law:
        np.testing.assert_allclose(through.right_velocity, one.right_velocity, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_crowds_of_bodies_against_a_quadratic_program(seed):
    """min ½ |M^-½Nᵀλ − M^½u⁻|², λ ≥ 0, by Lawson and Hanson; the bound of the error holds."""
    crowd, contacts = some_bodies(seed)
    normal, _, mass, left = rows_of(crowd, contacts)
    root = np.sqrt(mass)
    reaction = nnls((normal / root).T, root * left)[0]
    exact = left - normal.T @ reaction / mass
    requested = ("auto", 1e-10), ("interior_point", 1e-3), ("active_set", 1e-8)
    for solver, tolerance in requested:
        found = solve(crowd, contacts, tolerance=tolerance, solver=solver, canonical=False)
        error = np.sqrt(mass @ (after(crowd, found) - exact) ** 2 / crowd.bodies.mass.sum())
        assert found.status == "solved"
        assert error <= found.velocity_error + 1e-11
        assert found.velocity_error <= 1e3 * (tolerance + 1e-11)
    change = 0.5 * mass @ (exact**2 - left**2)
    assert percussions_of(crowd, contacts).energy_change == pytest.approx(change, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_few_factorisations_tell_the_closed_contacts(seed):
    crowd, contacts = some_bodies(seed, side=10)
    found = percussions_of(crowd, contacts)
    assert "firmer" in found.choice
    assert found.iterations <= 20


def percussions_of(crowd, contacts, **law):
    found = solve(crowd, contacts, law=ContactLaw(**law), tolerance=1e-9)
    assert found.status == "solved", found.reason
    return found


@pytest.mark.parametrize(
    "law", [{"friction": 0.3}, {"friction": 0.8}, {"friction": 0.3, "wall_friction": 0.0}]
)
@pytest.mark.parametrize("seed", range(4))
def test_friction_of_bodies_obeys_coulombs_law(seed, law):
    """By the natural map of u = W r + q, with W from where the contacts are."""
    crowd, contacts = some_bodies(seed)
    found = percussions_of(crowd, contacts, **law)
    normal, tangential, mass, left = rows_of(crowd, contacts)
    rows = np.empty((2 * len(contacts), len(mass)))
    rows[::2], rows[1::2] = -normal, -tangential  # of what the first body receives
    reaction = np.column_stack([found.reaction, found.friction.tangential]).ravel()
    delassus = csr_array((rows / mass) @ rows.T)
    off = natural_map(delassus, rows @ left, found.friction.coefficient, reaction)
    assert off < 1e-7
    np.testing.assert_allclose(after(crowd, found), left + rows.T @ reaction / mass, atol=1e-8)


@pytest.mark.parametrize("seed", range(2))
def test_intervals_of_bodies_against_linear_programs(seed):
    crowd, contacts = some_bodies(seed, gap=0.2)
    found = percussions_of(crowd, contacts)
    normal, _, mass, left = rows_of(crowd, contacts)
    closed = normal @ after(crowd, found) >= -1e-6
    balance, right = normal[closed].T, mass * (left - after(crowd, found))
    balance_of = intervals.Intervals(equilibrium.Equilibrium.of(contacts, found))
    widths = []
    for c in np.flatnonzero(closed)[:8]:
        mine = balance_of.of(intervals.weights_of_contacts(contacts, c))
        goal = np.eye(len(contacts))[c][closed]
        ends = [
            linprog(sign * goal, A_eq=balance, b_eq=right, bounds=(0, None)) for sign in (1, -1)
        ]
        assert mine.lower == pytest.approx(ends[0].fun, abs=1e-5)
        assert ends[1].status == 3 or mine.upper == pytest.approx(-ends[1].fun, abs=1e-5)
        widths.append(mine.width)
    assert max(widths) > 1.0
    assert determinacy(contacts, len(crowd), crowd).rank == np.linalg.matrix_rank(normal)
    least_energy = nearest.least_energy(contacts, found)
    np.testing.assert_allclose(found.reaction, least_energy, atol=1e-6)


BAD = {
    "hang together": {"body": [1, 1, 2, 1]},
    "shape": {"body": [1, 1]},
    "whole number": {"body": [1, 1, 1.5, 2]},
    "body 2: inertia -1": {"body": [1, 1, 2, 2], "inertia": [1, -1]},
    "body 2 turn differently": {"body": [1, 1, 2, 2], "spin": [0, 0, 1, 2]},
}


@pytest.mark.parametrize("words", BAD)
def test_bodies_that_cannot_be_are_refused_in_one_line(words):
    arguments = dict(BAD[words])
    crowd = disks_at([[0, 0], [0.5, 0], [1, 0], [1.5, 0]], spin=arguments.pop("spin", np.zeros(4)))
    with pytest.raises(ValueError, match=words) as refused:
        crowd.joined(**arguments)
    assert "\n" not in str(refused.value)


def test_stress_of_bodies_balances_their_momentum():
    """Σ m Δu φ over bodies = div Σ + t, at any place."""
    crowd, contacts = some_bodies(2)
    found, bodies, kernel = percussions_of(crowd, contacts), crowd.bodies, Kernel(width=0.3)
    at = np.random.default_rng(0).uniform(0, 2, (9, 2))
    field = stress_field(crowd, contacts, found.impulse, kernel, at)
    change = bodies.mean(found.right_velocity - crowd.velocity, crowd.mass) * bodies.mass[:, None]
    wanted = coarse_grain(bodies.centre, change, kernel, at)[0]
    np.testing.assert_allclose(
        field.divergence + field.traction, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max()
    )


def test_models_of_disks_refuse_bodies():
    crowd, contacts = some_bodies(2)
    for model in (
        lambda: first_order(crowd, contacts),
        lambda: solve(crowd, contacts, solver="projected_gradient"),
        lambda: GlobalProblem.of(crowd, contacts, crowd.velocity, np.zeros(len(contacts))),
    ):
        with pytest.raises(ValueError, match="bodies of several"):
            model()


def test_contacts_within_a_body_are_none():
    crowd = disks_at([[0, 0], [0.4, 0], [0.9, 0]])
    contacts = find_contacts(crowd, tolerance=1e-9)
    full = crowd.joined([1, 1, 2])
    assert (len(contacts), len(find_contacts(full, tolerance=1e-9))) == (2, 1)
    with pytest.raises(ValueError, match="one body"):
        solve(full, contacts)
