"""What a run costs: an engine's start and its cost per disk and step, fitted to the measured
runs."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.advice.library import Entry, stored_library
from analysis.engines import engine as engine_named
from analysis.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """CPU seconds of an engine's run: start_s + disk_step_s · disks · steps."""

    start_s: float
    disk_step_s: float

    def of(self, disk_steps: float) -> float:
        """Give CPU seconds of so many disks times steps."""
        return self.start_s + self.disk_step_s * disk_steps


def price_of(method: str, law: str, entries: Sequence[Entry]) -> Price | None:
    """Fit the price to all runs of an engine and law that ended, by non-negative least squares of
    the relative error; None where there is none."""
    runs = {
        (entry.name, point.stiffness_N_per_m, point.time_step_share): (
            entry.particle_steps(point),
            point.cpu_seconds,
        )
        for entry in entries
        for point in entry.points
        if (point.method, point.law) == (method, law) and point.status == "ok" and point.cpu_seconds
    }
    if not runs:
        return None
    work, seconds = np.array(list(runs.values()), dtype=float).T
    terms, fits = np.column_stack([1.0 / seconds, work / seconds]), []
    for kept in ([0, 1], [0], [1]):
        fitted = np.zeros(2)
        fitted[kept] = np.linalg.lstsq(terms[:, kept], np.ones(len(seconds)))[0]
        fits.append((fitted.min() < 0, float(np.sum((terms @ fitted - 1) ** 2)), *fitted))
    _, _, start, disk_step = min(fits)
    return Price(start_s=float(start), disk_step_s=float(disk_step))


# Not in the library, whose entries are penalty runs: fitted to `arch`, `jam` and 5,000 people, exact
# (benchmarks/rigid.py).
RIGID_PRICE = Price(start_s=2.1, disk_step_s=2.5e-6)
# What summing impulses costs besides: runs of `arch` of 1 s with and without (benchmarks/converge.py).
IMPULSES = {
    "lammps": Price(start_s=1.9, disk_step_s=4e-7),
    "yade": Price(start_s=0.0, disk_step_s=3.9e-6),
}


@functools.cache
def _stored_price(engine: str, law: str) -> Price:
    if engine == "rigid":
        return RIGID_PRICE
    # of an engine that nobody has measured nothing is said
    return price_of(engine, law, stored_library().entries) or Price(start_s=0.0, disk_step_s=0.0)


def expected_seconds(scene: Scene, engine: str) -> float:
    """Return about how long the engine takes to run the scene (CPU s on the machine of the stored
    library)."""
    known = {
        (point.method, point.law) for entry in stored_library().entries for point in entry.points
    }
    law = scene.contact.law if (engine, scene.contact.law) in known else "hooke"
    work = len(scene.snapshot) * engine_named(engine).timing(scene).steps
    impulses = IMPULSES[engine].of(work) if scene.run.impulses and engine in IMPULSES else 0.0
    return _stored_price(engine, law).of(work) + impulses
