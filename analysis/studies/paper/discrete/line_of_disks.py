"""Touching disks in a line, and what laws other than percussions make of their impact: Newton's law
and soft contacts."""

import numpy as np
from numpy.typing import ArrayLike

from analysis.percussions.dense_reference import dense_percussions
from analysis.scene.scene import Scene
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats

# Steps of an elastic impact per √(m/k): energy then grows by less than 1e-5 of itself.
STEPS_PER_PERIOD = 400


def aligned(mass: ArrayLike, velocity: ArrayLike, radius: float = 0.25) -> Snapshot:
    """Touching disks of one radius (m) along x, of masses (n,) kg and velocities along x (n,) m/s.

    Raises ValueError, as Snapshot does, for masses and velocities that do not fit."""
    n = len(np.asarray(mass))
    return Snapshot(
        position=np.column_stack([2 * radius * np.arange(n), np.zeros(n)]),
        velocity=np.column_stack([velocity, np.zeros(n)]),
        radius=np.full(n, radius),
        mass=np.asarray(mass, dtype=np.float64),
    )


def newton_impact(mass: ArrayLike, velocity: ArrayLike, restitution: float) -> Floats:
    """Velocities (n,) m/s after an impact of such disks by Newton's law, e in [0, 1], at all
    contacts at once."""
    line = aligned(mass, velocity)
    contacts = find_contacts(line, tolerance=1e-9)
    return dense_percussions(line, contacts, line.velocity, restitution=restitution)[1][:, 0]


def impact_time(scene: Scene) -> float:
    """√(m/k) of the heaviest disk (s): the time in which a soft contact of the scene works."""
    return float(np.sqrt(scene.snapshot.mass.max() / scene.contact.stiffness_N_per_m))


def cradle_scene(
    scene: Scene, disks: int, *, law: str = "hooke", restitution: float = 1.0, periods: float = 12.0
) -> Scene:
    """The first disks of a line with another contact law, run for `periods` times √(m/k) and long
    enough to part."""
    total = scene.snapshot
    part = Snapshot(
        position=total.position[:disks],
        velocity=total.velocity[:disks],
        radius=total.radius[:disks],
        mass=total.mass[:disks],
    )
    name = f"cradle_{disks}_e{restitution:g}"
    variant = scene.model_copy(update={"snapshot": part, "name": name})
    variant = variant.with_contact(law=law, restitution=restitution)
    period = impact_time(variant)
    step = period / STEPS_PER_PERIOD if restitution == 1 else None
    return variant.with_run(duration_s=periods * period, frames=20, time_step_s=step)
