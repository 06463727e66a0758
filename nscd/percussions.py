"""The answer: percussions with the certificate that says how good they are."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nscd.arrays import Floats, number
from nscd.bodies import Snapshot
from nscd.contacts import Contacts
from nscd.show import arrays, as_frame, as_html, draw

if TYPE_CHECKING:
    import pandas as pd

# Why kinetic energy can grow, ½ Σ λ·|C u⁻| at contacts that were opening being all that adds to it.
GAIN = "contacts with k > 0 press others together that were opening"


class Status(enum.StrEnum):
    """Say what an answer is worth.

    solved: residual and momentum error, recomputed, are within the tolerance
    inaccurate: they are not
    failed: no usable answer, as some number of it is not finite"""

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
    """Hold what Coulomb friction adds to an answer, all recomputed from it.

    coefficient: (k,) μ
    tangential: (k,) N·s, τ along t = (−n_y, n_x), without k_t
    state: (k,) of `ContactState`
    signorini: max|min(wλ, −v⁺)| / ‖u⁻‖∞, spins times radius included
    cone: max w_t(|τ| − μp_n)₊ / ‖u⁻‖∞
    natural_map: the larger of signorini and max w_t|τ − Π(τ + s⁺/w_t)| / ‖u⁻‖∞, Π onto |τ| ≤ μp_n,
        s⁺ the sliding velocity
    dissipation: Σ|μp_n|s⁺| − τs⁺|, what friction fails to dissipate, as a share of the kinetic
        energy before
    start: where the search for it began, which can decide between several answers
    starts: how many searches were made
    spread: m/s, how far apart the u⁺ are that they led to, spins times radius included; NaN where
        only one did"""

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

    def __repr__(self) -> str:
        counts = ", ".join(
            f"{int((self.state == state).sum())} {state.name.lower()}" for state in ContactState
        )
        return f"<FrictionPart: {counts}, natural map {self.natural_map:.1e}>"

    def columns(self) -> dict[str, list[Any]]:
        """Name the columns that friction adds to a table, each a list of k."""
        states = [ContactState(state).name.lower() for state in self.state]
        return {"friction_Ns": self.tangential.tolist(), "state": states}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Percussions:
    """Hold the percussions of one snapshot (paper eq. (1)) and their certificate.

    impulse: (k,2) N·s, the percussion p = k D(u⁺+u⁻) + λ n + τ t that the first body gives to the
        second: what a contact transmits, and what a mean force over a time Δt is made of, p/Δt
    reaction: (k,) N·s, λ ≥ 0 alone, what keeps the bodies apart: all of p where contacts do not
        dissipate, and 0 where dissipation alone parts them, as in a rebound
    right_velocity: (n,2) m/s, u⁺
    right_spin: (n,) rad/s, ω⁺
    residual: dimensionless, max|min(wλ, −v⁺)| / ‖u⁻‖∞ with w = 1/m_i + 1/m_j, v⁺ = C u⁺; with
        friction its natural map
    velocity_error: m/s, a proven bound of √(Σ m |u⁺ − exact|² / Σ m), spins included, see
        `nscd/core/error_bound.hpp`; inf where none is known, as with friction. It holds for positions as
        they are rounded: of bodies that fit exactly between two walls 1e-16 in a normal can decide
    momentum_error: dimensionless, the largest |m(u⁺−u⁻) + Dᵀp| of a disk, relative to the momentum
        that it has and receives
    energy_change: J, ½u⁺·Mu⁺ − ½u⁻·Mu⁻, spins included
    energy_error: its distance from −½ p·D(u⁺+u⁻), as a share of the kinetic energy before
    status: whether residual and momentum error are within the tolerance
    reason: why it is not `solved`
    warnings: what is odd about the answer
    solver: its name
    choice: why this solver
    canonical: whether λ is the one of least elastic energy (which a unique λ is)
    iterations: sweeps, rounds or factorisations
    seconds: s, of the wall clock
    snapshot, contacts: the n disks and k contacts that were solved
    friction: what Coulomb friction adds; None without
    window: s, the time that turns percussions into forces; None for an impact

    Residual, errors and energies are recomputed from impulse, reaction and velocities. Source:
    Jebrane, Argoul, Hakim, El Rhabi 2019."""

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
    snapshot: Snapshot
    contacts: Contacts
    friction: FrictionPart | None = None
    window: float | None = None

    def over(self, window: float) -> Percussions:
        """Give the same answer with a window (s), over which its percussions are forces p/window.

        That is the relaxation time τ where u⁻ is the desired velocity, the time step where it is
        the velocity that the drive makes without contacts. Raises ValueError for a window that is
        not positive."""
        need = "A time > 0 s"
        if not number(window, "window", need) > 0:
            raise ValueError(f"window: {window}. {need} is needed")
        return replace(self, window=float(window))

    @property
    def force(self) -> Floats:
        """Compute (k,2) N, the contact forces p/window that the first body gives to the second.

        Raises ValueError where no window is known: an impact has percussions and no forces."""
        if self.window is None:
            raise ValueError(
                "force: an impact has percussions (N·s). Read forces of answer.over(seconds)"
            )
        force: Floats = self.impulse / self.window
        return force

    def to_dataframe(self) -> pd.DataFrame:
        """Make a pandas data frame with one row per contact and units in its column names."""
        cells = arrays(self.snapshot.ids, self.contacts, self.reaction, self.impulse, self.window)
        return as_frame(cells | (self.friction.columns() if self.friction else {}))

    def plot(self, axes: Any = None) -> Any:
        """Draw disks and what contacts carry into matplotlib axes; return them."""
        force = self.window is not None
        return draw(
            self.snapshot,
            self.contacts,
            np.hypot(*(self.force if force else self.impulse).T),
            label="contact force (N)" if force else "percussion (N·s)",
            title=f"{self.status}, residual {self.residual:.0e}",
            axes=axes,
        )

    def __repr__(self) -> str:
        size = self.impulse / (self.window or 1.0)
        largest = float(np.hypot(*size.T).max(initial=0.0))
        return (
            f"<Percussions: {len(self.snapshot)} disks, {len(self.contacts)} contacts, largest "
            f"{largest:.3g} {'N·s' if self.window is None else 'N'}, {self.status}, "
            f"residual {self.residual:.1e}>"
        )

    def _repr_html_(self) -> str:
        return as_html(repr(self)[1:-1], self.to_dataframe())
