"""`python -m nscd`: compile the kernels once and check them on collisions whose answer is known."""

from __future__ import annotations

import logging
import sys
import time

import numpy as np

from nscd import ContactLaw, Snapshot, find_contacts, solve


def main() -> int:
    """Solve a pair with each law; 0 if the percussions are m_eff (1+e) U."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    started = time.perf_counter()
    pair = Snapshot(
        position=np.array([[0.0, 0.0], [0.5, 0.0]]),
        velocity=np.array([[2.0, 0.0], [0.0, 0.0]]),
        radius=np.full(2, 0.25),
        mass=np.full(2, 75.0),
    )
    contacts = find_contacts(pair, tolerance=1e-9)
    laws = {
        75.0: [ContactLaw(), ContactLaw(maintained=True), ContactLaw(dissipation=10.0)],
        112.5: [ContactLaw(restitution=0.5)],
    }
    for impulse, same in laws.items():
        for law in same:
            found = solve(pair, contacts, law=law, tolerance=1e-10)
            if not abs(found.impulse[0, 0] - impulse) < 1e-6:
                logging.error("%s: %g N·s where %g N·s is right", law, found.impulse[0, 0], impulse)
                return 1
    logging.info("kernels compiled and checked in %.1f s", time.perf_counter() - started)
    return 0


if __name__ == "__main__":
    sys.exit(main())
