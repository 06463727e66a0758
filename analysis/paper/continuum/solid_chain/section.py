"""Section 3.2.1: the chain as a deformable rod against a wall, by (12)–(14), corrected."""

import numpy as np

from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import MESH
from analysis.paper.continuum.solid_chain.charts import velocities
from analysis.paper.continuum.solid_chain.study import (
    AT,
    DENSITIES,
    LENGTH,
    SPEED,
    THRESHOLD,
    VOLUME,
    Chains,
    Trial,
    chains,
)
from analysis.support.progress import Progress
from nscd.continuum.medium import DENSITY

EQUAL = 0.01  # relative: numbers that agree
ROUNDING = 1e-9  # of the speed, or N·s per kg
STILL = 1e-6  # 1/s: people who do not close up


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build 3.2.1: right velocities of chains that stick and rebound, the statements tried."""
    found = chains(mesh)
    words = Words(
        __package__,
        **{"found": found, "error": max(trial.error for trial in found.trials)},
        **{"length": LENGTH, "density": DENSITY, "volume": VOLUME, "speed": SPEED},
        **{"threshold": THRESHOLD, "densities": DENSITIES, "at": AT},
        printed=sum(trial.printed for trial in found.trials),
        rebound=sum(_wrong(trial) for trial in found.trials),
        right=sum(_right(trial) for trial in found.trials),
    )
    return words.section(
        "3.2.1",
        pictures=[words.picture("fig_3_2_1_chain", velocities(found))],
        tables=[
            words.table("chains", [_row(trial) for trial in found.trials]),
            words.table(
                "densities",
                [[rho, *t.inner] for rho, t in zip(DENSITIES, found.dense, strict=True)],
            ),
            words.table(
                "profiles",
                [
                    [rod.name, model, *percussion]
                    for rod in found.varied
                    for model, percussion in (("(11)", rod.inner), ("rigid disks", rod.rigid))
                ],
            ),
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(found).items()],
        warnings=unsolved(found.answers),
    )


def verdicts(found: Chains) -> dict[str, Verdict]:
    """Judge what the paper says in 3.2.1."""
    table_1, length = found.table_1, found.table_1.chain.medium.length
    return {
        "condition": Verdict.of(not any(_wrong(trial) for trial in found.trials)),
        "solution": Verdict.of(
            *(table_1.formula_error(h) < EQUAL for h in (length, table_1.printed_length))
        ),
        "percussion": Verdict.of(
            abs(found.factor - 1) < EQUAL, bool(np.all(np.diff(table_1.inner) < 0))
        ),
        "increasing": Verdict.of(*(at in found.growing for at in AT)),
        "glued": Verdict.of(table_1.closing < STILL),
        "variable": Verdict.of(
            bool(np.all(np.diff([rod.inner[1] for rod in found.varied]) > 0)),
            found.rigid_factor < 1 + EQUAL,
        ),
        "constant": Verdict.of(
            found.constant.from_rigid < ROUNDING, found.constant.pressure < ROUNDING
        ),
        "free": Verdict.of(found.free.from_rigid < EQUAL),
    }


def _wrong(trial: Trial) -> bool:
    """Whether (13) as printed says something else than the elements."""
    return trial.printed != (trial.at_wall == 0)


def _right(trial: Trial) -> bool:
    """Whether the corrected (13) says what the elements say."""
    return trial.chain.sticks == (trial.at_wall == 0)


def _row(trial: Trial) -> list[Cell]:
    chain, answer = trial.chain, trial.answer
    return [
        trial.name,
        float(answer.medium.surface_dissipation),
        trial.at_wall,
        0.0 - chain.restitution * SPEED,
        float(answer.wall_force.sum()),
        chain.wall_percussion,
        trial.error,
        answer.energy.error,
        answer.residual,
        str(answer.status),
    ]
