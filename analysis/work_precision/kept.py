"""Soft references that are kept on disk, since they take as long as an engine's run."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from analysis.scene.scene import Scene
from analysis.work_precision.soft_reference import (
    TOLERANCE,
    ReferenceError,
    SoftReference,
    soft_reference,
)
from analysis.work_precision.window import Motion

# Counts up whenever `soft_reference` comes to give other numbers.
EDITION = 1


def kept_reference(scene: Scene, path: Path) -> SoftReference | str:
    """The soft reference of the scene from `path`.npz, or made and kept there; why there is none,
    in words."""
    file, key = path.with_name(path.name + ".npz"), f"{scene.digest()} {TOLERANCE} {EDITION}"
    try:
        with np.load(file) as kept:
            if str(kept["key"]) == key:
                both = [
                    Motion(
                        displacement=kept[f"{name}_displacement"], velocity=kept[f"{name}_velocity"]
                    )
                    for name in ("motion", "looser")
                ]
                return SoftReference(motion=both[0], looser=both[1], steps=int(kept["steps"]))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        pass
    try:
        made = soft_reference(scene)
    except ReferenceError as error:
        return str(error)
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.stem}.part.npz")
    np.savez(
        part,
        key=key,
        steps=made.steps,
        motion_displacement=made.motion.displacement,
        motion_velocity=made.motion.velocity,
        looser_displacement=made.looser.displacement,
        looser_velocity=made.looser.velocity,
    )
    part.replace(file)
    return made
