"""Fig. 9: pressure before the exit by the proposed collision and by the first-order model."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from analysis.pages.numbers import decimals
from analysis.pages.section import Claim, Section, Table, Verdict
from analysis.pages.words import Words
from analysis.paper.continuum.exit_room import BODY, MESH, SIDE, unsolved
from analysis.paper.continuum.fig9_exit_pressure.charts import maps, profiles, raw_maximum
from analysis.paper.continuum.fig9_exit_pressure.study import (
    AT_EXIT,
    CROWD,
    FAR,
    NEAR,
    SPEED,
    Pressures,
    RawMaxima,
    fastest,
    raw_maxima,
    solve_room,
)
from analysis.support.progress import Progress
from nscd.continuum.closed_forms.point_exit import point_sink
from nscd.continuum.rivals.first_order import PlaceEquation

# below this a shape is not called a Gaussian
GAUSSIAN = 0.95
# means over a body that change by more than this share at the last halving have not settled
SETTLED = 0.03


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 9: maps and profiles of both pressures, the Gaussian tried, the raw maximum."""
    words, room = Words(__package__), solve_room(mesh)
    if progress:
        progress("Fig. 9", 0.4)
    raw, fit = raw_maxima(1.25 * mesh), room.gaussian()
    warnings = unsolved(room.answers)
    if abs(raw.unsettled) > SETTLED:
        warnings.append(words.text("unsettled", change=raw.unsettled))
    return words.section(
        "9",
        pictures=[
            words.picture("fig_9_maps", maps(room)),
            words.picture("fig_9_profile", profiles(room, fit)),
            words.picture("fig_9_raw_maximum", raw_maximum(raw)),
        ],
        tables=[_pressures(words, room), _maxima(words, raw)],
        claims=judged(words, room),
        warnings=warnings,
        room=room,
        fit=fit,
        close=room.gaussian(FAR),
        sink=float(point_sink(np.zeros(1), SPEED, float(CROWD.rho), CROWD.k_v)[0]),
        sink_explained=room.explained(room.sink),
        raw=raw,
        uniform_raw=_list(row.raw for row in raw.uniform),
        uniform_body=_list(row.body for row in raw.uniform),
        graded_raw=_list(row.raw for row in raw.graded),
        graded_body=_list(row.body for row in raw.graded),
        density=float(CROWD.density),
        speed=SPEED,
        body=2 * BODY.width,
        far=FAR,
    )


def judged(words: Words, room: Pressures) -> list[Claim]:
    """Judge what the paper says of Fig. 9."""
    fit, close, p = room.gaussian(), room.gaussian(FAR), room.proposed
    inside, outside = p.band(0.0, NEAR), p.band(FAR)
    forms = (PlaceEquation.COMPLEMENTARITY, PlaceEquation.PRINTED)
    both = [room.first_order[form] for form in forms]
    shares = [field.band(0.0, AT_EXIT) / field.largest for field in both]
    speeds = [fastest(room.flows[form]) for form in forms]
    minimal = [s < 0.25 and f.from_exit > AT_EXIT for s, f in zip(shares, both, strict=True)]
    distances = {"near": NEAR, "far": FAR, "at_exit": AT_EXIT, "speed": SPEED}
    return [
        words.claim(
            "gaussian",
            Verdict.of(fit.explained > GAUSSIAN, close.explained > GAUSSIAN),
            fit=fit,
            close=close,
            sink_explained=room.explained(room.sink),
            **distances,
        ),
        words.claim(
            "concentrated",
            Verdict.of(inside > 2 * outside and p.from_exit < NEAR),
            room=room,
            inside=inside,
            outside=outside,
            **distances,
        ),
        words.claim("minimal", Verdict.of(*minimal), room=room, shares=shares, **distances),
        words.claim("fastest", Verdict.of(*(a > b for a, b in speeds)), speeds=speeds, **distances),
    ]


def _pressures(words: Words, room: Pressures) -> Table:
    return words.table(
        "pressures",
        ["model", "largest", "its distance from the exit (m)", "least", f"mean within {NEAR:g} m",
         f"mean beyond {FAR:g} m", "residual", "status"],
        [
            [f.name, f.largest, f.from_exit, float(f.pressure.min()), f.band(0.0, NEAR),
             f.band(FAR), f.answer.residual, str(f.answer.status)]
            for f in room.fields
        ],
        side=SIDE,
    )  # fmt: skip


def _maxima(words: Words, raw: RawMaxima) -> Table:
    return words.table(
        "maxima",
        ["mesh", "side (m)", "unknowns", "largest in any triangle (N·s/m)",
         "largest over a body (N·s/m)"],
        [
            [kind, row.size, row.unknowns, row.raw, row.body]
            for kind, rows in (("uniform", raw.uniform), ("graded to the jambs", raw.graded))
            for row in rows
        ],
    )  # fmt: skip


def _list(values: Iterable[float]) -> str:
    return ", ".join(decimals(value, 0) for value in values)
