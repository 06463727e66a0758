"""The library of advice, measured again, and tests of the advice on scenes that are not in it.

`python benchmarks/advice.py library [SCENE …]` measures the scenes of the library, or some of them,
and writes it; `python benchmarks/advice.py test [SCENE …]` asks for advice on unseen scenes,
measures every setting on them, and prints what was promised beside what came out; `python
benchmarks/advice.py impacts` does so for engines in unseen impacts, against their own model. Runs
are kept in `--runs` (out/advice): interrupted, all three go on where they stopped."""

import argparse
import dataclasses
import itertools
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analysis.pages.numbers import percent
from analysis.scene.scene import Scene
from analysis.studies.advice.candidates import Candidate, Question, rates_of
from analysis.studies.advice.choice import SHARES, advise, setting
from analysis.studies.advice.library import FILE, Entry, Library, stored_library, write_library
from analysis.studies.work_precision.chart import measure
from analysis.studies.work_precision.point import Point, PointStatus
from analysis.studies.work_precision.soft import Grid, prepare_window, settings_of, soft_engines
from analysis.support.parallel import workers
from benchmarks.advice_cases import IMPACTS, LIBRARY, UNSEEN, Makers
from benchmarks.machine import head, line, table

STORED = Path(__file__).resolve().parent.parent / "analysis" / "advice" / FILE
ASKED = (0.01, 0.05, 0.2)
SHOWN = 0.05
TIGHT = 0.02
# Finer time steps of a driven crowd cost more than any asked error is worth, coarser ones fail.
# YADE has the errors of LAMMPS with the same law (tests compare them), so that fewer of its runs
# tell its cost. Of an impact more is measured than advice chooses from.
DRIVEN = Grid(shares=(0.25, 1.0, 4.0, 8.0), of_engine={"yade": (1.0, 4.0)})
IMPACT = Grid(stiffer=(1.0,), shares=(*SHARES, 8.0), of_engine={"yade": (1.0, 4.0)})
SOFT = ("lammps", "yade")


WHO: dict[str, dict[str, Any]] = {
    "any method": {},
    "engines": {"methods": SOFT},
    "engines against their model": {"methods": SOFT, "against": "model"},
}
LOADS: dict[str, dict[str, Any]] = {"disk load": {}, "wall load": {"quantity": "wall-load"}}
QUESTIONS = {
    f"{who}, {load}": Question(error=1.0, **WHO[who], **LOADS[load])
    for who, load in itertools.product(WHO, LOADS)
}


def entries(cases: Makers, runs: Path, executor: Executor) -> Iterator[tuple[Scene, Entry]]:
    """Each scene, measured over the grid of its kind."""
    for number, (name, make) in enumerate(cases.items()):
        print(f"{number + 1} of {len(cases)}: {name}", file=sys.stderr)
        scene = make().model_copy(update={"name": name})
        (runs / name).mkdir(parents=True, exist_ok=True)
        window = prepare_window(scene, runs / name)
        grid = DRIVEN if window.driven else IMPACT
        settings = list(settings_of(window, soft_engines(), grid))
        measured = measure(window, name, settings, runs / name, executor)
        yield scene, Entry.of(scene, measured.points)


def outcome(scene: Scene, entry: Entry, asked_for: Question, library: Library) -> dict[str, Any]:
    """Ask, and look up what was measured: the choice (None: refused), what it promised, the measured
    error of that very setting (NaN where the run did not end well), its measured cost over that of
    the cheapest setting that reaches the asked error (NaN where none does), and whether the choice
    held; for a refusal, whether nothing reaches the error."""
    choice = advise(scene, asked_for, library=library).choice
    points = [p for p in entry.points if p.load == asked_for.load and p.method in asked_for.methods]
    if asked_for.against == "model":
        own = scene.contact.law, entry.stiffness_N_per_m
        points = [p for p in points if (p.law, p.stiffness_N_per_m) == own]
    errors = {p: error_of(p, asked_for) for p in points}
    reaching = [p for p, error in errors.items() if error <= asked_for.error]
    if choice is None:
        nothing = dict.fromkeys(("promised", "measured", "times"), np.nan)
        return {"choice": None, "held": not reaching, **nothing}
    best = min((p.cpu_seconds or 0.0 for p in reaching), default=np.nan)
    same = next((p for p in points if is_setting(p, choice)), None)
    measured, times = np.nan, np.nan
    if same is not None:
        measured, times = errors[same], np.divide(same.cpu_seconds or np.nan, best)
    found = {"choice": choice, "promised": choice.promised_error, "measured": measured}
    return found | {"times": times, "held": measured <= asked_for.error}


def error_of(point: Point, question: Question) -> float:
    """The measured error that the question is about; NaN where the run did not end well."""
    error = point.total_error if question.against == "rigid" else point.numerical_error
    return np.nan if error is None or point.status != PointStatus.OK else error


def is_setting(point: Point, candidate: Candidate) -> bool:
    """Whether the point was measured with the candidate's setting."""
    names = ("method", "law", "solver", "time_step_share", "tolerance")
    same = all(getattr(point, name) == getattr(candidate, name) for name in names)
    mine, theirs = candidate.stiffness_N_per_m, point.stiffness_N_per_m
    return same and (mine is None or theirs is None or abs(theirs / mine - 1) < 1e-9)


def summary(outcomes: pd.DataFrame) -> str:
    """A Markdown table: each question at each asked error."""
    rows = []
    for words, requested in itertools.product(QUESTIONS, ASKED):
        ours = outcomes[(outcomes.question == words) & (outcomes.asked == requested)]
        made, refused = ours[ours.choice.notna()], ours[ours.choice.isna()]
        times = made.times.dropna()
        cost = f"{times.median():.2f}, {times.max():.2f}" if len(times) else "–"
        counts = [n for some in (made, refused) for n in (len(some), int(some.held.sum()))]
        rows.append([words, percent(requested, 2), *counts, cost])
    names = ("question", "asked", "promised", "held", "refused", "rightly")
    return table([*names, "cost over the cheapest found, median and most"], rows)


def details(outcomes: pd.DataFrame) -> str:
    """A Markdown table: every scene and question at one asked error."""
    rows = []
    for o in outcomes[outcomes.asked == SHOWN].itertuples():
        cells, times = ["refused", "–"], "–" if np.isnan(o.times) else f"{o.times:.2f}"
        found = "nothing reaches it" if o.held else "but something reaches it"
        if o.choice is not None:
            cells = [setting(o.choice), percent(o.promised, 2)]
            found = "did not end well" if np.isnan(o.measured) else percent(o.measured, 2)
        rows.append([o.scene, o.question, *cells, found if o.held else f"**{found}**", times])
    names = ("scene", "question", f"choice for {percent(SHOWN, 2)}", "promised", "measured")
    return table([*names, "cost over the cheapest found"], rows)


def test(runs: Path, processes: int | None, names: Sequence[str]) -> None:
    """Print both tables for the unseen scenes, or those of these names, and for how many of them
    all promises held."""
    library, found = stored_library(), []
    with workers(processes) as executor:
        for scene, entry in entries(chosen(UNSEEN, names), runs, executor):
            known = {point.load for point in entry.points}
            for (words, question), requested in itertools.product(QUESTIONS.items(), ASKED):
                if question.load in known:
                    one = {"scene": entry.name, "question": words, "asked": requested}
                    question = dataclasses.replace(question, error=requested)
                    found.append(one | outcome(scene, entry, question, library))
    outcomes = pd.DataFrame(found)
    made, refused = outcomes[outcomes.choice.notna()], outcomes[outcomes.choice.isna()]
    broken = set(made[~made.held].scene)
    scenes = outcomes.scene.nunique()
    print(
        f"{len(made)} promises, {made.held.sum()} within the asked error; every promise held on "
        f"{scenes - len(broken)} of\n{scenes} unseen scenes. "
        f"{(made.measured <= made.promised).sum()} are also within the smaller error that the "
        f"choice itself promised.\n{(made.times > 2).sum()} choices cost more than twice the "
        f"cheapest found. {len(refused)} refusals, of which\n{refused.held.sum()} rightly: "
        f"no setting measured reaches the asked error.\n\n{summary(outcomes)}\n\n{details(outcomes)}"
    )


def chosen(cases: Makers, names: Sequence[str]) -> Makers:
    """Those of these names, or all."""
    if unknown := set(names) - set(cases):
        sys.exit(f"scenes: {', '.join(unknown)}. There are: {', '.join(cases)}")
    return {name: make for name, make in cases.items() if not names or name in names}


def impacts(runs: Path, processes: int | None, names: Sequence[str]) -> None:
    """Print for each unseen impact, or those of these names, what is advised within TIGHT of its
    engines' own model, and how every promise compares with what was measured."""
    question = Question(error=TIGHT, against="model", methods=SOFT)
    over: list[float] = []
    titles = ("impact", "disks", f"choice for {percent(TIGHT, 2)}", "promised", "measured")
    print(head(*titles, "promised/measured"))
    with workers(processes) as executor:
        for scene, entry in entries(chosen(IMPACTS, names), runs, executor):
            advice = advise(scene, question, library=stored_library())
            measured = {}
            for point in entry.points:
                same = next((c for c in advice.found if is_setting(point, c)), None)
                if point.quantity.startswith("disk") and same and point.numerical_error:
                    measured[same] = point.numerical_error
            ratios = [c.promised_error / error for c, error in measured.items()]
            over += ratios
            cells = ["refused", "–", "–"]
            if (choice := advice.choice) is not None:
                errors = (choice.promised_error, measured[choice])
                cells = [setting(choice), *(percent(error, 2) for error in errors)]
            spread = f"{min(ratios):.2f} to {max(ratios):.2f} ({len(ratios)})"
            print(line([entry.name, entry.likeness.disks, *cells, spread]), flush=True)
    print(f"\n{len(over)} promises: {min(over):.2f} to {max(over):.2f} times what was measured.")


def make_library(runs: Path, processes: int | None, names: Sequence[str]) -> None:
    """Measure the library's scenes, or those of these names, and write it."""
    known = {entry.name: entry for entry in stored_library().entries} if names else {}
    with workers(processes) as executor:
        known |= {entry.name: entry for _, entry in entries(chosen(LIBRARY, names), runs, executor)}
    measured = tuple(known[name] for name in LIBRARY)
    write_library(Library(entries=measured, rates=rates_of(measured)), STORED)
    print(STORED)


TASKS = {"library": make_library, "test": test, "impacts": impacts}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=TASKS)
    parser.add_argument("scenes", nargs="*", help="some scenes; all if left out")
    parser.add_argument("--runs", type=Path, default=Path("out/advice"), help="folder of the runs")
    parser.add_argument("--jobs", type=int, help="processes; as many as cores if left out")
    args = parser.parse_args()
    TASKS[args.what](args.runs.absolute(), args.jobs, args.scenes)


if __name__ == "__main__":
    main()
