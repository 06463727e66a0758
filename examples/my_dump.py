"""What passes on in a collision that my own LAMMPS run wrote?

Any text dump with `id x y radius` and `mass` or `density` will do. Four people collide in a row."""

from pathlib import Path

from crowd_percussions import PercussionAnalysis, open_bodies

HEAD = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n4\nITEM: BOX BOUNDS ss ss pp\n-2 2\n-2 2\n-1 1\n"
ROWS = """ITEM: ATOMS id x y radius mass vx vy
1 -0.75 0 0.25 75 1 0
2 -0.25 0 0.25 75 1 0
3 0.25 0 0.25 75 -1 0
4 0.75 0 0.25 75 -1 0
"""
Path("mine.dump").write_text(HEAD + ROWS, encoding="utf-8")

universe = open_bodies("mine.dump", time_step=1e-3)  # s
analysis = PercussionAnalysis(universe, left_velocity="dump").run()
percussions = analysis.results.percussions[0]
print("N·s:", percussions.impulse[:, 0], percussions.status)
analysis.plot().figure.savefig("my_dump.png")
