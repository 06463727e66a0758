"""Is the solver that I wrote right?

Projected Gauss–Seidel in ten lines, judged by what `solve` says of the same crowd: its certificate
does not depend on who found the answer."""

import numpy as np

from crowd_percussions import find_contacts, read_scene, solve

scene = read_scene("gate")
crowd, walls = scene.snapshot, scene.wall_segments()
contacts = find_contacts(crowd, walls, tolerance=1e-6)
desired = scene.drive.desired_velocity(crowd.position)  # m/s


def gauss_seidel(sweeps):
    velocity, reaction = desired.copy(), np.zeros(len(contacts))
    inverse = contacts.inverse_mass(crowd.mass)
    for contact in np.tile(np.arange(len(contacts)), sweeps):
        i, j, n = contacts.first[contact], contacts.second[contact], contacts.normal[contact]
        other = 0.0 if contacts.is_wall[contact] else velocity[j]
        push = max(-reaction[contact], n @ (velocity[i] - other) / inverse[contact])
        reaction[contact] += push
        velocity[i] -= push / crowd.mass[i] * n
        if not contacts.is_wall[contact]:
            velocity[j] += push / crowd.mass[j] * n
    return velocity


solution = solve(crowd, contacts, left_velocity=desired)
errors = [float(np.abs(gauss_seidel(sweeps) - solution.right_velocity).max()) for sweeps in (10, 200)]
print(f"solve: {solution.status}, off by at most {solution.velocity_error:.0e} m/s")
print(f"mine: off by {errors[0]:.0e} m/s after 10 sweeps, {errors[1]:.0e} after 200")
