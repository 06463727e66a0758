"""Answers measured against the rigid reference of a window: points with their two errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from analysis.support.machine import machine
from analysis.work_precision.continuum_ladder import ContinuumLadder
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.rigid_reference import RigidReference
from analysis.work_precision.rigid_solves import Solved
from analysis.work_precision.soft_reference import SoftReference
from analysis.work_precision.soft_runs import SoftRun
from analysis.work_precision.window import (
    CONTACT_FORCE,
    DISK_FORCE,
    WALL_FORCE,
    Quantity,
    Window,
    relative_error,
)
from nscd.arrays import Floats

# A sum over the walls below this share of what the disks carry is rounding.
NOTHING = 1e-9
# An answer that is wrong by more than all of it is none.
WRONG = 1.0
Values = dict[Quantity, Floats]


class Book:
    """The rigid reference of a window in all quantities, and points measured against it."""

    def __init__(self, *, window: Window, name: str, rigid: RigidReference) -> None:
        self.window, self.name = window, name
        self.stiffness = window.scene.contact.stiffness_N_per_m
        exact = window.quantities(window.rigid_motion(rigid.right_velocity), self.stiffness)
        largest = max(float(np.abs(v).max(initial=0.0)) for q, v in exact.items() if q.unit != "m")
        self.exact = {
            q: v
            for q, v in exact.items()
            if q.unit == "m" or np.abs(v).max(initial=0.0) > NOTHING * largest
        }
        bounds = window.bounds(rigid.bound)
        self.bar = {q: bounds[q] / float(np.sqrt((v**2).mean())) for q, v in self.exact.items()}

    def of_soft(
        self, runs: Sequence[SoftRun], references: dict[tuple[str, float], SoftReference | str]
    ) -> Iterator[Point]:
        """Points of engine runs: numerical error from the reference of their law and stiffness."""
        for run in runs:
            k = run.setting.stiffness_N_per_m
            reference = references[run.setting.law, k]
            own = looser = None
            if isinstance(reference, SoftReference):
                own, looser = (
                    self.window.quantities(m, k) for m in (reference.motion, reference.looser)
                )
            given = self.window.quantities(run.motion, k) if run.motion is not None else None
            for quantity in self.exact:
                numerical, model, bar, total = self._errors(quantity, given, own, looser)
                status, reason = run.status, run.reason
                if status == PointStatus.OK and numerical is not None and not numerical <= WRONG:
                    status = PointStatus.INACCURATE
                    reason = f"the run ended as if all were well, but is wrong by {numerical:.2g} times the whole"
                elif status == PointStatus.OK and isinstance(reference, str):
                    reason = f"no numerical error: {reference}"
                yield self._point(
                    quantity,
                    method=run.setting.engine,
                    law=run.setting.law,
                    time_step_s=run.time_step_s,
                    time_step_share=run.setting.share,
                    stiffness_N_per_m=k,
                    cpu_seconds=run.cpu_seconds,
                    numerical_error=numerical,
                    numerical_bar=bar,
                    model_error=model,
                    model_bar=None if bar is None else bar + self.bar[quantity],
                    total_error=total,
                    status=status,
                    reason=reason,
                    machine=run.machine,
                    date=run.date,
                )

    def of_solved(self, answers: Sequence[Solved]) -> Iterator[Point]:
        """Points of the rigid model (its error is numerical) and of the rivals (theirs is the
        model's)."""
        today, here = datetime.now(UTC).date().isoformat(), machine()
        for answer in answers:
            given = self._values(answer)
            for quantity, exact in self.exact.items():
                if given is not None and quantity not in given:
                    continue
                error = None if given is None else relative_error(given[quantity], exact, exact)
                ours = answer.method == "rigid"
                yield self._point(
                    quantity,
                    method=answer.method,
                    solver=answer.solver,
                    tolerance=answer.tolerance,
                    cpu_seconds=answer.cpu_seconds,
                    numerical_error=error if ours else None,
                    numerical_bar=self.bar[quantity] if ours else None,
                    model_error=0.0 if ours else error,
                    model_bar=0.0 if ours else self.bar[quantity],
                    total_error=error,
                    status=answer.status,
                    reason=answer.reason,
                    machine=here,
                    date=today,
                )

    def of_continuum(self, ladder: ContinuumLadder) -> Iterator[Point]:
        """Points of the continuum models: numerical error from the model's finest reference, whose
        bar is its change from the mesh of twice the side."""
        today, here = datetime.now(UTC).date().isoformat(), machine()
        converged = {coarse.model: (coarse, fine) for coarse, fine in ladder.references}
        for answer in ladder.answers:
            coarse, fine = converged[answer.model]
            sure = coarse.status == fine.status == PointStatus.OK
            given = answer.values(self.window)
            looser, own = (found.values(self.window) if sure else None for found in (coarse, fine))
            for quantity in self.exact:
                if quantity == CONTACT_FORCE:
                    continue
                numerical, model, bar, total = self._errors(quantity, given, own, looser)
                status, reason = answer.status, answer.reason
                if status == PointStatus.OK and numerical is not None and not numerical <= WRONG:
                    status = PointStatus.INACCURATE
                    reason = f"the mesh is too coarse: wrong by {numerical:.2g} times the whole"
                elif status == PointStatus.OK and not sure:
                    reason = f"no numerical error: the reference is {fine.status}: {fine.reason or coarse.reason}"
                yield self._point(
                    quantity,
                    method="continuum",
                    law=str(answer.model),
                    mesh_side_m=answer.side_m,
                    cpu_seconds=answer.cpu_seconds,
                    numerical_error=numerical,
                    numerical_bar=bar,
                    model_error=model,
                    model_bar=None if bar is None else bar + self.bar[quantity],
                    total_error=total,
                    status=status,
                    reason=reason,
                    machine=here,
                    date=today,
                )

    def _point(self, quantity: Quantity, **known: Any) -> Point:
        """A point of this window; what its method does not have is left out."""
        absent: dict[str, Any] = {"law": "", "solver": ""}
        absent |= dict.fromkeys(
            ("time_step_s", "time_step_share", "stiffness_N_per_m", "tolerance")
        )
        where = {"scene": self.name, "disks": len(self.window.scene.snapshot)}
        return Point(
            **(absent | where | {"quantity": quantity.name, "unit": quantity.unit} | known)
        )

    def _errors(
        self, quantity: Quantity, given: Values | None, own: Values | None, looser: Values | None
    ) -> tuple[float | None, ...]:
        """Numerical and model error, the bar of the model's reference `own` by its change from
        `looser`, and total error."""
        exact = self.exact[quantity]
        numerical, model, bar, total = None, None, None, None
        if own is not None and looser is not None:
            bar = relative_error(looser[quantity], own[quantity], exact)
            model = relative_error(own[quantity], exact, exact)
        if given is not None:
            total = relative_error(given[quantity], exact, exact)
            if own is not None:
                numerical = relative_error(given[quantity], own[quantity], exact)
        return numerical, model, bar, total

    def _values(self, answer: Solved) -> Values | None:
        if answer.motion is not None:
            return self.window.quantities(answer.motion, self.stiffness)
        if answer.disk_force is None or answer.contact_force is None:
            return None
        return {
            CONTACT_FORCE: answer.contact_force,
            DISK_FORCE: answer.disk_force.ravel(),
            WALL_FORCE: -answer.disk_force.sum(0),
        }
