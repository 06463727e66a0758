"""What makes scenes alike: a few dimensionless numbers of a scene, known without running it."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from analysis.engines.penalty import damping_ratio_for
from analysis.scene.scene import Scene
from analysis.work_precision.window import Window
from nscd import Contacts, find_contacts
from nscd.arrays import Floats
from nscd.segments import nearest_on_segment

# Pressed frictionless disks come to about two contacts each: as many as they have unknowns.
ISOSTATIC = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """Dimensionless numbers of a scene and its window.

    driven: pressed by a drive, else an impact.
    disks: how many.
    depth: how many disks a push passes through: contacts between the two disks farthest apart in
    the contact graph; of a crowd still to be pressed together, the mean diameters from the door to
    its farthest disk.
    links: contacts per disk.
    door: its width in mean diameters, 1 for an impact.
    mass_ratio: heaviest over lightest disk.
    damping_ratio: ζ at the asked restitution.
    hardness: how often a push can cross the crowd in the window, √(m̄/k) a disk: ∝ √k."""

    driven: bool
    disks: int
    depth: float
    links: float
    door: float
    mass_ratio: float
    damping_ratio: float
    hardness: float

    def distance(self, other: Likeness) -> float:
        """Compute how unlike: root of the sum of squares of log₂ of the ratios of depth, links,
        door, mass ratio and ζ; infinite between an impact and a driven crowd. Hardness is no part:
        curves run over it."""
        if self.driven != other.driven:
            return float("inf")
        return float(np.linalg.norm(np.log2(self._compared()) - np.log2(other._compared())))

    def _compared(self) -> Floats:
        damping = max(self.damping_ratio, 0.01)
        return np.array([self.depth, self.links, self.door, self.mass_ratio, damping])

    def to_json(self) -> list[float]:
        """Give the fields in order."""
        return [float(value) for value in astuple(self)]


def check_model(scene: Scene) -> None:
    """Raise ValueError for friction and a body force, which nothing was measured with."""
    if scene.contact.friction:
        raise ValueError(
            f"scene {scene.name}: contact.friction: {scene.contact.friction:g}; "
            "advice is for frictionless contacts"
        )
    if scene.body_force:
        raise ValueError(f"scene {scene.name}: body_force: advice is for scenes without")


def likeness_of(scene: Scene) -> Likeness:
    """Compute the numbers of a scene.

    Raises ValueError for a scene with friction or a body force, which nothing was measured with,
    and for an impact or a real crowd in which nobody touches anybody."""
    check_model(scene)
    snapshot, drive, contact = scene.snapshot, scene.drive, scene.contact
    diameter = 2.0 * float(snapshot.radius.mean())
    mass = float(snapshot.mass.mean())
    period = float(np.sqrt(mass / contact.stiffness_N_per_m))
    if drive is not None and scene.reconciliation is None:
        depth, links = _to_the_door(scene) / diameter, ISOSTATIC
    else:
        contacts = find_contacts(
            snapshot, scene.wall_segments(), tolerance=scene.analysis.contact_tolerance_m
        )
        if not len(contacts):
            raise ValueError(
                f"scene {scene.name}: nobody touches anybody at the start: nothing to compute"
            )
        depth, links = float(_longest_way(contacts, len(snapshot))), len(contacts) / len(snapshot)
    depth, door = max(depth, 1.0), 1.0
    if drive is not None:
        widths = [np.hypot(*np.subtract(*exit_.door)) for exit_ in drive.doors]
        door = float(min(widths)) / diameter
    lasts = Window(scene=scene).duration(contact.stiffness_N_per_m)
    return Likeness(
        driven=drive is not None,
        disks=len(snapshot),
        depth=depth,
        links=links,
        door=door,
        mass_ratio=float(snapshot.mass.max() / snapshot.mass.min()),
        damping_ratio=damping_ratio_for(contact.restitution),
        hardness=lasts / period / depth,
    )


def _to_the_door(scene: Scene) -> float:
    """From a door to the farthest disk that goes there (m)."""
    assert scene.drive is not None
    farthest = 0.0
    for exit_, mine in scene.drive.exits(scene.snapshot.ids):
        position = scene.snapshot.position[mine]
        nearest = nearest_on_segment(position, *map(np.array, exit_.door))
        farthest = max(farthest, float(np.hypot(*(nearest - position).T).max(initial=0.0)))
    return farthest


def _longest_way(contacts: Contacts, n: int) -> int:
    """Contacts between the disks farthest apart in the largest island: from its last disk in
    breadth-first order, again."""
    pairs = contacts.select(~contacts.is_wall)
    graph = coo_array((np.ones(len(pairs)), (pairs.first, pairs.second)), shape=(n, n)).tocsr()
    longest = 0
    seen = np.zeros(n, dtype=bool)
    for disk in range(n):
        if seen[disk]:
            continue
        order, _ = breadth_first_order(graph, disk, directed=False)
        seen[order] = True
        order, before = breadth_first_order(graph, int(order[-1]), directed=False)
        steps = np.zeros(n, dtype=np.int64)
        for reached in order[1:]:
            steps[reached] = steps[before[reached]] + 1
        longest = max(longest, int(steps[order].max()))
    return longest
