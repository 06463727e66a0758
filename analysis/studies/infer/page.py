"""The page of an inferred push, and its numbers as CSV and JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.pages import drawing
from analysis.pages.html import write_html
from analysis.pages.numbers import between, percent, significant, two
from analysis.pages.ranges import Chart
from analysis.pages.section import Section
from analysis.pages.words import Words
from analysis.studies.infer.crowd import PRIOR
from analysis.studies.infer.inference import NAMES, WALL_FACTOR, Inferred
from analysis.studies.infer.posterior import INTERVAL
from analysis.studies.infer.tracks import STATISTICS
from analysis.support.columns import Columns
from analysis.support.files import write_columns, write_json
from nscd.arrays import Floats

# Before the others, and as bars on the first screen; a number is odd beyond so many standard deviations.
SHOWN, BARS, ODD = ("contact_N", "wall_N", *PRIOR), 4, 2.5
HEAD = ["quantity", "before", "inferred", "width", "holds"]
COLUMNS = Columns("infer")


def interval(found: Floats) -> str:
    """Write a median and its interval: 46 (18–71)."""
    return f"{two(found[1])} ({between(found[0], found[2])})"


def rows(found: Inferred) -> list[list[str]]:
    """Give the rows of HEAD: quantiles before and after, the width as a share, and the coverage."""
    labels = Words(__package__).parts("names")
    after = {name: [interval(found.found[name]), percent(found.width[name], 2)] for name in SHOWN if found.fits}
    return [
        [labels[name], interval(found.prior[name]), *after.get(name, ["–", "–"]), percent(found.coverage[name], 2)]
        for name in SHOWN
    ]


def verdict(found: Inferred) -> str:
    """Say in Markdown what was inferred: the force first, then the push; or that nothing fits."""
    words = Words(__package__)
    ranked = sorted(found.odd.items(), key=lambda one: -abs(one[1]))
    odd = [words.parts("names")[name] for name, far in ranked if abs(far) > ODD]
    named = {name: interval(found.found[name]) for name in NAMES}
    return words.text("verdict", found=found, beyond=found.beyond, named=named, odd=odd, owed=_owed(found)[:3])


def below(found: Inferred) -> dict[str, float]:
    """Give the share of runs below what was seen, by statistic."""
    observed = np.array([*found.seen.values()])
    return dict(zip(found.seen, (found.statistics < observed).mean(0).tolist(), strict=True))


def _owed(found: Inferred) -> list[tuple[str, str]]:
    labels, ranked = Words(__package__).parts("names"), sorted(found.owed.items(), key=lambda one: -one[1])
    return [(labels[name].split(" (")[0], percent(fraction, 2)) for name, fraction in ranked]


def write_inferred(found: Inferred, name: str, notes: Sequence[str], folder: Path, command: str) -> list[Path]:
    """Write `index.html`, its picture, `runs.csv` and `infer.json`; return the paths, the page last."""
    words, labels, ratios = Words(__package__), Words(__package__).parts("names"), below(found)
    spans = np.quantile(found.statistics, INTERVAL, axis=0).T
    statistics = [
        [f"{labels[one]} ({STATISTICS[one]})", significant(value), interval(span), percent(ratios[one], 2), two(found.odd[one])]
        for (one, value), span in zip(found.seen.items(), spans, strict=True)
    ]
    alone = [
        [", ".join(labels[one] for one in names), *(interval(each[key]) for key in SHOWN[:BARS])]
        for names, each in (*found.alone.items(), (tuple(found.seen), found.found))
    ]
    charts = []
    for key in SHOWN[:BARS] if found.fits else ():
        bars = {of: (q[1], q[0], q[2]) for of, q in (("before", found.prior[key]), ("inferred", found.found[key]))}
        title, _, unit = labels[key].partition(" (")
        charts.append(Chart(title, unit.strip(")"), bars, widest=bars["inferred"][1:]))
    about: dict[str, Any] = {
        "runs": len(found.statistics), "unsolved": found.unsolved, "factor": WALL_FACTOR,
        "owed": _owed(found) if found.fits else [], "holds": [percent(found.coverage[key], 2) for key in SHOWN[:3]],
    }  # fmt: skip
    tables = [words.table("table_statistics", statistics), words.table("table_alone", alone)]
    tables, inferred = tables[: 1 + found.fits], [words.table("table_inferred", rows(found))]
    first = Section(number="result", title=words.text("title"), introduction=[verdict(found)], charts=charts,
                    warnings=notes, pictures=[words.picture("seen", _draw_statistics(found, labels))])  # fmt: skip
    folds = [
        Section(number="inferred", title=words.text("title_inferred"), tables=inferred),
        Section(number="statistics", title=words.text("title_statistics"), tables=tables),
        Section(number="sure", title=words.text("title_sure"), words=words.items("sure", **about),
                introduction=words.items("assumptions"), files=["runs.csv"]),
    ]  # fmt: skip
    columns = np.concatenate([found.statistics, found.values], axis=1).T
    names = [one for one in COLUMNS if one in (*found.seen, *NAMES)]
    write_columns(folder / "runs.csv", dict(zip(names, columns, strict=True)))
    write_json(folder / "infer.json", content(found))
    page = folder / "index.html"
    write_html(page, "infer.html", [first, *folds], command=command, name=name, first=first, folds=folds)
    return [folder / "runs.csv", folder / "infer.json", page]


def write_course(
    windows: Sequence[tuple[float, float, Mapping[str, float]]], parts: Sequence[Inferred | None], file: Path
) -> dict[str, Floats]:
    """Write and return the columns of windows.csv: the push share and the contact force in each window; odd is the share
    of runs that are less odd, and what is inferred holds where it is below 0.95."""
    table: dict[str, list[Any]] = {"start_s": [], "end_s": [], "odd": []}
    for (start, end, _), found in zip(windows, parts, strict=True):
        row = {"start_s": start, "end_s": end, "odd": found.beyond if found else np.nan}
        for name in ("push_share", "contact_N"):
            values = found.found[name] if found else [np.nan] * 3
            row |= {f"{name}_{percent}": value for percent, value in zip((5, 50, 95), values, strict=True)}
        for name, value in row.items():
            table.setdefault(name, []).append(float(f"{value:.3g}"))
    columns = {name: np.array(values) for name, values in table.items()}
    write_columns(file, columns)
    return columns


def content(found: Inferred) -> dict[str, Any]:
    """Give what infer.json holds: quantiles 5, 50 and 95 %; nothing inferred where nothing fits."""
    left = ("statistics", "values", "alone", *(() if found.fits else ("found", "width", "owed")))
    selected = {one.name: getattr(found, one.name) for one in fields(found) if one.name not in left}
    return {"fits": found.fits, "runs": len(found.statistics)} | {
        key: {name: np.asarray(each).tolist() for name, each in value.items()} if isinstance(value, Mapping) else value
        for key, value in selected.items()
    }


def _draw_statistics(found: Inferred, message: Mapping[str, str]) -> Figure:
    """Each statistic of the runs, and what was seen."""
    count = -(-len(found.seen) // 4)
    figure, every = drawing.panels(7.2, 1.9 * count, count, 4)
    for axes in every[len(found.seen) :]:
        axes.set_axis_off()
    for axes, (name, observed), runs in zip(every, found.seen.items(), found.statistics.T, strict=False):
        axes.hist(runs, bins=16, color=drawing.GREY, label="simulated crowds")
        axes.axvline(observed, color=drawing.VERMILION, lw=2, label="seen")
        axes.set(xlabel=f"{message[name]} ({STATISTICS[name]})", yticks=[])
    drawing.legend_below(figure, every[0], 2)
    return figure
