"""One page A4 about a scene, for a safety file."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import ALARM, BLUE, GREY, PALE_BAR
from analysis.pages.html import saved
from analysis.pages.numbers import significant
from analysis.pages.ranges import Chart
from analysis.pages.words import Words
from analysis.scene.scene import Scene
from analysis.studies.exposure.limits import limits_of_bodies
from analysis.studies.film.page import still_on
from analysis.studies.motion.study import MotionStudy
from analysis.studies.report.page import (
    Reported,
    assumptions,
    charts,
    crowds_table,
    lead,
    notes,
    with_distinct_names,
)
from analysis.support.files import whole_file

A4_IN = (8.27, 11.69)
# Letters of a line of words, over the whole page.
WIDE = 115


def write_sheets(reported: Sequence[Reported], folder: Path, command: str) -> list[Path]:
    """Write a sheet for each scene that moved; return the paths."""
    paths = []
    for one in with_distinct_names(reported):
        if one.moved is None:
            continue
        paths.append(folder / f"{one.scene.name}-sheet.pdf")
        with whole_file(paths[-1], "wb") as file:
            file.write(saved(draw_sheet(one, one.moved, command), "pdf"))
    return paths


def draw_sheet(one: Reported, motion: MotionStudy, command: str) -> Figure:
    """Draw the sheet: what was simulated, four numbers as ranges, one picture, assumptions, limits
    with their sources, what it cannot say, version and digest."""
    scene = one.scene
    figure = Figure(figsize=A4_IN)
    figure.text(0.06, 0.965, scene.title, fontsize=15, weight="bold", va="top")
    first = textwrap.fill(_plain(lead(scene, motion)), 105)
    figure.text(0.06, 0.938, first, fontsize=10, va="top")
    if one.animations:
        axes = figure.add_axes((0.06, 0.6, 0.42, 0.31))
        marks = still_on(axes, one.animations[0], one.animations[0].typical, motion.limits)
        if marks:
            axes.legend(handles=marks, fontsize=7, ncols=3, loc="upper center", frameon=False,
                        bbox_to_anchor=(0.5, 0), borderaxespad=2.5)  # fmt: skip
        axes.set(xticks=[], yticks=[], xlabel="", ylabel="")
    every = charts(motion)
    for number, chart in enumerate(every):
        _draw(figure.add_axes((0.54, 0.865 - 0.085 * number, 0.4, 0.022)), chart)
    sentences = [("How to read the ranges", notes(motion, every)), *_blocks(scene, motion, command)]
    _write(figure, 0.55, sentences)
    return figure


def _draw(axes: Axes, chart: Chart) -> None:
    ((mean, *ends),) = chart.found.values()
    for (low, high), height, colour in ((chart.widest or ends, 1.0, PALE_BAR), (ends, 0.5, BLUE)):
        axes.barh(0, high - low, left=low, height=height, color=colour)
    axes.plot(mean, 0, "ko", ms=4)
    for mark in chart.shown:
        axes.axvline(mark, color=ALARM, lw=1.2)
    for mark, text, late in chart.labelled:
        axes.text(mark, -2.9, text, fontsize=7, color=ALARM, ha="right" if late else "left")
    axes.set_title(f"{chart.heading}: {chart.text}", fontsize=9, loc="left", pad=3, weight="bold")
    axes.set(xlim=(0, chart.top), ylim=(-0.7, 0.7), yticks=[])
    axes.set_xticks(*zip(*chart.ticks, strict=True), fontsize=7)
    axes.tick_params(length=0)
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(GREY)


def _blocks(scene: Scene, motion: MotionStudy, command: str) -> list[tuple[str, list[str]]]:
    words = Words(__name__)
    limits = [
        f"{significant(one.number, 4)} {one.unit}: {one.what}{one.lasting} ({one.cited})"
        for one in limits_of_bodies(motion.limits)
    ]
    every = crowds_table(motion)
    crowds = [words.text("crowd", of=row) for row in (every.rows if every else ())]
    version = metadata.version("crowd-percussions")
    made = datetime.now(UTC).strftime("%Y-%m-%d")
    sentences = words.text(
        "made", version=version, date=made, digest=scene.digest()[:16], command=command
    )
    return [
        ("Assumptions", [*assumptions(scene, motion), *crowds]),
        ("Limits", [*limits, words.text("barriers")]),
        ("What this cannot say", words.items("cannot")),
        ("Made by", [sentences]),
    ]


def _write(figure: Figure, top: float, blocks: Sequence[tuple[str, list[str]]]) -> None:
    for title, lines in blocks:
        figure.text(0.06, top, title, fontsize=10, weight="bold", va="top")
        top -= 0.019
        for line in filter(None, lines):
            wrapped = textwrap.wrap(_plain(line), WIDE)
            figure.text(0.06, top, "\n".join(wrapped), fontsize=8.3, va="top", linespacing=1.25)
            top -= 0.0129 * len(wrapped) + 0.003
        top -= 0.008


def _plain(words: str) -> str:
    """Take the marks of Markdown away, and what would be a formula."""
    return words.replace("**", "").replace("*", "").replace("`", "").replace("$", r"\$")
