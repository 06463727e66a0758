"""How hard do 60 people press on the walls of my room?

Each pushes with 100 N towards a door of 0.8 m. The rigid engine walks them for 2 s; then the
percussions of the last frame, divided by the time in which people push, are forces."""

from pathlib import Path

from crowd_percussions import Crowd, PercussionAnalysis, open_bodies, room, simulate

scene = room("my_room", 5.0, 4.0, 0.8, Crowd(people=60, push=100.0), duration=2.0)
simulate(scene, "rigid", Path("my_room"))

universe = open_bodies("my_room/bodies.dump")
last = PercussionAnalysis(universe, scene).run(start=-1).results.frames[0]
at_walls = last.contacts.is_wall
wall_load = last.pressing[at_walls, 0].sum()
print(f"on the walls: {wall_load:.0f} N, {last.solution.status}")
last.plot().figure.savefig("my_room.png")
