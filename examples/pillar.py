"""Where does a pillar relieve a crowd, and which way is better still?

Each person in turn is a pillar: squared forces of all others, and their slope. Nobody moves."""

from dataclasses import replace

import numpy as np

import crowd_percussions as cp

scene = cp.make("arch", disks=60)
walls, ids, tau = scene.wall_segments(), np.arange(60), scene.drive.relaxation_time_s
way = lambda q: scene.drive.desired_velocity(q, ids + 1, 0.0)  # noqa: E731
push = cp.stepping.Push(desired=way, relaxation_time=tau)
motion = cp.Motion(scene.snapshot, walls, step=0.005, push=push)
for _ in range(200):
    motion.advance()
crowd, left = motion.snapshot(), way(motion.position)


def squares(pillar, moved=(0.0, 0.0)):
    here = (ids == pillar)[:, None]
    mass = np.where(here[:, 0], 1e9, 75.0)  # kg
    now = replace(crowd, position=crowd.position + here * moved, mass=mass)
    contacts = cp.find_contacts(now, walls, tolerance=0.005)
    solution = cp.solve(now, contacts, left_velocity=left * ~here, tolerance=1e-10)
    its = here[contacts.first] | (here[contacts.second % 60] & ~contacts.is_wall[:, None])
    force = np.where(its, 0.0, solution.impulse / tau)  # N
    try:
        slope = cp.gradient(solution, walls, impulse=2 * force / tau).position[pillar]
    except cp.NoGradientError:  # a contact is about to open
        slope = np.full(2, np.nan)
    return (force**2).sum(), slope


alone, sums, slopes = squares(-1)[0], *map(np.array, zip(*map(squares, ids), strict=True))
best = np.nanargmin(sums + 0 * slopes[:, 0])
there = -0.002 * slopes[best] / np.hypot(*slopes[best])  # 2 mm
foretold, solved = sums[best] + slopes[best] @ there, squares(best, there)[0]
print(f"person {best + 1}: {1 - sums[best] / alone:.1%} less, 2 mm on {1 - foretold / alone:.2%}")
