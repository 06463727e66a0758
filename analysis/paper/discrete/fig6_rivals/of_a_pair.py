"""The force of one pair by its gap, under each law."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import BLACK, BLUE, GREEN, PINK
from analysis.pages.section import Table
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats
from nscd.rivals import LoehnerReading, SocialForceLaw, loehner_force, social_force

RADIUS_M = 0.25
MASS_KG = 75.0


def _pair_forces(gap: Floats, radius: float, limit: float) -> dict[str, Floats]:
    """Forces (N) of pairs of equal disks with the given gaps (m), by law."""
    n, apart = len(gap), 10.0 * np.arange(len(gap))
    left, right = np.column_stack([0 * gap, apart]), np.column_stack([2 * radius + gap, apart])
    pairs = Snapshot(
        position=np.concatenate([left, right]),
        velocity=np.zeros((2 * n, 2)),
        radius=np.full(2 * n, radius),
        mass=np.full(2 * n, MASS_KG),
    )
    contacts = find_contacts(pairs, tolerance=float(max(gap.max(), 0.0)) + 1e-9)
    social = social_force(pairs, contacts)
    forces = {"repulsion": social.repulsion, "body": social.body, "social": social.normal}
    for reading in LoehnerReading:
        forces[reading] = loehner_force(pairs, contacts, limit, reading, tolerance=1e-12).on_first
    return forces


def ratio_of_sizes(overlap: float, radii: tuple[float, float]) -> float:
    """The social forces of a pair of the second radius (m) over that of the first at the same
    overlap (m)."""
    small, large = (
        _pair_forces(np.array([-overlap]), radius, 1.0)["social"][0] for radius in radii
    )
    return float(large / small)


def jump_at_touch(limit: float) -> float:
    """Löhner's force as printed just beyond touch over that at touch."""
    at_touch, beyond = _pair_forces(np.array([0.0, 1e-6]), RADIUS_M, limit)[LoehnerReading.PRINTED]
    return float(beyond / at_touch)


def laws_table(limit: float) -> Table:
    """The laws of one pair at a few gaps."""
    gap = np.array([-0.02, -0.005, 0.0, 0.02, 0.1, 0.3, 0.5])
    forces = _pair_forces(gap, RADIUS_M, limit)
    return Table(
        caption=f"Force of one pair by its gap, radii {RADIUS_M:g} m, f_max = {limit:g} N; negative gaps are overlaps.",
        head=(
            "gap (mm)",
            "social: repulsion (N)",
            "social: body (N)",
            "social: sum (N)",
            "Löhner as printed (N)",
            "Löhner, cases exchanged (N)",
        ),
        rows=np.column_stack([1e3 * gap, *forces.values()]).tolist(),
    )


def laws_picture(limit: float) -> Figure:
    """Force of one pair against its gap, by law."""
    gap = np.concatenate([np.linspace(-0.02, 0.0, 21), np.linspace(1e-6, 0.5, 200)])
    forces = _pair_forces(gap, RADIUS_M, limit)
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.add_subplot()
    axes.axvline(
        0.0, color=BLACK, lw=4, alpha=0.25, label="percussions: any force at touch, none beyond"
    )
    curves = (
        ("social", "social force (9)", BLUE, "-", "s"),
        ("repulsion", "its repulsion alone", GREEN, "--", "x"),
        (LoehnerReading.TEXT, "Löhner (10), cases exchanged", PINK, "-.", "D"),
        (LoehnerReading.PRINTED, "Löhner (10), as printed", PINK, ":", "v"),
    )
    touch = int((gap <= 0).sum())
    for name, label, colour, style, marker in curves:
        force = forces[name]
        # in two pieces, so that no line joins the two sides of the jump
        for part, words in ((slice(touch, None), label), (slice(None, touch), None)):
            axes.plot(
                1e3 * gap[part],
                force[part],
                ls=style,
                color=colour,
                marker=marker,
                markevery=20,
                ms=5,
                mfc="none",
                label=words,
            )
    law = SocialForceLaw()
    axes.annotate(
        f"A = {law.strength:g} N",
        (0.0, law.strength),
        (30.0, 1.6 * law.strength),
        arrowprops={"arrowstyle": "->"},
        fontsize=9,
    )
    axes.set(yscale="log", xlabel="gap (mm); negative: overlap", ylabel="force of a pair (N)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(loc="upper right", fontsize=9)
    return figure
