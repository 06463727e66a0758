"""The answer: percussions with the certificate that says how good they are."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from nscd.arrays import Floats


class Status(enum.StrEnum):
    """solved: the recomputed residual is within the tolerance; inaccurate: it is not; failed: no
    usable answer."""

    SOLVED = "solved"
    INACCURATE = "inaccurate"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Percussions:
    """Percussions of one snapshot (paper eq. (1)), with their certificate.

    reaction λ (k,) N·s, normal, ≥ 0 pushes; impulse p (k,2) N·s, the whole k D(u⁺+u⁻) + λ n that
    the first body gives to the second; right_velocity u⁺ (n,2) m/s; right_spin ω⁺ (n,) rad/s.

    residual: max|min(wλ, −v⁺)| / ‖u⁻‖∞, recomputed from the answer; momentum_error: the largest
    |m(u⁺−u⁻) + Dᵀp| of a disk, relative to the momentum that it has and receives. `solved` means
    that both are within the tolerance. energy_change ½u⁺·Mu⁺ − ½u⁻·Mu⁻ in J (spins included), and
    energy_error: its distance from −½ p·D(u⁺+u⁻), as a share of the kinetic energy before. status,
    and the reason where it is not `solved`; choice: why this solver; canonical: whether λ is the
    one of least elastic energy (which a unique λ is); warnings about the answer."""

    reaction: Floats
    impulse: Floats
    right_velocity: Floats
    right_spin: Floats
    residual: float
    momentum_error: float
    energy_change: float
    energy_error: float
    status: Status
    reason: str
    choice: str
    canonical: bool
    warnings: tuple[str, ...]
    solver: str
    iterations: int
    seconds: float
