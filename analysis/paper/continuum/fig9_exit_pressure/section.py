"""Fig. 9: pressure before the exit by the proposed collision and by the first-order model."""

from collections.abc import Iterable

import numpy as np

from analysis.pages.numbers import decimals
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import BODY, MESH, SIDE
from analysis.paper.continuum.fig9_exit_pressure.charts import maps, profiles, raw_maximum
from analysis.paper.continuum.fig9_exit_pressure.study import (
    AT_EXIT,
    CROWD,
    FAR,
    NEAR,
    SPEED,
    Field,
    Pressures,
    RawMaxima,
    raw_maxima,
    solve_room,
)
from analysis.support.progress import Progress
from nscd.continuum.closed_forms.point_exit import point_sink

# below this a shape is not called a Gaussian
GAUSSIAN = 0.95
# a pressure below this share of the largest is called minimal
MINIMAL = 0.25
# means over a body that change by more than this share at the last halving have not settled
SETTLED = 0.03


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 9: maps and profiles of both pressures, the Gaussian tried, the raw maximum."""
    room = solve_room(mesh)
    if progress:
        progress("Fig. 9", 0.4)
    raw, fit = raw_maxima(1.25 * mesh), room.gaussian()
    words = Words(
        __package__,
        **{"room": room, "fit": fit, "close": room.gaussian(FAR), "raw": raw},
        **{"density": CROWD.density, "speed": SPEED, "body": 2 * BODY.width, "side": SIDE},
        **{"near": NEAR, "far": FAR, "at_exit": AT_EXIT, "listed": _listed},
        sink=point_sink(0.0, SPEED, float(CROWD.rho), CROWD.k_v).item(),
    )
    warnings = unsolved(room.answers)
    if abs(raw.unsettled) > SETTLED:
        warnings.append(words.text("unsettled"))
    return words.section(
        "9",
        pictures=[
            words.picture("fig_9_maps", maps(room)),
            words.picture("fig_9_profile", profiles(room, fit)),
            words.picture("fig_9_raw_maximum", raw_maximum(raw)),
        ],
        tables=[
            words.table("pressures", [_row(field) for field in room.fields]),
            words.table("maxima", _maxima(raw)),
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(room).items()],
        warnings=warnings,
    )


def verdicts(room: Pressures) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 9."""
    both, p = (room.complementarity, room.printed), room.proposed
    return {
        "gaussian": Verdict.of(*(room.gaussian(r).explained > GAUSSIAN for r in (np.inf, FAR))),
        "concentrated": Verdict.of(p.band(0.0, NEAR) > 2 * p.band(FAR) and p.from_exit < NEAR),
        "minimal": Verdict.of(*(f.at_exit < MINIMAL and f.from_exit > AT_EXIT for f in both)),
        "fastest": Verdict.of(*(f.speeds[0] > f.speeds[1] for f in both)),
    }


def _row(field: Field) -> list[Cell]:
    return [
        field.name,
        field.largest,
        field.from_exit,
        float(field.pressure.min()),
        field.band(0.0, NEAR),
        field.band(FAR),
        field.answer.residual,
        str(field.answer.status),
    ]


def _maxima(raw: RawMaxima) -> list[list[Cell]]:
    return [
        [kind, row.size, row.unknowns, row.raw, row.body]
        for kind, rows in (("uniform", raw.uniform), ("graded to the jambs", raw.graded))
        for row in rows
    ]


def _listed(values: Iterable[float]) -> str:
    return ", ".join(decimals(value, 0) for value in values)
