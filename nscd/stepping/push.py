"""What moves the disks of a motion besides their contacts."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nscd.arrays import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Say what moves disks besides their contacts.

    desired: u_d(q) (n,2) m/s of disks at q (n,2) m
    relaxation_time: s, τ, in which a disk alone comes to it
    acceleration: (x, y) m/s², of all

    Raises ValueError for what is out of range."""

    desired: Callable[[Floats], Floats] | None = None
    relaxation_time: float = np.inf
    acceleration: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        tau = self.relaxation_time
        if self.desired is not None and not (np.isfinite(tau) and tau > 0):
            raise ValueError(f"relaxation_time: {tau} s; a time > 0 is needed")
        if not np.isfinite(self.acceleration).all():
            raise ValueError(
                f"acceleration: {self.acceleration} m/s²; two finite numbers are needed"
            )
