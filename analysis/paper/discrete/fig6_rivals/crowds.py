"""A crowd pressed to a door, as an engine left it, under every force law."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.compare.comparison import compare_run
from analysis.compare.statistics import correlation, relative_difference
from analysis.pages.names import ENGINE_NAMES
from analysis.paper.discrete.fig6_rivals.chains import all_pairs, mean_received, unsolved_of
from analysis.scene.real.separate import reconcile
from analysis.scene.scene import Scene
from nscd import Contacts, Snapshot, Walls, find_contacts
from nscd.arrays import Flags, Floats
from nscd.rivals import LoehnerReading, first_order, loehner_force, social_force

PERCUSSIONS, FIRST_ORDER, SOCIAL = "percussions p/τ", "first-order model λ m̄/τ", "social force"
PRINTED, TEXT = "Löhner as printed", "Löhner, cases exchanged"
READINGS = {PRINTED: LoehnerReading.PRINTED, TEXT: LoehnerReading.TEXT}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forces:
    """What one law gives to n disks at k contacts.

    contact: (k,) N normal, what the two sides receive on average
    carried: (n,) N, the sum of the magnitudes at each disk
    resultant: (n,2) N, the vector sum that each disk receives
    """

    contact: Floats
    carried: Floats
    resultant: Floats

    @property
    def spread(self) -> float:
        """Standard deviation over mean of the contacts."""
        return float(self.contact.std() / self.contact.mean())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArchForces:
    """Every law on one snapshot of a scene: n disks, k contacts.

    by_law: in the words of the tables, percussions first
    distance, inside: (k,) m of each contact from the middle of the door, and whether it is in the
        room
    speed_difference: rms of the first-order model's u⁺ minus the percussions', over u_d
    undetermined: contacts whose percussion the mechanics does not fix
    sliding: (k,) N, the social force's friction
    drive: (n,) N, m u_d/τ
    warnings: answers that were not solved
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

    @property
    def unequal_masses(self) -> bool:
        """Whether people differ in mass."""
        mass = self.snapshot.mass
        return bool(np.ptp(mass) > 1e-6 * mass.mean())

    @property
    def deepest(self) -> float:
        """The largest overlap (m)."""
        return float(-self.contacts.gap.min())


def arch_forces(scene: Scene, folder: Path) -> ArchForces:
    """Compute the forces on the snapshot of a finished run of a driven scene.

    Raises what `compare_run` does."""
    comparison = compare_run(folder)
    snapshot, drive, match = comparison.snapshot, scene.drive, comparison.match
    assert drive is not None
    contacts, n = match.contacts.select(match.in_rigid), len(snapshot)
    penalty, rigid = (part[match.in_rigid] for part in match.normal_parts())
    desired, time = drive.desired_velocity(snapshot.position), drive.relaxation_time_s
    model = first_order(snapshot, contacts, left_velocity=desired)
    wish = snapshot.mass * np.hypot(*desired.T) / time
    social = social_force(snapshot, contacts)
    by_law = {
        PERCUSSIONS: _symmetric(contacts, rigid, n),
        ENGINE_NAMES[comparison.record.engine]: _symmetric(contacts, penalty, n),
        FIRST_ORDER: _symmetric(contacts, model.multiplier * snapshot.mass.mean() / time, n),
        SOCIAL: Forces(
            contact=social.normal, carried=social.magnitude_sum(), resultant=social.resultant()
        ),
    }
    tolerance = scene.analysis.contact_tolerance_m
    for name, reading in READINGS.items():
        found = loehner_force(snapshot, contacts, wish, reading, tolerance=tolerance)
        by_law[name] = Forces(
            contact=mean_received(found),
            carried=found.magnitude_sum(),
            resultant=found.resultant(),
        )
    from_door = contacts.point - 0.5 * (np.array(drive.door_start_m) + np.array(drive.door_end_m))
    difference = model.right_velocity - comparison.answer.right_velocity
    return ArchForces(
        scene=scene,
        engine=ENGINE_NAMES[comparison.record.engine],
        snapshot=snapshot,
        contacts=contacts,
        by_law=by_law,
        distance=np.hypot(*from_door.T),
        inside=from_door @ np.array(drive.outward) <= 0,
        speed_difference=float(np.sqrt((difference**2).sum(1).mean())) / drive.speed_m_per_s,
        undetermined=int((~match.determined[match.in_rigid]).sum()),
        sliding=np.hypot(*social.sliding.T),
        drive=wish,
        warnings=unsolved_of(scene.name, comparison.answer, model),
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

    contact: (k,) N at the pairs that touch
    beyond: (m,) N at those that do not, down to LEFT_OUT_N
    carried: (n,) N, the sum of magnitudes at each disk
    carried_by_touching: (n,) N, its part from contacts
    carried_apart: (n,) N, the sum if all distances were 10 % larger
    friction: N, its largest at a contact
    moved: m, the largest displacement
    """

    contact: Floats
    beyond: Floats
    carried: Floats
    carried_by_touching: Floats
    carried_apart: Floats
    friction: float
    moved: float


def without_overlap(arch: ArchForces) -> WithoutOverlap:
    """Move the disks of the snapshot apart and evaluate the social force. Raises OverlapError."""
    scene, walls, drive = arch.scene, arch.scene.wall_segments(), arch.scene.drive
    assert drive is not None
    door = Walls(start=np.array([drive.door_start_m]), end=np.array([drive.door_end_m]))
    crowd = arch.snapshot
    found = reconcile(crowd.position, crowd.radius, walls, door, np.array(drive.outward))
    apart = replace(crowd, position=found.position)
    every = social_force(apart, all_pairs(apart, walls))
    touching = every.pairs.gap <= scene.analysis.contact_tolerance_m
    only = social_force(apart, every.pairs.select(touching))
    wider = replace(apart, position=1.1 * found.position)
    room = Walls(start=1.1 * walls.start, end=1.1 * walls.end)
    return WithoutOverlap(
        contact=only.normal,
        beyond=every.normal[~touching],
        carried=every.magnitude_sum(),
        carried_by_touching=only.magnitude_sum(),
        carried_apart=social_force(wider, all_pairs(wider, room)).magnitude_sum(),
        friction=float(np.hypot(*only.sliding.T).max()),
        moved=float(np.hypot(*(found.position - crowd.position).T).max()),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class BeyondTouch:
    """Löhner's law with all pairs up to some gap.

    share: of the forces' sum that pairs give which do not touch
    ratio: the largest f_ij/f_ji
    """

    share: float
    ratio: float


def loehner_beyond_touch(arch: ArchForces, reach: float) -> Mapping[str, BeyondTouch]:
    """Evaluate each reading of Löhner's law with all pairs up to `reach` (m) of gap."""
    tolerance = arch.scene.analysis.contact_tolerance_m
    pairs = find_contacts(arch.snapshot, tolerance=reach)
    apart = pairs.gap > tolerance
    out = {}
    for name, reading in READINGS.items():
        found = loehner_force(arch.snapshot, pairs, arch.drive, reading, tolerance=tolerance)
        both = np.stack([found.on_first, found.on_second])
        out[name] = BeyondTouch(
            share=float(both[:, apart].sum() / both.sum()),
            ratio=float((both.max(0) / both.min(0)).max()),
        )
    return out


def arch_rows(arches: Sequence[ArchForces]) -> list[tuple[str | float, ...]]:
    """Tabulate the laws on each snapshot against its percussions."""
    rows: list[tuple[str | float, ...]] = []
    for arch in arches:
        reference = arch.by_law[PERCUSSIONS]
        for name, forces in arch.by_law.items():
            force, at_disks = forces.contact, (reference.carried, forces.carried)
            rows.append(
                (
                    arch.scene.name,
                    name,
                    float(force.mean()),
                    float(np.median(force)),
                    float(force.max()),
                    forces.spread,
                    correlation(reference.contact, force),
                    relative_difference(reference.contact, force),
                    correlation(*at_disks),
                    relative_difference(*at_disks),
                )
            )
    return rows
