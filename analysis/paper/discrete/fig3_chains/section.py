"""Figure 3: chains of pedestrians, free and against a wall, against the closed forms."""

from collections.abc import Sequence

from analysis.pages.section import Section, Table, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.discrete.fig3_chains import charts, study
from analysis.paper.discrete.fig3_chains.study import Chains, Trial
from analysis.support.progress import Progress


def build(progress: Progress | None = None) -> Section:
    """Build figure 3: λ along chains against the closed forms, up to 10,000 disks."""
    chains = Chains.of(progress)
    words = Words(__package__, chains=chains, study=study)
    return words.section(
        "3",
        pictures=[
            words.picture("fig_3_chains", charts.percussions_along(chains.shown)),
            words.picture("fig_3_accuracy", charts.accuracy(chains.trials)),
        ],
        tables=[
            _table(words, "The solver that the product chooses", chains.trials),
            _table(words, "The interior point, whose residual long chains magnify,", chains.others),
        ],
        claims=[
            words.claim("constrained", Verdict.of(chains.printed_miss < 1e-6)),
            words.claim("free", Verdict.of(chains.free_error < 1e-10)),
            words.claim("at_one_speed", Verdict.of(max(chains.at_one_speed) < 1e-9)),
            words.claim("masses", Verdict.of(chains.change > 0.01)),
        ],
        warnings=unsolved(
            (
                f"chain of {len(t.chain.mass)}, {', '.join(t.chain.words)}, {t.answer.solver}",
                t.answer,
            )
            for t in chains.trials + chains.others
        ),
    )


def _table(words: Words, what: str, trials: Sequence[Trial]) -> Table:
    rows = [
        (
            len(t.chain.mass),
            *t.chain.words,
            float(t.answer.reaction.max()),
            t.reaction_error,
            t.velocity_error,
            t.cpu,
            t.answer.solver,
            str(t.answer.status),
        )
        for t in trials
    ]
    return words.table("table", rows, what=what)
