"""Where the ladder goes from one solver to the next, in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """Hold the numbers that the rungs choose by, all found by measuring (docs/results/solvers.md).

    sweeps: of a descent, at most, before its closed contacts are tried
    few_sweeps: the same in a small crowd, where a factorisation is cheap
    large: from this many disks on a crowd is large
    steady, steady_share: a descent has found the closed contacts once no more than this number
        and this share of all contacts change within 25 sweeps
    isostatic, redundant: between these numbers of closed contacts per unknown a packing is
        marginal: it has soft modes, and active sets cycle
    soft_accuracy: to this residual soft contacts are solved before their active set is closed
    pressed: a reaction above this share of the largest is one of a closed contact
    unique: reactions that differ by less than this share of the largest are the same"""

    sweeps: int = 1600
    few_sweeps: int = 200
    large: int = 2000
    steady: int = 2
    steady_share: float = 1e-3
    isostatic: float = 1.0
    redundant: float = 1.2
    soft_accuracy: float = 1e-7
    pressed: float = 1e-9
    unique: float = 1e-8


AT = Thresholds()
