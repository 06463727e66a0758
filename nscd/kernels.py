"""Compile the kernels before their first use, and check them on collisions whose answer is
known."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
from numpy.typing import ArrayLike

from nscd.arrays import Floats
from nscd.bodies import Snapshot
from nscd.contacts import find_contacts
from nscd.frames import Asked, Disks, solve_frames
from nscd.laws import ContactLaw
from nscd.solve import SOLVERS, solve
from nscd.stepping import Motion

# (law, N·s along the normal) of the percussion m_eff (1 + e) U of a pair.
COLLISIONS = (
    (ContactLaw(maintained=True), 75.0),
    (ContactLaw(dissipation=10.0), 75.0),
    (ContactLaw(restitution=0.5), 112.5),
)
# Right answers are nearer than this (m/s, N·s); wrong ones are not.
NEAR = 1e-6


def compiled_wrongly() -> list[str]:
    """Solve crowds whose answer is known, on two cores; a line for each answer that is another."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        found = [processes.submit(part) for part in (_without_friction, _by_others)]
        return [line for one in found for line in one.result()]


def _without_friction() -> list[str]:
    """Small crowds and rigid steps, alone and in large crowds."""
    lines = [*_judged("solve", _solved_rings(), 0.0), *_judged("a step", _steps(0.0), 0.0)]
    return lines + _judged("frames", _filmed(), 0.0)


def _by_others() -> list[str]:
    """Friction, each solver that can be asked for, and each law of contact: what the other process
    compiles too comes last, when it is there."""
    ring = _ring()
    contacts = find_contacts(ring, tolerance=1e-9)
    found = solve(ring, contacts, law=ContactLaw(friction=0.3), tolerance=1e-10).right_velocity
    lines = [*_judged("friction", [found], 0.0), *_judged("a step", _steps(0.3), 0.0)]
    for solver in SOLVERS:
        found = solve(ring, contacts, tolerance=1e-10, solver=solver).right_velocity
        lines += _judged(solver, [found], 0.0)
    pair = _crowd([[0.0, 0.0], [0.5, 0.0]], [[2.0, 0.0], [0.0, 0.0]])
    contacts = find_contacts(pair, tolerance=1e-9)
    for law, impulse in COLLISIONS:
        found = solve(pair, contacts, law=law, tolerance=1e-10).impulse[0]
        lines += _judged(str(law), [found], np.array([impulse, 0.0]))
    return lines


def _solved_rings() -> Iterator[Floats]:
    """Right velocities of rings, and of rows less what they are."""
    ring = _ring()
    yield solve(ring, find_contacts(ring, tolerance=1e-9), tolerance=1e-10).right_velocity
    row = _crowd([[0.5 * i, 0.0] for i in range(3)], [[3.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    found = solve(row, find_contacts(row, tolerance=1e-9), tolerance=1e-10).right_velocity
    yield found - np.array([1.0, 0.0])


def _steps(friction: float) -> Iterator[Floats]:
    motion = Motion(_ring(), step=1e-3, friction=friction)
    motion.advance()
    yield motion.velocity


def _filmed() -> Iterator[Floats]:
    """What is left of the velocities of the ring in two frames."""
    ring = _ring()
    parts = ring.position, ring.velocity, ring.radius, ring.mass
    position, left, radius, mass = (np.concatenate([part, part]) for part in parts)
    disks = Disks(np.array([0, 7, 14]), np.tile(ring.ids, 2), position, left, radius, mass)
    found = solve_frames(disks, None, Asked(1e-9, 0.5, 1e-10))
    for sign, disk in ((-1.0, found.first), (1.0, found.second)):
        np.add.at(left, disk, sign * found.impulse / mass[0])
    yield left


def _ring() -> Snapshot:
    """Six people round one, who all walk at the middle: 12 contacts, one more than balance
    determines, and nobody can move."""
    angle = np.arange(6) * np.pi / 3
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    middle = np.zeros((1, 2))
    return _crowd(np.concatenate([middle, 0.5 * outward]), np.concatenate([middle, -outward]))


def _crowd(position: ArrayLike, velocity: ArrayLike) -> Snapshot:
    place, speed = np.array(position, dtype=float), np.array(velocity, dtype=float)
    radius, mass = np.full(len(place), 0.25), np.full(len(place), 75.0)
    return Snapshot(position=place, velocity=speed, radius=radius, mass=mass)


def _judged(name: str, answers: Iterable[Floats], right: ArrayLike) -> list[str]:
    """A line for each answer that is not the right one."""
    return [
        f"{name}: {np.asarray(found).tolist()} where {np.asarray(right).tolist()} is right"
        for found in answers
        if not np.allclose(found, right, atol=NEAR)
    ]
