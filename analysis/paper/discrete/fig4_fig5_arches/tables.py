"""Tables of a pressed crowd: the largest forces, rings about the exit, the engines beside the
percussions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.compare.comparison import Comparison
from analysis.compare.statistics import correlation, relative_difference
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Table
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import RING_M, Arch


def engine_name(comparison: Comparison) -> str:
    record = comparison.record
    return (
        f"{ENGINE_NAMES[record.engine]}, k = {comparison.scene.contact.stiffness_N_per_m:.3g} N/m"
    )


def maxima_table(arch: Arch) -> Table:
    rows: list[Sequence[Cell]] = []
    carried, resultant, inside = arch.carried(), arch.resultants(), arch.inside()
    for name, values in (("sum of normal magnitudes", carried), ("vector sum", resultant)):
        most = arch.largest(values)
        middle, high = (float(v) for v in np.quantile(values[inside], (0.5, 0.95)))
        rows.append(
            (
                name, float(values[inside].mean()), middle, high, float(values[most]), float(arch.distance()[most]),
                float(arch.angle_degrees()[most]), int(arch.snapshot.ids[most]),
            )
        )  # fmt: skip
    head = ("force on a person, p/τ", "mean (N)", "median (N)", "95 % (N)", "largest (N)", "its distance (m)",
            "its angle (°)", "person")  # fmt: skip
    return Table(
        caption="Forces on the people inside, percussions with k = 0", head=head, rows=rows
    )


def rings_table(archs: dict[str, Arch]) -> Table:
    rows: list[Sequence[Cell]] = []
    for name, arch in archs.items():
        ring, speed = arch.rings(), np.hypot(*arch.answer.right_velocity.T)
        for r in range(int(ring.max()) + 1):
            at = ring == r
            if at.any():
                values = [float(v[at].mean()) for v in (speed, arch.carried(), arch.resultants())]
                rows.append(
                    (name, f"{r * RING_M:g} – {(r + 1) * RING_M:g}", int(at.sum()), *values)
                )
    head = ("arch", "distance from the middle of the exit (m)", "people", "speed u⁺ (m/s)", "sum of magnitudes (N)",
            "vector sum (N)")  # fmt: skip
    return Table(caption="Means of rings", head=head, rows=rows)


def engines_table(comparisons: Sequence[Comparison]) -> Table:
    rows = []
    for comparison in comparisons:
        penalty, rigid = comparison.disk_sums()
        distance = Arch.of(comparison.scene, comparison.snapshot).distance()
        rows.append(
            (
                engine_name(comparison), float(penalty.mean()), float(rigid.mean()), float(penalty.max()),
                float(distance[penalty.argmax()]), float(rigid.max()), float(distance[rigid.argmax()]),
                correlation(penalty, rigid), relative_difference(penalty, rigid), comparison.balance.unbalanced,
                str(comparison.answer.status),
            )
        )  # fmt: skip
    head = ("engine", "mean (N)", "percussions: mean (N)", "largest (N)", "its distance (m)", "percussions: largest (N)",
            "its distance (m)", "correlation", "relative difference (rms)", "share of the drive that accelerates",
            "status")  # fmt: skip
    return Table(
        caption="Sum of normal magnitudes at each person, engine against percussions p/τ on the same snapshot",
        head=head,
        rows=rows,
    )
