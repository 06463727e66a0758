"""Advice in words and numbers: the lines that a person reads, and the same as JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from analysis.advice.choice import LOADS, Advice, Candidate
from analysis.advice.library import Library
from analysis.pages.names import engine_name
from analysis.pages.numbers import percent, seconds
from analysis.work_precision.point import Point


def setting(candidate: Candidate) -> str:
    """The method with its setting."""
    name = engine_name(candidate.method)
    if candidate.time_step_s is None:
        return f"{name}, solver {candidate.solver}, tolerance {candidate.tolerance:g}"
    return (
        f"{name}, {candidate.law}, k = {candidate.stiffness_N_per_m:.3g} N/m, "
        f"Δt = {candidate.time_step_s:.3g} s ({candidate.time_step_share:g} × safe)"
    )


def headline(advice: Advice) -> str:
    """The choice in one line; or that there is none, and the best that is reached."""
    if advice.choice is not None:
        return (
            f"{setting(advice.choice)}: error of {advice.quantity} at most {percent(advice.choice.promised_error, 2)}, "
            f"{seconds(advice.choice.cpu_seconds)} CPU"
        )
    if advice.best is None:
        return f"nothing is known: no measured scene is enough like {advice.scene.name} in {advice.quantity}"
    return (
        f"nothing reaches {percent(advice.asked, 2)} in {advice.quantity}; the best, {setting(advice.best)}, promises "
        f"{percent(advice.best.promised_error, 2)}"
    )


def where_measured(advice: Advice, library: Library, chart: Sequence[Point] | None) -> list[str]:
    """Machine and date of the points that were read, each pair once."""
    names = {name for name, _ in advice.read}
    points = (
        chart
        if chart is not None
        else [p for e in library.entries if e.name in names for p in e.points]
    )
    return sorted({f"{point.machine}, {point.date}" for point in points})


def report(advice: Advice, measured: Sequence[str], left: Sequence[str]) -> list[str]:
    """All lines: the question, the choice, the next better one, each method, the curve, where it
    was read, what was left out.

    measured: machine and date of what was read.
    """
    against = (
        "the rigid model (numerical and model error)"
        if advice.against == "rigid"
        else f"{advice.scene.contact.law} contacts of the scene's stiffness, exactly solved (numerical error)"
    )
    lines = [
        f"{advice.scene.name}: {len(advice.scene.snapshot)} disks; {advice.quantity}, {LOADS[advice.quantity]},",
        f"within {percent(advice.asked, 2)} of {against}",
        "",
        "advised: " + headline(advice) if advice.choice else headline(advice),
    ]
    if advice.choice is not None and advice.better is not None:
        times = advice.better.cpu_seconds / advice.choice.cpu_seconds
        lines.append(
            f"next better: {setting(advice.better)}: at most {percent(advice.better.promised_error, 2)}, "
            f"{seconds(advice.better.cpu_seconds)} CPU ({times:.2g} times the price)"
        )
    elif advice.choice is not None:
        lines.append("next better: nothing promises half that error")
    others = [c for c in advice.by_method if c != advice.choice]
    lines += [
        f"or with {setting(c)}: at most {percent(c.promised_error, 2)}, {seconds(c.cpu_seconds)} CPU"
        for c in others
    ]
    lines += ["", "the curve that was read, from cheap to accurate:"]
    lines.append(f"  {'':<70}{'numerical':>12}{'model':>12}{'promised':>12}{'CPU':>10}")
    lines += [
        f"{'→' if c == advice.choice else ' '} {setting(c):<70}{percent(c.numerical_error, 2):>12}{percent(c.model_error, 2):>12}"
        f"{percent(c.promised_error, 2):>12}{seconds(c.cpu_seconds):>10}"
        for c in advice.curve
    ]
    if advice.own:
        lines.append("read from the chart of this scene")
    else:
        lines.append(
            "read from the scenes most like it: "
            + ", ".join(f"{name} ({percent(w, 2)})" for name, w in advice.read)
            if advice.read
            else "no measured scene is enough like it"
        )
    lines += [f"measured on {where}" for where in measured]
    lines += [
        "",
        "left out of the model, since the scene has no need of it:",
        *(f"  {line}" for line in left),
    ]
    return lines


def to_json(advice: Advice, measured: Sequence[str], left: Sequence[str]) -> dict[str, Any]:
    """As what `json` writes."""

    def one(candidate: Candidate | None) -> dict[str, Any] | None:
        return None if candidate is None else dataclasses.asdict(candidate)

    return {
        "scene": advice.scene.name,
        "quantity": advice.quantity,
        "against": advice.against,
        "asked_error": advice.asked,
        "likeness": dataclasses.asdict(advice.likeness),
        "choice": one(advice.choice),
        "next_better": one(advice.better),
        "best": one(advice.best),
        "by_method": [one(c) for c in advice.by_method],
        "curve": [one(c) for c in advice.curve],
        "read": [{"scene": name, "weight": weight} for name, weight in advice.read],
        "from_own_chart": advice.own,
        "measured": list(measured),
        "left_out": list(left),
    }
