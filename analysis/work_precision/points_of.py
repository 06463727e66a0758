"""Answers measured against the rigid reference of a window: points with their two errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from analysis.support.machine import machine
from analysis.work_precision.point import Method, Point, PointStatus
from analysis.work_precision.rigid_reference import RigidReference
from analysis.work_precision.window import Quantity, Values, Window, relative_error

# A sum over the walls below this share of what the disks carry is rounding.
NOTHING = 1e-9
# An answer that is wrong by more than all of it is none.
WRONG = 1.0


def today() -> str:
    """Give the date, as ISO has it."""
    return datetime.now(UTC).date().isoformat()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer(Method):
    """What a method gave on a window, and at what cost.

    cpu_seconds, status, reason, machine, date: as in `Point`.
    values: what it says of each quantity; None without an answer.
    lacks: quantities that the method does not have."""

    cpu_seconds: float | None
    values: Values | None
    lacks: tuple[Quantity, ...] = ()
    status: PointStatus = PointStatus.OK
    reason: str = ""
    machine: str = field(default_factory=machine)
    date: str = field(default_factory=today)


KNOWN = tuple(
    name
    for name in Answer.__dataclass_fields__
    if name not in ("values", "lacks", "status", "reason")
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Converged:
    """A method's own model, solved to convergence.

    own, looser: its values, and those of a coarser solution, whose difference is the error bar;
    None where there are none.
    why: why there are none.
    wrong: said of an answer that misses the model by more than all of it."""

    own: Values | None = None
    looser: Values | None = None
    why: str = ""
    wrong: str


class _Errors(NamedTuple):
    numerical: float | None = None
    numerical_bar: float | None = None
    model: float | None = None
    model_bar: float | None = None


class Judge:
    """Measures answers against the rigid reference of a window in all quantities.

    exact: the reference's values.
    bar: how far each may be off, relative to its rms."""

    def __init__(self, *, window: Window, name: str, rigid: RigidReference) -> None:
        self.window, self.name = window, name
        exact = window.rigid_values(rigid.right_velocity)
        largest = max(float(np.abs(v).max(initial=0.0)) for q, v in exact.items() if q.unit != "m")
        self.exact = {
            q: v
            for q, v in exact.items()
            if q.unit == "m" or np.abs(v).max(initial=0.0) > NOTHING * largest
        }
        bounds = window.bounds(rigid.bound)
        self.bar = {q: bounds[q] / float(np.sqrt((v**2).mean())) for q, v in self.exact.items()}

    def points(self, answer: Answer, converged: Converged | None = None) -> Iterator[Point]:
        """Yield a point per quantity. Without a converged model of its own, the error of an answer
        is numerical where the method is the rigid model, and the model's where it is another."""
        for quantity, exact in self.exact.items():
            given = answer.values
            if quantity in answer.lacks or (given is not None and quantity not in given):
                continue
            total = None if given is None else relative_error(given[quantity], exact, exact)
            bar, status, reason = self.bar[quantity], answer.status, answer.reason
            if converged is not None:
                errors = self._errors(quantity, given, converged)
                if status == PointStatus.OK:
                    status, reason = _judged(errors.numerical, reason, converged)
            elif answer.method == "rigid":
                errors = _Errors(total, bar, 0.0, 0.0)
            else:
                errors = _Errors(None, None, total, bar)
            yield Point(
                **{name: getattr(answer, name) for name in KNOWN},
                scene=self.name,
                disks=len(self.window.scene.snapshot),
                quantity=quantity.name,
                unit=quantity.unit,
                numerical_error=errors.numerical,
                numerical_bar=errors.numerical_bar,
                model_error=errors.model,
                model_bar=errors.model_bar,
                total_error=total,
                status=status,
                reason=reason,
            )

    def _errors(self, quantity: Quantity, given: Values | None, model: Converged) -> _Errors:
        exact = self.exact[quantity]
        if model.own is None or model.looser is None:
            return _Errors()
        own = model.own[quantity]
        bar = relative_error(model.looser[quantity], own, exact)
        numerical = None if given is None else relative_error(given[quantity], own, exact)
        off = relative_error(own, exact, exact)
        return _Errors(numerical, bar, off, bar + self.bar[quantity])


def _judged(numerical: float | None, reason: str, model: Converged) -> tuple[PointStatus, str]:
    """Status and reason of an answer that the method itself calls well."""
    if numerical is not None and not numerical <= WRONG:
        return PointStatus.INACCURATE, f"{model.wrong} by {numerical:.2g} times the whole"
    return PointStatus.OK, f"no numerical error: {model.why}" if model.own is None else reason
