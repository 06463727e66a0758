"""A crowd pressed to a door, as an engine left it, under every force law: contact by contact and
disk by disk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.compare.comparison import compare_run
from analysis.compare.statistics import correlation, relative_difference
from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE, PINK
from analysis.pages.names import ENGINE_NAMES
from analysis.pages.section import Table
from analysis.paper.discrete.fig6_rivals.on_chains import LEFT_OUT_N
from analysis.paper.discrete.pressed_crowd.arch import RING_M
from analysis.scene.real.separate import reconcile
from analysis.scene.scene import Scene
from nscd import Contacts, Snapshot, Walls, find_contacts
from nscd.arrays import Flags, Floats
from nscd.rivals import LoehnerReading, SocialForceLaw, first_order, loehner_force, social_force


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forces:
    """What one law gives: contact (k,) N normal, what the two sides receive on average; carried
    (n,) N, the sum of the magnitudes at each disk; resultant (n,2) N, the vector sum that each disk
    receives."""

    contact: Floats
    carried: Floats
    resultant: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArchForces:
    """Every law on one snapshot of a scene. by_law: in the words of the tables, percussions first.

    distance (k,) m of each contact from the middle of the door, inside the room where `inside`
    (k,); speed_difference: rms of the first-order model's u⁺ minus the percussions', over the
    desired speed; undetermined: contacts whose percussion the mechanics does not fix; sliding (k,)
    N, the social force's friction; drive m u_d/τ (n,) N; warnings: answers that were not solved.
    """

    scene: Scene
    engine: str
    snapshot: Snapshot
    contacts: Contacts
    by_law: Mapping[str, Forces]
    distance: Floats
    inside: Flags
    speed_difference: float
    undetermined: int
    sliding: Floats
    drive: Floats
    warnings: Sequence[str]


PERCUSSIONS, FIRST_ORDER, SOCIAL = "percussions p/τ", "first-order model λ m̄/τ", "social force"
PRINTED, TEXT = "Löhner as printed", "Löhner, cases exchanged"


def arch_forces(scene: Scene, folder: Path) -> ArchForces:
    """Forces on the snapshot of a finished run of a driven scene. Raises what `compare_run`
    does."""
    comparison = compare_run(folder)
    snapshot, drive = comparison.snapshot, scene.drive
    assert drive is not None
    contacts = comparison.percussions.contacts
    other = np.where(
        contacts.is_wall,
        contacts.second + 1,
        snapshot.ids[np.where(contacts.is_wall, 0, contacts.second)],
    )
    contacts = contacts.select(np.lexsort((contacts.is_wall, other, snapshot.ids[contacts.first])))
    penalty, rigid = (part[comparison.match.in_rigid] for part in comparison.match.normal_parts())
    desired, time = drive.desired_velocity(snapshot.position), drive.relaxation_time_s
    model = first_order(snapshot, contacts, left_velocity=desired)
    wish = snapshot.mass * np.hypot(*desired.T) / time
    n = len(snapshot)
    social = social_force(snapshot, contacts)
    by_law = {
        PERCUSSIONS: _symmetric(contacts, rigid, n),
        ENGINE_NAMES[comparison.record.engine]: _symmetric(contacts, penalty, n),
        FIRST_ORDER: _symmetric(contacts, model.multiplier * snapshot.mass.mean() / time, n),
        SOCIAL: Forces(
            contact=social.normal, carried=social.magnitude_sum(), resultant=social.resultant()
        ),
    }
    for name, reading in ((PRINTED, LoehnerReading.PRINTED), (TEXT, LoehnerReading.TEXT)):
        found = loehner_force(
            snapshot, contacts, wish, reading, tolerance=scene.analysis.contact_tolerance_m
        )
        mean = np.where(contacts.is_wall, found.on_first, 0.5 * (found.on_first + found.on_second))
        by_law[name] = Forces(
            contact=mean, carried=found.magnitude_sum(), resultant=found.resultant()
        )
    door = 0.5 * (np.array(drive.door_start_m) + np.array(drive.door_end_m))
    answers = (
        ("percussions", comparison.answer.status, comparison.answer.reason),
        ("first-order model", model.status, model.reason),
    )
    difference = model.right_velocity - comparison.answer.right_velocity
    return ArchForces(
        scene=scene,
        engine=ENGINE_NAMES[comparison.record.engine],
        snapshot=snapshot,
        contacts=contacts,
        by_law=by_law,
        distance=np.hypot(*(contacts.point - door).T),
        inside=(contacts.point - door) @ np.array(drive.outward) <= 0,
        speed_difference=float(np.sqrt((difference**2).sum(1).mean())) / drive.speed_m_per_s,
        undetermined=int((~comparison.match.determined[comparison.match.in_rigid]).sum()),
        sliding=np.hypot(*social.sliding.T),
        drive=wish,
        warnings=[f"{scene.name}, {name}: {s}: {why}" for name, s, why in answers if s != "solved"],
    )


def _symmetric(contacts: Contacts, force: Floats, n: int) -> Forces:
    """Forces that both sides of a contact receive alike."""
    return Forces(
        contact=force,
        carried=contacts.sum_at_disks(np.abs(force), n),
        resultant=contacts.momentum_change(force[:, None] * contacts.normal, n),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WithoutOverlap:
    """The social force on the same crowd moved apart by the least displacement until nobody
    overlaps.

    contact (k,) N at the pairs that touch; beyond (m,) N at those that do not, down to LEFT_OUT_N;
    carried (n,) N, sum of magnitudes at each disk, carried_by_touching (n,) N its part from
    contacts, carried_apart (n,) N the sum if all distances were 10 % larger; friction (N), its
    largest at a contact; moved (m), the largest displacement."""

    contact: Floats
    beyond: Floats
    carried: Floats
    carried_by_touching: Floats
    carried_apart: Floats
    friction: float
    moved: float


def without_overlap(arch: ArchForces) -> WithoutOverlap:
    """Move the disks of the snapshot apart and evaluate the social force. Raises OverlapError."""
    scene, walls, law = arch.scene, arch.scene.wall_segments(), SocialForceLaw()
    assert scene.drive is not None
    door = Walls(start=np.array([scene.drive.door_start_m]), end=np.array([scene.drive.door_end_m]))
    found = reconcile(
        arch.snapshot.position, arch.snapshot.radius, walls, door, np.array(scene.drive.outward)
    )
    apart = replace(arch.snapshot, position=found.position)
    every = social_force(apart, find_contacts(apart, walls, tolerance=law.reach(LEFT_OUT_N)), law)
    touching = every.pairs.gap <= scene.analysis.contact_tolerance_m
    only = social_force(apart, every.pairs.select(touching), law)
    wider = replace(apart, position=1.1 * found.position)
    room = Walls(start=1.1 * walls.start, end=1.1 * walls.end)
    spread = social_force(wider, find_contacts(wider, room, tolerance=law.reach(LEFT_OUT_N)), law)
    return WithoutOverlap(
        contact=only.normal,
        beyond=every.normal[~touching],
        carried=every.magnitude_sum(),
        carried_by_touching=only.magnitude_sum(),
        carried_apart=spread.magnitude_sum(),
        friction=float(np.hypot(*only.sliding.T).max()),
        moved=float(np.hypot(*(found.position - arch.snapshot.position).T).max()),
    )


def loehner_beyond_touch(
    arch: ArchForces, reach: float
) -> Mapping[str, tuple[float, float, float]]:
    """For each reading of Löhner's law with all pairs up to `reach` (m) of gap: the share of the
    forces' sum that pairs give which do not touch, the largest ratio f_ij/f_ji, and |Σ over pairs
    of f_ij + f_ji| over Σ|f|."""
    tolerance = arch.scene.analysis.contact_tolerance_m
    pairs = find_contacts(arch.snapshot, tolerance=reach)
    apart = pairs.gap > tolerance
    out = {}
    for name, reading in ((PRINTED, LoehnerReading.PRINTED), (TEXT, LoehnerReading.TEXT)):
        found = loehner_force(arch.snapshot, pairs, arch.drive, reading, tolerance=tolerance)
        both = found.on_first + found.on_second
        ratio = np.maximum(found.on_first, found.on_second) / np.minimum(
            found.on_first, found.on_second
        )
        net = float(np.hypot(*found.resultant().sum(0)))
        out[name] = (
            float(both[apart].sum() / both.sum()),
            float(ratio.max()),
            net / float(both.sum()),
        )
    return out


def arch_table(arches: Sequence[ArchForces]) -> Table:
    """The laws on each snapshot in numbers."""
    rows = []
    for arch in arches:
        reference = arch.by_law[PERCUSSIONS]
        for name, forces in arch.by_law.items():
            rows.append(
                (
                    arch.scene.name,
                    name,
                    float(forces.contact.mean()),
                    float(np.median(forces.contact)),
                    float(forces.contact.max()),
                    float(forces.contact.std() / forces.contact.mean()),
                    correlation(reference.contact, forces.contact),
                    relative_difference(reference.contact, forces.contact),
                    correlation(reference.carried, forces.carried),
                    relative_difference(reference.carried, forces.carried),
                )
            )
    return Table(
        caption="The pressed crowds: normal force at the touching contacts, and the sum of magnitudes at each disk, against "
        "the percussions of the same snapshot. Relative difference: rms of the difference over rms of the percussions.",
        head=(
            "scene",
            "law",
            "mean (N)",
            "median (N)",
            "largest (N)",
            "spread/mean",
            "correlation, contacts",
            "relative difference, contacts",
            "correlation, disks",
            "relative difference, disks",
        ),
        rows=rows,
    )


def arch_picture(equal: ArchForces, unequal: ArchForces) -> Figure:
    """Distribution of the force, force against distance from the door, social and first-order
    against percussions."""
    figure = Figure(figsize=(10.5, 8.6), layout="constrained")
    axes = figure.subplots(2, 2)
    styles = {
        PERCUSSIONS: (BLACK, "-", "o", 2.4),
        equal.engine: (GREY, "-", "P", 2.4),
        SOCIAL: (BLUE, "--", "s", 1.6),
        TEXT: (PINK, "-.", "D", 1.6),
        PRINTED: (PINK, ":", "v", 1.6),
    }
    for name, (colour, style, marker, width) in styles.items():
        force = equal.by_law[name].contact
        ordered = np.sort(force)
        share = 1 - np.arange(len(ordered)) / len(ordered)
        axes[0, 0].step(ordered, share, style, color=colour, lw=width, where="post", label=name)
        middle, mean = _rings(equal, force)
        axes[0, 1].plot(middle, mean, marker, ls=style, color=colour, lw=width, ms=5, label=name)
    axes[0, 0].set(
        xscale="log",
        xlim=(10, None),
        xlabel="normal force f (N)",
        ylabel="share of contacts beyond f",
        title=f"{equal.scene.name}: distribution",
    )
    axes[0, 1].set(
        yscale="log",
        xlabel="distance from the middle of the door (m)",
        ylabel=f"mean normal force, rings of {RING_M:g} m (N)",
        title=f"{equal.scene.name}: force against distance",
    )
    handles, labels = axes[0, 1].get_legend_handles_labels()
    _scatter(axes[1, 0], equal, SOCIAL, "s", BLUE)
    _scatter(axes[1, 1], unequal, FIRST_ORDER, "^", ORANGE)
    for panel in axes.flat:
        panel.grid(alpha=0.3)
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9)
    return figure


def _rings(arch: ArchForces, force: Floats) -> tuple[Floats, Floats]:
    """Middle radius (m) of rings about the door that have ten contacts at least, and the mean force
    (N) in each."""
    ring = (arch.distance[arch.inside] / RING_M).astype(np.int64)
    number = np.bincount(ring)
    total = np.asarray(np.bincount(ring, force[arch.inside]), dtype=np.float64)
    enough = number >= 10
    return np.asarray((np.flatnonzero(enough) + 0.5) * RING_M, dtype=np.float64), total[
        enough
    ] / number[enough]


def _scatter(axes: Axes, arch: ArchForces, name: str, marker: str, colour: str) -> None:
    reference, force = arch.by_law[PERCUSSIONS].contact, arch.by_law[name].contact
    top = 1.05 * max(float(reference.max()), float(force.max())) / 1e3
    axes.plot([0, top], [0, top], color=BLACK, lw=0.8, label="equal")
    axes.plot(
        reference / 1e3, force / 1e3, marker, ms=3.5, mfc="none", mec=colour, mew=0.8, ls="none"
    )
    axes.set(
        xlabel=f"{PERCUSSIONS} (kN)",
        ylabel=f"{name} (kN)",
        title=f"{arch.scene.name}: {name.split(' λ')[0]}, correlation {correlation(reference, force):.3f}",
    )
    axes.legend(loc="lower right", fontsize=9)
