"""A ContactProblem in elimination order, and its matrix–vector products."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nscd.arrays import Floats
from nscd.compiling import inner, kernel
from nscd.compiling.team import ALONE, Team
from nscd.problem import ContactProblem
from nscd.solvers.cholesky.factor import Factor, factor_of

# Up to this ratio of w masses are even: contacts may then all have the same stiffness, whatever
# they join.
EVEN = 100.0


class System(NamedTuple):
    """Hold a ContactProblem with its disks in elimination order, as the kernels take it.

    first, second: (k,) places of the disks, −1 for a wall
    normal_first, normal_second, tangent_first, tangent_second: (k,d), rows of C and T
    normal_weight, tangent_weight: (k,) kg, k_n and k_t
    mass: (n,d) kg, kg m²; d = 2, or 3 with spins
    free: (n,d) m/s, û
    offset: (k,) m/s, b
    inverse_mass: (k,) 1/kg, w
    scale: m/s, ‖u⁻‖∞"""

    first: Any
    second: Any
    normal_first: Any
    normal_second: Any
    tangent_first: Any
    tangent_second: Any
    normal_weight: Any
    tangent_weight: Any
    mass: Any
    free: Any
    offset: Any
    inverse_mass: Any
    scale: float


def system_of(problem: ContactProblem, team: Team = ALONE) -> tuple[System, Factor]:
    """Put a problem into the kernels' form, and reserve storage for its factors in a good order."""
    factor = factor_of(problem, team)
    order, place, contact = factor.order, factor.place, factor.contact
    first, second = problem.first[contact], problem.second[contact]
    system = System(
        first=place[first],
        second=np.where(second >= 0, place[second], np.int32(-1)),
        normal_first=problem.normal_first[contact],
        normal_second=problem.normal_second[contact],
        tangent_first=problem.tangent_first[contact],
        tangent_second=problem.tangent_second[contact],
        normal_weight=problem.normal_weight[contact],
        tangent_weight=problem.tangent_weight[contact],
        mass=problem.mass[order],
        free=problem.free[order],
        offset=problem.offset[contact],
        inverse_mass=problem.inverse_mass[contact],
        scale=problem.scale,
    )
    return system, factor


def in_given_order(problem: ContactProblem) -> System:
    """Put a problem into the kernels' form without reordering it."""
    return System(
        problem.first,
        problem.second,
        problem.normal_first,
        problem.normal_second,
        problem.tangent_first,
        problem.tangent_second,
        problem.normal_weight,
        problem.tangent_weight,
        problem.mass,
        problem.free,
        problem.offset,
        problem.inverse_mass,
        problem.scale,
    )


@kernel
def stiffness(inverse_mass: Any) -> Any:
    """Choose the relative stiffness (k,) kg of the contacts as a penalty model, from their w (k,).

    The same for all, 1/max w, so that its stiff limit has the least Σλ²; 1/w where masses differ
    too much for that."""
    if evenly(inverse_mass):
        return np.full(len(inverse_mass), 1.0 / inverse_mass.max())
    return 1.0 / inverse_mass


def even(inverse_mass: Floats) -> bool:
    """Tell from w (k,) whether masses are even enough for one stiffness, and for first-order
    methods."""
    return bool(inverse_mass.max() <= EVEN * inverse_mass.min())


@inner
def evenly(inverse_mass: Any) -> Any:
    """Tell the same in kernels."""
    return inverse_mass.max() <= EVEN * inverse_mass.min()


@kernel(fastmath=True)
def approach(system: Any, u: Any, out: Any) -> None:
    """Compute out = C u, (k,). C has no entries at the spins."""
    for c in range(len(out)):
        i, j = system.first[c], system.second[c]
        x, y = u[i, 0], u[i, 1]
        if j >= 0:
            x -= u[j, 0]
            y -= u[j, 1]
        out[c] = system.normal_first[c, 0] * x + system.normal_first[c, 1] * y


@kernel(fastmath=True)
def add_reactions(system: Any, reaction: Any, factor: float, out: Any) -> None:
    """Add factor · Cᵀ reaction to out, (n,d)."""
    for c in range(len(reaction)):
        i, j = system.first[c], system.second[c]
        push = factor * reaction[c]
        x, y = system.normal_first[c, 0] * push, system.normal_first[c, 1] * push
        out[i, 0] += x
        out[i, 1] += y
        if j >= 0:
            out[j, 0] -= x
            out[j, 1] -= y


@kernel(fastmath=True)
def inertia(system: Any, u: Any, out: Any) -> None:
    """Compute out = Â u = (M + DᵀKD) u, (n,d)."""
    n, d = u.shape
    for i in range(n):
        for a in range(d):
            out[i, a] = system.mass[i, a] * u[i, a]
    for c in range(len(system.first)):
        if system.normal_weight[c] == 0.0 and system.tangent_weight[c] == 0.0:
            continue
        i, j = system.first[c], system.second[c]
        along = across = 0.0
        for a in range(d):
            along += system.normal_first[c, a] * u[i, a]
            across += system.tangent_first[c, a] * u[i, a]
            if j >= 0:
                along += system.normal_second[c, a] * u[j, a]
                across += system.tangent_second[c, a] * u[j, a]
        along *= system.normal_weight[c]
        across *= system.tangent_weight[c]
        for a in range(d):
            out[i, a] += along * system.normal_first[c, a] + across * system.tangent_first[c, a]
            if j >= 0:
                out[j, a] += (
                    along * system.normal_second[c, a] + across * system.tangent_second[c, a]
                )
