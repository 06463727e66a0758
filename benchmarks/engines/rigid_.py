"""The rigid engine of this project: percussions of each step over its duration. What does not turn but rubs is
a body of two joined disks."""

import numpy as np
from record import Record, scene

from crowd_percussions import __version__
from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push

h, bodies = scene.step_s / scene.substeps, np.array(scene.bodies)
joined = scene.friction > 0 and not scene.turns
x, y, r, m, vx, vy = np.repeat(bodies, 2 if joined else 1, axis=0).T
x = x + (np.tile([-0.5, 0.5], len(bodies)) * r if joined else 0)
m = m / 2 if joined else m
state = Snapshot(position=np.column_stack([x, y]), velocity=np.column_stack([vx, vy]), radius=r, mass=m)
if joined:
    state = state.joined(np.repeat(np.arange(len(bodies)), 2))
point, normal = np.array(scene.walls).reshape(-1, 2, 2).swapaxes(0, 1)
way = 99 * np.column_stack([-normal[:, 1], normal[:, 0]])
walls, push = Walls(start=point - way, end=point + way), Push(acceleration=scene.gravity)
motion = Motion(state, walls, step=h, friction=scene.friction, push=push)


def shown():
    """Of each body its state: of joined disks the mean."""
    every = np.column_stack([motion.position, motion.velocity, motion.spin])
    return every.reshape(len(bodies), -1, 5).mean(axis=1) if joined else every


record = Record(__version__)
for step in record.steps():
    for _ in range(scene.substeps):
        report = motion.advance()
    neighbours = report.neighbours
    n = neighbours.normal
    force = (report.reaction[:, None] * n + report.friction[:, None] * np.column_stack([-n[:, 1], n[:, 0]])) / h
    part = 2 if joined else 1
    other = np.where(neighbours.second < 0, -1 - neighbours.wall, neighbours.second // part)
    listed = zip(neighbours.first // part, other, *force.T, strict=True)
    record.frame(step, shown(), [row for row in listed if any(row[2:])])
