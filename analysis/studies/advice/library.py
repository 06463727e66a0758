"""The stored library of charts: its entries, how alike scenes are, curves of error, and what a run
costs."""

from __future__ import annotations

import functools
import gzip
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import TypeAdapter

from analysis.engines.penalty import damping_ratio_for
from analysis.engines.price import Price
from analysis.scene.scene import Scene
from analysis.studies.work_precision.point import Point, PointStatus
from analysis.studies.work_precision.window import Window
from nscd import Contacts, find_contacts
from nscd.segments import nearest_on_segment

# Pressed frictionless disks come to about two contacts each: as many as they have unknowns.
ISOSTATIC = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Similarity:
    """Dimensionless numbers of a scene and its window.

    depth: how many disks a push passes through: contacts between the two disks farthest apart in
    the contact graph; of a crowd still to be pressed together, the mean diameters from the door to
    its farthest disk."""

    driven: bool  # pressed by a drive, else an impact
    disks: int  # how many
    depth: float
    links: float  # contacts per disk
    door: float  # its width in mean diameters, 1 for an impact
    mass_ratio: float  # heaviest over lightest disk
    damping_ratio: float  # ζ at the asked restitution
    hardness: float  # how often a push can cross the crowd in the window, √(m̄/k) a disk: ∝ √k

    def distance(self, other: Similarity) -> float:
        """Compute how unlike: root of the sum of squares of log₂ of the ratios of depth, links,
        door, mass ratio and ζ; infinite between an impact and a driven crowd. Hardness is no part:
        curves run over it."""
        if self.driven != other.driven:
            return float("inf")
        mine, others = (
            np.array([one.depth, one.links, one.door, one.mass_ratio, max(one.damping_ratio, 0.01)])
            for one in (self, other)
        )
        return float(np.linalg.norm(np.log2(mine) - np.log2(others)))


def similarity_of(scene: Scene) -> Similarity:
    """Compute the numbers of a scene.

    Raises ValueError for a scene with friction or a body force, which nothing was measured with,
    and for an impact or a real crowd in which nobody touches anybody."""
    scene.check_plain("advice is")
    snapshot, drive, contact = scene.snapshot, scene.drive, scene.contact
    diameter = 2.0 * float(snapshot.radius.mean())
    mass = float(snapshot.mass.mean())
    period = float(np.sqrt(mass / contact.stiffness_N_per_m))
    if drive is not None and scene.reconciliation is None:
        depth, links = _to_the_door(scene) / diameter, ISOSTATIC
    else:
        touch = scene.analysis.contact_tolerance_m
        contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=touch)
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
    return Similarity(
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
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    pairs = contacts.select(~contacts.is_wall)
    graph = coo_array((np.ones(len(pairs)), (pairs.first, pairs.second)), shape=(n, n)).tocsr()
    longest = 0
    visited = np.zeros(n, dtype=bool)
    for disk in range(n):
        if visited[disk]:
            continue
        order, _ = breadth_first_order(graph, disk, directed=False)
        visited[order] = True
        order, before = breadth_first_order(graph, int(order[-1]), directed=False)
        steps = np.zeros(n, dtype=np.int64)
        for reached in order[1:]:
            steps[reached] = steps[before[reached]] + 1
        longest = max(longest, int(steps[order].max()))
    return longest


FILE = "library.json.gz"
# By load and what, in one word: disk_numerical.
Rates = dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Entry:
    """A measured scene: its name, what it is like, its own stiffness, how long its window is at
    that stiffness, and its points."""

    name: str
    likeness: Similarity
    stiffness_N_per_m: float  # noqa: N815  (the unit is newton)
    window_s: float
    points: tuple[Point, ...]

    @classmethod
    def of(cls, scene: Scene, points: Iterable[Point]) -> Self:
        """Make the entry of a scene from what of these points is of it. Raises as `similarity_of`."""
        stiffness = scene.contact.stiffness_N_per_m
        return cls(
            name=scene.name,
            likeness=similarity_of(scene),
            stiffness_N_per_m=stiffness,
            window_s=Window(scene=scene).duration(stiffness),
            points=tuple(point for point in points if point.scene == scene.name),
        )

    def hardness(self, point: Point) -> float:
        """Compute the hardness (see `Similarity`) of a point's contacts."""
        assert point.stiffness_N_per_m is not None
        stiffer = point.stiffness_N_per_m / self.stiffness_N_per_m
        return self.likeness.hardness * float(stiffer**0.5)

    def particle_steps(self, point: Point) -> float:
        """Count disks times steps of a point's run over the window, which for an impact shortens as
        √k grows."""
        assert point.time_step_s is not None
        assert point.stiffness_N_per_m is not None
        window = self.window_s
        if not self.likeness.driven:
            window *= float((self.stiffness_N_per_m / point.stiffness_N_per_m) ** 0.5)
        return point.disks * window / point.time_step_s


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Library:
    """Measured scenes, and the rates of the safety factors that they were found to need (see
    `candidates.rates_of`)."""

    entries: tuple[Entry, ...]
    rates: Rates


def write_library(library: Library, path: Path) -> None:
    """Write the library as JSON, compressed: of the same library the same bytes."""
    path.write_bytes(gzip.compress(TypeAdapter(Library).dump_json(library), mtime=0))


@functools.cache
def stored_library() -> Library:
    """Read the library that the product brings along."""
    return read_library(Path(__file__).with_name(FILE).read_bytes())


def read_library(content: bytes) -> Library:
    """Read what `write_library` wrote. Raises ValueError for anything else."""
    return TypeAdapter(Library).validate_json(gzip.decompress(content))


# As many scenes are read, none of which is less like the one asked about than FARTHEST (three
# doublings of one number).
NEAREST, FARTHEST = 3, 3.0
# Scenes count by 1/(NEAR² + distance²).
NEAR = 0.35
# Below the softest contacts measured by more than this factor of hardness nothing is known.
SOFTER = 0.7
# Errors below this are rounding.
LEAST = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Expected numerical and model error, before any safety factor."""

    numerical: float
    model: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """The measured curves of one quantity (its points' load) that are read for a scene of a
    likeness."""

    likeness: Similarity
    load: str
    entries: Sequence[Entry]

    @cached_property
    def read(self) -> tuple[tuple[Entry, float], ...]:
        """The entries that are read and their weights, which sum to 1; none where no scene in the
        library is like it."""
        near = [
            (self.likeness.distance(entry.likeness), number, entry)
            for number, entry in enumerate(self.entries)
            if any(point.load == self.load for point in entry.points)
        ]
        near.sort(key=lambda found: found[:2])
        chosen = [
            (entry, 1.0 / (NEAR**2 + d * d)) for d, _, entry in near[:NEAREST] if d <= FARTHEST
        ]
        total = sum(weight for _, weight in chosen)
        return tuple((entry, weight / total) for entry, weight in chosen)

    def fractions(self, method: str, law: str) -> list[float]:
        """List the shares of the safe time step that were measured with an engine."""
        points = (
            p for entry, _ in self.read for p in self._points_with(entry, method=method, law=law)
        )
        return sorted({p.time_step_share for p in points if p.time_step_share is not None})

    def rigid_settings(self) -> list[tuple[str, float]]:
        """List the solvers that were measured, with their tolerances."""
        points = (p for entry, _ in self.read for p in self._points_with(entry, method="rigid"))
        return sorted({(p.solver, p.tolerance) for p in points if p.tolerance is not None})

    def soft(self, method: str, law: str, fraction: float, hardness: float) -> Errors | None:
        """Expect errors of an engine at a share of the safe step, with contacts of a hardness:
        geometric means over the scenes read, each interpolated in log hardness.

        Scenes that know nothing so soft are passed over; None where one did not end well, or all
        know nothing."""
        logs, weights = [], []
        for entry, weight in self.read:
            points = self._points_with(entry, method=method, law=law)
            run = sorted((p for p in points if p.time_step_share == fraction), key=entry.hardness)
            if not run or hardness < SOFTER * entry.hardness(run[0]):
                continue
            errors = _between(entry, run, points, hardness)
            if errors is None:
                return None
            logs.append(np.log([errors.numerical, errors.model]))
            weights.append(weight)
        if not logs:
            return None
        numerical, model = np.exp(np.average(logs, axis=0, weights=weights))
        return Errors(numerical=float(numerical), model=float(model))

    def rigid(self, solver: str, tolerance: float) -> Errors | None:
        """Expect the numerical error of a solver asked for a tolerance: the largest of the scenes
        read. None where any did not end well."""
        worst = 0.0
        for entry, _ in self.read:
            point = next(iter(self._points_with(entry, solver=solver, tolerance=tolerance)), None)
            if point is None or point.status != PointStatus.OK or point.numerical_error is None:
                return None
            worst = max(worst, point.numerical_error)
        return Errors(numerical=worst, model=0.0) if self.read else None

    def rigid_seconds(self, solver: str, tolerance: float) -> float:
        """Expect CPU seconds of a solution, in proportion to the disks: geometric mean over the
        scenes read."""
        logs, weights = [], []
        for entry, weight in self.read:
            for point in self._points_with(entry, solver=solver, tolerance=tolerance):
                seconds = (point.cpu_seconds or LEAST) * self.likeness.disks / point.disks
                logs.append(np.log(seconds))
                weights.append(weight)
        return float(np.exp(np.average(logs, weights=weights)))

    def _points_with(self, entry: Entry, **setting: object) -> list[Point]:
        """The points of an entry with this load and setting."""
        return [
            point
            for point in entry.points
            if point.load == self.load
            and all(getattr(point, name) == value for name, value in setting.items())
        ]


def _between(
    entry: Entry, run: Sequence[Point], all_of_law: Sequence[Point], hardness: float
) -> Errors | None:
    """The errors of an entry at a hardness, between its two nearest points of a run (from soft to
    hard), beyond the ends those at the end; None where one of them did not end well. No contact is
    credited with less model error than a harder one: a load that rings can come out right by
    luck."""
    hardness_of_points = [entry.hardness(point) for point in run]
    index = int(np.clip(np.searchsorted(hardness_of_points, hardness), 1, max(len(run) - 1, 1)))
    beside = run[index - 1 : index + 1]
    at, numerical, model = hardness_of_points[index - 1 : index + 1], [], []
    for point, hard in zip(beside, at, strict=True):
        if point.status != PointStatus.OK or None in (point.numerical_error, point.model_error):
            return None
        harder = (q for q in all_of_law if entry.hardness(q) >= (1 - 1e-9) * hard)
        numerical.append(max(point.numerical_error or 0.0, LEAST))
        model.append(max(LEAST, *(q.model_error or 0.0 for q in harder)))
    errors = (np.interp(np.log(hardness), np.log(at), np.log(one)) for one in (numerical, model))
    return Errors(**dict(zip(("numerical", "model"), np.exp([*errors]).tolist(), strict=True)))


def price_of(method: str, law: str, entries: Sequence[Entry]) -> Price | None:
    """Fit the price to all runs of an engine and law that ended, by non-negative least squares of
    the relative error; None where there is none."""
    from scipy.optimize import nnls  # here, since every run starts with this module

    runs = {
        (entry.name, point.stiffness_N_per_m, point.time_step_share): (
            entry.particle_steps(point),
            point.cpu_seconds,
        )
        for entry in entries
        for point in entry.points
        if (point.method, point.law) == (method, law) and point.status == "ok" and point.cpu_seconds
    }
    if not runs:
        return None
    work, seconds = np.array(list(runs.values()), dtype=float).T
    terms = np.column_stack([1.0 / seconds, work / seconds])
    (start, disk_step), _ = nnls(terms, np.ones(len(seconds)))
    return Price(start_s=float(start), disk_step_s=float(disk_step))
