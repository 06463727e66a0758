"""The library of advice, made anew, and a test of the advice on scenes that are not in it.

`python benchmarks/advice.py library` measures the scenes of the library and writes it; `python
benchmarks/advice.py test` asks for advice on unseen scenes, measures every setting on them, and
prints what was promised beside what came out. Runs are kept in `--runs` (out/advice): interrupted,
both go on where they stopped."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from advice_cases import LIBRARY, UNSEEN, Makers

from analysis.advice.choice import Against, Candidate, advise, window_of
from analysis.advice.library import FILE, Entry, Library, library_text, stored_library
from analysis.advice.likeness import likeness_of
from analysis.advice.measure_library import measured_points
from analysis.advice.safety import rates_of
from analysis.advice.words import setting
from analysis.engines import ENGINES
from analysis.pages.numbers import percent
from analysis.scene.scene import Scene
from analysis.support.files import write_text
from analysis.support.parallel import workers
from analysis.work_precision.point import Point, PointStatus

STORED = Path(__file__).resolve().parent.parent / "analysis" / "advice" / FILE
ASKED = (0.01, 0.05, 0.2)
SHOWN = 0.05
SOFT = ("lammps", "yade")


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What is asked of every scene, and in words."""

    words: str
    quantity: str
    against: Against
    methods: tuple[str, ...]


QUESTIONS = (
    Question(
        words="any method, disk load",
        quantity="disk-load",
        against="rigid",
        methods=("rigid", *SOFT),
    ),
    Question(
        words="any method, wall load",
        quantity="wall-load",
        against="rigid",
        methods=("rigid", *SOFT),
    ),
    Question(words="engines, disk load", quantity="disk-load", against="rigid", methods=SOFT),
    Question(words="engines, wall load", quantity="wall-load", against="rigid", methods=SOFT),
    Question(
        words="engines against their model, disk load",
        quantity="disk-load",
        against="model",
        methods=SOFT,
    ),
    Question(
        words="engines against their model, wall load",
        quantity="wall-load",
        against="model",
        methods=SOFT,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One question, one scene, one asked error: the choice (None: refused) and what it promised;
    what was measured with that very setting (None where the run did not end well); its measured
    cost over that of the cheapest setting that reaches the asked error (None where none does)."""

    scene: str
    question: Question
    asked: float
    choice: Candidate | None
    measured: float | None
    times_best: float | None
    reachable: bool

    @property
    def held(self) -> bool:
        """Whether the choice is within the asked error; for a refusal, whether nothing is."""
        if self.choice is None:
            return not self.reachable
        return self.measured is not None and self.measured <= self.asked


def entries(cases: Makers, runs: Path, executor: Executor) -> Iterator[tuple[Scene, Entry]]:
    """Each scene, measured."""
    engines = tuple(engine.NAME for engine in ENGINES if engine.find())
    for number, (name, make) in enumerate(cases.items()):
        print(f"{number + 1} of {len(cases)}: {name}", file=sys.stderr)
        scene = make()
        points = measured_points(scene, name, engines, runs / name, executor)
        yield (
            scene,
            Entry(
                name=name,
                likeness=likeness_of(scene),
                stiffness_N_per_m=scene.contact.stiffness_N_per_m,
                window_s=window_of(scene),
                points=points,
            ),
        )


def outcome(
    scene: Scene, entry: Entry, question: Question, asked: float, library: Library
) -> Outcome:
    """Ask, and look up what was measured."""
    advice = advise(
        scene,
        asked,
        quantity=question.quantity,
        against=question.against,
        methods=question.methods,
        library=library,
    )
    points = [
        p
        for p in entry.points
        if p.quantity.split("_")[0] == question.quantity.split("-")[0]
        and p.method in question.methods
    ]
    if question.against == "model":
        points = [
            p
            for p in points
            if p.law == scene.contact.law and p.stiffness_N_per_m == entry.stiffness_N_per_m
        ]
    reaching = [p for p in points if (e := error_of(p, question)) is not None and e <= asked]
    best = min((p.cpu_seconds or 0.0 for p in reaching), default=None)
    measured, times = None, None
    if advice.choice is not None:
        same = next((p for p in points if is_setting(p, advice.choice)), None)
        measured = None if same is None else error_of(same, question)
        if same is not None and best is not None and same.cpu_seconds is not None:
            times = same.cpu_seconds / best
    return Outcome(
        scene=entry.name,
        question=question,
        asked=asked,
        choice=advice.choice,
        measured=measured,
        times_best=times,
        reachable=best is not None,
    )


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


def summary(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Lines of a Markdown table: each question at each asked error."""
    yield "| question | asked | promised | held | refused | rightly | cost over the cheapest found, median and most |"
    yield "|---|---|---|---|---|---|---|"
    for question in QUESTIONS:
        for asked in ASKED:
            ours = [o for o in outcomes if o.question == question and o.asked == asked]
            made, refused = [o for o in ours if o.choice], [o for o in ours if not o.choice]
            times = [o.times_best for o in made if o.times_best is not None]
            cost = f"{np.median(times):.2f}, {max(times):.2f}" if times else "–"
            yield (
                f"| {question.words} | {percent(asked, 2)} | {len(made)} | {sum(o.held for o in made)} | {len(refused)} "
                f"| {sum(o.held for o in refused)} | {cost} |"
            )


def details(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Lines of a Markdown table: every scene and question at one asked error."""
    yield f"| scene | question | choice for {percent(SHOWN, 2)} | promised | measured | cost over the cheapest found |"
    yield "|---|---|---|---|---|---|"
    for o in outcomes:
        if o.asked != SHOWN:
            continue
        if o.choice is None:
            rightly = "nothing reaches it" if o.held else "**but something reaches it**"
            yield f"| {o.scene} | {o.question.words} | refused | – | {rightly} | – |"
            continue
        measured = "did not end well" if o.measured is None else percent(o.measured, 2)
        times = "–" if o.times_best is None else f"{o.times_best:.2f}"
        yield (
            f"| {o.scene} | {o.question.words} | {setting(o.choice)} | {percent(o.choice.promised_error, 2)} "
            f"| {measured if o.held else f'**{measured}**'} | {times} |"
        )


def test(runs: Path, processes: int | None) -> None:
    """Print both tables, and for how many scenes all promises held."""
    library, outcomes = stored_library(), []
    with workers(processes) as executor:
        for scene, entry in entries(UNSEEN, runs, executor):
            known = {point.quantity.split("_")[0] for point in entry.points}
            for question in QUESTIONS:
                if question.quantity.split("-")[0] in known:
                    outcomes += [outcome(scene, entry, question, asked, library) for asked in ASKED]
    made = [o for o in outcomes if o.choice is not None]
    scenes = dict.fromkeys(o.scene for o in outcomes)
    kept = [name for name in scenes if all(o.held for o in made if o.scene == name)]
    dear = [o for o in made if o.times_best is not None and o.times_best > 2]
    refused = [o for o in outcomes if o.choice is None]
    closer = [
        o
        for o in made
        if o.measured is not None and o.choice and o.measured <= o.choice.promised_error
    ]
    print(
        f"{len(made)} promises, {sum(o.held for o in made)} within the asked error; every promise held on {len(kept)} of"
    )
    print(
        f"{len(scenes)} unseen scenes. {len(closer)} are also within the smaller error that the choice itself promised."
    )
    print(
        f"{len(dear)} choices cost more than twice the cheapest found. {len(refused)} refusals, of which"
    )
    print(f"{sum(o.held for o in refused)} rightly: no setting measured reaches the asked error.\n")
    for line in (*summary(outcomes), "", *details(outcomes)):
        print(line)


def make_library(runs: Path, processes: int | None) -> None:
    """Measure the library's scenes and write it."""
    with workers(processes) as executor:
        measured = tuple(entry for _, entry in entries(LIBRARY, runs, executor))
    write_text(STORED, library_text(Library(entries=measured, rates=rates_of(measured))))
    print(STORED)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=("library", "test"))
    parser.add_argument("--runs", type=Path, default=Path("out/advice"), help="folder of the runs")
    parser.add_argument("--jobs", type=int, help="processes; as many as cores if left out")
    options = parser.parse_args()
    (make_library if options.what == "library" else test)(options.runs.absolute(), options.jobs)


if __name__ == "__main__":
    main()
