"""Tables of the push in a corridor: gap by gap, the front of the wave, impulses against
percussions."""

from __future__ import annotations

import numpy as np

from analysis.compare.statistics import penalty_difference, statistics
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Cell, Table
from analysis.paper.discrete.fig2_corridor.columns import Gaps
from analysis.paper.discrete.fig2_corridor.push import Push, first_arrivals, long_wave_speed
from analysis.scene.scene import Scene
from nscd import Contacts
from nscd.arrays import Floats

INELASTIC, ELASTIC = 0.05, 1.0


def differences(pushes: list[Push], against: str) -> Floats:
    """Rows of (k in N/m or damping ratio ζ, relative difference of ∫f dt and p)."""
    return np.array(
        [
            (
                p.stiffness if against == "k" else p.comparison.record.damping_ratio,
                statistics(p.comparison)["contact_relative_difference"],
            )
            for p in pushes
        ]
    )


def gap_table(gaps: Gaps) -> Table:
    return Table(
        caption="The push from column to column: momentum along x through each gap, the momentum gained beyond it (walls give "
        "none along x, so they must agree), the closed form for columns that move as one, and the largest percussion.",
        head=[
            "distance (m)",
            "through the gap (N·s)",
            "gained beyond (N·s)",
            "(5), (6) for columns (N·s)",
            "largest (N·s)",
        ],
        rows=np.column_stack(
            [gaps.distance, gaps.flux, gaps.gained, gaps.columns, gaps.largest]
        ).tolist(),
    )


def soft_tables(
    pushes: list[Push], waves: list[Push], scene: Scene, contacts: Contacts
) -> list[Table]:
    speeds: list[list[Cell]] = []
    for p in waves:
        closed = long_wave_speed(scene.with_contact(stiffness_N_per_m=p.stiffness), contacts)
        last = float(first_arrivals(p.comparison.snapshot.position[:, 0], p.arrival)[1][-1])
        name = ENGINE_NAMES[p.engine]
        speeds.append(
            [name, p.restitution, p.stiffness, last, p.speed, closed, p.speed / closed - 1]
        )
    shares: list[list[Cell]] = []
    for p in pushes:
        if p.restitution == ELASTIC:
            continue
        numbers = statistics(p.comparison)
        shares.append(
            [
                ENGINE_NAMES[p.engine],
                p.restitution,
                p.comparison.record.damping_ratio,
                p.stiffness,
                numbers["contact_relative_difference"],
                numbers["contact_correlation"],
                numbers["contacts_only_penalty"],
                p.comparison.balance.closure_error,
                _between_engines(p, pushes),
            ]
        )
    return [
        Table(
            caption="The front of the push in soft contacts, against long waves in the same springs.",
            head=["engine", "e", "k (N/m)", "at the last column (s)", "speed (m/s)", "long waves (m/s)", "relative difference"],
            rows=speeds,
        ),
        Table(
            caption="Impulses ∫f dt of soft contacts against the percussions p, contact by contact (N·s with N·s). Closure: how "
            "far the impulses are from the momentum that disks gained, at worst, as a share of the largest gain.",
            head=[
                "engine", "e", "ζ", "k (N/m)", "rms difference", "correlation", "contacts made later", "closure",
                "to the other engine",
            ],
            rows=shares,
        ),
    ]  # fmt: skip


def _between_engines(push: Push, pushes: list[Push]) -> Cell:
    for other in pushes:
        same = other.stiffness == push.stiffness and other.restitution == push.restitution
        if same and other.engine != push.engine:
            return penalty_difference(push.comparison, other.comparison)
    return "–"
