"""The page of an inferred push, and its numbers as CSV and JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.infer.crowd import PRIOR
from analysis.infer.inference import FITS, NAMES, WALL_FACTOR, Inferred
from analysis.infer.tracks import STATISTICS
from analysis.pages import drawing
from analysis.pages.html import write_html
from analysis.pages.numbers import between, percent, significant, two
from analysis.pages.ranges import Chart
from analysis.pages.section import Section
from analysis.pages.words import Words
from analysis.support.files import write_columns, write_json
from nscd.arrays import Floats

SHOWN = ("contact_N", "wall_N", *[*PRIOR][:5])  # before the others on the page
HEAD = ["quantity", "before", "inferred", "width", "holds"]


def interval(found: Floats) -> str:
    """Write a median and its interval: 46 (18–71)."""
    low, middle, high = found.tolist()
    return f"{two(middle)} ({between(low, high)})"


def rows(found: Inferred, names: Sequence[str] = NAMES) -> list[list[str]]:
    """Give the rows of HEAD: quantiles before and after, the width as a share, and the coverage."""
    said = Words(__package__).parts("names")
    after = {name: interval(found.found[name]) if found.fits else "–" for name in names}
    numbers = {name: (percent(found.width[name], 2), percent(found.coverage[name], 2)) for name in names}
    return [[said[name], interval(found.prior[name]), after[name], *numbers[name]] for name in names]


def verdict(found: Inferred) -> str:
    """Say what was inferred, in Markdown: the force first, then the push; or that nothing fits."""
    far = [(name, *_place(found, name)) for name in found.seen]
    odd = [name for name, _, share in far if not 0.025 <= share <= 0.975]
    named = {name: interval(found.found[name]) for name in NAMES}
    values = {"fits": found.fits, "beyond": found.beyond, "runs": len(found.statistics), "named": named, "odd": odd}
    return Words(__package__).text("verdict", **values, owed=_owed(found)[:3])


def _owed(found: Inferred) -> list[tuple[str, str]]:
    said = Words(__package__).parts("names")
    ranked = sorted(found.owed.items(), key=lambda one: -one[1])
    return [(said[name].split(" (")[0], percent(share, 2)) for name, share in ranked]


def _place(found: Inferred, name: str) -> tuple[Floats, float]:
    """The statistics of the runs, and the share of them that is below what was seen."""
    runs = found.statistics[:, [*found.seen].index(name)]
    return runs, float((runs < found.seen[name]).mean())


def write_inferred(found: Inferred, name: str, notes: Sequence[str], folder: Path, command: str) -> list[Path]:
    """Write `index.html`, its pictures, `runs.csv` and `infer.json`; return the paths, the page last."""
    words, said = Words(__package__), Words(__package__).parts("names")
    order = (*SHOWN, *(one for one in NAMES if one not in SHOWN))
    statistics, alone = [], []
    for one in found.seen:
        runs, share = _place(found, one)
        cells = [f"{said[one]} ({STATISTICS[one]})", significant(found.seen[one]), interval(np.quantile(runs, (0.05, 0.5, 0.95)))]
        statistics.append([*cells, percent(share, 2)])
    for names, each in (*found.alone.items(), (tuple(found.seen), found.found)):
        alone.append([", ".join(said[one] for one in names), *(interval(each[key]) for key in (*SHOWN[:4],))])
    charts = [
        Chart(said[key].split(" (")[0], "N", {"before": _bar(found.prior[key]), "inferred": _bar(found.found[key])})
        for key in SHOWN[:2] if found.fits
    ]  # fmt: skip
    about = {"runs": len(found.statistics), "unsolved": found.unsolved, "factor": WALL_FACTOR, "most": FITS}
    about |= {"holds": [percent(found.coverage[key], 2) for key in (*SHOWN[:2], "push_share")], "owed": _owed(found)}
    first = Section(
        number="result", title=words.text("title"), introduction=[verdict(found)], charts=charts, warnings=notes,
        pictures=[words.picture("seen", _seen(found, said))],
    )  # fmt: skip
    folds = [
        Section(number="inferred", title=words.text("title_inferred"),
                tables=[words.table("table_inferred", rows(found, order))],
                pictures=[words.picture("posterior", _posterior(found, said))] if found.fits else []),
        Section(number="statistics", title=words.text("title_statistics"),
                tables=[words.table("table_statistics", statistics),
                        *([words.table("table_alone", alone)] if found.fits else [])]),
        Section(number="sure", title=words.text("title_sure"), words=words.items("sure", **about)),
        Section(number="assumptions", title=words.text("title_assumptions"), introduction=words.items("assumptions"),
                files=["runs.csv"]),
    ]  # fmt: skip
    columns = dict(zip((*found.seen, *NAMES), np.concatenate([found.statistics, found.values], axis=1).T, strict=True))
    write_columns(folder / "runs.csv", columns)
    write_json(folder / "infer.json", content(found))
    about = {"command": command, "name": name, "first": first, "folds": folds}
    page = write_html(folder / "index.html", "infer.html", [first, *folds], **about)
    return [folder / "runs.csv", folder / "infer.json", page]


def content(found: Inferred) -> dict[str, Any]:
    """Give what infer.json holds: quantiles 5, 50 and 95 %; nothing inferred where nothing fits."""
    left = ("statistics", "values", "alone", *(() if found.fits else ("found", "width", "owed")))
    kept = {one.name: getattr(found, one.name) for one in fields(found) if one.name not in left}
    kept |= {key: {name: np.asarray(each).tolist() for name, each in value.items()}
             for key, value in kept.items() if isinstance(value, Mapping)}  # fmt: skip
    return {"fits": found.fits, "runs": len(found.statistics)} | kept


def _bar(found: Floats) -> tuple[float, float, float]:
    low, middle, high = found.tolist()
    return middle, low, high


def _seen(found: Inferred, said: Mapping[str, str]) -> Figure:
    """Each statistic of the runs, and what was seen."""
    figure, every = drawing.panels(7.2, 3.8, 2, 4)
    for axes in every[len(found.seen) :]:
        axes.set_axis_off()
    for axes, name in zip(every, found.seen, strict=False):
        runs = _place(found, name)[0]
        axes.hist(runs, bins=16, color=drawing.GREY, label="runs of the law")
        axes.axvline(found.seen[name], color=drawing.VERMILION, lw=2, label="seen")
        axes.set(xlabel=f"{said[name]} ({STATISTICS[name]})", yticks=[])
    drawing.legend_below(figure, every[0], 2)
    return figure


def _posterior(found: Inferred, said: Mapping[str, str]) -> Figure:
    """Intervals of parameters and forces before and after."""
    figure, every = drawing.panels(7.2, 3.8, 2, 4)
    every[-1].set_axis_off()
    for axes, name in zip(every, SHOWN, strict=False):
        for height, (of, colour, label) in enumerate(
            ((found.prior, drawing.GREY, "before"), (found.found, drawing.BLUE, "inferred"))
        ):
            low, middle, high = of[name].tolist()
            axes.plot([low, high], [height, height], color=colour, lw=7, solid_capstyle="butt", label=label)
            axes.plot(middle, height, "o", color=drawing.BLACK, ms=4)
        axes.set(xlabel=said[name], yticks=[], ylim=(-0.7, 1.7))
    drawing.legend_below(figure, every[0], 2)
    return figure
