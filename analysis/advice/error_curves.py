"""Expected errors of a setting on a scene, read from the measured curves of the scenes most like
it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    """The measured curves of one quantity (its points' names begin with `load`: contact, disk,
    wall, displacement) that are read for a scene of a likeness."""

    likeness: Likeness
    load: str
    entries: Sequence[Entry]

    @cached_property
    def read(self) -> tuple[tuple[Entry, float], ...]:
        """The entries that are read and their weights, which sum to 1; none where no scene in the
        library is like it."""
        near = sorted(
            (
                (self.likeness.distance(entry.likeness), number, entry)
                for number, entry in enumerate(self.entries)
                if any(self._ours(point) for point in entry.points)
            ),
            key=lambda found: found[:2],
        )
        chosen = [
            (entry, 1.0 / (NEAR**2 + d * d)) for d, _, entry in near[:NEAREST] if d <= FARTHEST
        ]
        total = sum(weight for _, weight in chosen)
        return tuple((entry, weight / total) for entry, weight in chosen)

    def shares(self, method: str, law: str) -> list[float]:
        """List the shares of the safe time step that were measured with an engine."""
        return sorted(
            {
                point.time_step_share
                for entry, _ in self.read
                for point in entry.points
                if (point.method, point.law) == (method, law) and point.time_step_share is not None
            }
        )

    def rigid_settings(self) -> list[tuple[str, float]]:
        """List the solvers that were measured, with their tolerances."""
        return sorted(
            {
                (point.solver, point.tolerance)
                for entry, _ in self.read
                for point in entry.points
                if point.method == "rigid" and point.tolerance is not None
            }
        )

    def soft(self, method: str, law: str, share: float, hardness: float) -> Errors | None:
        """Errors of an engine at a share of the safe step, with contacts of a hardness: geometric
        means over the scenes read, each interpolated in log hardness. Scenes that know nothing so
        soft are passed over; None where one did not end well, or all know nothing."""
        found = []
        for entry, weight in self.read:
            points = [
                p for p in entry.points if self._ours(p) and (p.method, p.law) == (method, law)
            ]
            run = sorted((p for p in points if p.time_step_share == share), key=entry.hardness)
            if not run or hardness < SOFTER * entry.hardness(run[0]):
                continue
            errors = _between(entry, run, points, hardness)
            if errors is None:
                return None
            found.append((weight, errors))
        return _mean(found)

    def rigid(self, solver: str, tolerance: float) -> Errors | None:
        """Numerical error of a solver asked for a tolerance: the largest of the scenes read. None
        where any did not end well."""
        worst = 0.0
        for entry, _ in self.read:
            points = [
                p
                for p in entry.points
                if self._ours(p) and (p.solver, p.tolerance) == (solver, tolerance)
            ]
            if (
                not points
                or points[0].status != PointStatus.OK
                or points[0].numerical_error is None
            ):
                return None
            worst = max(worst, points[0].numerical_error)
        return Errors(numerical=worst, model=0.0) if self.read else None

    def rigid_seconds(self, solver: str, tolerance: float) -> float:
        """CPU seconds of a solution, in proportion to the disks: geometric mean over the scenes
        read."""
        logs = []
        for entry, weight in self.read:
            for point in entry.points:
                if self._ours(point) and (point.solver, point.tolerance) == (solver, tolerance):
                    seconds = (point.cpu_seconds or LEAST) * self.likeness.disks / point.disks
                    logs.append((weight, float(np.log(seconds))))
        return float(np.exp(sum(w * s for w, s in logs) / sum(w for w, _ in logs)))

    def _ours(self, point: Point) -> bool:
        return point.quantity.split("_")[0] == self.load


def _between(
    entry: Entry, run: Sequence[Point], all_of_law: Sequence[Point], hardness: float
) -> Errors | None:
    """The errors of an entry at a hardness, between its two nearest points of a run (from soft to
    hard), beyond the ends those at the end; None where one of them did not end well. No contact is
    credited with less model error than a harder one: a load that rings can come out right by
    luck."""
    known = np.array([entry.hardness(point) for point in run])
    place = int(np.clip(np.searchsorted(known, hardness), 1, len(run) - 1)) if len(run) > 1 else 0
    beside = run[max(place - 1, 0) : place + 1]
    if any(
        p.status != PointStatus.OK or p.numerical_error is None or p.model_error is None
        for p in beside
    ):
        return None
    numerical = [max(p.numerical_error or 0.0, LEAST) for p in beside]
    model = [
        max(
            [LEAST]
            + [
                q.model_error
                for q in all_of_law
                if q.model_error is not None and entry.hardness(q) >= (1 - 1e-9) * entry.hardness(p)
            ]
        )
        for p in beside
    ]
    at = np.log([entry.hardness(point) for point in beside])
    where = float(np.log(hardness))
    return Errors(
        numerical=float(np.exp(np.interp(where, at, np.log(numerical)))),
        model=float(np.exp(np.interp(where, at, np.log(model)))),
    )


def _mean(found: Iterable[tuple[float, Errors]]) -> Errors | None:
    values = list(found)
    if not values:
        return None
    total = sum(weight for weight, _ in values)
    return Errors(
        numerical=float(np.exp(sum(w * np.log(e.numerical) for w, e in values) / total)),
        model=float(np.exp(sum(w * np.log(e.model) for w, e in values) / total)),
    )
