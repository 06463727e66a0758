"""The page of a chart: one self-contained HTML file, with its pictures and numbers as files beside
it."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from analysis.pages.bodies import ladder_table
from analysis.pages.html import write_html
from analysis.pages.names import engine_name
from analysis.pages.numbers import number, significant
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.studies.work_precision import charts
from analysis.studies.work_precision.chart import ACCURACY, Measured
from analysis.studies.work_precision.point import Point, PointStatus, pareto_front, write_points
from analysis.studies.work_precision.window import Quantity

# What a first screen says the cost of.
ENOUGH = 0.05
COLUMNS = ("method", "setting", "CPU s", "numerical", "model", "sum", "total")
CROSSES = ("method", "setting", "quantity", "CPU s", "numerical", "status", "reason")
SIZES = ("method", "disks", "setting", "CPU s", "numerical", "model")


def write_chart(chart: Measured, folder: Path, command: str, more: Sequence[Section] = ()) -> Path:
    """Write `index.html`, `points`, `pareto` and `scaling` as CSV and JSON, and the pictures as PNG
    and PDF; return the path of the page. more: sections that come last."""
    points, quantities = chart.points, chart.quantities
    write_points(folder, points)
    fronts = [pareto_front(_of(points, quantity)) for quantity in quantities]
    write_points(folder, [point for front in fronts for point in front], "pareto")
    write_points(folder, chart.scaling, "scaling")
    words = Words(__package__)
    first, compared = _first(words, chart), _compared(words, chart)
    sections = [_section(words, chart, quantity) for quantity in quantities]
    sections += _unfinished(words, points, quantities) + _scaling(words, chart.scaling)
    sections += more
    if chart.scene.drive is not None:  # what all of this says about people as soft as they are
        title, sentences, table = words.text("bodies"), words.text("softness"), ladder_table(chart.scene)
        section = Section(number="bodies", title=title, introduction=[sentences], tables=[table])
        sections.append(section)
    return write_html(
        folder / "index.html",
        "chart.html",
        [first, compared, *sections],
        "",
        command=command,
        quick=chart.quick,
        scene=chart.scene,
        first=first,
        compared=compared,
        sections=sections,
        engines=[one.method for one in (*points, *chart.scaling)],
        places=sorted({f"{p.machine}, {p.date}" for p in (*points, *chart.scaling)}),
        count=len(points),
    )


def front_table(
    chart: Measured, quantity: Quantity
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Give head and rows of the Pareto fronts of one quantity in words: of all methods, then of
    soft contacts alone."""
    points = _of(chart.points, quantity)
    rows = [_row(p) for p in (*pareto_front(points), *pareto_front(_soft(points)))]
    return COLUMNS, [tuple(row[name] for name in COLUMNS) for row in rows]


def _first(words: Words, chart: Measured) -> Section:
    """What rigid and soft contacts cost for one error, and the first quantity's picture."""
    quantity, *_ = chart.quantities
    points, name = chart.points, f"{quantity.name}_total"
    caption = words.text("total", quantity=quantity.words)
    sentences = [words.text("enough", enough=ENOUGH)]
    for one in chart.quantities:
        every = _of(points, one)
        found = {"soft": _enough(_soft(every))}
        found["rigid"] = _enough([p for p in every if p.method == "rigid"])
        sentences.append(words.text("costs", title=one.words, enough=ENOUGH, **found))
    disks, contacts = len(chart.window.scene.snapshot), len(chart.window.contacts)
    return Section(
        number="result",
        title=words.text("result"),
        introduction=[words.text("lead", disks=disks, contacts=contacts)],
        words=sentences,
        pictures=[
            Picture(name=name, caption=caption, figure=charts.total_picture(points, quantity))
        ],
        warnings=chart.warnings,
    )


def _enough(points: Sequence[Point]) -> tuple[Point, str] | None:
    """The cheapest point with an error of at most ENOUGH, or else the nearest, and its setting."""
    front = pareto_front(points)
    chosen = next(
        (p for p in front if (p.error_sum or 0.0) <= ENOUGH), front[-1] if front else None
    )
    return None if chosen is None else (chosen, _row(chosen)["setting"].split(",")[0])


def _compared(words: Words, chart: Measured) -> Section:
    """What is compared, and how the errors are measured."""
    window, scene = chart.window, chart.scene
    driven = words.text(
        "driven" if window.driven else "impact",
        scene=scene,
        disks=len(window.scene.snapshot),
        contacts=len(window.contacts),
        moved_apart=scene.reconciliation is None,
        duration=window.duration(scene.contact.stiffness_N_per_m),
        push=scene.push_range,
    )
    starts = _starts(_of(chart.points, chart.quantities[0]))
    sides = ", ".join(significant(side) for side in chart.mesh_sides)
    medium = (
        [words.text("no_continuum", no_continuum=chart.no_continuum)]
        if chart.no_continuum
        else [words.text("continuum", mesh_sides=sides)]
    )
    numerical = words.text("numerical", origin=chart.rigid.origin)
    time = words.text("time", starts=starts)
    sentences = [driven, numerical, words.text("model"), words.text("errors"), time, *medium]
    return Section(number="compared", title=words.text("compared"), introduction=sentences)


def _section(words: Words, chart: Measured, quantity: Quantity) -> Section:
    """One quantity: the picture, and the fronts."""
    points = _of(chart.points, quantity)
    bars = {
        "rigid": _largest(p for p in points if p.method == "rigid"),
        "soft": _largest(_soft(points)),
        "continuum": _largest(p for p in points if p.mesh_side_m is not None),
    }
    figure = charts.work_precision_picture(points, quantity, chart.scene.name)
    fronts = {"front": pareto_front(points), "soft_front": pareto_front(_soft(points))}
    title = f"{quantity.words[:1].upper()}{quantity.words[1:]} ({quantity.unit})"
    caption = words.text("known", bars=bars)
    picture = Picture(name=quantity.name, caption=caption, figure=figure)
    rows_of = {name: _rows(found, COLUMNS) for name, found in fronts.items() if found}
    tables = [words.table(name, rows) for name, rows in rows_of.items()]
    return Section(number=quantity.name, title=title, pictures=[picture], tables=tables)


def _rows(points: Iterable[Point], names: Sequence[str]) -> list[list[str]]:
    return [[_row(point)[name] for name in names] for point in points]


def _of(points: Iterable[Point], quantity: Quantity) -> list[Point]:
    return [p for p in points if p.quantity == quantity.name]


def _soft(points: Iterable[Point]) -> list[Point]:
    return [p for p in points if p.stiffness_N_per_m is not None]


def _row(point: Point) -> dict[str, str]:
    setting = "–"
    if point.stiffness_N_per_m is not None:
        step = f"Δt = {number(point.time_step_s)} s = {significant(point.time_step_share)} × safe"
        setting = f"k = {number(point.stiffness_N_per_m)} N/m, {step}"
    elif point.mesh_side_m is not None:
        setting = f"triangles of {number(point.mesh_side_m)} m"
    elif point.tolerance is not None:
        setting = f"tolerance {number(point.tolerance)}"
    return {
        "method": charts.style_of(point).label,
        "disks": number(point.disks),
        "setting": setting,
        "CPU s": number(point.cpu_seconds),
        "numerical": number(point.numerical_error),
        "model": number(point.model_error),
        "sum": number(point.error_sum),
        "total": number(point.total_error),
        "status": str(point.status),
        "reason": point.reason,
    }


def _unfinished(
    words: Words, points: Sequence[Point], quantities: Iterable[Quantity]
) -> list[Section]:
    """What is no answer, or a wrong one, each method and setting once: in the first quantity in
    which it is."""
    rows: dict[tuple[str, str], list[str]] = {}
    for quantity in quantities:
        for point in _of(points, quantity):
            if point.status != PointStatus.OK:
                row = _row(point) | {"quantity": quantity.words}
                cells = [row[name] for name in CROSSES]
                rows.setdefault((row["method"], row["setting"]), cells)
    if not rows:
        return []
    table = words.table("crosses", list(rows.values()))
    return [Section(number="unfinished", title=words.text("unfinished"), tables=[table])]


def _scaling(words: Words, points: Sequence[Point]) -> list[Section]:
    """What each method costs at other sizes."""
    if not points:
        return []
    caption = words.text("scaling_picture")
    figure = charts.scaling_picture(points, ACCURACY)
    return [
        Section(
            number="scaling",
            title=words.text("scaling"),
            introduction=[words.text("scaled", accuracy=ACCURACY)],
            pictures=[Picture(name="scaling", caption=caption, figure=figure)],
            tables=[words.table("sizes", _rows(points, SIZES))],
        )
    ]


def _largest(points: Iterable[Point]) -> float | None:
    """The largest error bar of the reference of points."""
    finite = [point.numerical_bar for point in points if point.numerical_bar is not None]
    return max(finite, default=None)


def _starts(points: Iterable[Point]) -> list[tuple[str, float]]:
    """The cheapest run of each engine: about what it takes to start it."""
    costs: dict[str, float] = {}
    for point in _soft(points):
        if point.cpu_seconds is not None:
            costs[point.method] = min(costs.get(point.method, np.inf), point.cpu_seconds)
    return [(engine_name(name), cost) for name, cost in costs.items()]
