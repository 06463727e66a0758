"""Who is pressed most in a filmed crowd?

Heads are not bodies: people get a radius, and are moved apart where they would overlap. The report
says how far."""

import numpy as np

from crowd_percussions import import_crowd, percussions_of, read_heads, shipped

scenes = shipped("scenes")
tracked = read_heads(scenes / "gate_excerpt.txt", 405)
crowd = import_crowd(tracked, radius=0.18, room=scenes / "rooms" / "gate.toml", name="filmed")
print(crowd.statement)

found = percussions_of(crowd.scene, crowd.scene.snapshot)
size = np.hypot(*found.pressing.T)  # N, of each contact
load = found.contacts.sum_at_disks(size, len(found.snapshot))
maximum = int(np.argmax(load))
print(f"person {found.snapshot.ids[maximum]}: {load[maximum]:.0f} N in all, {found.solution.status}")
found.plot().figure.savefig("my_trajectory.png")
