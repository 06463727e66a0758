"""The impact of a line of disks by every law: percussions, Newton's law, soft contacts of both engines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from analysis.charts import ENGINE_NAMES
from analysis.engines import EngineError
from analysis.paper.cradle import aligned, cradle_scene, newton_impact, velocities_after
from analysis.paper.section import Cell, Progress
from analysis.scene import read_scene
from nscd import ContactLaw, Percussions, find_contacts, solve
from nscd.bodies import Floats

TOLERANCE = 1e-10
MASS, PRINTED_K, LIGHT = 75.0, 10.0, 1.0  # kg
# k of the limit k → ∞, over m: large, yet not beyond what double precision resolves.
LARGE = 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Impact:
    """One law's answer for a line: masses (n,) kg, velocities before and after (n,) m/s; the percussions where it has any."""

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


def impacts_of(disks: int, runs: Path, warnings: list[str], progress: Progress | None) -> list[Impact]:
    """The impact of a line by every law; the first four: k = 0, the printed k with both masses, k → ∞."""
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
    scene = read_scene("four_disks")
    for engine, law, e, periods in (
        ("lammps", "hooke", 1.0, 12),
        ("yade", "hooke", 1.0, 12),
        ("lammps", "hertz", 1.0, 48),
        ("lammps", "hooke", 0.01, 100),
        ("yade", "hooke", 0.01, 100),
    ):
        variant = cradle_scene(scene, disks, law=law, restitution=e, periods=periods)
        try:
            after = velocities_after(variant, engine, runs, progress)[:, 0]
        except EngineError as error:
            warnings.append(f"{variant.name}, {engine}: {error}")
            continue
        label = f"{ENGINE_NAMES[engine]}, e = {e:g}, {law}"
        impacts.append(Impact(law=label, mass=mass, before=left, after=after))
    return impacts
