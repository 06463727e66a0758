"""Readings of Fig. 8's "error of the order of 10⁻²": what is compared, how, with what it agrees."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import MESH, SIDE
from analysis.paper.continuum.fig8_turbulence.forces import (
    Case,
    Forces,
    Pair,
    Pressing,
    Setting,
    Wall,
)
from nscd.arrays import Floats

CHECKED = (4.0, 9.0, 25.0, 100.0)  # k_v ≥ 4, of which the paper speaks
FINER = 9.0  # the k_v that is tried on half the mesh too
# 10⁻² to the nearest power of ten
LARGEST_OF_ORDER = 10**-1.5
# an error that changes by more than this share on a mesh of half the side is the mesh's
SETTLED = 0.2
CELL = "mean difference of |F| over the largest |F_t| in any triangle"

Measure = Callable[[Pair], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One way to read the error: in words, how it is measured, and the setting."""

    words: str
    measure: Measure
    setting: Setting


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tried:
    """A reading tried.

    errors: (2, k_v) of cases a and b at CHECKED.
    finer: (2,) at FINER on half the mesh, or NaN.
    """

    reading: Reading
    errors: Floats
    finer: Floats

    @property
    def reached(self) -> bool:
        """Of the order of 10⁻² or less for every k_v and both cases."""
        return bool(self.errors.max() <= LARGEST_OF_ORDER)

    @property
    def reached_somewhere(self) -> bool:
        """The same for one k_v and both cases."""
        return bool(self.errors.max(0).min() <= LARGEST_OF_ORDER)

    @property
    def at_finer(self) -> Floats:
        """(2,) at FINER on the mesh itself."""
        return self.errors[:, CHECKED.index(FINER)]

    @property
    def settled(self) -> bool:
        """Whether half the mesh leaves the error as it is."""
        return bool((np.abs(self.finer / self.at_finer - 1) < SETTLED).all())


def readings(mesh: float = MESH) -> list[Reading]:
    """List all that are tried, the plain one first; `mesh` is the side of the triangles (m)."""
    plain = Setting(mesh=mesh)
    opened, half = replace(plain, pressing=Pressing.OPEN), replace(plain, mesh=0.5 * mesh)
    measured: list[tuple[str, Measure, Setting]] = [
        ("‖|F| − |F_t|‖ / ‖F_t‖, L² over the room", Pair.of_moduli, plain),
        ("‖F − F_t‖ / ‖F_t‖, of the vectors", Pair.of_vectors, plain),
        ("the same of |F|, as means over a body", Pair.on_bodies, plain),
        ("mean difference of |F| over the mean of |F_t|", Pair.of_mean, plain),
        ("mean difference of |F| over the largest |F_t| over a body", Pair.of_largest_body, plain),
        (CELL, Pair.of_largest_cell, plain),
        (f"{CELL}, half the mesh", Pair.of_largest_cell, half),
        (f"{CELL}, p_t = 0 on the exit", Pair.of_largest_cell, opened),
        ("pressure: ‖p − δt p_t‖ / ‖δt p_t‖ over a body, p_t of (16)", Pair.of_pressures, plain),
        ("largest pressure over a body: |p − δt p_t| / δt p_t", Pair.of_largest_pressures, plain),
        ("largest pressure in any triangle: the same", Pair.of_raw_pressures, plain),
    ]
    varied = [
        ("k_s everywhere, as printed", replace(plain, wall=Wall.EVERYWHERE)),
        ("k_s = 0", replace(plain, wall=Wall.NOWHERE)),
        ("k~s~ grows with k~v~ (k~s~ = k~v~/9)", replace(plain, wall=Wall.SHARE)),
        ("ρ in kg/m², k~v~ and k~s~ as they stand", replace(plain, mixed_units=True)),
        ("people instead of kilograms throughout", replace(plain, person=1.0)),
        ("√3 in (18), as printed", replace(plain, friction=plain.friction * 1.5**0.5)),
        ("c₂ that makes (16) continuous", replace(plain, pressing=Pressing.CONTINUOUS)),
        ("p_t = 0 on the exit", opened),
        ("p_t from congestion instead of (16)", replace(plain, pressing=Pressing.CONGESTION)),
        ("P2 elements for (11)", replace(plain, order=2)),
        ("δt = 0.001 s", replace(plain, time_step=0.001)),
        ("δt = 0.1 s", replace(plain, time_step=0.1)),
        ("room of 5 m", replace(plain, side=5.0, mesh=5.0 / SIDE * mesh)),
        ("room of 18 m", replace(plain, side=18.0, mesh=18.0 / SIDE * mesh)),
        ("another draw of the random speeds", replace(plain, seed=2)),
    ]
    measured += [(f"L² of |F|: {words}", Pair.of_moduli, setting) for words, setting in varied]
    return [Reading(words=w, measure=measure, setting=setting) for w, measure, setting in measured]


class Compared:
    """Forces of both cases in each setting, solved when first asked for.

    The plain setting and that on half the mesh serve many readings and are kept.
    warnings: of what was not solved.
    """

    def __init__(self, plain: Setting) -> None:
        self.plain = plain
        self.warnings: dict[str, None] = {}
        self.known = {(case, s): Forces(case, s) for case in Case for s in (plain, _halved(plain))}

    def errors(self, reading: Reading, volumes: Sequence[float], *, half: bool = False) -> Floats:
        """Measure both cases for each k_v, (2, k_v), if asked for on half the mesh."""
        setting = _halved(reading.setting) if half else reading.setting
        rows = []
        for case in Case:
            forces = self.known.get((case, setting)) or Forces(case, setting)
            rows.append([reading.measure(forces.pair(volume)) for volume in volumes])
            self.warnings |= dict.fromkeys(unsolved(forces.answers))
        return np.array(rows)

    def tried(self, reading: Reading) -> Tried:
        """Try a reading, on half the mesh too where it is of the plain setting or reaches 10⁻²."""
        errors, finer = self.errors(reading, CHECKED), np.full(2, np.nan)
        if reading.setting == self.plain or errors.max() <= LARGEST_OF_ORDER:
            finer = self.errors(reading, [FINER], half=True)[:, 0]
        return Tried(reading=reading, errors=errors, finer=finer)


def _halved(setting: Setting) -> Setting:
    return replace(setting, mesh=0.5 * setting.mesh)
