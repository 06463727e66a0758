"""Outcomes of the contest as rows, Markdown and CSV, with ratios and cost exponents; and the short table of
docs/results/solvers.md: this product beside the best peer, case by case."""

import csv
import io
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from cases import Case
from contest.compete import CANONICAL, NEAR, TARGET, Outcome

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
    bests = [outcome.best for outcome in outcomes]
    exact = min((best for best in bests if best), key=lambda best: best.residual, default=None)
    at, fastest = np.nan, np.nan
    for level in (TARGET, NEAR):
        times = [
            best.seconds
            for best, outcome in zip(bests, outcomes, strict=True)
            if best and outcome.solver in peers and best.residual <= level
        ]
        if times:
            at, fastest = level, min(times)
            break
    rows = []
    for best, outcome in zip(bests, outcomes, strict=True):
        head = (case.name, len(case.snapshot), len(case.contacts), outcome.solver)
        if best is None or exact is None:
            rows.append(
                Row(*head, "", np.nan, np.nan, False, np.nan, np.nan, at, 0, np.nan, outcome.ended)
            )
            continue
        asked = f"{best.asked:.0f} iterations" if best.asked >= 1 else f"asked {best.asked:.0e}"
        setting = ", ".join(part for part in (best.variant, asked) if part)
        reached = best.residual <= TARGET
        rows.append(
            Row(
                *head,
                setting,
                best.seconds,
                best.residual,
                best.own,
                float(np.abs(best.velocity - exact.velocity).max()) / scale,
                fastest / best.seconds if reached else np.nan,
                at,
                best.iterations,
                best.peak_MB,
                "" if reached else outcome.ended or "its tightest",
            )
        )
    return rows


def markdown(rows: Sequence[Row]) -> str:
    """The table in Markdown."""
    columns: dict[str, Callable[[Row], str]] = {
        "family": lambda row: row.family,
        "disks": lambda row: str(row.disks),
        "contacts": lambda row: str(row.contacts),
        "solver": lambda row: row.solver,
        "CPU s": lambda row: _seconds(row.cpu_s),
        "residual": lambda row: number(row.residual, 2) + ("*" if row.own_velocity else ""),
        "error of u⁺": lambda row: number(row.error, 2),
        "× best peer": lambda row: _ratio(row),
        "memory, MB": lambda row: f"{row.peak_MB:.0f}" if row.peak_MB >= 1 else "",
        "setting": lambda row: "; ".join(part for part in (row.setting, row.note) if part),
    }
    cells = [list(columns), *([show(row) for show in columns.values()] for row in rows)]
    widths = [max(len(line[c]) for line in cells) for c in range(len(columns))]
    text = [_line(line, widths) for line in cells]
    return (
        "\n".join([text[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *text[1:]]) + "\n"
    )


def comma_separated(rows: Sequence[Row]) -> str:
    """The rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Row._fields)
    writer.writerows(rows)
    return text.getvalue()


def exponents(rows: Sequence[Row]) -> str:
    """Cost ∝ Nˣ, fitted to the sizes from 500 disks at which a solver reached 1e-10, by family and
    solver."""
    solvers = list(dict.fromkeys(row.solver for row in rows))
    families = list(dict.fromkeys(row.family for row in rows))
    cells = [["solver", *families]]
    for solver in solvers:
        line = [solver]
        for family in families:
            good = [
                (row.disks, row.cpu_s)
                for row in rows
                if (row.solver, row.family) == (solver, family)
                and row.residual <= TARGET
                and row.disks >= 500
            ]
            sizes, seconds = np.array(good).reshape(-1, 2).T
            fit = (
                f"{np.polyfit(np.log(sizes), np.log(seconds), 1)[0]:.2f}" if len(good) > 1 else "–"
            )
            line.append(f"{fit} ({len(good)})" if len(good) > 1 else fit)
        cells.append(line)
    widths = [max(len(line[c]) for line in cells) for c in range(len(cells[0]))]
    text = [_line(line, widths) for line in cells]
    return (
        "\n".join([text[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *text[1:]]) + "\n"
    )


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return (
        "| "
        + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        + " |"
    )


def _seconds(value: float) -> str:
    return decimals(value, 5 if value < 0.1 else 3)


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
    lines = [" | ".join(SHORT_HEAD), " | ".join(["---"] * len(SHORT_HEAD))]
    cases = dict.fromkeys((row.family, row.disks, row.contacts) for row in rows)
    for case in cases:
        mine = {row.solver: row for row in rows if (row.family, row.disks, row.contacts) == case}
        if "auto" not in mine or CANONICAL not in mine:
            continue
        own = [mine["auto"], mine[CANONICAL]]
        times = [_short_time(row.cpu_s) if row.residual <= TARGET else "–" for row in own]
        faster = [
            "–" if row.times_faster != row.times_faster else f"{row.times_faster:.1f}"
            for row in own
        ]
        family, disks, contacts = case
        lines.append(
            " | ".join(
                [family, f"{disks:,}", f"{contacts:,}", *times, _best_peer(mine, peers), *faster]
            )
        )
    return "\n".join(f"| {line} |" for line in lines) + "\n"


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
