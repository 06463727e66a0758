"""Can a solver of others take my problem, and I theirs?

FCLIB is the form in which Siconos and others exchange contact problems with friction. Out, in, and
solved again."""

from pathlib import Path

import numpy as np

from crowd_percussions import percussions_of, read_problem, read_scene, write_problem

scene = read_scene("gate").with_contact(friction=0.3)
found = percussions_of(scene, scene.snapshot)
write_problem(Path("gate.hdf5"), found, {"source": "a filmed crowd before a gate"})

again = read_problem(Path("gate.hdf5")).solve()
difference = float(np.abs(again.solution.right_velocity - found.solution.right_velocity).max())
print(f"{len(found.contacts)} contacts, {found.solution.status}; u⁺ differs by {difference:.0e} m/s")
