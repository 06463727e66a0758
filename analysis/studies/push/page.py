"""The page of a hindcast, and its numbers as CSV."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.pages import drawing
from analysis.pages.html import write_html
from analysis.pages.numbers import NONE, decimals, interval, number, percent, significant
from analysis.pages.ranges import Chart
from analysis.pages.section import Section, Table
from analysis.pages.words import Words
from analysis.studies.push.hindcast import (
    ARM_N,
    CLOSEST,
    DRAWS,
    ONSET,
    POSITION,
    RIGID,
    SCORES,
    TAU_S,
    Cases,
    Hindcast,
    closest,
    error_of,
    momentum,
    onsets,
)
from analysis.support.columns import Columns
from analysis.support.files import write_rows
from nscd.arrays import Floats

BEATS = 0.95
# With a larger error of onsets no model describes a trial (s).
POOR_S = 0.1
SCORE_NAMES = {ONSET: "onsets", POSITION: "positions", CLOSEST: "closest heads"}
BASELINES = {"nobody": "nobody moves", "copy": "copies of the first", "geometry": "gaps alone"}
# Smaller odds are not written out.
UNLIKELY = 1e-4
HEAD = ["model", "onsets (s)", "positions (m)", "closest (m)", "beats all", "impossible", "odds"]
# Posture is drawn in so many bins.
BINS = 12


def title_of(name: str) -> str:
    """Name a model or baseline in words: penalty, 2·10³ N/m."""
    if name == RIGID:
        return name
    return BASELINES.get(name) or f"penalty, {number(float(name))} N/m"


def summary(found: Hindcast) -> list[list[str]]:
    """Give the rows of HEAD: medians, and 5 and 95 %, of root mean square errors over the cases
    that can be."""
    rows = []
    for name, one in (found.models | found.base).items():
        last = [NONE] * 3
        if name in found.models:
            fractions = " / ".join(percent(fraction, 2) for fraction in found.better(name).values())
            impossible = float((~one.possible).mean())
            last = [fractions, percent(impossible, 2) if impossible else "0", _odds(found, name)]
        cells = [_spread(one.scores[score][one.possible]) for score in SCORES]
        rows.append([title_of(name), *cells, *last])
    return rows


def verdicts(found: Hindcast) -> list[str]:
    """Say which models are out, which beat the baselines, and what is not validated."""
    return Words(__package__).items("words", **_values(found))


def write_hindcast(found: Hindcast, folder: Path, command: str) -> list[Path]:
    """Write `index.html`, its pictures, `scores.csv` and `onsets.csv`; return the paths, the page
    last."""
    words, trial, arms = Words(__package__), found.trial, found.inputs.arms
    about = {
        "people": len(trial.people),
        "models": len(found.models),
        "wall": trial.wall is not None,
        "depths": interval((trial.depth.min(), trial.depth.max())),
        "sd": trial.depth_sd,
        "arms": interval([round(float(end), 2) for end in (arms.min(), arms.max())], 2),
        "taus": interval(TAU_S),
        "reach": [float(found.inputs.reach.min()), float(found.inputs.reach.max())],
        "arm_force": interval(ARM_N),
        "cases": len(found.inputs.tau),
        "draws": DRAWS,
    }
    first = Section(
        number="result",
        title=words.text("title"),
        introduction=[words.text("lead", **about)],
        words=[words.text("verdict", **_values(found))],
        charts=_charts(found),
        pictures=[words.picture("heads", _draw_heads(found))],
        warnings=trial.notes,
    )
    folds = _folds(words, found, about)
    scores, nearest, page = (folder / name for name in ("scores.csv", "onsets.csv", "index.html"))
    write_rows(scores, CASES, _cases(found))
    write_rows(nearest, ["model", "case", *trial.people], _nearest(found))
    content: dict[str, Any] = {"command": command, "name": trial.name}
    content |= {"first": first, "folds": folds}
    return [scores, nearest, write_html(page, "push.html", [first, *folds], **content)]


def _folds(words: Words, found: Hindcast, about: Mapping[str, object]) -> list[Section]:
    """How sure it is, the numbers, and what was assumed; about: what the assumptions say."""
    pictures = []
    if np.ptp(found.inputs.arms) > 0:
        pictures = [words.picture("posture", _posture(found))]
    scores, models = words.table("table_scores", summary(found)), _models(words, found)
    return [
        Section(
            number="models",
            title=words.text("title_models"),
            words=verdicts(found),
            pictures=pictures,
        ),
        Section(
            number="numbers",
            title=words.text("title_numbers"),
            tables=[scores, models, _people(words, found)],
            files=["scores.csv", "onsets.csv"],
        ),
        Section(
            number="assumptions",
            title=words.text("title_assumptions"),
            introduction=words.items("assumptions", **about),
        ),
    ]


def _charts(found: Hindcast) -> list[Chart]:
    """Errors of onsets of models and baselines; the largest force of penalty models that are not
    excluded."""
    errors, forces = {}, {}
    for name, one in (found.models | found.base).items():
        chosen = one.scores[ONSET][one.possible]
        if len(chosen) and name != "nobody":
            low, middle, high = np.quantile(chosen, [0.05, 0.5, 0.95])
            errors[_short(name)] = float(middle), float(low), float(high)
    for name in found.combined():
        if name != RIGID:
            low, high = found.likely(name)[1]
            forces[_short(name)] = np.nan, 1e-3 * low, 1e-3 * high
    made = [Chart("error of the onsets", "s", errors)]
    return [*made, Chart("largest force of the first contact", "kN", forces)] if forces else made


def _short(name: str) -> str:
    """Name a model beside a bar: 20 kN/m."""
    title = BASELINES.get(name, name)
    return title if title != name or name == RIGID else f"{significant(float(name) / 1e3)} kN/m"


def _values(found: Hindcast) -> dict[str, object]:
    combined, models = found.combined(), found.models
    best = max(found.odds, key=lambda name: found.odds[name].fraction, default="")
    fits = {name: found.likely(name) for name in combined}
    soft = np.array([fits[name][1] for name in combined if name != RIGID])
    impulse = np.array([fits[name][2] for name in combined])
    beat = {score: [n for n in models if found.better(n)[score] >= BEATS] for score in SCORES}
    first = found.trial.pushed.max()
    wedged = (first > found.inputs.gap.sum(1)) if found.trial.wall is not None else np.zeros(1)
    return {
        "best": title_of(best) if best else "",
        "out": _models_named([name for name, one in found.odds.items() if one.out]),
        "together": _models_named(combined),
        "many": len(combined),
        "unsettled": _models_named(
            [name for name in combined if name != best and not found.odds[name].settled]
        ),
        "fits": "; ".join(
            f"{_models_named([name])}: {interval(fit[0], 2)}" for name, fit in fits.items()
        ),
        "postures": float(np.ptp(found.inputs.arms)),
        "beat": [(SCORE_NAMES[s], _models_named(beat[s])) for s in SCORES if beat[s]],
        "unbeaten": _list([SCORE_NAMES[score] for score in SCORES if not beat[score]]),
        "error": error_of(found.trial, models),
        "poor": POOR_S,
        "forces": 1e-3 * np.array([soft[:, 0].min(), soft[:, 1].max()]) if soft.size else None,
        "impulses": (impulse[:, 0].min(), impulse[:, 1].max()) if impulse.size else None,
        "momentum": momentum(found.trial),
        "impossible": max(float((~one.possible).mean()) for one in models.values()),
        "wedged": float(wedged.mean()),
        "none": _models_named([name for name in models if name not in found.odds]),
    }


def _models_named(names: Sequence[str]) -> str:
    """Models in a sentence: penalty with 2 000 or 5 000 N/m and rigid."""
    soft = [number(float(name)) for name in names if name != RIGID]
    return " and ".join(
        [f"penalty with {_list(soft)} N/m"] * bool(soft) + [RIGID] * (RIGID in names)
    )


def _list(words: Sequence[str]) -> str:
    return " or ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def _odds(found: Hindcast, name: str) -> str:
    one = found.odds.get(name)
    if one is None:
        return "no possible case"
    if one.fraction == 1:
        return "likeliest"
    if not one.settled:
        return "order not settled"
    return f"{_ratio(one.fraction)} ({_ratio(one.high)} – {_ratio(one.low)})"


def _ratio(fraction: float) -> str:
    # models that are wrong by so much are just that: the scatter of onsets has no such tails
    if fraction <= UNLIKELY:
        return f"< 1 : {number(1 / UNLIKELY)}"
    return f"1 : {significant(1 / fraction, 2)}"


def _spread(values: Floats) -> str:
    if not len(values):
        return NONE
    low, middle, high = (decimals(each, 2) for each in np.quantile(values, [0.05, 0.5, 0.95]))
    return f"{middle} ({low} – {high})"


def _models(words: Words, found: Hindcast) -> Table:
    rows = []
    for name in found.odds:
        arms, force, impulse, reach = found.likely(name)
        peak = NONE if name == RIGID else interval([1e-3 * each for each in force], 2)
        ends = [interval(arms, 2), interval(reach, 2), peak, interval(impulse, 2)]
        rows.append([title_of(name), _odds(found, name), *ends])
    return words.table("table_models", rows)


def _people(words: Words, found: Hindcast) -> Table:
    trial = found.trial
    at, near, room = onsets(trial, trial.along), closest(trial.along), trial.torso_gap
    rows = [
        [
            person,
            number(trial.mass[position]),
            decimals(room[position - 1], 2) if position else NONE,
            decimals(at[position], 2),
            decimals(near[position - 1], 2) if position else NONE,
        ]
        for position, person in enumerate(trial.people)
    ]
    if trial.wall is not None:
        rows.append(["wall", NONE, decimals(room[-1], 2), NONE, NONE])
    return words.table("table_people", rows)


CASES = Columns("push")


def _cases(found: Hindcast) -> Iterator[list[object]]:
    inputs = found.inputs
    drawn = inputs.batch, inputs.arms, inputs.wall, inputs.tau, inputs.reach, inputs.force
    for name, one in (found.models | found.base).items():
        scores = [one.scores[score] for score in SCORES]
        columns = [*drawn, one.possible.astype(int), *scores, one.largest, one.impulse]
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield [name, *("" if each != each else f"{each:.6g}" for each in row)]


def _nearest(found: Hindcast) -> Iterator[list[object]]:
    trial = found.trial
    yield ["measured", "", *map(repr, onsets(trial, trial.along).tolist())]
    for name, one in found.models.items():
        case = found.nearest(name)
        yield [name, case, *map(repr, one.onset[case].tolist())]


def _styles(found: Hindcast) -> Iterator[tuple[str, dict[str, Any]]]:
    for index, name in enumerate(found.models):
        colour = (*drawing.COLOURS, drawing.SKY, drawing.VERMILION)[index]
        yield name, {"color": colour, "ls": drawing.LINES[index % 4], "label": _short(name)}


def _posture(found: Hindcast) -> Figure:
    """Errors of onsets against posture: medians over the other inputs."""
    arms = found.inputs.arms
    edges = np.linspace(arms.min(), arms.max(), BINS + 1)
    index = np.clip(np.searchsorted(edges, arms) - 1, 0, BINS - 1)
    figure, (axes,) = drawing.panels(8.0, 4.5)

    def draw(one: Cases, **style: Any) -> None:
        errors = one.scores[ONSET]
        bins = [errors[(index == each) & one.possible] for each in range(BINS)]
        middle = [float(np.median(each)) if len(each) else np.nan for each in bins]
        axes.plot(0.5 * (edges[1:] + edges[:-1]), middle, **style)

    for name, appearance in _styles(found):
        draw(found.models[name], lw=1.5, **appearance)
    for name, style in (("copy", ":"), ("geometry", "--")):
        draw(found.base[name], color=drawing.GREY, ls=style, label=title_of(name), lw=2, zorder=0)
    x = "share of the room between chests that arms bridge"
    drawing.label(axes, x, "error of onsets (s)", ylim=(0, None))
    axes.grid(color=drawing.GRID)
    drawing.legend_below(figure, axes, 4)
    return figure


def _draw_heads(found: Hindcast) -> Figure:
    """Heads against time, each model's nearest case."""
    trial = found.trial
    figure, (axes,) = drawing.panels(8.0, 4.0)
    time = trial.time - trial.start_s
    measured, *_ = axes.plot(time, trial.along, color=drawing.BLACK, lw=3, alpha=0.5)
    measured.set_label("measured")
    for name, style in _styles(found):
        lines = axes.plot(time, found.head_positions(name)[:, 1:], lw=1, **style)
        for line in lines[1:]:
            line.set_label("_")
    if trial.wall is not None:
        axes.axhline(trial.wall, color=drawing.BLACK, lw=2)
    axes.set(xlabel="time after the push (s)", ylabel="along the row (m)")
    axes.grid(color=drawing.GRID)
    drawing.legend_below(figure, axes, 4)
    return figure
