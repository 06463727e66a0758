"""What a crowd is: scenes, their disks, rooms and packings."""

from analysis.scene.rooms import Crowd, from_geometry, room
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
    "Crowd",
    "Drive",
    "Room",
    "Run",
    "Scene",
    "SceneError",
    "Wall",
    "from_geometry",
    "read_room",
    "read_scene",
    "room",
    "scene_names",
]
