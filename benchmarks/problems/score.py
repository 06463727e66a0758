"""The answers of solvers to a library: which are right, how long they took, and how solvers
compare."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.pages.drawing import EVERY_COLOUR, GRID
from analysis.support.columns import Columns
from analysis.support.parallel import Progress
from benchmarks.problems.judge import judge
from benchmarks.problems.writing import UNIQUE, read_manifest
from nscd.arrays import Floats

# Added to the seconds of each problem before their geometric mean is taken, so that microseconds on
# the smallest ones decide nothing (s).
SHIFT = 0.01
COLUMNS = Columns("score")
MISSING = "missing"


def score(library: Path, solution_files: Sequence[Path], progress: Progress | None = None) -> pd.DataFrame:
    """Judge folders of answers, one a solver, each with a file of the name of the problem's: a row
    for each solver and problem, by COLUMNS.

    Raises ExchangeError naming the file for what cannot be read, ValueError for a folder without
    any answer and for two of the same name."""
    entries = read_manifest(library)
    names = [folder.resolve().name for folder in solution_files]
    for name, folder in zip(names, solution_files, strict=True):
        if names.count(name) > 1:
            raise ValueError(f"{folder}: two folders of answers are named {name}")
        if not any((folder / entry["file"]).is_file() for entry in entries):
            raise ValueError(f"{folder}: no answer to any problem of {library}")
    rows = []
    for number, entry in enumerate(entries):
        problem, unique = library / entry["file"], entry["velocity"] == UNIQUE
        of = [entry[name] for name in ("name", "family", "disks", "contacts", "friction")]
        for name, folder in zip(names, solution_files, strict=True):
            file, cells = folder / entry["file"], (MISSING, "")
            if file.is_file():
                one = judge(problem, file, unique=unique)
                errors = one.residual, one.velocity, one.determined, one.outside, one.seconds
                cells = "right" if one.right else "wrong", one.why, *errors
            rows.append([name, *of, *cells])
        if progress:
            progress("problems", (number + 1) / len(entries))
    found = pd.DataFrame(rows, columns=list(COLUMNS))
    return found.sort_values("solver", key=lambda one: one.map(names.index), kind="stable")


def with_friction(scores: pd.DataFrame, friction: bool) -> pd.DataFrame:
    """Keep the problems with friction, or those without, and the solvers that answer any."""
    some = scores[(scores.mu > 0) == friction]
    return some[some.solver.isin(some.solver[some.verdict != MISSING])]


def times(scores: pd.DataFrame) -> pd.DataFrame:
    """Give (solver, problem) s, the CPU time of right answers; infinite for all others, nan where a
    right one says nothing."""
    right = scores.assign(cpu_s=scores.cpu_s.astype(float).where(scores.verdict == "right", np.inf))
    return right.pivot(index="solver", columns="problem", values="cpu_s")


def means(seconds: pd.DataFrame, limit: float) -> pd.Series:
    """Give each solver's shifted geometric mean exp(mean ln(t + shift)) − shift of `times` (s);
    whatever is not right counts as `limit` (s). nan where a right answer does not say its time."""
    logarithm = np.log(seconds.clip(upper=limit) + SHIFT)
    return np.exp(logarithm.mean(axis=1, skipna=False)) - SHIFT


def profiles(seconds: pd.DataFrame, ratios: Floats) -> pd.DataFrame:
    """Give (solver, ratio) the share of problems that a solver answers rightly within so many times
    the time of the fastest right answer (Dolan, Moré, Math. Program. 91 (2002) 201).

    A problem that nobody answers rightly counts against everybody."""
    known = seconds.fillna(np.inf)
    within = {ratio: (known <= ratio * known.min()) & np.isfinite(known) for ratio in ratios}
    return pd.DataFrame({ratio: one.mean(axis=1) for ratio, one in within.items()})


DASHES = ("-", "--", "-.", ":")
# The longest ratio that is drawn.
MOST = 1e4


def profile_picture(scores: pd.DataFrame) -> Figure:
    """Draw the profiles without friction and with it."""
    figure = Figure(figsize=(11, 6.5), layout="constrained", dpi=150)
    panels = figure.subplots(1, 2, sharey=True)
    every = list(scores.solver.unique())
    for panel, friction in zip(panels, (False, True), strict=True):
        some = with_friction(scores, friction)
        count = some.problem.nunique()
        panel.set_title(f"{'with' if friction else 'without'} friction: {count} problems")
        panel.set_xlabel("times the CPU seconds of the fastest")
        panel.grid(True, color=GRID, lw=0.6)
        panel.set_xscale("log")
        panel.set(ylim=(0, 1.03), xlim=(0.9, MOST))
        if not count:
            continue
        fractions = profiles(times(some), np.logspace(0, np.log10(MOST), 400))
        for name, fraction in fractions.loc[some.solver.unique()].iterrows():
            if fraction.any():
                turn, number = divmod(every.index(name), len(EVERY_COLOUR))
                style = {"color": EVERY_COLOUR[number], "ls": DASHES[turn % len(DASHES)]}
                panel.step(fraction.index, fraction, where="post", lw=1.8, label=name, **style)
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8)
    panels[0].set_ylabel("share of the problems answered rightly")
    return figure
