"""Safety factors: how far expected errors were off when each scene of the library was predicted from
the others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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


def factor(rates: Rates, curves: Curves, what: str) -> float:
    """What the expected errors of a scene are multiplied with: exp(rate · unlikeness), at least 1;
    infinite where there is no rate. what: numerical, model or rigid (a solver's numerical
    error)."""
    rate = rates.get((curves.likeness.driven, curves.load, what))
    # that others came out better than predicted is luck
    return float("inf") if rate is None else float(np.exp(max(rate, 0.0) * unlikeness(curves)))


def unlikeness(curves: Curves) -> float:
    """Weighted mean of NEAR + distance over the scenes read."""
    return sum(
        weight * (NEAR + curves.likeness.distance(entry.likeness)) for entry, weight in curves.read
    )


def rates_of(entries: Sequence[Entry]) -> Rates:
    """Rates that hold for WITHIN of the errors between NO_MATTER and NO_USE, each scene predicted
    from all others.

    The rate of one point is log(measured/expected)/unlikeness. Against promises that are made for
    one scene from many it errs on the safe side where the scene left out was the only one of its
    sort."""
    found: dict[tuple[bool, str, str], list[float]] = {}
    for entry in entries:
        others = [other for other in entries if other is not entry]
        for load in sorted({point.quantity.split("_")[0] for point in entry.points}):
            curves = Curves(likeness=entry.likeness, load=load, entries=others)
            if not curves.read:
                continue
            far = unlikeness(curves)
            for what, measured, expected in _predicted(entry, curves):
                rate = float(np.log(max(measured, NO_MATTER) / max(expected, NO_MATTER))) / far
                found.setdefault((entry.likeness.driven, load, what), []).append(rate)
    return {key: float(np.quantile(rates, WITHIN)) for key, rates in found.items()}


def _predicted(entry: Entry, curves: Curves) -> Iterable[tuple[str, float, float]]:
    """What, measured and expected error of every point that matters; those of engines in an impact
    are not read from other scenes."""
    for point in entry.points:
        if point.quantity.split("_")[0] != curves.load or not _matters(point):
            continue
        if point.method == "rigid":
            assert point.tolerance is not None
            if errors := curves.rigid(point.solver, point.tolerance):
                yield "rigid", point.numerical_error or 0.0, errors.numerical
        elif entry.likeness.driven and point.time_step_share is not None:
            errors = curves.soft(
                point.method, point.law, point.time_step_share, entry.hardness(point)
            )
            if errors:
                yield "numerical", point.numerical_error or 0.0, errors.numerical
                yield "model", point.model_error or 0.0, errors.model


def _matters(point: Point) -> bool:
    known = point.status == PointStatus.OK and point.numerical_error is not None
    return known and point.model_error is not None and (point.error_sum or 0.0) <= NO_USE
