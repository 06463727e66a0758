"""Disks pressed into a corner by springs, dashpots and friction: steps of which all forces are known."""

import numpy as np

from nscd import Snapshot, Walls

CORNER = Walls(start=[[0, -1], [-1, 0]], end=[[0, 9], [9, 0]])
G, STEP_S, FRICTION = np.array([-2.0, -1.4]), 2e-3, 0.5


def force(stiffness, overlap, n, slip, approach):
    """On the second: a spring and a dashpot that do not pull, and friction."""
    normal = max(stiffness * overlap + 0.01 * stiffness * approach, 0.0)
    across = np.clip(-300 * slip, -FRICTION * normal, FRICTION * normal)
    return normal * n + across * np.array([-n[1], n[0]]), across


def contacts_of(x, v, w, r):
    rows = []
    for i in range(len(x)):
        for j in range(i + 1, len(x)):
            way, n = x[j] - x[i], (x[j] - x[i]) / np.hypot(*(x[j] - x[i]))
            if (overlap := r[i] + r[j] - np.hypot(*way)) > 0:
                u = v[j] - v[i]
                slip = u @ [-n[1], n[0]] - r[i] * w[i] - r[j] * w[j]
                rows.append((i, j, *force(2e4, overlap, n, slip, -u @ n), n, overlap))
        for axis in (0, 1):
            n = -np.eye(2)[axis]
            if (overlap := r[i] - x[i, axis]) > 0:
                slip = -v[i] @ [-n[1], n[0]] - r[i] * w[i]
                rows.append((i, -1 - axis, *force(4e4, overlap, n, slip, v[i] @ n), n, overlap))
    return rows


def pressed(steps=120, seed=0, side=4, arms=(0.0, 0.0)):
    """Snapshots and tables of contacts of the steps: semi-implicit Euler. arms: shares of the overlap, of bodies and
    with walls, by which torques act nearer than at the radius."""
    random, n = np.random.default_rng(seed), side * side
    r, m = random.uniform(0.2, 0.25, n), random.uniform(60, 90, n)
    x = 0.3 + 0.5 * np.array([divmod(k, side) for k in range(n)]) + random.uniform(-0.02, 0.02, (n, 2))
    v, w, snapshots, tables = random.uniform(-0.5, 0.5, (n, 2)), np.zeros(n), [], []
    for step in range(steps):
        snapshots.append(Snapshot(position=x, velocity=v, radius=r, mass=m, spin=w, time=step * STEP_S))
        rows, f, torque = contacts_of(x, v, w, r), m[:, None] * G, np.zeros(n)
        for i, j, on_second, across, _, overlap in rows:
            for k, sign in ((i, -1), *([(j, 1)] if j >= 0 else [])):
                f[k] += sign * on_second
                torque[k] -= (r[k] - arms[j < 0] * overlap) * across
        i, j = (np.array([row[k] for row in rows], dtype=int) for k in (0, 1))
        on_second, normal = (np.array([row[k] for row in rows]).reshape(-1, 2) for k in (2, 4))
        tables.append({"first": i + 1, "second": np.abs(j + (j >= 0)), "is_wall": j < 0, "force": on_second,
                       "normal": normal})  # fmt: skip
        v, w = v + STEP_S * f / m[:, None], w + STEP_S * torque / (0.5 * m * r**2)
        x = x + STEP_S * v
    return snapshots, tables


def weight(now):
    return now.mass[:, None] * G
