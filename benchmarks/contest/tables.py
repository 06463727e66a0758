"""Outcomes of the contest as a table, with ratios and cost exponents; the short table of
docs/results/solvers.md, this product beside the best peer, case by case; and its picture, what
accuracy costs."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.pages.drawing import EVERY_COLOUR, GRID
from benchmarks.contest.compete import NEAR, TARGET, Outcome
from benchmarks.contest.peers import CANONICAL, PEERS
from benchmarks.machine import power, table
from benchmarks.problems.families import Case

CASE = ["family", "disks", "contacts"]


def rows_of(case: Case, outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """The rows of a case, products first, as the outcomes come.

    error: max|u⁺ − u*| / ‖u⁻‖∞ with u* the most exact answer of all solvers; times_faster: CPU
    seconds of the best peer at 1e-10 over this solver's (best_peer_at 1e-8: no peer reached 1e-10),
    left out where this solver did not reach 1e-10, or no peer even 1e-8."""
    scale = float(np.abs(case.left_velocity).max())
    known = [outcome.best for outcome in outcomes if outcome.best]
    exact = min(known, key=lambda best: best.residual, default=None)
    rivals = [outcome.best for outcome in outcomes if outcome.best and outcome.solver in PEERS]
    reached = (x for x in (TARGET, NEAR) if any(best.residual <= x for best in rivals))
    at = next(reached, np.nan)
    fastest = min((best.seconds for best in rivals if best.residual <= at), default=np.nan)
    rows = []
    for outcome in outcomes:
        sizes = case.name, len(case.snapshot), len(case.contacts)
        row = dict(zip(CASE, sizes, strict=True)) | {"solver": outcome.solver, "best_peer_at": at}
        row |= {"cpu_s": np.nan, "residual": np.nan, "times_faster": np.nan, "note": outcome.ended}
        if (best := outcome.best) is not None and exact is not None:
            requested = f"{best.requested:.0f} iterations" if best.requested >= 1 else f"asked {best.requested:.0e}"
            row |= {
                "setting": ", ".join(part for part in (best.variant, requested) if part),
                "cpu_s": best.seconds,
                "residual": best.residual,
                "own_velocity": best.own,
                "error": float(np.abs(best.velocity - exact.velocity).max()) / scale,
                "iterations": best.iterations,
                "peak_MB": best.peak_MB,
                "note": outcome.ended or "its tightest",
            }
            if best.residual <= TARGET:
                row |= {"times_faster": fastest / best.seconds, "note": ""}
        rows.append(row)
    return rows


def exponents(rows: pd.DataFrame) -> str:
    """Cost ∝ Nˣ, fitted to the sizes from 500 disks at which a solver reached 1e-10, by family and
    solver, with the number of sizes."""
    large = rows[(rows.residual <= TARGET) & (rows.disks >= 500)]

    def fit(solver: str, family: str) -> str:
        good = large[(large.solver == solver) & (large.family == family)]
        return f"{power(good.disks, good.cpu_s):.2f} ({len(good)})" if len(good) > 1 else "–"

    families = rows.family.unique()
    lines = ([solver, *(fit(solver, one) for one in families)] for solver in rows.solver.unique())
    return table(["solver", *families], lines)


SHORT_HEAD = (
    "crowd", "disks", "contacts", "any reactions", "least energy", "best peer", "times faster, any",
    "least energy",
)  # fmt: skip


def summary(rows: pd.DataFrame) -> str:
    """The table in Markdown; a time without an answer at 1e-10 is –."""
    lines = []
    for (family, disks, contacts), found in rows.groupby(CASE, sort=False):
        mine = found.set_index("solver")
        if not {"auto", CANONICAL} <= set(mine.index):
            continue
        own = mine.loc[["auto", CANONICAL]]
        times = own.cpu_s.where(own.residual <= TARGET).map(_short_time)
        faster = ["–" if np.isnan(one) else f"{one:.1f}" for one in own.times_faster]
        sizes = f"{disks:,}", f"{contacts:,}"
        peers = mine[mine.index.isin(list(PEERS)) & (mine.residual <= mine.best_peer_at)]
        lines.append([family, *sizes, *times, _best_peer(peers), *faster])
    return table(SHORT_HEAD, lines)


def _best_peer(peers: pd.DataFrame) -> str:
    if peers.empty:
        return "none in time"
    best = peers.loc[peers.cpu_s.idxmin()]
    words = "" if best.best_peer_at == TARGET else " (to 10⁻⁸)"
    return f"{best.name}, {_short_time(best.cpu_s)}{words}"


def _short_time(seconds: float) -> str:
    if np.isnan(seconds):
        return "–"
    unit, size = ("s", seconds) if seconds >= 0.9995 else ("ms", 1e3 * seconds)
    return f"{size:.0f} {unit}" if size >= 9.95 else f"{size:.2g} {unit}"


# marker and dashes tell the lines apart without colour
MARKERS = "osD^v<>Px"
DASHES = ("-", "--", "-.", ":")


def picture(cases: Sequence[tuple[Case, Sequence[Outcome]]]) -> Figure:
    """Draw residuals above and errors of u⁺ below against CPU seconds, one column a case. The error
    is against the most exact answer of all solvers; below 1e-16 it is drawn at 1e-16."""
    figure = Figure(figsize=(5.5 * len(cases), 8), layout="constrained", dpi=150)
    panels = figure.subplots(2, len(cases), sharex="col", sharey="row", squeeze=False)
    handles = {}
    for (above, below), (case, outcomes) in zip(panels.T, cases, strict=True):
        every = [a for outcome in outcomes for a in outcome.attempts]
        if not every:
            continue
        scale = float(np.abs(case.left_velocity).max())
        exact = min(every, key=lambda a: a.residual).velocity
        for turn, outcome in enumerate(outcomes):
            attempts = [a for a in outcome.attempts if np.isfinite(a.residual)]
            if not attempts:
                continue
            variant = f" ({attempts[0].variant})" if attempts[0].variant else ""
            style = {
                "color": EVERY_COLOUR[turn % len(EVERY_COLOUR)],
                "marker": MARKERS[turn % len(MARKERS)],
                "ls": DASHES[turn % len(DASHES)],
                "lw": 1.2 if turn else 2,
            }
            seconds, residuals = [a.seconds for a in attempts], [a.residual for a in attempts]
            errors = [float(np.abs(a.velocity - exact).max()) / scale for a in attempts]
            for panel, values in ((above, residuals), (below, errors)):
                (drawn,) = panel.loglog(seconds, np.maximum(values, 1e-16), ms=5, **style)
            handles.setdefault(outcome.solver + variant, drawn)
        above.set_title(f"{case.name}: {len(case.snapshot)} disks, {len(case.contacts)} contacts")
        below.set_xlabel("CPU seconds")
    panels[0, 0].set_ylabel("residual, recomputed")
    panels[1, 0].set_ylabel("error of u⁺ / ‖u⁻‖∞")
    for panel in panels.flat:
        panel.grid(True, which="major", color=GRID, lw=0.6)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=8)
    return figure
