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
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.advice.candidates import Candidate, Question, rates_of
from analysis.advice.choice import SHARES, advise, setting
from analysis.advice.library import FILE, Entry, Library, library_text, stored_library
from analysis.pages.numbers import percent
from analysis.scene.scene import Scene
from analysis.support.files import write_text
from analysis.support.parallel import workers
from analysis.work_precision.chart import measure
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.soft import Grid, prepare_window, settings_of, soft_engines
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


QUESTIONS = {
    "any method, disk load": Question(error=1.0),
    "any method, wall load": Question(error=1.0, quantity="wall-load"),
    "engines, disk load": Question(error=1.0, methods=SOFT),
    "engines, wall load": Question(error=1.0, quantity="wall-load", methods=SOFT),
    "engines against their model, disk load": Question(error=1.0, against="model", methods=SOFT),
    "engines against their model, wall load": Question(
        error=1.0, quantity="wall-load", against="model", methods=SOFT
    ),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """One question, one scene, one asked error.

    times_best: its measured cost over that of the cheapest setting that reaches the asked error;
    None where none does."""

    scene: str
    words: str  # the question, in words
    asked: float
    choice: Candidate | None  # None: refused
    measured: float | None  # with that very setting; None where the run did not end well
    times_best: float | None
    reachable: bool

    @property
    def held(self) -> bool:
        """Whether the choice is within the asked error; for a refusal, whether nothing is."""
        if self.choice is None:
            return not self.reachable
        return self.measured is not None and self.measured <= self.asked


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


def outcome(scene: Scene, entry: Entry, words: str, asked: float, library: Library) -> Outcome:
    """Ask, and look up what was measured."""
    question = dataclasses.replace(QUESTIONS[words], error=asked)
    advice = advise(scene, question, library=library)
    points = [p for p in entry.points if p.load == question.load and p.method in question.methods]
    if question.against == "model":
        own = scene.contact.law, entry.stiffness_N_per_m
        points = [p for p in points if (p.law, p.stiffness_N_per_m) == own]
    reaching = [p for p in points if (e := error_of(p, question)) is not None and e <= asked]
    best = min((p.cpu_seconds or 0.0 for p in reaching), default=None)
    measured, times = None, None
    if advice.choice is not None:
        same = next((p for p in points if is_setting(p, advice.choice)), None)
        measured = None if same is None else error_of(same, question)
        if same is not None and best is not None and same.cpu_seconds is not None:
            times = same.cpu_seconds / best
    return Outcome(entry.name, words, asked, advice.choice, measured, times, best is not None)


def error_of(point: Point, question: Question) -> float | None:
    """The measured error that the question is about; None where the run did not end well."""
    if point.status != PointStatus.OK:
        return None
    return point.total_error if question.against == "rigid" else point.numerical_error


def is_setting(point: Point, candidate: Candidate) -> bool:
    """Whether the point was measured with the candidate's setting."""
    same = all(
        getattr(point, name) == getattr(candidate, name)
        for name in ("method", "law", "solver", "time_step_share", "tolerance")
    )
    if candidate.stiffness_N_per_m is None or point.stiffness_N_per_m is None:
        return same
    return same and abs(point.stiffness_N_per_m / candidate.stiffness_N_per_m - 1) < 1e-9


def summary(outcomes: Sequence[Outcome]) -> str:
    """A Markdown table: each question at each asked error."""
    rows = []
    for words, asked in itertools.product(QUESTIONS, ASKED):
        ours = [o for o in outcomes if o.words == words and o.asked == asked]
        made, refused = [o for o in ours if o.choice], [o for o in ours if not o.choice]
        times = [o.times_best for o in made if o.times_best is not None]
        cost = f"{np.median(times):.2f}, {max(times):.2f}" if times else "–"
        counts = [n for some in (made, refused) for n in (len(some), sum(o.held for o in some))]
        rows.append([words, percent(asked, 2), *counts, cost])
    names = ("question", "asked", "promised", "held", "refused", "rightly")
    return table([*names, "cost over the cheapest found, median and most"], rows)


def details(outcomes: Sequence[Outcome]) -> str:
    """A Markdown table: every scene and question at one asked error."""
    rows = []
    for o in (o for o in outcomes if o.asked == SHOWN):
        if o.choice is None:
            rightly = "nothing reaches it" if o.held else "**but something reaches it**"
            rows.append([o.scene, o.words, "refused", "–", rightly, "–"])
            continue
        measured = "did not end well" if o.measured is None else percent(o.measured, 2)
        told = [setting(o.choice), percent(o.choice.promised_error, 2)]
        times = "–" if o.times_best is None else f"{o.times_best:.2f}"
        rows.append([o.scene, o.words, *told, measured if o.held else f"**{measured}**", times])
    names = ("scene", "question", f"choice for {percent(SHOWN, 2)}", "promised", "measured")
    return table([*names, "cost over the cheapest found"], rows)


def test(runs: Path, processes: int | None, names: Sequence[str]) -> None:
    """Print both tables for the unseen scenes, or those of these names, and for how many of them
    all promises held."""
    library, outcomes = stored_library(), []
    chosen = {name: make for name, make in UNSEEN.items() if not names or name in names}
    with workers(processes) as executor:
        for scene, entry in entries(chosen, runs, executor):
            known = {point.load for point in entry.points}
            for words, question in QUESTIONS.items():
                if question.load in known:
                    outcomes += [outcome(scene, entry, words, asked, library) for asked in ASKED]
    made = [o for o in outcomes if o.choice is not None]
    scenes = dict.fromkeys(o.scene for o in outcomes)
    kept = [name for name in scenes if all(o.held for o in made if o.scene == name)]
    dear = [o for o in made if o.times_best is not None and o.times_best > 2]
    refused = [o for o in outcomes if o.choice is None]
    closer = sum(
        o.measured <= o.choice.promised_error for o in made if o.choice and o.measured is not None
    )
    print(
        f"{len(made)} promises, {sum(o.held for o in made)} within the asked error; every promise "
        f"held on {len(kept)} of\n{len(scenes)} unseen scenes. {closer} are also within the smaller "
        f"error that the choice itself promised.\n{len(dear)} choices cost more than twice the "
        f"cheapest found. {len(refused)} refusals, of which\n{sum(o.held for o in refused)} rightly: "
        f"no setting measured reaches the asked error.\n\n{summary(outcomes)}\n\n{details(outcomes)}"
    )


def impacts(runs: Path, processes: int | None) -> None:
    """Print for each unseen impact what is advised within TIGHT of its engines' own model, and how
    every promise compares with what was measured."""
    question = Question(error=TIGHT, against="model", methods=SOFT)
    over: list[float] = []
    names = ("impact", "disks", f"choice for {percent(TIGHT, 2)}", "promised", "measured")
    print(head(*names, "promised/measured"))
    with workers(processes) as executor:
        for scene, entry in entries(IMPACTS, runs, executor):
            advice = advise(scene, question, library=stored_library())
            measured = {}
            for point in entry.points:
                same = next((c for c in advice.found if is_setting(point, c)), None)
                if point.quantity.startswith("disk") and same and point.numerical_error:
                    measured[same] = point.numerical_error
            ratios = [c.promised_error / error for c, error in measured.items()]
            over += ratios
            told = ["refused", "–", "–"]
            if (choice := advice.choice) is not None:
                errors = (choice.promised_error, measured[choice])
                told = [setting(choice), *(percent(error, 2) for error in errors)]
            spread = f"{min(ratios):.2f} to {max(ratios):.2f} ({len(ratios)})"
            print(line([entry.name, entry.likeness.disks, *told, spread]), flush=True)
    print(f"\n{len(over)} promises: {min(over):.2f} to {max(over):.2f} times what was measured.")


def make_library(runs: Path, processes: int | None, names: Sequence[str]) -> None:
    """Measure the library's scenes, or those of these names, and write it."""
    chosen = {name: make for name, make in LIBRARY.items() if not names or name in names}
    known = {entry.name: entry for entry in stored_library().entries} if names else {}
    with workers(processes) as executor:
        known |= {entry.name: entry for _, entry in entries(chosen, runs, executor)}
    measured = tuple(known[name] for name in LIBRARY)
    write_text(STORED, library_text(Library(entries=measured, rates=rates_of(measured))))
    print(STORED)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=("library", "test", "impacts"))
    parser.add_argument("scenes", nargs="*", help="some scenes; all if left out")
    parser.add_argument("--runs", type=Path, default=Path("out/advice"), help="folder of the runs")
    parser.add_argument("--jobs", type=int, help="processes; as many as cores if left out")
    options = parser.parse_args()
    given = options.runs.absolute(), options.jobs
    if options.what == "impacts":
        impacts(*given)
    else:
        {"test": test, "library": make_library}[options.what](*given, options.scenes)


if __name__ == "__main__":
    main()
