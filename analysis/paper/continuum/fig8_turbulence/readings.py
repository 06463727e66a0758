"""Readings of Fig. 8's "error of the order of 10⁻²": what is compared, how the difference is
measured, with what it agrees."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.pages.section import Cell, Claim, Table, Verdict
from analysis.paper.continuum.exit_room import MESH, SIDE, warn
from analysis.paper.continuum.fig8_turbulence.study import (
    FRICTION,
    Case,
    Forces,
    Pair,
    Pressing,
    Setting,
    Wall,
)
from analysis.support.progress import Progress
from nscd.arrays import Floats

CHECKED = (4.0, 9.0, 25.0, 100.0)  # k_v ≥ 4, of which the paper speaks
# 10⁻² to the nearest power of ten
LARGEST_OF_ORDER = 10**-1.5
# an error that changes by more than this share on a mesh of half the side is the mesh's
SETTLED = 0.2

Measure = Callable[[Pair], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One way to read the error: in words, how it is measured, and the setting."""

    words: str
    measure: Measure
    setting: Setting


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tried:
    """A reading tried: errors (2, k_v) of cases a and b at CHECKED; finer (2,) at k_v = 9 on half
    the mesh, or NaN."""

    reading: Reading
    errors: Floats
    finer: Floats

    @property
    def reached(self) -> bool:
        """Of the order of 10⁻² or less for every k_v and both cases."""
        return bool(self.errors.max() <= LARGEST_OF_ORDER)

    @property
    def settled(self) -> bool:
        """Whether half the mesh leaves the error (at k_v = 9) as it is."""
        here = self.errors[:, CHECKED.index(9.0)]
        return bool((np.abs(self.finer / here - 1) < SETTLED).all())


def readings(mesh: float = MESH) -> list[Reading]:
    """All that are tried, the plain one first; `mesh` is the side of the triangles (m)."""
    plain = Setting(mesh=mesh)
    cell = "mean difference of |F| over the largest |F_t| in any triangle"
    measured: list[tuple[str, Measure, Setting]] = [
        ("‖|F| − |F_t|‖ / ‖F_t‖, L² over the room", Pair.moduli, plain),
        ("‖F − F_t‖ / ‖F_t‖, of the vectors", Pair.vectors, plain),
        ("the same of |F|, as means over a body", Pair.on_bodies, plain),
        ("mean difference of |F| over the mean of |F_t|", Pair.of_mean, plain),
        ("mean difference of |F| over the largest |F_t| over a body", Pair.of_largest_body, plain),
        (cell, Pair.of_largest_cell, plain),
        (f"{cell}, half the mesh", Pair.of_largest_cell, replace(plain, mesh=0.5 * mesh)),
        (
            f"{cell}, p_t = 0 on the exit",
            Pair.of_largest_cell,
            replace(plain, pressing=Pressing.OPEN),
        ),
        ("pressure: ‖p − δt p_t‖ / ‖δt p_t‖ over a body, p_t of (16)", Pair.pressures, plain),
        ("largest pressure over a body: |p − δt p_t| / δt p_t", Pair.largest_pressures, plain),
        ("largest pressure in any triangle: the same", Pair.largest_raw_pressures, plain),
    ]
    varied = [
        ("k_s everywhere, as printed", replace(plain, wall=Wall.EVERYWHERE)),
        ("k_s = 0", replace(plain, wall=Wall.NOWHERE)),
        ("k_s grows with k_v (k_s = k_v/9)", replace(plain, wall=Wall.SHARE)),
        ("ρ in kg/m², k_v and k_s as they stand", replace(plain, mixed_units=True)),
        ("people instead of kilograms throughout", replace(plain, person=1.0)),
        ("√3 in (18), as printed", replace(plain, friction=FRICTION * 1.5**0.5)),
        ("c₂ that makes (16) continuous", replace(plain, pressing=Pressing.CONTINUOUS)),
        ("p_t = 0 on the exit", replace(plain, pressing=Pressing.OPEN)),
        ("p_t from congestion instead of (16)", replace(plain, pressing=Pressing.CONGESTION)),
        ("P2 elements for (11)", replace(plain, order=2)),
        ("δt = 0.001 s", replace(plain, time_step=0.001)),
        ("δt = 0.1 s", replace(plain, time_step=0.1)),
        ("room of 5 m", replace(plain, side=5.0, mesh=5.0 / SIDE * mesh)),
        ("room of 18 m", replace(plain, side=18.0, mesh=18.0 / SIDE * mesh)),
        ("another draw of the random speeds", replace(plain, seed=2)),
    ]
    measured += [(f"L² of |F|: {words}", Pair.moduli, setting) for words, setting in varied]
    return [
        Reading(words=words, measure=measure, setting=setting)
        for words, measure, setting in measured
    ]


class _Compared:
    """Both cases in one setting: each crowd turbulence solved once, and each k_v, when first asked
    for."""

    def __init__(self, setting: Setting, warnings: list[str]) -> None:
        self.setting, self.warnings = setting, warnings
        self.forces = {case: Forces(case, setting) for case in Case}
        self.pairs: dict[tuple[Case, float], Pair] = {}
        for case, forces in self.forces.items():
            step = forces.turbulence
            warn(warnings, f"crowd turbulence, case {case}, {setting}", step.status, step.reason)

    def pair(self, case: Case, k: float) -> Pair:
        if (case, k) not in self.pairs:
            pair = self.pairs[case, k] = self.forces[case].pair(k)
            what = f"(11), case {case}, k_v = {k:g}, {self.setting}"
            warn(self.warnings, what, pair.answer.status, pair.answer.reason)
        return self.pairs[case, k]


def try_all(mesh: float, warnings: list[str], progress: Progress | None = None) -> list[Tried]:
    """Every reading, and on half the mesh where it is of the plain setting or reaches 10⁻²."""
    every, tried = readings(mesh), []
    plain = every[0].setting
    # the plain setting serves many readings, the others one each
    known = {s: _Compared(s, warnings) for s in (plain, replace(plain, mesh=0.5 * mesh))}
    for number, reading in enumerate(every):
        if progress:
            progress("readings of Fig. 8", number / len(every))
        here = known.get(reading.setting) or _Compared(reading.setting, warnings)
        errors = np.array([[reading.measure(here.pair(case, k)) for k in CHECKED] for case in Case])
        finer = np.full(2, np.nan)
        if reading.setting == plain or errors.max() <= LARGEST_OF_ORDER:
            half = replace(reading.setting, mesh=0.5 * reading.setting.mesh)
            there = known.get(half) or _Compared(half, warnings)
            finer = np.array([reading.measure(there.pair(case, 9.0)) for case in Case])
        tried.append(Tried(reading=reading, errors=errors, finer=finer))
    return tried


def readings_table(tried: Sequence[Tried]) -> Table:
    """All readings and their errors."""
    rows: list[list[Cell]] = []
    for t in tried:
        finer: list[Cell] = (
            ["–", "–"] if np.isnan(t.finer).any() else [float(error) for error in t.finer]
        )
        rows.append([t.reading.words, *(float(error) for error in t.errors.ravel()), *finer])
    return Table(
        caption="Readings of Fig. 8's error, δt = 0.01 s unless said; (a) random, (b) uniform left velocity. F = div "
        "σ of (11), "
        "F_t = −δt∇·σ of the crowd turbulence, both N·s/m² (over δt: N/m²; the ratio is the same). Last: on a mesh of half the "
        "side, k_v = 9.",
        head=[
            "reading",
            *(f"{case}: k_v = {k:g}" for case in Case for k in CHECKED),
            *(f"{case}: half the mesh" for case in Case),
        ],
        rows=rows,
    )


def error_claim(tried: Sequence[Tried]) -> Claim:
    """Whether a reading gives 10⁻² for k_v ≥ 4 and δt = 0.01 s, and keeps it on a finer mesh."""
    reached = [t for t in tried if t.reached]
    sound = [t for t in reached if t.settled]
    some = [t for t in tried if t.errors.max(0).min() <= LARGEST_OF_ORDER and t.settled]
    verdict = Verdict.HOLDS if sound else Verdict.PARTLY if some else Verdict.FAILS
    steady = [t for t in tried if t.settled]
    best = min(steady, key=lambda t: float(t.errors.min()))
    raw = next(t for t in tried if t.reading.measure is Pair.of_largest_cell)
    reason = (
        f"{len(tried)} readings. The plain one, a relative difference in L², gives {tried[0].errors.min():.2g} to "
        f"{tried[0].errors.max():.2g}. The least, of any reading that half the mesh leaves as it is, is "
        f"{best.errors.min():.2g} "
        f"({best.reading.words}). Over the largest force in any triangle the mean difference (k_v = 9) is "
        f"{raw.errors[0, 1]:.2g} and {raw.errors[1, 1]:.2g}, and {raw.finer[0]:.2g} and {raw.finer[1]:.2g} on half the mesh: "
        "that order is the mesh's"
    )
    if sound:
        reason += f". {len(sound)} readings hold it for every k_v: {sound[0].reading.words}"
    return Claim(
        where="3.2.2, Fig. 8",
        statement="similar results for k_v ≥ 4 and a time step δt = 0.01 s (error of the order of 10^(-2))",
        verdict=verdict,
        reason=reason,
    )
