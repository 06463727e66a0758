"""The page of a hindcast, and its numbers as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, COLOURS, GREY, GRID, LINES, MARKERS, SKY, VERMILION
from analysis.pages.html import render, write_pictures
from analysis.pages.numbers import NONE, decimals, interval, number, percent, significant
from analysis.pages.section import Section, Table
from analysis.pages.words import Words
from analysis.push.hindcast import RIGID, Hindcast
from analysis.push.row import STOPPED_M, TAU_S, TAUS_S, behind
from analysis.push.scores import CLOSEST, NEVER_S, ONSET, POSITION, SCORES, closest, onsets
from analysis.push.trial import ONSET_M_PER_S
from analysis.support.files import write_rows, write_text
from nscd.arrays import Floats

BEATS = 0.95
# Beyond this smallest error of onsets no model describes a trial (s).
POOR_S = 0.1
TITLES = {
    ONSET: "Onsets (s, root mean square)",
    POSITION: "Heads in the first 0.8 s of the push (m, root mean square)",
    CLOSEST: "Closest heads (m, root mean square)",
}
BASELINES = {"nobody": "nobody moves", "copy": "copies of the first", "geometry": "gaps alone"}
POSTURES = {0.0: "chests meet", 0.5: "half-way", 1.0: "arms touch"}
# Smaller odds are not written out.
UNLIKELY = 1e-4
HEAD = ["model", *(name.replace("_", " ") for name in SCORES), "beats all baselines", "odds"]


def title_of(name: str) -> str:
    """Name a model or baseline in words: LAMMPS, 2·10³ N/m."""
    if name == RIGID:
        return name
    return BASELINES.get(name) or f"LAMMPS, {number(float(name))} N/m"


def summary(found: Hindcast) -> list[list[str]]:
    """Give the rows of HEAD: medians and 5 and 95 % over all cases."""
    rows = []
    for name, one in (found.scored | found.base).items():
        cells = [_spread(one.scores[score], np.median(one.scores[score])) for score in SCORES]
        model = name in found.scored
        shares = (
            " / ".join(percent(share, 2) for share in found.better(name).values())
            if model
            else NONE
        )
        rows.append([title_of(name), *cells, shares, _odds(found.odds[name]) if model else NONE])
    return rows


def verdicts(found: Hindcast) -> list[str]:
    """Say which models beat the baselines, what is not told apart, and what is not validated."""
    return Words(__package__).items("words", **_values(found))


def write_hindcast(found: Hindcast, folder: Path, command: str) -> list[Path]:
    """Write `index.html`, its pictures, `scores.csv` and `onsets.csv`; return the paths, the page
    last."""
    words, trial = Words(__package__), found.trial
    section = Section(
        number="models",
        title=words.text("title"),
        words=verdicts(found),
        pictures=[
            words.picture("onsets", _onsets(found), limit=ONSET_M_PER_S, tau=TAU_S, never=NEVER_S),
            words.picture(
                "heads", _heads(found), tau=TAU_S, posture=_posture(float(found.inputs.arms[0]))
            ),
        ],
        tables=[*_tables(words, found), _models(words, found), _people(words, found)],
        files=["scores.csv", "onsets.csv"],
    )
    page = render(
        "push.html",
        command=command,
        trial=trial,
        introduction=words.text(
            "introduction",
            people=len(trial.people),
            wall=trial.wall is not None,
            depths=interval((trial.depth.min(), trial.depth.max())),
        ),
        sections=[section],
        images=write_pictures([section], folder / "figures"),
    )
    write_rows(folder / "scores.csv", ["model", "arms", "tau_s", "draw", *SCORES], _cases(found))
    write_rows(folder / "onsets.csv", ["model", "arms", *trial.people], _central(found))
    write_text(folder / "index.html", page)
    return [folder / name for name in ("scores.csv", "onsets.csv", "index.html")]


def _values(found: Hindcast) -> dict[str, object]:
    """What the sentences say."""
    together, central = found.together(), found.inputs.central
    scores = []
    for score in SCORES:
        good = [name for name in found.scored if found.better(name)[score] >= BEATS]
        name = TITLES[score].split(" (")[0]
        scores.append({"name": name, "models": _models_named(good), "one": len(good) == 1})
    out = [name for name in found.odds if name not in together]
    onset = {name: one.onset[central] for name, one in found.scored.items()}
    soft = [name for name in together if name != RIGID] or [*onset][:-1]
    forces = 1e-3 * np.concatenate([found.moved[name].largest[central] for name in soft])
    impulses = np.concatenate([found.moved[name].impulse[central] for name in together])
    short = behind(found.trial, found.moved[RIGID].along)
    return {
        "scores": scores,
        "together": {"words": _models_named(together), "one": len(together) == 1},
        "out": _list([f"{title_of(name)} ({_odds(found.odds[name])})" for name in out]),
        "least": min(float(one.scores[ONSET].min()) for one in found.scored.values()),
        "poor": POOR_S,
        "posture": max(_between(each[:, None], each[None]) for each in onset.values()),
        "stiffness": _between(onset[[*onset][-2]], onset[RIGID]),
        "forces": (forces.min(), forces.max()),
        "impulses": (np.nanmin(impulses), np.nanmax(impulses)),
        "stopped": float((short > STOPPED_M).mean()),
        "short": float(short.max()),
    }


def _between(one: Floats, other: Floats) -> float:
    """The largest root mean square of differences of onsets (…, n) s over people."""
    return float(np.sqrt(((one - other) ** 2).mean(-1)).max())


def _models_named(names: Sequence[str]) -> str:
    """Models in a sentence: LAMMPS with 2 000 or 5 000 N/m, and rigid."""
    soft = [number(float(name)) for name in names if name != RIGID]
    words = [f"LAMMPS with {_list(soft)} N/m"] if soft else []
    return _list(words + [RIGID] * (RIGID in names))


def _list(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def _odds(share: float) -> str:
    # models that are wrong by so much are just that: the scatter of onsets has no such tails
    return (
        f"1 : {significant(1 / share, 2)}"
        if share > UNLIKELY
        else f"below 1 : {number(1 / UNLIKELY)}"
    )


def _spread(values: Floats, middle: float) -> str:
    low, high = np.quantile(values, [0.05, 0.95])
    return f"{decimals(float(middle), 2)} ({decimals(float(low), 2)} – {decimals(float(high), 2)})"


def _tables(words: Words, found: Hindcast) -> Iterator[Table]:
    inputs = found.inputs
    postures = np.unique(inputs.arms)
    for score in SCORES:
        rows = []
        for name, one in (found.scored | found.base).items():
            cells = []
            for share in postures:
                chosen = inputs.arms == share
                middle = one.scores[score][chosen & inputs.central]
                cells.append(_spread(one.scores[score][chosen], float(middle[0])))
            beats = percent(found.better(name)[score], 2) if name in found.scored else NONE
            rows.append([title_of(name), *cells, beats])
        yield words.table(
            "table_scores",
            rows,
            title=TITLES[score],
            tau=TAU_S,
            taus=(min(TAUS_S), max(TAUS_S)),
            sd=found.trial.depth_sd,
            arms=[_posture(share) for share in postures.tolist()],
        )


def _posture(share: float) -> str:
    return POSTURES.get(share, f"arms fill {significant(share)}")


def _models(words: Words, found: Hindcast) -> Table:
    central = found.inputs.central
    rows = []
    for name, moved in found.moved.items():
        force, impulse = moved.largest[central], moved.impulse[central]
        peak = NONE if name == RIGID else interval((1e-3 * force.min(), 1e-3 * force.max()), 2)
        through = interval((np.nanmin(impulse), np.nanmax(impulse)), 2)
        rows.append([title_of(name), _odds(found.odds[name]), peak, through])
    return words.table("table_models", rows, tau=TAU_S)


def _people(words: Words, found: Hindcast) -> Table:
    trial = found.trial
    at, near = onsets(trial, trial.along), closest(trial.along)
    rows: list[list[str]] = []
    for number_, person in enumerate(trial.people):
        room = decimals(trial.torso_gap[number_ - 1], 2) if number_ else NONE
        nearest = decimals(near[number_ - 1], 2) if number_ else NONE
        mass = number(trial.mass[number_])
        rows.append([person, mass, room, decimals(at[number_], 2), nearest])
    return words.table("table_people", rows)


def _cases(found: Hindcast) -> Iterator[list[object]]:
    inputs = found.inputs
    for name, one in (found.scored | found.base).items():
        for case in range(len(inputs.tau)):
            given = [inputs.arms[case], inputs.tau[case], int(inputs.draw[case])]
            yield [name, *given, *(repr(float(one.scores[score][case])) for score in SCORES)]


def _central(found: Hindcast) -> Iterator[list[object]]:
    trial = found.trial
    yield ["measured", "", *map(repr, onsets(trial, trial.along).tolist())]
    for name, one in (found.scored | found.base).items():
        for case in np.flatnonzero(found.inputs.central):
            yield [name, found.inputs.arms[case], *map(repr, one.onset[case].tolist())]


def _looks(found: Hindcast) -> Iterator[tuple[str, dict[str, Any]]]:
    """The models and how they are drawn."""
    for place, name in enumerate(found.scored):
        colour = (*COLOURS, SKY, VERMILION)[place]
        yield (
            name,
            {"color": colour, "ls": LINES[place % 4], "label": title_of(name)},
        )


def _onsets(found: Hindcast) -> Figure:
    """Onset against person, posture by posture."""
    trial, cases = found.trial, np.flatnonzero(found.inputs.central)
    figure = Figure(figsize=(11.0, 3.8), layout="constrained")
    people = np.arange(1, len(trial.people) + 1)
    every = np.atleast_1d(figure.subplots(1, len(cases), sharey=True))
    for axes, case in zip(every, cases, strict=True):
        for place, (name, look) in enumerate(_looks(found)):
            marker = MARKERS[place % len(MARKERS)]
            axes.plot(people, found.scored[name].onset[case], marker=marker, ms=4, lw=1, **look)
        for name, one in found.base.items():
            if name != "nobody":
                style = ":" if name == "copy" else "--"
                axes.plot(
                    people, one.onset[case], style, color=GREY, lw=2, label=title_of(name), zorder=0
                )
        axes.plot(
            people, onsets(trial, trial.along), "x", color=BLACK, ms=9, mew=2, label="measured"
        )
        axes.set(title=_posture(float(found.inputs.arms[case])), xlabel="person", xticks=people)
        axes.grid(color=GRID)
    every[0].set(ylabel="onset (s)")
    figure.legend(
        *every[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8
    )
    return figure


def _heads(found: Hindcast) -> Figure:
    """Heads against time."""
    trial, case = found.trial, int(np.flatnonzero(found.inputs.central)[0])
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    time = trial.time - trial.start_s
    axes.plot(time, trial.along, color=BLACK, lw=3, alpha=0.5)
    for name, look in _looks(found):
        lines = axes.plot(time, found.moved[name].along[case, :, 1:], lw=1, **look)
        for line in lines[1:]:
            line.set_label("_")
    if trial.wall is not None:
        axes.axhline(trial.wall, color=BLACK, lw=2)
    axes.set(xlabel="time after the push (s)", ylabel="along the row (m)")
    axes.grid(color=GRID)
    axes.legend(fontsize=8, loc="upper left")
    return figure
