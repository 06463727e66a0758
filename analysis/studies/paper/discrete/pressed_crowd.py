"""A crowd pressed to an exit, in figures 4 to 6: its percussions, pictures, words and seeds."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison, compare_run, correlation, relative_difference
from analysis.compare.study import Study, study
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.pages import drawing
from analysis.pages.names import engine_label
from analysis.pages.numbers import interval as interval_of
from analysis.pages.section import Cell, Picture, Section
from analysis.pages.words import Words
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
from analysis.scene.packing import heap
from analysis.scene.scene import Drive, Scene
from analysis.scene.shipped_scenes import MASS_KG, make
from analysis.studies.paper.discrete.engine_runs import SeededRun, each, end_of, seeded_runs
from analysis.studies.paper.solutions import unsolved, with_progress
from analysis.support.parallel import Progress
from nscd import ContactLaw, Percussions, Snapshot, solve
from nscd.arrays import Floats, Indices, Mask
from nscd.indeterminacy.intervals import IntervalStatus, interval, weights_of_disk
from nscd.indeterminacy.linear import ProgramError
from nscd.show import contact_lines

log = logging.getLogger(__name__)
RING_M = 1.0
# Half the exit (0.5 m) and a metre beyond: what is called the neighbourhood of the exit here.
NEIGHBOURHOOD_M = 1.5
# Contacts that part faster open.
OPENS_M_PER_S = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Arch(SnapshotPercussions):
    """A snapshot of a driven crowd and its percussions for the desired velocity as u⁻ (paper (1),
    (7) corrected): n people, k contacts."""

    drive: Drive
    window: float  # s, the relaxation time τ that turns percussions p into forces p/τ

    @classmethod
    def of(cls, scene: Scene, snapshot: Snapshot) -> Arch:
        """Solve the percussions (k = 0) of a snapshot in the room of a scene. Raises ValueError for
        a scene without drive."""
        if scene.drive is None:
            raise ValueError(f"drive: scene {scene.name} has none, so nobody presses")
        found = percussions_of(scene, snapshot, tolerance=1e-10)
        values = {field.name: getattr(found, field.name) for field in fields(found)}
        return cls(drive=scene.drive, **values)

    def under(self, law: ContactLaw) -> Percussions:
        """Solve the percussions of the same snapshot and left velocity under another contact
        law."""
        return solve(
            self.snapshot, self.contacts, left_velocity=self.left_velocity, law=law, tolerance=1e-8
        )

    def normal_forces(self) -> Floats:
        """Give n·p/τ at each contact, (k,) N."""
        return np.asarray((self.solution.impulse * self.contacts.normal).sum(1) / self.window)

    def carried(self) -> Floats:
        """Sum |n·p|/τ over the contacts of each person, (n,) N: how hard one is pressed, from
        whatever side."""
        return self.contacts.sum_at_disks(np.abs(self.normal_forces()), len(self.snapshot))

    def resultants(self) -> Floats:
        """Give |Σ p|/τ of each person, (n,) N: forces from opposite sides cancel; m |u⁺ − u⁻|/τ,
        whatever the pressing."""
        change = self.contacts.momentum_change(self.solution.impulse, len(self.snapshot))
        return np.asarray(np.hypot(*change.T) / self.window, dtype=np.float64)

    def inside(self) -> Mask:
        """Tell who has not passed the line of the exit, (n,)."""
        from_line = self.snapshot.position - np.array(self.drive.door_start_m)
        return np.asarray(from_line @ np.array(self.drive.outward) < 0)

    def distance(self) -> Floats:
        """Measure from the middle of the exit to each person's centre, (n,) m."""
        return np.asarray(np.hypot(*(self.snapshot.position - self.door_middle).T))

    def angle_degrees(self) -> Floats:
        """Give the direction of each person seen from the middle of the exit, (n,): 0 straight into
        the room, ±90 along the wall."""
        x, y = (self.snapshot.position - self.door_middle).T
        out_x, out_y = self.drive.outward
        return np.asarray(np.degrees(np.arctan2(y * out_x - x * out_y, -(x * out_x + y * out_y))))

    def opening(self) -> int:
        """Count the contacts that open."""
        approach = self.contacts.approach_velocity(self.solution.right_velocity)
        return int((approach < -OPENS_M_PER_S).sum())

    def person_of_most(self, values: Floats) -> int:
        """Find the person inside who has the largest value (n,)."""
        return int(np.argmax(np.where(self.inside(), values, -np.inf)))

    def overlap_share(self) -> float:
        """Give the largest overlap over the mean diameter."""
        deepest = max(-self.contacts.gap.min(initial=0.0), 0.0)
        return float(deepest / (2 * self.snapshot.radius.mean()))

    def rings(self) -> Indices:
        """Give the ring of each person, (n,): 0 within a metre of the middle of the exit, then 1,
        …; −1 for those outside."""
        return np.where(self.inside(), (self.distance() / RING_M).astype(np.int64), -1)

    def by_ring(self, values: Floats) -> list[Floats]:
        """Part values (n,) of people by their rings, from the exit on."""
        ring = self.rings()
        return [values[ring == r] for r in range(int(ring.max()) + 1)]

    @property
    def door_middle(self) -> Floats:
        """The middle of the exit, (2,) m."""
        ends = np.array([self.drive.door_start_m, self.drive.door_end_m])
        return np.asarray(ends.mean(0))


def carried_interval(arch: Arch, person: int) -> tuple[float, float]:
    """Prove the interval (N) of the sum of normal magnitudes of a person, (nan, nan) where none
    could be proven."""
    try:
        found = interval(arch.contacts, arch.solution, weights_of_disk(arch.contacts, person))
    except (ProgramError, ValueError) as error:
        log.warning("no interval for person %d: %s", person, error)
        return float("nan"), float("nan")
    if found.status == IntervalStatus.UNPROVEN:
        return float("nan"), float("nan")
    return found.lower / arch.window, found.upper / arch.window


def snapshot(arch: Arch) -> Figure:
    """Draw configuration, right velocities, and force on each person: vector sum and sum of
    magnitudes."""
    figure, axes = drawing.panels(10.5, 11.0, 2, 2)
    position, velocity = arch.snapshot.position, arch.solution.right_velocity
    forces, speed = arch.normal_forces(), np.hypot(*velocity.T)
    fields = (
        ("(a) configuration and contact forces", None, "n·p/τ of a contact (N)"),
        ("(b) right velocity u⁺", speed, "speed (m/s)"),
        ("(c) force on each person: vector sum", arch.resultants(), "|Σ p|/τ (N)"),
        ("(c′) force on each person: sum of magnitudes", arch.carried(), "Σ |n·p|/τ (N)"),
    )
    for axis, (title, values, label) in zip(axes, fields, strict=True):
        shown = forces if values is None else values[arch.inside()]
        norm = Normalize(0.0, float(np.quantile(shown, 0.99)))
        _draw_people(axis, arch, values, norm)
        if values is None:
            lines = contact_lines(arch.snapshot, arch.contacts)
            drawing.draw_forces(axis, lines, forces, norm)
        drawing.label(axis, title=title)
        drawing.add_scale(figure, axis, norm, label)
    moving = speed > 0.05 * np.quantile(speed, 0.9)
    shown = velocity[moving] / 4
    drawing.draw_vectors(axes[1], position[moving], shown, width=0.0025, color=drawing.BLACK)
    for axis, values in zip(axes[2:], (arch.resultants(), arch.carried()), strict=True):
        maximum = position[arch.person_of_most(values)]
        anchor = (0.4, np.copysign(max(abs(maximum[1]) + 0.6, 1.6), maximum[1]))
        arrow = {"arrowstyle": "->", "color": drawing.BLACK, "lw": 1.5}
        axis.annotate("largest", maximum, anchor, fontsize=9, arrowprops=arrow)
    return figure


def _draw_people(axes: Axes, arch: Arch, values: Floats | None, norm: Normalize) -> None:
    drawing.draw_disks(axes, arch.snapshot, drawing.PALE, values=values, norm=norm)
    ends = np.array([arch.drive.door_start_m, arch.drive.door_end_m])
    along = 50.0 * (ends[1] - ends[0])
    drawing.draw_walls(axes, [(ends[0], ends[0] - along), (ends[1], ends[1] + along)])
    reach = arch.snapshot.position[arch.inside()]
    low, high = reach.min(0) - 0.5, np.maximum(reach.max(0), (1.5, -np.inf)) + 0.5
    limits: dict[str, Any] = {"xlim": (low[0], high[0]), "ylim": (low[1], high[1])}
    drawing.label(axes, "x (m)", "y (m)", **limits, aspect="equal")


def engines(comparisons: Sequence[Comparison]) -> Figure:
    """Draw the sum of magnitudes at each person: percussions against each engine."""
    figure, every = drawing.panels(4.6 * len(comparisons), 5.0, 1, len(comparisons))
    for axes, comparison in zip(every, comparisons, strict=True):
        penalty, rigid = (values / 1e3 for values in comparison.disk_sums())
        near = Arch.of(comparison.scene, comparison.snapshot).distance() <= NEIGHBOURHOOD_M
        top = 1.05 * float(max(penalty.max(), rigid.max()))
        axes.plot([0, top], [0, top], color=drawing.BLACK, lw=0.8, label="equal")
        far: dict[str, Any] = {"ms": 3.5, "mfc": "none", "mec": drawing.BLUE, "mew": 0.7}
        axes.plot(penalty[~near], rigid[~near], "o", label="farther", **far)
        close: dict[str, Any] = {"ms": 5, "color": drawing.ORANGE, "mec": drawing.BLACK, "mew": 0.5}
        label = f"within {NEIGHBOURHOOD_M:g} m of the exit"
        axes.plot(penalty[near], rigid[near], "s", label=label, **close)
        axes.set(xlim=(0, top), ylim=(0, top), aspect="equal")
        x, y, title = "engine (kN)", "percussions, p/τ (kN)", engine_label(comparison)
        drawing.label(axes, x, y, title, legend="upper left")
    return figure


# The scene `jam`: disks too large for the exit, so that an arch really blocks it.
BLOCKED_SEEDS: Sequence[int] = range(1, 6)
STIFFNESSES = (1e6, 1e7)  # N/m, of the blocked crowds
# At rest nobody inside has a larger right velocity, and no larger share of the drive accelerates.
AT_REST_M_PER_S, AT_REST_SHARE = 0.01, 1e-3
MEAN_RADIUS_M = 0.17  # of the scene `arch`


def gathered(run: EngineRun) -> Arch:
    """Solve the last frame of a run. Raises EngineError, DumpError."""
    return Arch.of(run.scene, end_of(run))


def grown(people: int, seed: int) -> Arch:
    """Solve a heap grown disk by disk at the shut exit, at the instant when it opens.

    Its disks are those of the scene `arch` in size, they touch without overlap and just carry one
    another: an arch as it forms, before anybody has moved."""
    scene = make("arch", people, seed)
    assert scene.drive is not None
    half = 0.5 * float(np.hypot(*np.subtract(scene.drive.door_end_m, scene.drive.door_start_m)))
    position, radius = heap(people, seed, MEAN_RADIUS_M, half)
    mass = np.full(people, MASS_KG)
    return Arch.of(scene, Snapshot(position=position, radius=radius, mass=mass))


def blocked_runs(runs: Path) -> list[SeededRun]:
    """List the runs of `blocked`; none without an engine."""

    def scene(k: float, seed: int) -> Scene:
        return make("jam", None, seed).with_contact(stiffness_N_per_m=k).with_run(frames=1)

    every = itertools.product(STIFFNESSES, BLOCKED_SEEDS)
    crowds = ((f"seed{seed}_k{k:.0e}", seed, scene(k, seed)) for k, seed in every)
    return seeded_runs(crowds, runs / "jam_seeds")


class Blocked:
    """A crowd behind an exit that an arch blocks: its percussions, and beside the engine's forces.

    still: whether it has come to rest in the engine, whatever the percussions say
    at_rest: whether an arch stopped it, and it has come to rest"""

    def __init__(self, run: SeededRun) -> None:
        self.seed, self.arch, self.comparison = run.seed, gathered(run), compare_run(run.folder)
        self.stiffness = self.comparison.scene.contact.stiffness_N_per_m
        self.still = self.comparison.balance.unbalanced < AT_REST_SHARE
        fastest = np.hypot(*self.arch.solution.right_velocity[self.arch.inside()].T).max()
        self.at_rest = self.still and bool(fastest < AT_REST_M_PER_S)


def blocked(runs: Path, warnings: list[str], progress: Progress | None = None) -> list[Blocked]:
    """Solve the crowds of BLOCKED_SEEDS, at rest or not; one whose run fails is a warning."""
    return each(with_progress(blocked_runs(runs), "blocked exits", progress), Blocked, warnings)


EVERY: Sequence[str] = [engine.NAME for engine in PENALTY]
NEAR_M = 3.0  # where the density is measured


def arch_runs(scene: Scene, runs: Path) -> list[EngineRun]:
    """List the scene by every engine."""
    return [EngineRun.of(scene, engine, runs) for engine in EVERY]


def arch_study(scene: Scene, runs: Path, progress: Progress | None) -> Study:
    """Run the scene by every engine, and compare each with its percussions.

    Raises EngineError if no engine gathered the crowd."""
    found = study(scene, EVERY, [scene.contact.stiffness_N_per_m], runs, progress)
    if not found.comparisons:
        raise EngineError("; ".join(found.failures))
    return found


def without_crowd(number: str, title: str, reason: str) -> Section:
    """Make what is left of a section where no engine gathered its crowd."""
    return Section(number=number, title=title, warnings=(reason,))


def crowd_parts(arch: Arch, found: Study, prefix: str, name: str) -> Section:
    """Describe a crowd as a part of its section: how dense it is; itself, and its percussions
    against each engine; the forces on the people inside, and by each engine.

    arch: that of the first engine of `found`; prefix, name: of the pictures"""
    words, comparisons, inside = Words(__name__), found.comparisons, arch.inside()
    numbers = {
        "inside": int(inside.sum()),
        "people": len(inside),
        "time": found.scene.analysis.time_s,
        "density": (inside & (arch.distance() <= NEAR_M)).sum() / (0.5 * np.pi * NEAR_M**2),
        "near": NEAR_M,
        "engine": engine_label(comparisons[0]),
        "unbalanced": comparisons[0].balance.unbalanced,
    }
    drawn = {
        prefix + name: ("snapshot", snapshot(arch)),
        f"{prefix}engines": ("engines", engines(comparisons)),
    }
    return Section(
        number="",
        title="",
        words=[words.text("words", **numbers)],
        pictures=[
            Picture(name=file, caption=words.text(block), figure=figure)
            for file, (block, figure) in drawn.items()
        ],
        tables=[
            words.table("table_maxima", _maxima_rows(arch)),
            words.table("table_engines", [_engine_row(comparison) for comparison in comparisons]),
        ],
        warnings=[*found.warnings, *unsolved([("percussions of the snapshot", arch.solution)])],
    )


def _maxima_rows(arch: Arch) -> list[Sequence[Cell]]:
    rows: list[Sequence[Cell]] = []
    sums = ("sum of normal magnitudes", arch.carried()), ("vector sum", arch.resultants())
    for name, values in sums:
        maximum, inside = arch.person_of_most(values), values[arch.inside()]
        sizes = inside.mean(), *np.quantile(inside, (0.5, 0.95)), values[maximum]
        position = arch.distance()[maximum], arch.angle_degrees()[maximum]
        # equilibrium fixes every vector sum
        bounds = carried_interval(arch, maximum) if name == sums[0][0] else (values[maximum],) * 2
        person = int(arch.snapshot.ids[maximum])
        rows.append((name, *map(float, (*sizes, *position)), person, interval_of(bounds)))
    return rows


def _engine_row(comparison: Comparison) -> Sequence[Cell]:
    penalty, rigid = comparison.disk_sums()
    distance = Arch.of(comparison.scene, comparison.snapshot).distance()
    means = float(penalty.mean()), float(rigid.mean())
    maximum = (float(v) for f in (penalty, rigid) for v in (f.max(), distance[f.argmax()]))
    alike = correlation(penalty, rigid), relative_difference(penalty, rigid)
    ended = comparison.balance.unbalanced, str(comparison.solution.status)
    return (engine_label(comparison), *means, *maximum, *alike, *ended)
