"""The page of a chart: one self-contained HTML file, with its pictures and numbers as files beside
it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.pages.html import render, write_picture
from analysis.pages.names import engine_name
from analysis.pages.numbers import number, percent, significant
from analysis.pages.section import Picture
from analysis.support.files import write_text
from analysis.work_precision.chart import ACCURACY, Chart
from analysis.work_precision.charts import scaling_picture, work_precision_picture
from analysis.work_precision.looks import look_of
from analysis.work_precision.point import Point, PointStatus, pareto_front, write_points
from analysis.work_precision.window import Quantity

COLUMNS = ("method", "setting", "cpu", "numerical", "model", "sum", "total")


def write_chart(chart: Chart, folder: Path, command: str) -> Path:
    """Write `index.html`, `points`, `pareto` and `scaling` as CSV and JSON, and the pictures as PNG
    and PDF; return the path of the page."""
    measured, window, scene = chart.measured, chart.measured.window, chart.scene
    points, quantities = measured.points, measured.quantities
    write_points(folder, points)
    fronts = [pareto_front(_of(points, quantity)) for quantity in quantities]
    write_points(folder, [point for front in fronts for point in front], "pareto")
    write_points(folder, chart.scaling, "scaling")
    scaled = ""
    if chart.scaling:
        figure = scaling_picture(chart.scaling, ACCURACY)
        scaled = write_picture(Picture(name="scaling", caption="", figure=figure), folder)
    stiffness = scene.contact.stiffness_N_per_m
    page = render(
        "chart.html",
        command=command,
        quick=chart.quick,
        scene=scene,
        driven=window.driven,
        disks=len(window.scene.snapshot),
        contacts=len(window.contacts),
        moved_apart=window.driven and scene.reconciliation is None,
        duration=number(window.duration(stiffness)),
        stiffness=number(stiffness),
        origin=measured.rigid.origin,
        sections=[_section(chart, quantity, folder) for quantity in quantities],
        no_continuum=measured.no_continuum,
        mesh_sides=", ".join(f"{side:g}" for side in chart.mesh_sides),
        unfinished=_unfinished(points, quantities),
        starts=_starts(_of(points, quantities[0])),
        scaling=[_row(p) for p in chart.scaling],
        scaling_image=scaled,
        accuracy=percent(ACCURACY),
        places=sorted({f"{p.machine}, {p.date}" for p in (*points, *chart.scaling)}),
        count=len(points),
        warnings=chart.warnings,
    )
    write_text(folder / "index.html", page)
    return folder / "index.html"


def front_table(chart: Chart, quantity: Quantity) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Give head and rows of the Pareto fronts of one quantity in words: of all methods, then of
    soft contacts alone."""
    points = _of(chart.measured.points, quantity)
    rows = [_row(p) for p in (*pareto_front(points), *pareto_front(_soft(points)))]
    head = tuple("CPU s" if name == "cpu" else name for name in COLUMNS)
    return head, [tuple(str(row[name]) for name in COLUMNS) for row in rows]


def _section(chart: Chart, quantity: Quantity, folder: Path) -> dict[str, Any]:
    points = _of(chart.measured.points, quantity)
    figure = work_precision_picture(points, quantity, chart.scene.name)
    return {
        "name": quantity.name,
        "words": quantity.words,
        "unit": quantity.unit,
        "image": write_picture(Picture(name=quantity.name, caption="", figure=figure), folder),
        "front": [_row(p) for p in pareto_front(points)],
        "soft_front": [_row(p) for p in pareto_front(_soft(points))],
        "rigid_bar": _largest(p for p in points if p.method == "rigid"),
        "continuum_bar": _largest(p for p in points if p.mesh_side_m is not None),
        "soft_bar": _largest(_soft(points)),
    }


def _of(points: Iterable[Point], quantity: Quantity) -> list[Point]:
    return [p for p in points if p.quantity == quantity.name]


def _soft(points: Iterable[Point]) -> list[Point]:
    return [p for p in points if p.stiffness_N_per_m is not None]


def _row(point: Point) -> dict[str, Any]:
    setting = "–"
    if point.stiffness_N_per_m is not None:
        step = f"Δt = {number(point.time_step_s)} s = {significant(point.time_step_share)} × safe"
        setting = f"k = {number(point.stiffness_N_per_m)} N/m, {step}"
    elif point.mesh_side_m is not None:
        setting = f"triangles of {number(point.mesh_side_m)} m"
    elif point.tolerance is not None:
        setting = f"tolerance {number(point.tolerance)}"
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


def _unfinished(points: Sequence[Point], quantities: Iterable[Quantity]) -> list[dict[str, Any]]:
    """What is no answer, or a wrong one, each method and setting once: in the first quantity in
    which it is."""
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for quantity in quantities:
        for point in _of(points, quantity):
            if point.status != PointStatus.OK:
                row = _row(point) | {"quantity": quantity.words}
                rows.setdefault((row["method"], row["setting"]), row)
    return list(rows.values())


def _largest(points: Iterable[Point]) -> str:
    """The largest error bar of the reference of points."""
    known = [point.numerical_bar for point in points if point.numerical_bar is not None]
    return number(max(known, default=None))


def _starts(points: Iterable[Point]) -> list[tuple[str, str]]:
    """The cheapest run of each engine: about what it takes to start it."""
    costs: dict[str, float] = {}
    for point in _soft(points):
        if point.cpu_seconds is not None:
            costs[point.method] = min(costs.get(point.method, np.inf), point.cpu_seconds)
    return [(engine_name(name), number(cost)) for name, cost in costs.items()]
