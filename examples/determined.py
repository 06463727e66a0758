"""Which contact forces can be known at all?

Six people stand round a seventh and press on them: 12 contacts, and balance determines one fewer.
Every reaction then lies in an interval; inside it no measurement of motion tells one from another."""

import numpy as np

from crowd_percussions import (
    Snapshot,
    determinacy,
    draw,
    find_contacts,
    interval,
    solve,
    weights_of_contacts,
)

angle = np.arange(6) * np.pi / 3
outward = np.column_stack([np.cos(angle), np.sin(angle)])
ring = Snapshot(
    position=np.concatenate([np.zeros((1, 2)), 0.5 * outward]),
    velocity=np.concatenate([np.zeros((1, 2)), -outward]),  # m/s, all towards the middle
    radius=np.full(7, 0.25),
    mass=np.full(7, 75.0),
)
contacts = find_contacts(ring, tolerance=1e-9)
known = determinacy(contacts, len(ring))
print(f"{len(contacts)} contacts, rank {known.rank}, determined: {known.determined.sum()}")

solution = solve(ring, contacts)
first = interval(contacts, solution, weights_of_contacts(contacts, 0))
ends = np.round([first.lower, first.upper], 6) + 0.0
print(f"the first: {solution.reaction[0]:.1f} N·s, anything from {ends[0]:g} to {ends[1]:g} N·s")
draw(ring, contacts, solution.reaction, label="N·s", title="one of many answers").figure.savefig(
    "determined.png"
)
