"""Figure 1: four aligned disks, by the percussions, Newton's law of impact and soft contacts."""

from pathlib import Path

from analysis.engines.run import EngineRun
from analysis.pages.section import Claim, Section, Table, Verdict
from analysis.pages.words import Words
from analysis.paper.discrete.fig1_four_disks import charts, study
from analysis.paper.discrete.fig1_four_disks.study import MASS, FourDisks, cradle_runs
from analysis.support.progress import Progress


def engine_runs(runs: Path) -> list[EngineRun]:
    """List four and three disks by the engines."""
    return cradle_runs(4, runs) + cradle_runs(3, runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 1: every law's velocities, energies and percussions; the threshold; what
    restitution becomes.

    runs: where engine runs are kept and reused. An engine that is missing becomes a warning.
    """
    disks = FourDisks.of(runs, progress)
    rigid, printed, light, limit = disks.fours[:4]
    words = Words(
        __package__,
        disks=disks,
        study=study,
        rigid=rigid,
        printed=printed,
        light=light,
        limit=limit,
    )
    return words.section(
        "1",
        pictures=[
            words.picture("fig_1_velocities", charts.after_impact(disks.fours)),
            words.picture("fig_1_dissipation", charts.against_dissipation(disks)),
        ],
        tables=_tables(words, disks),
        claims=_claims(words, disks),
        warnings=disks.warnings,
    )


def _tables(words: Words, disks: FourDisks) -> list[Table]:
    rows = [
        (j, float(found), float(closed))
        for j, (found, closed) in enumerate(zip(*disks.influences, strict=True), start=1)
    ]
    return [
        words.table("table_four", [impact.row() for impact in disks.fours]),
        words.table("table_three", [impact.row() for impact in disks.threes]),
        words.table("table_threshold", disks.thresholds),
        words.table("table_restitution", disks.restitutions),
        words.table("table_opening", disks.opening_rows()),
        words.table("table_influence", rows),
    ]


def _claims(words: Words, disks: FourDisks) -> list[Claim]:
    by_formula, by_solver = disks.formula
    pair, four = disks.misses
    far = disks.influences[0][2:]
    error = abs(by_solver / by_formula - 1)
    change = abs(disks.fours[1].after - disks.fours[0].after).max()
    threshold = 1e-3 * MASS
    restitution = Verdict.FAILS if pair > 1e-6 else Verdict.of(True, four < 1e-6)
    return [
        words.claim("non_local", Verdict.of(bool(abs(far).min() > threshold)), far=far),
        words.claim("formula_3", Verdict.of(error < 1e-9), error=error),
        words.claim("elastic", Verdict.of(disks.fours[1].returned > 0.5), change=change),
        words.claim("restitution", restitution),
    ]
