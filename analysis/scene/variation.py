"""Other crowds that the same words describe: by seed where a scene is made, by jitter where it is
given."""

import dataclasses

import numpy as np

from analysis.scene.anthropometry import apart
from analysis.scene.scene import Scene, SceneError
from analysis.scene.shipped_scenes import SEEDED, make

# How well the place (m) and the radius (share) of a person in a given scene are taken to be known.
PLACE_M, RADIUS_SHARE = 0.02, 0.02
# A crowd in which somebody has come through the door or a wall is drawn again, so often at most.
DRAWS = 50


def variant(scene: Scene, number: int) -> Scene:
    """Return crowd `number` of a scene; 0 is the scene itself.

    A shipped scene of random disks is made with another seed. Any other has its places moved at
    random, by 2 cm in the mean square along each axis, and its radii multiplied by 1 ± 2 %; where
    other frames of a film came with it, they take turns with its own, and are varied so too. Disks
    that then overlap are pushed apart as little as possible. Where somebody is then outside the
    walls, as who stood in the door may be, all are drawn again.

    Raises StepError where they cannot be pushed apart, SceneError where somebody stays outside."""
    if number == 0:
        return scene
    if scene.name in SEEDED and _is_shipped(scene):
        crowd = make(scene.name, seed=1 + number).snapshot
        return scene.model_copy(update={"snapshot": crowd})
    random = np.random.default_rng([2, number])
    frames = (scene.snapshot, *scene.other_crowds)
    given = frames[number % len(frames)]
    rest = {"reconciliation": None, "other_frames": None, "other_crowds": ()}
    for draws in range(DRAWS):
        moved = dataclasses.replace(
            given,
            position=given.position + random.normal(0.0, PLACE_M, given.position.shape),
            radius=given.radius * random.uniform(1 - RADIUS_SHARE, 1 + RADIUS_SHARE, len(given)),
        )
        crowd = apart(moved, scene.wall_segments())
        made = scene.model_copy(update=rest | {"snapshot": crowd})
        try:
            made.check(f"{scene.name}, crowd {number}")
        except SceneError:
            if draws == DRAWS - 1:
                raise
        else:
            break
    return made


def how_varied(scene: Scene, crowds: int) -> str:
    """Say in words what so many crowds of a scene differ in."""
    if scene.name in SEEDED and _is_shipped(scene):
        return "the seed of their places and radii"
    said = (
        f"places (σ = {100 * PLACE_M:g} cm along each axis) and radii (± {100 * RADIUS_SHARE:g} %)"
    )
    others = scene.other_frames
    if not others or not others.frames[: crowds - 1]:
        return said
    after = others.after_s[: crowds - 1]
    return (
        f"the frame of the film ({1 + len(after)} frames, from {max(0.0, -min(after)):.2g} s before "
        f"to {max(0.0, *after):.2g} s after that of the first crowd), {said}"
    )


def _is_shipped(scene: Scene) -> bool:
    """Whether its crowd is the one that its name makes."""
    shipped = make(scene.name).snapshot
    return len(shipped) == len(scene.snapshot) and bool(
        np.array_equal(shipped.radius, scene.snapshot.radius)
    )
