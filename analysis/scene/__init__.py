"""What a crowd is: scenes, their disks, rooms and packings."""

from analysis.scene.floor_files import read_floor
from analysis.scene.new_scene import Crowd, Inside, from_geometry, room
from analysis.scene.plan_roles import Floor
from analysis.scene.scene import Drive, Room, Scene, SceneError, read_room, read_scene, scene_names
from analysis.scene.schema import Analysis, ContactModel, Run, Wall
from analysis.scene.waiting import Doorway, opposing

__all__ = [
    "Analysis", "ContactModel", "Crowd", "Doorway", "Drive", "Floor", "Inside", "Room", "Run",
    "Scene", "SceneError", "Wall", "from_geometry", "opposing", "read_floor", "read_room",
    "read_scene", "room", "scene_names",
]  # fmt: skip
