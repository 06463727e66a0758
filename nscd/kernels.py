"""Compile the kernels before their first use, and check them on collisions whose answer is
known."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from nscd import ContactLaw, Snapshot, find_contacts, solve

# (law, N·s along the normal): kernels of small crowds; of large ones and of friction.
COLLISIONS = (
    ((ContactLaw(), 75.0),),
    (
        (ContactLaw(friction=0.3), 75.0),
        (ContactLaw(maintained=True), 75.0),
        (ContactLaw(dissipation=10.0), 75.0),
        (ContactLaw(restitution=0.5), 112.5),
    ),
)


def compiled_wrongly() -> list[str]:
    """Solve a pair with each law, on two cores; a line for each percussion that is not m_eff (1+e)
    U."""
    with ProcessPoolExecutor(len(COLLISIONS), mp_context=get_context("spawn")) as processes:
        return [line for found in processes.map(_wrong, COLLISIONS) for line in found]


def _wrong(collisions: tuple[tuple[ContactLaw, float], ...]) -> list[str]:
    pair = Snapshot(
        position=np.array([[0.0, 0.0], [0.5, 0.0]]),
        velocity=np.array([[2.0, 0.0], [0.0, 0.0]]),
        radius=np.full(2, 0.25),
        mass=np.full(2, 75.0),
    )
    contacts = find_contacts(pair, tolerance=1e-9)
    lines = []
    for law, impulse in collisions:
        found = solve(pair, contacts, law=law, tolerance=1e-10).impulse[0, 0]
        if not abs(found - impulse) < 1e-6:
            lines.append(f"{law}: {found:g} N·s where {impulse:g} N·s is right")
    return lines
