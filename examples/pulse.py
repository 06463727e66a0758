"""How fast does a push run through people who stand?

A row walks at 1 m/s into people at rest. The front is where somebody has moved by 1 cm."""

from pathlib import Path

import numpy as np

from crowd_percussions import Snapshot, open_bodies, read_scene, simulate


def standing(gap, seed, rows=4, along=12):
    row, index = (one.ravel() for one in np.meshgrid(np.arange(rows), np.arange(along)))
    shift = np.random.default_rng(seed).uniform(-0.25, 0.25, (row.size, 2)) * gap * (rows > 1)
    return Snapshot(
        position=(0.4 + gap) * np.column_stack([index + 0.5 * (row % 2), 0.866 * row]) + shift,
        velocity=np.outer(index == 0, [1.0, 0.0]),
        radius=np.full(row.size, 0.2),
        mass=np.where(index == 0, 1e4, 75.0),
    )


def front_speed(crowd, **contact):
    engine = "lammps" if "stiffness_N_per_m" in contact else "rigid"
    scene = read_scene("chain").model_copy(update={"snapshot": crowd})
    scene = scene.with_contact(restitution=0.1, **contact)
    simulate(scene.with_run(duration_s=1.5, frames=300, time_step_s=None), engine, Path("run"))
    frames, start = open_bodies("run/bodies.dump").trajectory, crowd.position[:, 0]
    moved = np.array([frame.positions[:, 0] - start > 0.01 for frame in frames])
    first = np.array([frame.time for frame in frames])[moved.argmax(axis=0)]
    return np.polyfit(*np.array([first, start])[:, moved.any(axis=0)], 1)[0]  # m/s


speeds = {}
for gap in (0.05, 0.1, 0.2):
    arms = {"arm_reach_m": gap / 2, "arm_force_N": 150.0}
    for kind, contact in {"hard": {}, "soft": {"stiffness_N_per_m": 1e4}, "arms": arms}.items():
        found = [front_speed(standing(gap, seed), **contact) for seed in (1, 2)]
        speeds[gap, kind] = found
        print(f"gap {gap} m, {kind}: {min(found):.1f} to {max(found):.1f} m/s")
