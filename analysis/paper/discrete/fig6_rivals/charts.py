"""Pictures of the rivals: a pair by its gap, chains against a wall, pressed crowds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.statistics import correlation
from analysis.pages.drawing import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PINK,
    add_scale,
    contact_lines,
    draw_disks,
    draw_forces,
    draw_walls,
)
from analysis.paper.discrete.fig6_rivals.chains import ChainForces
from analysis.paper.discrete.fig6_rivals.crowds import (
    FIRST_ORDER,
    PERCUSSIONS,
    PRINTED,
    SOCIAL,
    TEXT,
    ArchForces,
)
from analysis.paper.discrete.fig6_rivals.evacuation import Evacuation, room
from analysis.paper.discrete.fig6_rivals.pair import RADIUS_M, pair_forces
from analysis.paper.discrete.pressed_crowd import RING_M
from nscd.arrays import Floats
from nscd.rivals import LoehnerReading, SocialForceLaw

OF_A_PAIR = (
    ("social", "social force (9)", BLUE, "-", "s"),
    ("repulsion", "its repulsion alone", GREEN, "--", "x"),
    (LoehnerReading.TEXT, "Löhner (10), cases exchanged", PINK, "-.", "D"),
    (LoehnerReading.PRINTED, "Löhner (10), as printed", PINK, ":", "v"),
)
OF_A_CHAIN = (
    ("percussion", "percussions p/τ", BLACK, "o", "-", 9),
    ("first_order", "first-order model, λ m̄/τ", ORANGE, "^", "--", 5),
    ("social_at_rest", "social force, at rest under the drive", GREEN, "x", ":", 7),
    ("social", "social force, touching chain", BLUE, "s", "-", 5),
    ("loehner_text", "Löhner, cases exchanged", PINK, "D", "-.", 5),
    ("loehner_printed", "Löhner, as printed", PINK, "v", ":", 5),
)
HOLLOW = ("percussion", "loehner_printed")
# Rings with fewer contacts have no mean.
LEAST_CONTACTS = 10


def laws(limit: float) -> Figure:
    """Draw the force of one pair against its gap, by law; limit: N, f_max."""
    gap = np.concatenate([np.linspace(-0.02, 0.0, 21), np.linspace(1e-6, 0.5, 200)])
    forces = pair_forces(gap, RADIUS_M, limit)
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.add_subplot()
    label = "percussions: any force at touch, none beyond"
    axes.axvline(0.0, color=BLACK, lw=4, alpha=0.25, label=label)
    touch = int((gap <= 0).sum())
    for name, label, colour, line, marker in OF_A_PAIR:
        style: dict[str, Any] = {"ls": line, "color": colour, "marker": marker, "markevery": 20}
        style |= {"ms": 5, "mfc": "none"}
        # in two pieces, so that no line joins the two sides of the jump
        axes.plot(1e3 * gap[touch:], forces[name][touch:], label=label, **style)
        axes.plot(1e3 * gap[:touch], forces[name][:touch], **style)
    strength = SocialForceLaw().strength
    axes.annotate(
        f"A = {strength:g} N",
        (0.0, strength),
        (30.0, 1.6 * strength),
        arrowprops={"arrowstyle": "->"},
        fontsize=9,
    )
    axes.set(yscale="log", xlabel="gap (mm); negative: overlap", ylabel="force of a pair (N)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(loc="upper right", fontsize=9)
    return figure


def chains(equal: ChainForces, unequal: ChainForces) -> Figure:
    """Draw the force along the chain for equal and unequal masses, and what the first-order model
    misjudges."""
    figure = Figure(figsize=(12.5, 4.8), layout="constrained")
    left = figure.add_subplot(1, 3, 1)
    middle = figure.add_subplot(1, 3, 2, sharey=left)
    for axes, chain in ((left, equal), (middle, unequal)):
        contact = np.arange(1, len(chain.percussion) + 1)
        for name, label, colour, marker, style, size in OF_A_CHAIN:
            face = "none" if name in HOLLOW else colour
            drawn: dict[str, Any] = {"ls": style, "color": colour, "ms": size, "mfc": face}
            axes.plot(contact, getattr(chain, name), marker, lw=1.2, label=label, **drawn)
        masses = f"{chain.mass.min():g} to {chain.mass.max():g} kg"
        if chain.equal_masses:
            masses = f"{chain.mass[0]:g} kg each"
        axes.set(yscale="log", xticks=contact, title=f"Masses: {masses}")
        axes.set_xlabel(f"contact (1: free end, {len(contact)}: wall)")
        axes.grid(alpha=0.3, which="both")
    left.set_ylabel("normal force (N)")
    handles, labels = left.get_legend_handles_labels()
    _misjudged(figure.add_subplot(1, 3, 3), equal, unequal)
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _misjudged(axes: Axes, equal: ChainForces, unequal: ChainForces) -> None:
    for chain, marker, style, colour, label in (
        (equal, "o", "--", BLACK, "equal masses"),
        (unequal, "^", "-", ORANGE, "unequal masses"),
    ):
        contact = np.arange(1, len(chain.percussion) + 1)
        share = 100 * (chain.first_order / chain.percussion - 1)
        axes.plot(contact, share, marker, ls=style, color=colour, label=label)
        axes.set_xticks(contact)
    axes.set(xlabel="contact", ylabel="first-order model above percussions (%)")
    axes.set_title("First-order model, λ m̄/τ")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)


def arches(equal: ArchForces, unequal: ArchForces) -> Figure:
    """Draw the distribution of the force, the force against the distance from the door, and social
    force and first-order model against percussions."""
    figure = Figure(figsize=(10.5, 8.6), layout="constrained")
    (by_force, by_distance), (social, first_order) = figure.subplots(2, 2)
    styles = {
        PERCUSSIONS: (BLACK, "-", "o", 2.4),
        equal.engine: (GREY, "-", "P", 2.4),
        SOCIAL: (BLUE, "--", "s", 1.6),
        TEXT: (PINK, "-.", "D", 1.6),
        PRINTED: (PINK, ":", "v", 1.6),
    }
    for name, (colour, style, marker, width) in styles.items():
        force = np.sort(equal.by_law[name].contact)
        share = 1 - np.arange(len(force)) / len(force)
        by_force.step(force, share, style, color=colour, lw=width, where="post")
        middle, mean = _rings(equal, equal.by_law[name].contact)
        drawn: dict[str, Any] = {"ls": style, "color": colour, "lw": width, "ms": 5}
        by_distance.plot(middle, mean, marker, label=name, **drawn)
    by_force.set(xscale="log", xlim=(10, None), xlabel="normal force f (N)")
    by_force.set(ylabel="share of contacts beyond f", title=f"{equal.scene.name}: distribution")
    by_distance.set(yscale="log", xlabel="distance from the middle of the door (m)")
    by_distance.set_ylabel(f"mean normal force, rings of {RING_M:g} m (N)")
    by_distance.set_title(f"{equal.scene.name}: force against distance")
    handles, labels = by_distance.get_legend_handles_labels()
    _scatter(social, equal, SOCIAL, "s", BLUE)
    _scatter(first_order, unequal, FIRST_ORDER, "^", ORANGE)
    for axes in (by_force, by_distance, social, first_order):
        axes.grid(alpha=0.3)
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9)
    return figure


def _rings(arch: ArchForces, force: Floats) -> tuple[Floats, Floats]:
    """Middle radius (m) of rings about the door, and the mean force (N) in each."""
    ring = (arch.distance[arch.inside] / RING_M).astype(np.int64)
    count = np.bincount(ring)
    enough = count >= LEAST_CONTACTS
    total = np.bincount(ring, force[arch.inside])[enough]
    middle = (np.flatnonzero(enough) + 0.5) * RING_M
    return np.asarray(middle, dtype=np.float64), np.asarray(total / count[enough])


def _scatter(axes: Axes, arch: ArchForces, name: str, marker: str, colour: str) -> None:
    reference, force = (arch.by_law[law].contact / 1e3 for law in (PERCUSSIONS, name))
    top = 1.05 * max(float(reference.max()), float(force.max()))
    axes.plot([0, top], [0, top], color=BLACK, lw=0.8, label="equal")
    axes.plot(reference, force, marker, ms=3.5, mfc="none", mec=colour, mew=0.8, ls="none")
    axes.set(xlabel=f"{PERCUSSIONS} (kN)", ylabel=f"{name} (kN)")
    law, alike = name.split(" λ")[0], correlation(reference, force)
    axes.set_title(f"{arch.scene.name}: {law}, correlation {alike:.3f}")
    axes.legend(loc="lower right", fontsize=9)


def evacuations(found: Sequence[Evacuation]) -> Figure:
    """Draw the crowd before the exit at the last look, a panel for each desired speed, with the
    contacts that overlap."""
    walls, _ = room()
    first = {one.speed: one for one in reversed(found)}
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    panels = figure.subplots(1, len(first), sharey=True, squeeze=False)[0]
    norm = Normalize(0.0, 1e3 * max(one.deepest.max() for one in found))
    for axes, (speed, one) in zip(panels, sorted(first.items()), strict=True):
        pairs, crowd = one.looks[-1].pairs, one.crowd
        draw_disks(axes, crowd)
        draw_walls(axes, zip(walls.start, walls.end, strict=True))
        draw_forces(axes, contact_lines(crowd, pairs), -1e3 * pairs.gap, norm)
        deepest = 1e3 * one.deepest[-1]
        axes.set_title(f"$u_d$ = {speed:g} m/s: deepest overlap {deepest:.1f} mm", fontsize=10)
        axes.set(xlim=(-6.0, 1.5), ylim=(-4.5, 4.5), aspect="equal", xlabel="x (m)")
    panels[0].set_ylabel("y (m)")
    add_scale(figure, list(panels), norm, "overlap of a contact (mm)")
    return figure
