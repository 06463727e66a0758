"""The process in which LAMMPS runs with a look at each step. It imports little, so that short runs
are short."""

# In the folder of the decks: names of walls and their two ends (m), in the order of the scene.
WALLS = "impulse_walls.txt"
# The numbers of a drive whose people keep their distance.
DISTANCE = "drive.txt"
