"""percussions benchmark-library and benchmark-score."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from analysis.cli.app import Jobs, Out, path, positive, progress, say_expected, show, write_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from analysis.library.score import Scores

# Of the whole library, in CPU seconds.
WHOLE_S = 150.0


def benchmark_library(
    only: Annotated[
        list[str] | None, typer.Option(help="Name of a problem; repeated. Left out: all.")
    ] = None,
    jobs: Jobs = None,
    out: Out = Path("library"),
) -> None:
    """Write the library of contact problems: FCLIB files, each with its answer, and a manifest.

    Crowds of seven families and frames of a real one, with and without friction, up to 5,000
    people; 45 MB in all. `benchmark-score` holds answers of any solver against it.

    Example: percussions benchmark-library --out library"""
    from analysis.library.writing import PROBLEMS, write_library
    from analysis.support.parallel import workers

    names = {problem.name: problem for problem in PROBLEMS}
    for name in only or ():
        if name not in names:
            raise ValueError(f"only: {name}; there are: {', '.join(names)}")
    chosen = [problem for name, problem in names.items() if not only or name in only]
    if not only:
        say_expected(WHOLE_S, f"{len(chosen)} problems", jobs)
    with contextlib.ExitStack() as stack:
        alone = jobs == 1 or len(chosen) == 1
        executor = None if alone else stack.enter_context(workers(jobs))
        print(write_library(out, chosen, executor, stack.enter_context(progress())))


def benchmark_score(
    library: Annotated[Path, typer.Argument(parser=path, help="Folder of the library.")],
    answers: Annotated[
        list[Path],
        typer.Argument(
            parser=path,
            help="Folders of answers, one a solver: HDF5 files of the names of the problems', with "
            "r in /solution and perhaps the CPU `seconds` as its attribute.",
        ),
    ],
    limit: Annotated[
        float,
        typer.Option(parser=positive, help="CPU seconds that count for what is not right, in s."),
    ] = 20.0,
    out: Out = Path("scores"),
) -> None:
    """Judge the answers of solvers to the library, by what the mechanics determines.

    Right is an answer that solves the equations and, without friction, has the velocities that
    there are, the forces that balance determines, and others within their intervals. Writes
    scores.csv and profile.png.

    Example: percussions benchmark-score library answers/mine answers/theirs"""
    from analysis.library.score import score, write_scores

    with progress() as bars:
        found = score(library, answers, bars)
    write_scores(out / "scores.csv", found)
    for friction in (False, True):
        _say(found.of(friction), friction, limit)
    print(out / "scores.csv")
    write_picture(out / "profile.png", lambda: _profile(found))


def _profile(scores: Scores) -> Figure:
    from analysis.library.picture import profile_picture

    return profile_picture(scores)


def _say(scores: Scores, friction: bool, limit: float) -> None:
    """Print a line for each solver, the fastest first."""
    from analysis.pages.numbers import number

    if not scores.problems:
        return
    means, right = scores.means(limit), scores.right
    least = min((mean for mean in means if math.isfinite(mean)), default=math.nan)
    rows = []
    for place in sorted(range(len(means)), key=lambda p: (math.isnan(means[p]), means[p])):
        residuals = [one.residual for one in scores.verdicts[place] if one and one.right]
        rows.append(
            [
                scores.solvers[place],
                str(int(right[place].sum())),
                str(sum(one is not None and not one.right for one in scores.verdicts[place])),
                number(means[place], 2),
                number(means[place] / least, 2),
                number(max(residuals, default=math.nan), 2),
            ]
        )
    kind = "with friction (residual alone)" if friction else "without friction"
    head = ["solver", "right", "wrong", "mean CPU s", "times the best", "worst residual"]
    show(head, rows, title=f"{len(scores.problems)} problems {kind}")
