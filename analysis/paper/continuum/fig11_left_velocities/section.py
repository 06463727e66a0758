"""Fig. 11: right velocity and pressure for two left velocities, uniform and random."""

from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import MESH
from analysis.paper.continuum.fig11_left_velocities import study
from analysis.paper.continuum.fig11_left_velocities.charts import maps
from analysis.paper.continuum.fig11_left_velocities.study import LeftVelocities, Run
from analysis.support.progress import Progress
from nscd.continuum.medium import table_1_medium

STOPPED = 0.01  # of the desired speed: slower counts as cancelled
ALIKE, SOMEHOW = 0.95, 0.5  # cosine between two fields that have the same form, or something of it
RANDOM = 0.2  # of the random part that comes back


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 11: right velocity and pressure for uniform and random left velocities."""
    found = study.left_velocities(mesh)
    words = Words(
        __package__,
        **{"found": found, "even": found.even, "study": study, "length": table_1_medium().length},
    )
    return words.section(
        "11",
        pictures=[words.picture("fig_11_left_velocities", maps([found.even, found.drawn[0]]))],
        tables=[
            words.table("runs", [_row(run) for run in found.runs]),
            words.table(
                "echoes", [[s, *e] for s, e in zip(study.SEEDS, found.echoes, strict=True)]
            ),
            words.table(
                "outflows",
                [
                    [k, run.outflow, run.kept, run.compressed, str(run.answer.status)]
                    for k, run in found.flows.items()
                ],
            ),
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(found).items()],
        warnings=unsolved(found.answers),
    )


def verdicts(found: LeftVelocities) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 11."""
    even, slow = found.even, STOPPED * study.MEAN
    stopped = even.walls.normal < slow and even.walls.along < slow
    return {
        "cancelled": Verdict.of(stopped, all(run.walls.largest < slow for run in found.runs)),
        "maximal": Verdict.of(*(run.largest_from_exit < study.NEAR for run in found.runs)),
        "same_form": Verdict.of(even.cosine > ALIKE, even.cosine > SOMEHOW),
        "random": Verdict.of(abs(found.echo.share) > RANDOM),
    }


def _row(run: Run) -> list[Cell]:
    return [
        run.name,
        run.kept,
        run.cosine,
        *run.walls,
        run.outflow,
        float(run.pressure.max()),
        run.largest_from_exit,
        *run.near_and_far,
        run.answer.residual,
        str(run.answer.status),
    ]
