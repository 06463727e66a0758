"""The impact of a line of disks by every law: percussions, Newton's law, soft contacts of both
engines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import bisect

from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell
from analysis.paper.discrete.line_of_disks import (
    aligned,
    cradle_scene,
    newton_impact,
    velocities_after,
)
from analysis.scene.scene import read_scene
from analysis.support.progress import Progress
from nscd import ContactLaw, Percussions, find_contacts, solve
from nscd.arrays import Floats

TOLERANCE = 1e-10
MASS, PRINTED_K, LIGHT = 75.0, 10.0, 1.0  # kg
# k of the limit k → ∞, over m: large, yet not beyond what double precision resolves.
LARGE = 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Impact:
    """One law's answer for a line: masses (n,) kg, velocities before and after (n,) m/s; the
    percussions where it has any."""

    law: str
    mass: Floats
    before: Floats
    after: Floats
    answer: Percussions | None = None

    @property
    def first_impulse(self) -> float:
        """p between the first two disks (N·s), from the momentum of the first."""
        return float(self.mass[0] * (self.before[0] - self.after[0]))

    @property
    def energies(self) -> tuple[float, float]:
        """Kinetic energy before and after (J)."""
        return tuple(float(0.5 * self.mass @ u**2) for u in (self.before, self.after))  # type: ignore[return-value]

    def row(self) -> list[Cell]:
        """Law, mass, u⁺ of each disk, p¹², λ¹², energies, status."""
        answer = self.answer
        reaction: Cell = "–" if answer is None else float(answer.reaction[0])
        status = "–" if answer is None else ", ".join([str(answer.status), *answer.warnings])
        return [
            self.law,
            float(self.mass[0]),
            *map(float, self.after),
            self.first_impulse,
            reaction,
            *self.energies,
            status,
        ]


def percussions(mass: ArrayLike, left: ArrayLike, law: ContactLaw) -> Percussions:
    """Percussions of touching disks in a line with masses (n,) kg and left velocities (n,) m/s."""
    snapshot = aligned(mass, left)
    return solve(snapshot, find_contacts(snapshot, tolerance=1e-9), law=law, tolerance=TOLERANCE)


def first_only(disks: int, speed: float = 2.0) -> Floats:
    """Left velocities (n,) m/s where the first disk moves and the others are at rest."""
    return np.concatenate([[speed], np.zeros(disks - 1)])


def opening_threshold(mass: ArrayLike) -> float:
    """The k (kg) beyond which the first contact of a line at rest, hit by its first disk, opens; by
    bisection.

    The sign is that of λ¹²/m − (u²⁺ − u¹⁺): the contact carries a reaction below the threshold and
    opens above."""
    masses = np.asarray(mass, dtype=np.float64)
    left = first_only(len(masses))

    def pressed(k: float) -> float:
        answer = percussions(masses, left, ContactLaw(dissipation=k))
        right = answer.right_velocity[:, 0]
        return float(answer.reaction[0] / masses[0] + right[0] - right[1])

    return float(
        bisect(pressed, 1e-3 * masses.min(), 1e3 * masses.max(), xtol=1e-10 * masses.min())
    )


def line_restitution(disks: int, restitution: float) -> float:
    """(u²⁺ − u¹⁺)/U of equal disks hit by their first one, with k of the pair's `restitution`."""
    left = first_only(disks)
    right = percussions(
        np.full(disks, MASS), left, ContactLaw(restitution=restitution)
    ).right_velocity[:, 0]
    return float((right[1] - right[0]) / left[0])


def influence(mass: ArrayLike, left: ArrayLike, step: float = 1e-3) -> Floats:
    """∂λ¹²/∂u_j⁻ (n,) kg of the inelastic impact, by central differences of `step` m/s."""
    base = np.asarray(left, dtype=np.float64)
    changes = [
        percussions(mass, base + shift, ContactLaw()).reaction[0]
        - percussions(mass, base - shift, ContactLaw()).reaction[0]
        for shift in step * np.eye(len(base))
    ]
    return np.array(changes) / (2 * step)


def cradle_runs(disks: int, runs: Path) -> list[EngineRun]:
    """The line as soft disks: elastic and strongly damped, by both engines, and with Hertz' law."""
    scene = read_scene("four_disks")
    return [
        EngineRun.of(
            cradle_scene(scene, disks, law=law, restitution=e, periods=periods), engine, runs
        )
        for engine, law, e, periods in (
            ("lammps", "hooke", 1.0, 12),
            ("yade", "hooke", 1.0, 12),
            ("lammps", "hertz", 1.0, 48),
            ("lammps", "hooke", 0.01, 100),
            ("yade", "hooke", 0.01, 100),
        )
    ]


def impacts_of(
    disks: int, runs: Path, warnings: list[str], progress: Progress | None
) -> list[Impact]:
    """The impact of a line by every law; the first four: k = 0, the printed k with both masses, k →
    ∞."""
    mass, left = np.full(disks, MASS), first_only(disks)
    cases = [
        ("percussions, k = 0", mass, ContactLaw()),
        (f"percussions, k = {PRINTED_K:g} kg", mass, ContactLaw(dissipation=PRINTED_K)),
        (
            f"percussions, k = {PRINTED_K:g} kg, m = {LIGHT:g} kg",
            mass / MASS * LIGHT,
            ContactLaw(dissipation=PRINTED_K),
        ),
        ("percussions, k = 10⁶ m (k → ∞)", mass, ContactLaw(dissipation=LARGE * MASS)),
        ("percussions, pair's e = 0.5", mass, ContactLaw(restitution=0.5)),
    ]
    impacts = []
    for law, masses, contact_law in cases:
        answer = percussions(masses, left, contact_law)
        after = answer.right_velocity[:, 0]
        impacts.append(Impact(law=law, mass=masses, before=left, after=after, answer=answer))
    snapshot = aligned(mass, left)
    contacts = find_contacts(snapshot, tolerance=1e-9)
    for e in (0.5, 1.0):
        after = newton_impact(snapshot, contacts, e)[:, 0]
        impacts.append(Impact(law=f"Newton, e = {e:g}", mass=mass, before=left, after=after))
    for run in cradle_runs(disks, runs):
        contact = run.scene.contact
        try:
            after = velocities_after(run, progress)[:, 0]
        except EngineError as error:
            warnings.append(f"{run.scene.name}, {run.engine}: {error}")
            continue
        label = f"{ENGINE_NAMES[run.engine]}, e = {contact.restitution:g}, {contact.law}"
        impacts.append(Impact(law=label, mass=mass, before=left, after=after))
    return impacts
