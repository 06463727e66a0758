"""Outcomes of the contest as rows and Markdown, with ratios and cost exponents; the short table of
docs/results/solvers.md, this product beside the best peer, case by case; and its picture, what
accuracy costs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import EVERY_COLOUR, GRID
from analysis.pages.numbers import decimals, number
from benchmarks.contest.compete import NEAR, TARGET, Outcome
from benchmarks.contest.peers import CANONICAL, PEERS
from benchmarks.machine import power, table
from benchmarks.problems.families import Case


class Row(NamedTuple):
    """One solver on one case. error: max|u⁺ − u*| / ‖u⁻‖∞ with u* the most exact answer of all
    solvers; times_faster: CPU seconds of the best peer at 1e-10 over this solver's (best_peer_at
    1e-8: no peer reached 1e-10); NaN where this solver did not reach 1e-10, or no peer even
    1e-8."""

    family: str
    disks: int
    contacts: int
    solver: str
    setting: str
    cpu_s: float
    residual: float
    own_velocity: bool
    error: float
    times_faster: float
    best_peer_at: float
    iterations: int
    peak_MB: float  # noqa: N815  (megabyte)
    note: str


def rows_of(case: Case, outcomes: Sequence[Outcome]) -> list[Row]:
    """The rows of a case, products first, as the outcomes come."""
    scale = float(np.abs(case.left_velocity).max())
    every = [outcome.best for outcome in outcomes if outcome.best]
    exact = min(every, key=lambda best: best.residual, default=None)
    rivals = [outcome.best for outcome in outcomes if outcome.best and outcome.solver in PEERS]
    reached = (x for x in (TARGET, NEAR) if any(best.residual <= x for best in rivals))
    at = next(reached, np.nan)
    fastest = min((best.seconds for best in rivals if best.residual <= at), default=np.nan)
    rows = []
    for outcome in outcomes:
        head = (case.name, len(case.snapshot), len(case.contacts), outcome.solver)
        if (best := outcome.best) is None or exact is None:
            nothing = ("", np.nan, np.nan, False, np.nan, np.nan, at, 0, np.nan)
            rows.append(Row(*head, *nothing, outcome.ended))
            continue
        asked = f"{best.asked:.0f} iterations" if best.asked >= 1 else f"asked {best.asked:.0e}"
        setting = ", ".join(part for part in (best.variant, asked) if part)
        error = float(np.abs(best.velocity - exact.velocity).max()) / scale
        times, note = fastest / best.seconds, ""
        if best.residual > TARGET:
            times, note = np.nan, outcome.ended or "its tightest"
        measured = (setting, best.seconds, best.residual, best.own, error, times, at)
        rows.append(Row(*head, *measured, best.iterations, best.peak_MB, note))
    return rows


def markdown(rows: Sequence[Row]) -> str:
    """The table in Markdown."""
    names = (
        "family", "disks", "contacts", "solver", "CPU s", "residual", "error of u⁺", "× best peer",
        "memory, MB", "setting",
    )  # fmt: skip
    cells = (
        (
            *(row.family, row.disks, row.contacts, row.solver),
            decimals(row.cpu_s, 5 if row.cpu_s < 0.1 else 3),
            number(row.residual, 2) + ("*" if row.own_velocity else ""),
            number(row.error, 2),
            _ratio(row),
            f"{row.peak_MB:.0f}" if row.peak_MB >= 1 else "",
            "; ".join(part for part in (row.setting, row.note) if part),
        )
        for row in rows
    )
    return table(names, cells) + "\n"


def exponents(rows: Sequence[Row]) -> str:
    """Cost ∝ Nˣ, fitted to the sizes from 500 disks at which a solver reached 1e-10, by family and
    solver."""
    large = [row for row in rows if row.residual <= TARGET and row.disks >= 500]

    def fit(solver: str, family: str) -> str:
        good = [row for row in large if (row.solver, row.family) == (solver, family)]
        grown = power([row.disks for row in good], [row.cpu_s for row in good])
        return "–" if np.isnan(grown) else f"{grown:.2f} ({len(good)})"

    solvers, families = (
        list(dict.fromkeys(getattr(row, name) for row in rows)) for name in ("solver", "family")
    )
    lines = ([solver, *(fit(solver, family) for family in families)] for solver in solvers)
    return table(["solver", *families], lines) + "\n"


def _ratio(row: Row) -> str:
    if np.isnan(row.times_faster):
        return "–"
    return f"{row.times_faster:.2f}" + ("†" if row.best_peer_at > TARGET else "")


SHORT_HEAD = (
    "crowd", "disks", "contacts", "any reactions", "least energy", "best peer", "times faster, any",
    "least energy",
)  # fmt: skip


def summary(rows: Sequence[Row]) -> str:
    """The table in Markdown; a time without an answer at 1e-10 is –."""
    lines = []
    for case in dict.fromkeys(row[:3] for row in rows):
        mine = {row.solver: row for row in rows if row[:3] == case}
        if "auto" not in mine or CANONICAL not in mine:
            continue
        own = [mine["auto"], mine[CANONICAL]]
        times = [_short_time(row.cpu_s) if row.residual <= TARGET else "–" for row in own]
        faster = ["–" if np.isnan(r.times_faster) else f"{r.times_faster:.1f}" for r in own]
        family, disks, contacts = case
        sizes = f"{disks:,}", f"{contacts:,}"
        lines.append([family, *sizes, *times, _best_peer(mine), *faster])
    return table(SHORT_HEAD, lines) + "\n"


def _best_peer(mine: dict[str, Row]) -> str:
    good = [row for name, row in mine.items() if name in PEERS and row.residual <= row.best_peer_at]
    if not good:
        return "none in time"
    best = min(good, key=lambda row: row.cpu_s)
    words = "" if best.best_peer_at == TARGET else " (to 10⁻⁸)"
    return f"{best.solver}, {_short_time(best.cpu_s)}{words}"


def _short_time(seconds: float) -> str:
    if seconds >= 0.9995:
        return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
    ms = 1e3 * seconds
    return f"{ms:.0f} ms" if ms >= 9.95 else f"{ms:.2g} ms"


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
            look = {
                "color": EVERY_COLOUR[turn % len(EVERY_COLOUR)],
                "marker": MARKERS[turn % len(MARKERS)],
                "ls": DASHES[turn % len(DASHES)],
                "lw": 1.2 if turn else 2,
            }
            seconds, residuals = [a.seconds for a in attempts], [a.residual for a in attempts]
            errors = [float(np.abs(a.velocity - exact).max()) / scale for a in attempts]
            for panel, values in ((above, residuals), (below, errors)):
                (drawn,) = panel.loglog(seconds, np.maximum(values, 1e-16), ms=5, **look)
            handles.setdefault(outcome.solver + variant, drawn)
        above.set_title(f"{case.name}: {len(case.snapshot)} disks, {len(case.contacts)} contacts")
        below.set_xlabel("CPU seconds")
    panels[0, 0].set_ylabel("residual, recomputed")
    panels[1, 0].set_ylabel("error of u⁺ / ‖u⁻‖∞")
    for panel in panels.flat:
        panel.grid(True, which="major", color=GRID, lw=0.6)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3, fontsize=8)
    return figure
