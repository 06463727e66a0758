"""What a crowd is: scenes, their disks, rooms and packings."""

from analysis.scene.scene import (
    Analysis,
    ContactModel,
    Drive,
    Room,
    Run,
    Scene,
    SceneError,
    Wall,
    read_room,
    read_scene,
    scene_names,
)

__all__ = [
    "Analysis",
    "ContactModel",
    "Drive",
    "Room",
    "Run",
    "Scene",
    "SceneError",
    "Wall",
    "read_room",
    "read_scene",
    "scene_names",
]
