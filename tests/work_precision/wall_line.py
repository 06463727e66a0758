"""A line of people who push against a wall: what every disk receives is known."""

import numpy as np

from tests.crowds import disks_at, drive_to, scene_at


def line_at_a_wall(disks=3, stiffness=1e6):
    """Disks of 75 kg in a line that want to walk at 2 m/s (τ = 0.5 s) into a wall: each pushes with
    300 N."""
    radius = 0.25
    x = -radius - 2 * radius * np.arange(disks)
    snapshot = disks_at(np.column_stack([x, np.zeros(disks)]), radius=radius)
    # everybody walks to a door far away beyond the wall
    return scene_at(
        snapshot, [((0.0, -1.0), (0.0, 1.0))], name="line", time=1.0,
        drive=drive_to((1e6, -0.5), (1e6, 0.5)), run={"duration_s": 1.0, "frames": 1},
        contact={"stiffness_N_per_m": stiffness, "restitution": 0.1},
    )  # fmt: skip
