"""The short table of docs/results/solvers.md: this product beside the best peer, case by case."""

from collections.abc import Sequence

from contest.compete import CANONICAL, NEAR, TARGET
from contest.tables import Row

HEAD = (
    "crowd", "disks", "contacts", "any reactions", "least energy", "best peer", "times faster, any",
    "least energy",
)  # fmt: skip


def summary(rows: Sequence[Row], peers: Sequence[str]) -> str:
    """The table in Markdown; a time without an answer at 1e-10 is –."""
    lines = [" | ".join(HEAD), " | ".join(["---"] * len(HEAD))]
    cases = dict.fromkeys((row.family, row.disks, row.contacts) for row in rows)
    for case in cases:
        mine = {row.solver: row for row in rows if (row.family, row.disks, row.contacts) == case}
        if "auto" not in mine or CANONICAL not in mine:
            continue
        own = [mine["auto"], mine[CANONICAL]]
        times = [_time(row.cpu_s) if row.residual <= TARGET else "–" for row in own]
        faster = [
            "–" if row.times_faster != row.times_faster else f"{row.times_faster:.1f}"
            for row in own
        ]
        family, disks, contacts = case
        lines.append(
            " | ".join([family, f"{disks:,}", f"{contacts:,}", *times, _best(mine, peers), *faster])
        )
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def _best(mine: dict[str, Row], peers: Sequence[str]) -> str:
    for level, words in ((TARGET, ""), (NEAR, " (to 10⁻⁸)")):
        good = [row for name, row in mine.items() if name in peers and row.residual <= level]
        if good:
            best = min(good, key=lambda row: row.cpu_s)
            return f"{best.solver}, {_time(best.cpu_s)}{words}"
    return "none in time"


def _time(seconds: float) -> str:
    if seconds >= 0.9995:
        return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
    ms = 1e3 * seconds
    return f"{ms:.0f} ms" if ms >= 9.95 else f"{ms:.2g} ms"
