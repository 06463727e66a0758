"""Fig. 7: the crowd's border of walls, exit and free border, and the collision (11) in it."""

import numpy as np

from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import MESH, SIDE
from analysis.paper.continuum.fig7_border import study
from analysis.paper.continuum.fig7_border.charts import border
from analysis.paper.continuum.fig7_border.study import Limits, Run
from analysis.support.progress import Progress
from nscd.continuum.mesh import mesh_of

ROUNDING = 1e-9  # of the speed
# ∫|∇u⁻|² has no limit where it still grows by this share of what it does in the end, and ∫|∇w|² one
# where its changes shrink to less than this share
GROWS, SHRINKS = 0.5, 0.8


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 7: the three kinds of border, (11) there, which left velocities it takes."""
    room = study.crowd_in_a_corner()
    shown = mesh_of(room, 1.25 * mesh)
    alone, pushed = both = study.runs(room, mesh, np.ascontiguousarray(shown.p.T))
    if progress:
        progress("Fig. 7", 0.5)
    norms = study.limits(2.5 * mesh)
    words = Words(
        __package__,
        **{"alone": alone, "pushed": pushed, "norms": norms, "study": study, "side": SIDE},
        residual=max(run.answer.residual for run in both),
        enters=max(run.enters for run in both) / study.SPEED,
        pulls=min(float(run.answer.wall_force.min()) for run in both),
        apart=max(run.apart for run in both),
    )
    return words.section(
        "7",
        pictures=[words.picture("fig_7_border", border(room, pushed, shown))],
        tables=[
            words.table("runs", [_row(run) for run in both]),
            words.table(
                "norms",
                [[n.side, int(n.answer.space.basis.N), n.left, n.total] for n in norms.meshes],
            ),
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(both, norms).items()],
        warnings=unsolved([*((run.name, run.answer) for run in both), *norms.answers]),
    )


def verdicts(both: list[Run], norms: Limits) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 7."""
    apart = max(max(run.enters / study.SPEED, run.apart) for run in both)
    pushes = all(run.answer.wall_force.min() >= 0 for run in both)
    grows = norms.growth[-1] > GROWS * study.FOREVER
    converges = norms.change[-1] < SHRINKS * norms.change[-2]
    well = Verdict.of(converges, False) if grows else Verdict.HOLDS
    return {"impenetrable": Verdict.of(apart < ROUNDING and pushes), "unique": well}


def _row(run: Run) -> list[Cell]:
    a, e = run.answer, run.answer.energy
    energies = [e.before, e.change, e.volume, e.surface, e.wall, e.external, e.error]
    return [
        run.name,
        int(a.space.basis.N),
        run.enters,
        run.load,
        run.peak,
        *energies,
        a.residual,
        str(a.status),
    ]
