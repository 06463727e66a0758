"""The arch under other laws: dissipation k up to far beyond m_eff, and contacts held shut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.compare.statistics import relative_difference
from analysis.paper.discrete.pressed_crowd.arch import Arch, carried_interval
from nscd import ContactLaw, Percussions
from nscd.arrays import Floats

# kg; two people of 75 kg have the effective mass 37.5 kg
DISSIPATIONS = (0.0, 1.0, 3.0, 10.0, 30.0, 37.5, 100.0, 300.0, 1e3, 1e4)
EFFECTIVE_MASS = 37.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maintained:
    """What the equality W λ = C u⁻ (paper (2), (8)) asks of an arch, by its shortest solution λ/τ.

    pulling: how many contacts pull
    strongest_N, total_N: N, the largest pull and the sum of all
    push_N: N, the largest push
    spread: least over largest singular value of C M^(-1/2), zeros left out
    answer: the percussions with `maintained=True`
    """

    pulling: int
    strongest_N: float  # noqa: N815  (the unit is newton)
    total_N: float  # noqa: N815
    push_N: float  # noqa: N815
    spread: float
    answer: Percussions

    @classmethod
    def of(cls, arch: Arch) -> Maintained:
        """Solve by singular values of the dense M^(-1/2) Cᵀ, which do not square the condition as W
        does."""
        root = np.sqrt(np.repeat(arch.snapshot.mass, 2))
        matrix = arch.contacts.normal_matrix(len(arch.snapshot)).toarray().T / root[:, None]
        reaction, _, rank, values = np.linalg.lstsq(
            matrix, root * arch.left_velocity.ravel(), rcond=1e-10
        )
        force = reaction / arch.window
        pulls = np.minimum(force, 0.0)
        return cls(
            pulling=int((force < -1e-9 * np.abs(force).max()).sum()),
            strongest_N=float(-pulls.min()),
            total_N=float(-pulls.sum()),
            push_N=float(force.max()),
            spread=float(values[rank - 1] / values[0]),
            answer=arch.under(ContactLaw(maintained=True)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """The arch under a law.

    dissipation: kg, k
    across: whether k acts across contacts too, as the paper's single k does
    arch: with the answer under that law
    most: the person who carries most
    lower, upper: N, the proven interval of Σ λ/τ at that person
    """

    dissipation: float
    across: bool
    arch: Arch
    most: int
    lower: float
    upper: float

    @property
    def forces(self) -> Floats:
        """n·p/τ (k,) N."""
        return self.arch.normal_forces()

    @property
    def reactions(self) -> Floats:
        """λ/τ (k,) N."""
        return self.arch.answer.reaction / self.arch.window

    @property
    def name(self) -> str:
        """The law in words."""
        return f"k = {self.dissipation:g} kg{'' if self.across else ', normal only'}"

    @property
    def gains(self) -> bool:
        """Whether the impact gains energy."""
        return self.arch.answer.energy_change > 0

    @property
    def energy_error(self) -> float:
        """How far the balance of energy is from closing, over the energy before."""
        return self.arch.answer.energy_error

    @property
    def energy_share(self) -> float:
        """ΔE/E⁻ of the impact: −1 where all of the left velocity's energy is lost, > 0 where energy
        was gained."""
        mass, left = self.arch.snapshot.mass, self.arch.left_velocity
        return self.arch.answer.energy_change / (0.5 * float(mass @ (left**2).sum(1)))


def dissipation_trials(arch: Arch, dissipations: Sequence[float] = DISSIPATIONS) -> list[Trial]:
    """Solve the arch with each k, along and across the contacts (paper (1)) and along the normals
    only."""
    trials = []
    for across in (True, False):
        for k in dissipations:
            law = ContactLaw(dissipation=k, tangential_dissipation=None if across else 0.0)
            tried = replace(arch, answer=arch.under(law))
            most = tried.largest(tried.carried())
            lower, upper = carried_interval(tried, most)
            trials.append(
                Trial(dissipation=k, across=across, arch=tried, most=most, lower=lower, upper=upper)
            )
    return trials


def changes(trials: Sequence[Trial]) -> Mapping[float, float]:
    """Measure how far the sums of magnitudes are from those of the first trial (rms), by k (kg)."""
    start = trials[0].arch.carried()
    return {t.dissipation: relative_difference(start, t.arch.carried()) for t in trials}
