"""A line of people who push against a wall: what every disk receives is known."""

import numpy as np

from analysis.scene.scene import Analysis, ContactModel, Drive, Run, Scene, Wall
from tests.crowds import disks_at


def line_at_a_wall(disks=3, stiffness=1e6):
    """Disks of 75 kg in a line that want to walk at 2 m/s (τ = 0.5 s) into a wall: each pushes with
    300 N."""
    radius = 0.25
    x = -radius - 2 * radius * np.arange(disks)
    snapshot = disks_at(np.column_stack([x, np.zeros(disks)]), radius=radius)
    # everybody walks to a door far away beyond the wall
    drive = Drive(
        speed_m_per_s=2.0,
        relaxation_time_s=0.5,
        door_start_m=(1e6, -0.5),
        door_end_m=(1e6, 0.5),
        outward=(1.0, 0.0),
    )
    return Scene(
        name="line",
        title="A line at a wall",
        source="a test",
        snapshot=snapshot,
        walls=(Wall(name="wall", start_m=(0.0, -1.0), end_m=(0.0, 1.0)),),
        drive=drive,
        contact=ContactModel(stiffness_N_per_m=stiffness, restitution=0.1),
        run=Run(duration_s=1.0, frames=1),
        analysis=Analysis(kind="driven", time_s=1.0),
    )
