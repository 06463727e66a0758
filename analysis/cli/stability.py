"""percussions stability."""

import time
from pathlib import Path

from analysis.cli.app import command_line, progress, say_expected, show_page
from analysis.cli.options import Out, Processes

# CPU seconds of an attempt, start of its engine included.
ATTEMPT_S = 2.0


def stability(
    *,
    case: list[str] | None = None,
    quick: bool = False,
    runs: Out = Path("out"),
    scheduler: str | None = None,
    jobs: Processes | None = None,
    out: Out = Path("stability"),
) -> None:
    """Find where each method fails, by provoked failures, and compare with theory.

    case: Name of a case. May be repeated. Default: all.
    quick: A coarse atlas.

    Example: percussions stability --case time_step --case skin --out stability"""
    from analysis.stability.atlas import build, choose
    from analysis.stability.page import summary, write_atlas

    started, cases = time.perf_counter(), choose(case, quick)
    attempts = sum(len(one.rows.values) * len(one.columns.values) for one in cases)
    say_expected(attempts * ATTEMPT_S, f"at most {attempts} attempts and their boundaries", jobs)
    with progress() as bars:
        maps = build(cases, runs, quick, bars, jobs, scheduler)
    page = write_atlas(maps, out, command_line(), quick, time.perf_counter() - started)
    print(*summary(maps), sep="\n")
    show_page(page)
