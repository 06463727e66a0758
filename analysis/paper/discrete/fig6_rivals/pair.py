"""The force of one pair by its gap, under each law."""

import numpy as np

from nscd import Snapshot, find_contacts
from nscd.arrays import Floats
from nscd.rivals import LoehnerReading, loehner_force, social_force

RADIUS_M = 0.25
MASS_KG = 75.0


def pair_forces(gap: Floats, radius: float, limit: float) -> dict[str, Floats]:
    """Compute forces (N) of pairs of equal disks with the given gaps (m), by law."""
    n, apart = len(gap), 10.0 * np.arange(len(gap))
    left, right = np.column_stack([0 * gap, apart]), np.column_stack([2 * radius + gap, apart])
    pairs = Snapshot(
        position=np.concatenate([left, right]),
        velocity=np.zeros((2 * n, 2)),
        radius=np.full(2 * n, radius),
        mass=np.full(2 * n, MASS_KG),
    )
    contacts = find_contacts(pairs, tolerance=float(max(gap.max(), 0.0)) + 1e-9)
    social = social_force(pairs, contacts)
    forces = {"repulsion": social.repulsion, "body": social.body, "social": social.normal}
    for reading in LoehnerReading:
        forces[reading] = loehner_force(pairs, contacts, limit, reading, tolerance=1e-12).on_first
    return forces


def ratio_of_sizes(overlap: float, radii: tuple[float, float]) -> float:
    """Divide the social force of a pair of the second radius (m) by that of the first at the same
    overlap (m)."""
    small, large = (pair_forces(np.array([-overlap]), radius, 1.0)["social"][0] for radius in radii)
    return float(large / small)


def jump_at_touch(limit: float) -> float:
    """Divide Löhner's force as printed just beyond touch by that at touch."""
    at_touch, beyond = pair_forces(np.array([0.0, 1e-6]), RADIUS_M, limit)[LoehnerReading.PRINTED]
    return float(beyond / at_touch)


def pair_rows(limit: float) -> list[list[float]]:
    """Tabulate gap (mm) and forces (N) of one pair at a few gaps, by law."""
    gap = np.array([-0.02, -0.005, 0.0, 0.02, 0.1, 0.3, 0.5])
    rows: list[list[float]] = np.column_stack(
        [1e3 * gap, *pair_forces(gap, RADIUS_M, limit).values()]
    ).tolist()
    return rows
