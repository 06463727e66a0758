"""Stress of an engine's contact forces and of the percussions on the same snapshot."""

from numpy.typing import ArrayLike

from analysis.compare.comparison import Comparison
from nscd.stress import Kernel, StressField, stress_field


def stresses(
    comparison: Comparison, kernel: Kernel, at: ArrayLike
) -> tuple[StressField, StressField]:
    """Coarse-grain stress, divergence and wall traction of the engine and of the percussions.

    at: (m,2) m, the points

    For a driven crowd of its contact forces and of p/τ, in N/m; for an impact of ∫f dt and of p, in
    N·s/m: like with like. Contacts that only one of them has carry nothing in the other. Raises
    ValueError as `stress_field` does."""
    match, snapshot = comparison.match, comparison.snapshot
    return (
        stress_field(snapshot, match.contacts, match.penalty, kernel, at),
        stress_field(snapshot, match.contacts, match.rigid, kernel, at),
    )
