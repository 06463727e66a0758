"""The page of a chart: one self-contained HTML file, with its pictures and numbers as files beside
it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from analysis.pages.html import render, write_picture
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.numbers import number, percent
from analysis.pages.section import Picture
from analysis.support.files import write_text
from analysis.work_precision.chart import Chart
from analysis.work_precision.charts import look_of, scaling_picture, work_precision_picture
from analysis.work_precision.continuum_ladder import SIDES
from analysis.work_precision.pareto import pareto_front
from analysis.work_precision.point import Point, PointStatus, write_points
from analysis.work_precision.scaling import ACCURACY
from analysis.work_precision.window import Quantity


def write_chart(chart: Chart, folder: Path, command: str) -> Path:
    """Write `index.html`, `points`, `pareto` and `scaling` as CSV and JSON, and the pictures as PNG
    and PDF."""
    measured = chart.measured
    fronts = {q: pareto_front(_of(measured.points, q)) for q in measured.quantities}
    write_points(folder, measured.points)
    write_points(folder, [point for front in fronts.values() for point in front], "pareto")
    write_points(folder, chart.scaling, "scaling")
    sections = []
    for quantity, front in fronts.items():
        figure = work_precision_picture(measured.points, quantity, chart.scene.name)
        image = write_picture(Picture(name=quantity.name, caption="", figure=figure), folder)
        sections.append(
            {
                "name": quantity.name,
                "words": quantity.words,
                "unit": quantity.unit,
                "image": image,
                "front": [_row(point) for point in front],
                "soft_front": [
                    _row(p) for p in pareto_front(_soft(_of(measured.points, quantity)))
                ],
                "rigid_bar": _rigid_bar(measured.points, quantity),
                "continuum_bar": _largest(
                    p.numerical_bar
                    for p in _of(measured.points, quantity)
                    if p.mesh_side_m is not None
                ),
                "soft_bar": _largest(
                    p.numerical_bar
                    for p in _of(measured.points, quantity)
                    if p.stiffness_N_per_m is not None
                ),
            }
        )
    scaled = ""
    if chart.scaling:
        figure = scaling_picture(chart.scaling, ACCURACY)
        scaled = write_picture(Picture(name="scaling", caption="", figure=figure), folder)
    first = _of(measured.points, measured.quantities[0])
    window, scene = measured.window, chart.scene
    stiffness = scene.contact.stiffness_N_per_m
    page = render(
        "chart.html",
        command=command,
        scene=scene,
        driven=window.driven,
        disks=len(window.scene.snapshot),
        contacts=len(window.contacts),
        moved_apart=window.driven and scene.reconciliation is None,
        duration=number(window.duration(stiffness)),
        stiffness=number(stiffness),
        origin=measured.rigid.origin,
        sections=sections,
        no_continuum=measured.no_continuum,
        mesh_sides=", ".join(f"{side:g}" for side in SIDES),
        unfinished=_unfinished(measured.points, measured.quantities),
        starts=_starts(first),
        scaling=[_row(p) for p in chart.scaling],
        scaling_image=scaled,
        accuracy=percent(ACCURACY),
        places=sorted({f"{p.machine}, {p.date}" for p in (*measured.points, *chart.scaling)}),
        count=len(measured.points),
        warnings=chart.warnings,
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


def front_table(chart: Chart, quantity: Quantity) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and rows of the Pareto fronts of one quantity in words: of all methods, then of soft
    contacts alone."""
    head = ("method", "setting", "CPU s", "numerical", "model", "sum", "total")
    points = _of(chart.measured.points, quantity)
    rows = [_row(p) for p in (*pareto_front(points), *pareto_front(_soft(points)))]
    return head, [
        tuple(
            str(row[k]) for k in ("method", "setting", "cpu", "numerical", "model", "sum", "total")
        )
        for row in rows
    ]


def _of(points: Iterable[Point], quantity: Quantity) -> list[Point]:
    return [p for p in points if p.quantity == quantity.name]


def _soft(points: Iterable[Point]) -> list[Point]:
    return [p for p in points if p.stiffness_N_per_m is not None]


def _row(point: Point) -> dict[str, Any]:
    if (
        point.stiffness_N_per_m is not None
        and point.time_step_s is not None
        and point.time_step_share is not None
    ):
        setting = (
            f"k = {number(point.stiffness_N_per_m)} N/m, Δt = {number(point.time_step_s)} s "
            f"= {point.time_step_share:.3g} × safe"
        )
    elif point.mesh_side_m is not None:
        setting = f"triangles of {number(point.mesh_side_m)} m"
    else:
        setting = f"tolerance {number(point.tolerance)}" if point.tolerance is not None else "–"
    return {
        "method": look_of(point).label,
        "disks": point.disks,
        "setting": setting,
        "cpu": number(point.cpu_seconds),
        "numerical": number(point.numerical_error),
        "model": number(point.model_error),
        "sum": number(point.error_sum),
        "total": number(point.total_error),
        "status": str(point.status),
        "reason": point.reason,
    }


def _unfinished(points: Iterable[Point], quantities: Iterable[Quantity]) -> list[dict[str, Any]]:
    """What is no answer, or a wrong one, each method and setting once: in the first quantity in
    which it is."""
    points = list(points)
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for quantity in quantities:
        for point in _of(points, quantity):
            if point.status != PointStatus.OK:
                row = _row(point) | {"quantity": quantity.words}
                rows.setdefault((row["method"], row["setting"]), row)
    return list(rows.values())


def _rigid_bar(points: Iterable[Point], quantity: Quantity) -> str:
    return _largest(p.numerical_bar for p in _of(points, quantity) if p.method == "rigid")


def _largest(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    return number(max(known)) if known else "–"


def _starts(points: Iterable[Point]) -> list[tuple[str, str]]:
    """The cheapest run of each engine: about what it takes to start it."""
    costs: dict[str, float] = {}
    for point in points:
        if point.stiffness_N_per_m is not None and point.cpu_seconds is not None:
            costs[point.method] = min(costs.get(point.method, np.inf), point.cpu_seconds)
    return [(ENGINE_NAMES.get(name, name), number(cost)) for name, cost in costs.items()]
