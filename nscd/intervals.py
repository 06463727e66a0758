"""How much a contact, a disk or a wall can carry: proven intervals over all admissible percussions."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components

from nscd.admissible import Admissible, Optimum, ProgramError, maximise
from nscd.bodies import Floats, read_only
from nscd.contacts import Contacts
from nscd.orthogonal import factorise
from nscd.percussions import Percussions

# Ends are called proven if certificate and attained value agree to this share of the largest reaction.
PROVEN = 1e-8
# Where disks are wedged no bound holds for all percussions; ends are proven for those up to this multiple of the answer.
WEDGED_MULTIPLE = 1e3


class IntervalStatus(enum.StrEnum):
    """proven: both ends are; unbounded: an end is infinite, by a self-stress that only pushes, a finite one proven;
    unproven: certificate and attained value differ by `gap`; the interval still contains the true one."""

    PROVEN = "proven"
    UNBOUNDED = "unbounded"
    UNPROVEN = "unproven"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interval:
    """[lower, upper] of Σ w_c λ'_c over the admissible percussions λ' (N·s for weights without unit).

    lower and upper are bounds by weak duality: no admissible percussion lies beyond; gap: how far at most they are from
    values that are attained (rounding, or `unproven`). lower_velocity, upper_velocity (n,2): the certificates, and by
    how much an end moves when the impulses on the disks change by Δ (n,2) N·s: Σ w λ' ≤ upper + Σ upper_velocity·Δ for
    every λ' ≥ 0 whose impulses Cᵀλ' differ from the answer's by Δ (and likewise ≥ lower + …).
    """

    lower: float
    upper: float
    gap: float
    status: IntervalStatus
    lower_velocity: Floats
    upper_velocity: Floats

    @property
    def width(self) -> float:
        """upper − lower; 0 but for rounding where the mechanics determines the quantity."""
        return self.upper - self.lower


@dataclass(frozen=True, slots=True, eq=False)
class Intervals:
    """Intervals of one answer, one after the other; what they share is computed once."""

    admissible: Admissible
    _pressing: dict[int, tuple[Optimum, NDArray[np.bool_]]] = field(default_factory=dict)
