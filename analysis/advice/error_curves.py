"""Expected errors of a setting on a scene, read from the measured curves of the scenes most like
it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.advice.library import Entry
from analysis.advice.likeness import Likeness
from analysis.work_precision.point import Point, PointStatus

# As many scenes are read, none of which is less like the one asked about than FARTHEST (three
# doublings of one number).
NEAREST, FARTHEST = 3, 3.0
# Scenes count by 1/(NEAR² + distance²).
NEAR = 0.35
# Below the softest contacts measured by more than this factor of hardness nothing is known.
SOFTER = 0.7
# Errors below this are rounding.
LEAST = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Expected numerical and model error, before any safety factor."""

    numerical: float
    model: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """The measured curves of one quantity (its points' load) that are read for a scene of a
    likeness."""

    likeness: Likeness
    load: str
    entries: Sequence[Entry]

    @cached_property
    def read(self) -> tuple[tuple[Entry, float], ...]:
        """The entries that are read and their weights, which sum to 1; none where no scene in the
        library is like it."""
        near = [
            (self.likeness.distance(entry.likeness), number, entry)
            for number, entry in enumerate(self.entries)
            if any(point.load == self.load for point in entry.points)
        ]
        near.sort(key=lambda found: found[:2])
        chosen = [
            (entry, 1.0 / (NEAR**2 + d * d)) for d, _, entry in near[:NEAREST] if d <= FARTHEST
        ]
        total = sum(weight for _, weight in chosen)
        return tuple((entry, weight / total) for entry, weight in chosen)

    def shares(self, method: str, law: str) -> list[float]:
        """List the shares of the safe time step that were measured with an engine."""
        points = (p for entry, _ in self.read for p in self._of(entry, method=method, law=law))
        return sorted({p.time_step_share for p in points if p.time_step_share is not None})

    def rigid_settings(self) -> list[tuple[str, float]]:
        """List the solvers that were measured, with their tolerances."""
        points = (p for entry, _ in self.read for p in self._of(entry, method="rigid"))
        return sorted({(p.solver, p.tolerance) for p in points if p.tolerance is not None})

    def soft(self, method: str, law: str, share: float, hardness: float) -> Errors | None:
        """Expect errors of an engine at a share of the safe step, with contacts of a hardness:
        geometric means over the scenes read, each interpolated in log hardness.

        Scenes that know nothing so soft are passed over; None where one did not end well, or all
        know nothing."""
        logs, weights = [], []
        for entry, weight in self.read:
            points = self._of(entry, method=method, law=law)
            run = sorted((p for p in points if p.time_step_share == share), key=entry.hardness)
            if not run or hardness < SOFTER * entry.hardness(run[0]):
                continue
            errors = _between(entry, run, points, hardness)
            if errors is None:
                return None
            logs.append(np.log([errors.numerical, errors.model]))
            weights.append(weight)
        if not logs:
            return None
        numerical, model = np.exp(np.average(logs, axis=0, weights=weights))
        return Errors(numerical=float(numerical), model=float(model))

    def rigid(self, solver: str, tolerance: float) -> Errors | None:
        """Expect the numerical error of a solver asked for a tolerance: the largest of the scenes
        read. None where any did not end well."""
        worst = 0.0
        for entry, _ in self.read:
            point = next(iter(self._of(entry, solver=solver, tolerance=tolerance)), None)
            if point is None or point.status != PointStatus.OK or point.numerical_error is None:
                return None
            worst = max(worst, point.numerical_error)
        return Errors(numerical=worst, model=0.0) if self.read else None

    def rigid_seconds(self, solver: str, tolerance: float) -> float:
        """Expect CPU seconds of a solution, in proportion to the disks: geometric mean over the
        scenes read."""
        logs, weights = [], []
        for entry, weight in self.read:
            for point in self._of(entry, solver=solver, tolerance=tolerance):
                seconds = (point.cpu_seconds or LEAST) * self.likeness.disks / point.disks
                logs.append(np.log(seconds))
                weights.append(weight)
        return float(np.exp(np.average(logs, weights=weights)))

    def _of(self, entry: Entry, **setting: object) -> list[Point]:
        """The points of an entry with this load and setting."""
        return [
            point
            for point in entry.points
            if point.load == self.load
            and all(getattr(point, name) == value for name, value in setting.items())
        ]


def _between(
    entry: Entry, run: Sequence[Point], all_of_law: Sequence[Point], hardness: float
) -> Errors | None:
    """The errors of an entry at a hardness, between its two nearest points of a run (from soft to
    hard), beyond the ends those at the end; None where one of them did not end well. No contact is
    credited with less model error than a harder one: a load that rings can come out right by
    luck."""
    known = [entry.hardness(point) for point in run]
    place = int(np.clip(np.searchsorted(known, hardness), 1, max(len(run) - 1, 1)))
    beside = run[place - 1 : place + 1]
    at, numerical, model = known[place - 1 : place + 1], [], []
    for point, hard in zip(beside, at, strict=True):
        if point.status != PointStatus.OK or None in (point.numerical_error, point.model_error):
            return None
        harder = (q for q in all_of_law if entry.hardness(q) >= (1 - 1e-9) * hard)
        numerical.append(max(point.numerical_error or 0.0, LEAST))
        model.append(max(LEAST, *(q.model_error or 0.0 for q in harder)))

    def read(errors: Sequence[float]) -> float:
        return float(np.exp(np.interp(np.log(hardness), np.log(at), np.log(errors))))

    return Errors(numerical=read(numerical), model=read(model))
