"""Stress of an engine's contact forces and of the percussions on the same snapshot."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from analysis.compare.comparison import Comparison
from nscd import Contacts
from nscd.stress import Kernel, StressField, stress_field


def stresses(
    comparison: Comparison, kernel: Kernel, at: ArrayLike
) -> tuple[StressField, StressField]:
    """Coarse-grained stress, divergence and wall traction at the points (m,2) m, of the engine and
    of the percussions.

    For a driven crowd of its contact forces and of p/τ, in N/m; for an impact of ∫f dt and of p, in
    N·s/m: like with like. Contacts that only one of them has carry nothing in the other. Raises
    ValueError as `stress_field` does."""
    snapshot = comparison.snapshot
    first = np.searchsorted(snapshot.ids, comparison.first)
    disk = np.searchsorted(
        snapshot.ids, np.where(comparison.is_wall, snapshot.ids[0], comparison.second)
    )
    contacts = Contacts(
        first=first,
        second=np.where(comparison.is_wall, comparison.second - 1, disk),
        is_wall=comparison.is_wall,
        normal=comparison.normal,
        gap=comparison.gap,
        point=snapshot.position[first] + snapshot.radius[first, None] * comparison.normal,
    )
    return (
        stress_field(snapshot, contacts, comparison.penalty, kernel, at),
        stress_field(snapshot, contacts, comparison.rigid, kernel, at),
    )
