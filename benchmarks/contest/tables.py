"""Outcomes of the contest as rows, Markdown and CSV, with ratios and cost exponents; and the short table of
docs/results/solvers.md: this product beside the best peer, case by case."""

import csv
import io
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from cases import Case
from contest.compete import CANONICAL, NEAR, TARGET, Outcome
from machine import table

from analysis.pages.numbers import decimals, number


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


def rows_of(case: Case, outcomes: Sequence[Outcome], peers: Sequence[str]) -> list[Row]:
    """The rows of a case, products first, as the outcomes come."""
    scale = float(np.abs(case.left_velocity).max())
    found = [(outcome, outcome.best) for outcome in outcomes]
    exact = min((best for _, best in found if best), key=lambda best: best.residual, default=None)
    rivals = [best for outcome, best in found if best and outcome.solver in peers]
    at, fastest = np.nan, np.nan
    for level in (TARGET, NEAR):
        if times := [best.seconds for best in rivals if best.residual <= level]:
            at, fastest = level, min(times)
            break
    rows = []
    for outcome, best in found:
        head = (case.name, len(case.snapshot), len(case.contacts), outcome.solver)
        if best is None or exact is None:
            nothing = ("", np.nan, np.nan, False, np.nan, np.nan, at, 0, np.nan)
            rows.append(Row(*head, *nothing, outcome.ended))
            continue
        asked = f"{best.asked:.0f} iterations" if best.asked >= 1 else f"asked {best.asked:.0e}"
        setting = ", ".join(part for part in (best.variant, asked) if part)
        reached = best.residual <= TARGET
        error = float(np.abs(best.velocity - exact.velocity).max()) / scale
        times = fastest / best.seconds if reached else np.nan
        note = "" if reached else outcome.ended or "its tightest"
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


def comma_separated(rows: Sequence[Row]) -> str:
    """The rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([Row._fields, *rows])
    return text.getvalue()


def exponents(rows: Sequence[Row]) -> str:
    """Cost ∝ Nˣ, fitted to the sizes from 500 disks at which a solver reached 1e-10, by family and
    solver."""
    large = [row for row in rows if row.residual <= TARGET and row.disks >= 500]

    def fit(solver: str, family: str) -> str:
        good = [(r.disks, r.cpu_s) for r in large if (r.solver, r.family) == (solver, family)]
        if len(good) < 2:
            return "–"
        sizes, seconds = np.log(good).T
        return f"{np.polyfit(sizes, seconds, 1)[0]:.2f} ({len(good)})"

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


def summary(rows: Sequence[Row], peers: Sequence[str]) -> str:
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
        lines.append([family, *sizes, *times, _best_peer(mine, peers), *faster])
    return table(SHORT_HEAD, lines) + "\n"


def _best_peer(mine: dict[str, Row], peers: Sequence[str]) -> str:
    for level, words in ((TARGET, ""), (NEAR, " (to 10⁻⁸)")):
        good = [row for name, row in mine.items() if name in peers and row.residual <= level]
        if good:
            best = min(good, key=lambda row: row.cpu_s)
            return f"{best.solver}, {_short_time(best.cpu_s)}{words}"
    return "none in time"


def _short_time(seconds: float) -> str:
    if seconds >= 0.9995:
        return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
    ms = 1e3 * seconds
    return f"{ms:.0f} ms" if ms >= 9.95 else f"{ms:.2g} ms"
