"""Complete congestion: crowds that nobody leaves, by the first-order model and by percussions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.paper.discrete.pressed_crowd import AT_REST_M_PER_S, Arch, Blocked
from nscd import solve
from nscd.rivals import first_order

# kg, as in the paper's Fig. 5 here; how often they are drawn for each crowd
LEAST_KG, MOST_KG, DRAWS = 50.0, 100.0, 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Congestion:
    """Whether a crowd behind a blocked exit stays, by law: the fastest inside.

    first_order, equal: m/s, by the first-order model, and by percussions of equal masses
    unequal: (draws,) m/s, by percussions of masses from 50 to 100 kg
    """

    seed: int
    stiffness: float
    first_order: float
    equal: float
    unequal: tuple[float, ...]

    @classmethod
    def of(cls, crowd: Blocked) -> Congestion:
        """Solve a blocked crowd by both models, and with other masses."""
        arch = crowd.arch
        model = first_order(arch.snapshot, arch.contacts, left_velocity=arch.left_velocity)
        random = np.random.default_rng([crowd.seed, round(crowd.stiffness)])
        masses = random.uniform(LEAST_KG, MOST_KG, (DRAWS, len(arch.snapshot)))
        return cls(
            seed=crowd.seed,
            stiffness=crowd.stiffness,
            first_order=_fastest(arch, model.right_velocity),
            equal=_fastest(arch, arch.answer.right_velocity),
            unequal=tuple(_fastest(arch, _with_masses(arch, mass)) for mass in masses),
        )

    @property
    def congests(self) -> bool:
        """Whether the first-order model stops everybody."""
        return self.first_order < AT_REST_M_PER_S

    @property
    def freed(self) -> int:
        """In how many draws unequal masses set somebody free."""
        return sum(speed >= AT_REST_M_PER_S for speed in self.unequal)


def _with_masses(arch: Arch, mass: np.ndarray) -> np.ndarray:
    snapshot = replace(arch.snapshot, mass=mass)
    answer = solve(snapshot, arch.contacts, left_velocity=arch.left_velocity, tolerance=1e-10)
    return answer.right_velocity


def _fastest(arch: Arch, velocity: np.ndarray) -> float:
    """The largest speed (m/s) of those inside."""
    return float(np.hypot(*velocity[arch.inside()].T).max())
