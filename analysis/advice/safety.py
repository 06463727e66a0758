"""Safety factors: how far expected errors were off when each scene of the library was predicted
from the others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.advice.error_curves import NEAR, Curves
from analysis.advice.library import Entry, Rates
from analysis.work_precision.point import Point, PointStatus

# So many of the errors that were predicted are to be within the factor: nearly all, since a choice
# is the best of many settings and so tends to be one whose error was predicted too low.
WITHIN = 0.98
# Errors below this are as good as none, those above this no use to anybody: neither says how safe a
# promise is.
NO_MATTER, NO_USE = 1e-4, 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Safety:
    """What expected errors are multiplied with before they are promised: the numerical and the
    model error of engines, and the numerical error of a solver (rigid)."""

    numerical: float = 1.0
    model: float = 1.0
    rigid: float = 1.0


# Of an impact that was tried: engines round otherwise, and shorten steps to meet frames.
TRIED = Safety(numerical=1.5, model=1.1)


def safety_of(rates: Rates, curves: Curves) -> Safety:
    """Compute the factors of curves that are read from other scenes: exp(rate · unlikeness), at
    least 1; infinite where there is no rate."""

    def factor(what: str) -> float:
        rate = rates.get((curves.load, what))
        # that others came out better than predicted is luck
        return float("inf") if rate is None else float(np.exp(max(rate, 0.0) * unlikeness(curves)))

    return Safety(**{what: factor(what) for what in Safety.__dataclass_fields__})


def unlikeness(curves: Curves) -> float:
    """Compute the weighted mean of NEAR + distance over the scenes read."""
    return sum(
        weight * (NEAR + curves.likeness.distance(entry.likeness)) for entry, weight in curves.read
    )


def rates_of(entries: Sequence[Entry]) -> Rates:
    """Compute rates that hold for WITHIN of the errors between NO_MATTER and NO_USE, each scene
    predicted from all others.

    The rate of one point is log(measured/expected)/unlikeness. Against promises that are made for
    one scene from many it errs on the safe side where the scene left out was the only one of its
    sort."""
    found: dict[tuple[str, str], list[float]] = {}
    for entry in entries:
        others = [other for other in entries if other is not entry]
        for load in sorted({point.load for point in entry.points}):
            curves = Curves(likeness=entry.likeness, load=load, entries=others)
            if not curves.read:
                continue
            far = unlikeness(curves)
            for what, measured, expected in _predicted(entry, curves):
                rate = float(np.log(max(measured, NO_MATTER) / max(expected, NO_MATTER))) / far
                found.setdefault((load, what), []).append(rate)
    return {key: float(np.quantile(rates, WITHIN)) for key, rates in found.items()}


def _predicted(entry: Entry, curves: Curves) -> Iterable[tuple[str, float, float]]:
    """What, measured and expected error of every point that matters."""
    for point in entry.points:
        if point.load != curves.load or not _matters(point):
            continue
        if point.method == "rigid":
            assert point.tolerance is not None
            if errors := curves.rigid(point.solver, point.tolerance):
                yield "rigid", point.numerical_error or 0.0, errors.numerical
        elif point.time_step_share is not None:
            errors = curves.soft(
                point.method, point.law, point.time_step_share, entry.hardness(point)
            )
            if errors:
                yield "numerical", point.numerical_error or 0.0, errors.numerical
                yield "model", point.model_error or 0.0, errors.model


def _matters(point: Point) -> bool:
    known = point.status == PointStatus.OK and point.numerical_error is not None
    return known and point.model_error is not None and (point.error_sum or 0.0) <= NO_USE
