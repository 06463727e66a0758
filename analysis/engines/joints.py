"""What friction does at the joints of walls in engines with springs."""

from __future__ import annotations

import numpy as np

from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from nscd.segments import connect

# N, of the force for which a length is said.
FORCE = 1000.0


def friction_at_joints(scene: Scene) -> str:
    """Say how far friction is off where disks slide from wall to wall; nothing where none does from
    where it stands at the start.

    Walls that meet hand a disk from one to the next where they are in line, or at a corner that
    points at it. Its tangential spring then begins at zero, and is back after a sliding of μF/k_t."""
    if not scene.contact.friction or not (joints := _passed(scene)):
        return ""
    law = penalty_of(scene)
    length = law.friction * FORCE / law.tangential_stiffness
    return (
        f"friction at {joints} joints of walls: the tangential spring of a disk that slides over "
        f"one begins again at zero; its friction is too small over the next {length:.2g} m (at {FORCE:g} N, "
        "in proportion to the force)"
    )


def _passed(scene: Scene) -> int:
    """How many joints some disk is not within the corner of."""
    walls = scene.wall_segments()
    if not len(walls):
        return 0
    meeting = connect(walls.start, walls.end)
    ends = np.stack([walls.start, walls.end], axis=1)
    passed = 0
    for vertex in np.unique(meeting.vertex):
        wall, side = np.nonzero(meeting.vertex == vertex)
        if len(wall) < 2:
            continue
        arms = ends[wall, 1 - side] - ends[wall, side]
        (a, b), away = arms[:2], scene.snapshot.position - ends[wall[0], side[0]]
        across = a[0] * b[1] - a[1] * b[0]
        # away = α a + β b: within the corner where α, β > 0
        alpha = away[:, 0] * b[1] - away[:, 1] * b[0]
        beta = a[0] * away[:, 1] - a[1] * away[:, 0]
        within = (alpha * across > 0) & (beta * across > 0)
        passed += len(wall) > 2 or not within.all()
    return passed
