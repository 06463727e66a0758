"""A chain of people who press each other against a wall, under every force law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq, root

from analysis.pages.drawing import BLACK, BLUE, GREEN, ORANGE, PINK
from analysis.pages.section import Table
from analysis.scene.scene import Scene
from nscd import Contacts, Snapshot, Walls, find_contacts, solve
from nscd.arrays import Flags, Floats
from nscd.rivals import LoehnerReading, SocialForceLaw, first_order, loehner_force, social_force

LEFT_OUT_N = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChainForces:
    """Normal forces (N) at the contacts of one chain, (k,) from its free end to the wall, which is
    the last.

    percussion p/τ; first_order λ m̄/τ with the mean mass m̄; social: one contact of the touching
    chain; social_section: all pairs that act across that contact; social_at_rest: one contact where
    the social forces balance the drive, with gap_at_rest (k,) m; loehner_printed, loehner_text: at
    touch, the mean of what the two receive. mass (n,) kg; drive (n,) N; warnings: answers that were
    not solved."""

    mass: Floats
    drive: Floats
    percussion: Floats
    first_order: Floats
    social: Floats
    social_section: Floats
    social_at_rest: Floats
    gap_at_rest: Floats
    loehner_printed: Floats
    loehner_text: Floats
    warnings: Sequence[str]

    @property
    def equal_masses(self) -> bool:
        """Whether everybody has the same mass."""
        return bool(np.ptp(self.mass) == 0)


def chain_forces(scene: Scene, relaxation_time: float) -> ChainForces:
    """Forces of the chain whose left velocities are the desired ones, people being driven by m
    u_d/τ toward the wall."""
    snapshot, walls = scene.snapshot, scene.wall_segments()
    contacts = find_contacts(snapshot, walls, tolerance=scene.analysis.contact_tolerance_m)
    law = SocialForceLaw()
    answer = solve(snapshot, contacts, tolerance=1e-10)
    model = first_order(snapshot, contacts)
    drive = snapshot.mass * snapshot.velocity[:, 0] / relaxation_time
    warnings = [
        f"{scene.name}, {name}: {found.status}: {found.reason}"
        for name, found in (("percussions", answer), ("first-order model", model))
        if found.status != "solved"
    ]
    rest, error = _social_rest(snapshot, walls, drive, law)
    if error > 1e-6:
        warnings.append(
            f"{scene.name}, social force at rest: a force of {error:.1e} N is left unbalanced"
        )
    nearest = _pairs(rest, walls, law).select(_next_to(_pairs(rest, walls, law), len(rest)))
    loehner = {}
    for reading in LoehnerReading:
        found = loehner_force(
            snapshot, contacts, drive, reading, tolerance=scene.analysis.contact_tolerance_m
        )
        loehner[reading] = np.where(
            contacts.is_wall, found.on_first, 0.5 * (found.on_first + found.on_second)
        )
    return ChainForces(
        mass=snapshot.mass,
        drive=drive,
        percussion=(answer.impulse * contacts.normal).sum(1) / relaxation_time,
        first_order=model.multiplier * snapshot.mass.mean() / relaxation_time,
        social=social_force(snapshot, contacts, law).normal,
        social_section=_across_sections(snapshot, _pairs(snapshot, walls, law), law),
        social_at_rest=social_force(rest, nearest, law).normal,
        gap_at_rest=nearest.gap,
        loehner_printed=loehner[LoehnerReading.PRINTED],
        loehner_text=loehner[LoehnerReading.TEXT],
        warnings=warnings,
    )


def gap_that_carries(force: float, law: SocialForceLaw) -> float:
    """The gap (m; negative: an overlap) at which the social force of one pair is `force` N."""
    low, high = -1.0, law.reach(min(LEFT_OUT_N, force))
    return float(
        brentq(
            lambda g: float(law.repulsion(np.array(g)) + law.body(np.array(g))) - force, low, high
        )
    )


def _social_rest(
    snapshot: Snapshot, walls: Walls, drive: Floats, law: SocialForceLaw
) -> tuple[Snapshot, float]:
    """The chain where the social forces of all pairs balance the drive, and the largest unbalanced
    force (N)."""
    # each contact carries what is driven behind it, as the start of a search that also counts pairs
    # further apart
    gaps = np.array([gap_that_carries(force, law) for force in np.cumsum(drive)])
    spread = np.cumsum(gaps[::-1])[::-1]

    def at(place: Floats) -> Snapshot:
        still = np.zeros_like(snapshot.position)
        return replace(
            snapshot, position=np.column_stack([place, snapshot.position[:, 1]]), velocity=still
        )

    def unbalanced(place: Floats) -> Floats:
        moved = at(place)
        balance: Floats = (
            social_force(moved, _pairs(moved, walls, law), law).resultant()[:, 0] + drive
        )
        return balance

    found = root(unbalanced, snapshot.position[:, 0] - spread, tol=1e-12)
    return at(found.x), float(np.abs(unbalanced(found.x)).max())


def _pairs(snapshot: Snapshot, walls: Walls, law: SocialForceLaw) -> Contacts:
    return find_contacts(snapshot, walls, tolerance=law.reach(LEFT_OUT_N))


def _next_to(pairs: Contacts, n: int) -> Flags:
    """Which pairs are neighbours in the chain, the last disk and the wall among them."""
    return np.asarray(
        np.where(pairs.is_wall, pairs.first == n - 1, pairs.second == pairs.first + 1)
    )


def _across_sections(snapshot: Snapshot, pairs: Contacts, law: SocialForceLaw) -> Floats:
    force = social_force(snapshot, pairs, law).normal
    other = np.where(pairs.is_wall, len(snapshot), pairs.second)
    section = np.arange(len(snapshot))[:, None]
    across = (pairs.first <= section) & (section < other)
    total: Floats = (across * force).sum(1)
    return total


def chain_picture(equal: ChainForces, unequal: ChainForces) -> Figure:
    """Force along the chain by contact for equal and unequal masses, and what the first-order model
    misjudges."""
    figure = Figure(figsize=(12.5, 4.8), layout="constrained")
    curves = (
        ("percussion", "percussions p/τ", BLACK, "o", "-", 9),
        ("first_order", "first-order model, λ m̄/τ", ORANGE, "^", "--", 5),
        ("social_at_rest", "social force, at rest under the drive", GREEN, "x", ":", 7),
        ("social", "social force, touching chain", BLUE, "s", "-", 5),
        ("loehner_text", "Löhner, cases exchanged", PINK, "D", "-.", 5),
        ("loehner_printed", "Löhner, as printed", PINK, "v", ":", 5),
    )
    axes = None
    for number, chain in enumerate((equal, unequal)):
        axes = figure.add_subplot(1, 3, number + 1, sharey=axes)
        contact = np.arange(1, len(chain.percussion) + 1)
        for name, label, colour, marker, style, size in curves:
            filled = name not in ("percussion", "loehner_printed")
            axes.plot(
                contact,
                getattr(chain, name),
                marker,
                ls=style,
                color=colour,
                ms=size,
                mfc=colour if filled else "none",
                lw=1.2,
                label=label,
            )
        masses = (
            f"{chain.mass[0]:g} kg each"
            if chain.equal_masses
            else f"{chain.mass.min():g} to {chain.mass.max():g} kg"
        )
        axes.set(
            yscale="log",
            xlabel=f"contact (1: free end, {len(contact)}: wall)",
            xticks=contact,
            title=f"Masses: {masses}",
        )
        axes.grid(alpha=0.3, which="both")
    figure.axes[0].set_ylabel("normal force (N)")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    _misjudged(figure.add_subplot(1, 3, 3), equal, unequal)
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _misjudged(axes: Axes, equal: ChainForces, unequal: ChainForces) -> None:
    for chain, marker, style, label in (
        (equal, "o", "--", "equal masses"),
        (unequal, "^", "-", "unequal masses"),
    ):
        contact = np.arange(1, len(chain.percussion) + 1)
        share = 100 * (chain.first_order / chain.percussion - 1)
        axes.plot(
            contact,
            share,
            marker,
            ls=style,
            color=ORANGE if chain is unequal else BLACK,
            label=label,
        )
        axes.set_xticks(contact)
    axes.set(
        xlabel="contact",
        ylabel="first-order model above percussions (%)",
        title="First-order model, λ m̄/τ",
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)


def chain_table(chain: ChainForces) -> Table:
    """The forces of one chain, a row a contact."""
    masses = "equal" if chain.equal_masses else "unequal"
    columns = (
        chain.percussion,
        chain.first_order,
        chain.social,
        chain.social_section,
        chain.social_at_rest,
        1e3 * chain.gap_at_rest,
        chain.loehner_printed,
        chain.loehner_text,
    )
    return Table(
        caption=f"Chain of {len(chain.mass)} against a wall, {masses} masses: normal force by contact; the last is the wall. "
        "The first-order column is λ m̄/τ: for its shape, since λ is not a force.",
        head=(
            "contact",
            "mass before it (kg)",
            "percussions p/τ (N)",
            "first order λ m̄/τ (N)",
            "social, touching (N)",
            "social, all pairs across (N)",
            "social, at rest (N)",
            "its gap (mm)",
            "Löhner as printed (N)",
            "Löhner, cases exchanged (N)",
        ),
        rows=[
            (i + 1, float(mass), *map(float, row))
            for i, (mass, row) in enumerate(
                zip(chain.mass, np.column_stack(columns).tolist(), strict=True)
            )
        ],
    )
