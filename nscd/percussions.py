"""The answer: percussions with the certificate that says how good they are."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscd.arrays import Floats


class Status(enum.StrEnum):
    """solved: the recomputed residual is within the tolerance; inaccurate: it is not; failed: no
    usable answer."""

    SOLVED = "solved"
    INACCURATE = "inaccurate"
    FAILED = "failed"


class ContactState(enum.IntEnum):
    """Name what a contact with friction does: open, stuck, or sliding along ±t, t = (−n_y, n_x)."""

    OPEN = 0
    STICK = 1
    FORWARD = 2
    BACKWARD = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionPart:
    """What Coulomb friction adds to an answer, all recomputed from it.

    coefficient (k,) μ; tangential (k,) N·s τ along (−n_y, n_x), without k_t; state (k,) of
    `ContactState`. Residuals, in units of ‖u⁻‖∞ (spins times radius included): signorini max|min(wλ,
    −v⁺)|; cone max w_t(|τ| − μp_n)₊; natural_map the larger of signorini and max w_t|τ − Π(τ + s⁺/w_t)|,
    Π onto |τ| ≤ μp_n, s⁺ the sliding velocity. dissipation: Σ|μp_n|s⁺| − τs⁺|, what friction fails to
    dissipate, as a share of the kinetic energy before. start: where the search for it began, which
    can decide between several answers. starts: from how many it was searched; spread m/s: how far
    apart the u⁺ are that they led to, spins times radius included, NaN where only one did."""

    coefficient: Floats
    tangential: Floats
    state: NDArray[np.int8]
    signorini: float
    cone: float
    dissipation: float
    natural_map: float
    start: str
    starts: int = 1
    spread: float = float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Percussions:
    """Percussions of one snapshot (paper eq. (1)), with their certificate.

    reaction λ (k,) N·s, normal, ≥ 0 pushes; impulse p (k,2) N·s, the whole k D(u⁺+u⁻) + λ n that
    the first body gives to the second; right_velocity u⁺ (n,2) m/s; right_spin ω⁺ (n,) rad/s.

    residual: max|min(wλ, −v⁺)| / ‖u⁻‖∞, recomputed from the answer; momentum_error: the largest
    |m(u⁺−u⁻) + Dᵀp| of a disk, relative to the momentum that it has and receives. velocity_error m/s:
    a proven bound of √(Σ m |u⁺ − exact|² / Σ m), spins included (`nscd.solvers.velocity_error`); inf
    where none is known, as with friction. `solved` means that both are within the tolerance. energy_change ½u⁺·Mu⁺ − ½u⁻·Mu⁻ in J (spins included), and
    energy_error: its distance from −½ p·D(u⁺+u⁻), as a share of the kinetic energy before. status,
    and the reason where it is not `solved`; choice: why this solver; canonical: whether λ is the
    one of least elastic energy (which a unique λ is); warnings about the answer. friction: what
    Coulomb friction adds, None without; the residual is then its natural map, and the impulse holds
    the friction."""

    reaction: Floats
    impulse: Floats
    right_velocity: Floats
    right_spin: Floats
    residual: float
    velocity_error: float
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
    friction: FrictionPart | None = None
