"""The answers of solvers to a library: which are right, how long they took, and how solvers
compare."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import EVERY_COLOUR, GRID
from analysis.support.columns import Columns
from analysis.support.files import write_rows
from analysis.support.parallel import Progress
from benchmarks.problems.judge import Verdict, judge
from benchmarks.problems.writing import UNIQUE, read_manifest
from nscd.arrays import Floats

# Added to the seconds of each problem before their geometric mean is taken, so that microseconds on
# the smallest ones decide nothing (s).
SHIFT = 0.01
COLUMNS = Columns("""
solver, problem, family | | name of the folder of answers; of the problem and its family
disks, contacts, mu | – | of the problem
verdict, why | | `right`, `wrong` or `missing`; what is beyond its threshold
residual | – | natural map over max of the free contact velocities, recomputed
velocity_error | – | largest distance of a velocity from the one there is, over the largest u⁻
determined_error | – | the same of reactions that balance determines, over the largest reaction
outside_interval | – | how far the worst other reaction lies outside its interval, over the largest
cpu_s | s | what the answer says it took
""")
MISSING = "missing"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scores:
    """Hold the verdicts on s solvers and p problems."""

    solvers: tuple[str, ...]  # names
    problems: tuple[dict[str, Any], ...]  # what the manifest says of each
    verdicts: tuple[tuple[Verdict | None, ...], ...]  # by solver and problem; None: no answer

    def of(self, friction: bool) -> Scores:
        """Keep the problems with friction, or those without, and the solvers that answer any."""
        kept = [bool(entry["friction"]) == friction for entry in self.problems]
        problems = [number for number, keep in enumerate(kept) if keep]
        rows = [tuple(row[number] for number in problems) for row in self.verdicts]
        solvers = [place for place, row in enumerate(rows) if any(row)]
        return Scores(
            solvers=tuple(self.solvers[place] for place in solvers),
            problems=tuple(self.problems[number] for number in problems),
            verdicts=tuple(rows[place] for place in solvers),
        )

    @property
    def right(self) -> Any:
        """Tell (s,p) which answers are right."""
        rows = [[one is not None and one.right for one in row] for row in self.verdicts]
        return np.array(rows, dtype=bool).reshape(len(self.solvers), len(self.problems))

    @property
    def seconds(self) -> Floats:
        """Give (s,p) s, the CPU time of right answers; infinite for all others, nan where a right
        one says nothing."""
        rows = [
            [math.inf if one is None or not one.right else _or_nan(one.seconds) for one in row]
            for row in self.verdicts
        ]
        return np.array(rows, dtype=np.float64).reshape(self.right.shape)

    def means(self, limit: float) -> Floats:
        """Give (s,) s, the shifted geometric mean exp(mean ln(t + shift)) − shift of the CPU times;
        whatever is not right counts as `limit` (s). nan where a right answer does not say its
        time."""
        taken = np.minimum(self.seconds, limit)
        if not taken.shape[1]:
            return np.full(len(self.solvers), math.nan)
        return np.asarray(np.exp(np.log(taken + SHIFT).mean(1)) - SHIFT)

    def profiles(self, ratios: Floats) -> Floats:
        """Give (s,r) the share of problems that a solver answers rightly within so many times the
        time of the fastest right answer (Dolan, Moré, Math. Program. 91 (2002) 201).

        A problem that nobody answers rightly counts against everybody."""
        seconds = np.where(np.isnan(self.seconds), math.inf, self.seconds)
        best = seconds.min(0, initial=math.inf)
        within = seconds[:, :, None] <= best[None, :, None] * ratios
        return np.asarray((within & np.isfinite(seconds)[:, :, None]).mean(1))


def score(library: Path, answers: Sequence[Path], progress: Progress | None = None) -> Scores:
    """Judge folders of answers, one a solver, each with a file of the name of the problem's.

    Raises ExchangeError naming the file for what cannot be read, ValueError for a folder without
    any answer and for two of the same name."""
    entries = read_manifest(library)
    names = [folder.resolve().name for folder in answers]
    for name, folder in zip(names, answers, strict=True):
        if names.count(name) > 1:
            raise ValueError(f"{folder}: two folders of answers are named {name}")
        if not any((folder / entry["file"]).is_file() for entry in entries):
            raise ValueError(f"{folder}: no answer to any problem of {library}")
    columns = []
    for number, entry in enumerate(entries):
        problem, unique = library / entry["file"], entry["velocity"] == UNIQUE
        files = [folder / entry["file"] for folder in answers]
        columns.append([judge(problem, f, unique=unique) if f.is_file() else None for f in files])
        if progress:
            progress("problems", (number + 1) / len(entries))
    return Scores(
        solvers=tuple(names), problems=tuple(entries), verdicts=tuple(zip(*columns, strict=True))
    )


def write_scores(path: Path, scores: Scores) -> None:
    """Write one row per solver and problem as CSV."""
    rows = []
    for solver, verdicts in zip(scores.solvers, scores.verdicts, strict=True):
        for entry, one in zip(scores.problems, verdicts, strict=True):
            head = [solver, entry["name"], entry["family"], entry["disks"], entry["contacts"]]
            head += [entry["friction"]]
            if one is None:
                rows.append([*head, MISSING, *[""] * 6])
                continue
            errors = (one.residual, one.velocity, one.determined, one.outside, one.seconds)
            cells = ["" if v is None or math.isnan(v) else v for v in errors]
            rows.append([*head, "right" if one.right else "wrong", one.why, *cells])
    write_rows(path, COLUMNS, rows)


def _or_nan(seconds: float | None) -> float:
    return math.nan if seconds is None else seconds


DASHES = ("-", "--", "-.", ":")
# The longest ratio that is drawn.
MOST = 1e4


def profile_picture(scores: Scores) -> Figure:
    """Draw the profiles without friction and with it, those with the most right answers first."""
    figure = Figure(figsize=(11, 6.5), layout="constrained", dpi=150)
    panels = figure.subplots(1, 2, sharey=True)
    ratios = np.logspace(0, np.log10(MOST), 400)
    for panel, friction in zip(panels, (False, True), strict=True):
        some = scores.of(friction)
        count = len(some.problems)
        panel.set_title(f"{'with' if friction else 'without'} friction: {count} problems")
        panel.set_xlabel("times the CPU seconds of the fastest")
        panel.grid(True, color=GRID, lw=0.6)
        panel.set_xscale("log")
        panel.set(ylim=(0, 1.03), xlim=(0.9, MOST))
        if not count:
            continue
        for name, share in zip(some.solvers, some.profiles(ratios), strict=True):
            if share.any():
                turn, number = divmod(scores.solvers.index(name), len(EVERY_COLOUR))
                look = {"color": EVERY_COLOUR[number], "ls": DASHES[turn % len(DASHES)]}
                panel.step(ratios, share, where="post", lw=1.8, label=name, **look)
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8)
    panels[0].set_ylabel("share of the problems answered rightly")
    return figure
