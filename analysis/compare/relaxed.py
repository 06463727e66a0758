"""A crowd at rest, begun anew from one configuration, so that stiffer springs change nothing but
their softness."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.compare.comparison import Comparison
from analysis.scene.anthropometry import apart
from analysis.scene.scene import Scene, SceneError
from nscd import Snapshot
from nscd.stepping import StepError

# The share of the drive that may still accelerate a crowd "at rest".
AT_REST = 0.01
# From so many stiffnesses on a trend is fitted.
FEWEST = 4


def at_rest(comparison: Comparison) -> bool:
    """Whether a crowd has come to rest: Σ |m a| is at most 1 % of Σ |drive|."""
    pressed = comparison.scene.analysis.kind != "impact"
    return pressed and comparison.balance.unbalanced <= AT_REST


def begun_anew(scene: Scene, rested: Comparison, stiffnesses: int) -> Scene | None:
    """Return the scene with the crowd of a run that came to rest: without those beyond the door,
    without speed, overlaps pushed apart as little as possible.

    None where it has not come to rest, where that is no scene, and for fewer than four stiffnesses,
    of which no trend is fitted."""
    if stiffnesses < FEWEST or not at_rest(rested):
        return None
    now, stays = rested.snapshot, np.ones(len(rested.snapshot), dtype=bool)
    if scene.drive:
        stays = ~scene.drive.gone(now.position, now.ids)
    still = Snapshot(
        position=now.position[stays],
        velocity=0.0 * now.velocity[stays],
        radius=now.radius[stays],
        mass=now.mass[stays],
        ids=now.ids[stays],
    )
    try:
        anew = scene.model_copy(
            update={
                "snapshot": apart(still, scene.wall_segments()),
                "reconciliation": None,
                "other_frames": None,
                "other_crowds": (),
            }
        )
        anew.check(scene.name)
    except (StepError, SceneError):
        return None
    return anew


def folder_of(folder: Path) -> Path:
    """Where such a run lives, beside the one from the scene's own beginning."""
    return folder.with_name(f"{folder.name}_anew")
