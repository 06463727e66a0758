"""Arches at an exit: what each person carries, and how it varies over random arches and with their number."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.charts import BLACK, BLUE, GREY, ORANGE
from analysis.dumps import open_bodies, snapshot_of
from analysis.engines import ENGINES, EngineError
from analysis.making import make
from analysis.paper.section import Cell, Picture, Progress, Table
from analysis.scene import Drive, Scene
from analysis.study import run_engine
from nscd import ContactLaw, Contacts, Percussions, Snapshot, find_contacts, solve
from nscd.admissible import ProgramError
from nscd.bodies import Floats, Integers
from nscd.indeterminacy import determinacy
from nscd.intervals import IntervalStatus, interval, weights_of_disk

log = logging.getLogger(__name__)
SEEDS: Sequence[int] = range(1, 21)
# people → arches, beside those of SEEDS
SIZES: Mapping[int, int] = {150: 3, 300: 3, 1200: 3, 2400: 3, 5000: 3}
PEOPLE = 594
# The scene `jam`: disks too large for the exit, so that an arch really blocks it.
BLOCKED_SEEDS: Sequence[int] = range(1, 6)
AT_REST_M_PER_S = 0.01
# Larger crowds press harder and gather later: stiffer, so that disks overlap alike, and later, so that all have arrived.
GATHERED = 2000
RING_M = 1.0
# Half the exit (0.5 m) and a metre beyond: what is called the neighbourhood of the exit here.
NEIGHBOURHOOD_M = 1.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arch:
    """A snapshot of a driven crowd and its percussions for the desired velocity as u⁻ (paper (1), (7) corrected).

    left_velocity (n,2) m/s; window: the relaxation time τ (s) that turns percussions p into forces p/τ.
    """

    drive: Drive
    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats
    window: float
    answer: Percussions

    @classmethod
    def of(cls, scene: Scene, snapshot: Snapshot) -> Arch:
        """The percussions (k = 0) of a snapshot in the room of a scene. Raises ValueError for a scene without drive."""
        if scene.drive is None:
            raise ValueError(f"drive: scene {scene.name} has none, so nobody presses")
        contacts = find_contacts(
            snapshot, scene.wall_segments(), tolerance=scene.analysis.contact_tolerance_m
        )
        left = scene.drive.desired_velocity(snapshot.position)
        answer = solve(snapshot, contacts, left_velocity=left, tolerance=1e-10)
        return cls(
            drive=scene.drive,
            snapshot=snapshot,
            contacts=contacts,
            left_velocity=left,
            window=scene.drive.relaxation_time_s,
            answer=answer,
        )

    def under(self, law: ContactLaw) -> Percussions:
        """The percussions of the same snapshot and left velocity under another contact law."""
        return solve(self.snapshot, self.contacts, left_velocity=self.left_velocity, law=law, tolerance=1e-8)

    def normal_forces(self) -> Floats:
        """n·p/τ at each contact, (k,) N."""
        forces: Floats = (self.answer.impulse * self.contacts.normal).sum(1) / self.window
        return forces

    def carried(self) -> Floats:
        """Σ |n·p|/τ over the contacts of each person, (n,) N: how hard a person is pressed, from whatever side."""
        size, n = np.abs(self.normal_forces()), len(self.snapshot)
        pairs = ~self.contacts.is_wall
        first = np.bincount(self.contacts.first, size, n)
        return np.asarray(first + np.bincount(self.contacts.second[pairs], size[pairs], n), dtype=np.float64)

    def resultants(self) -> Floats:
        """|Σ p|/τ of each person, (n,) N: forces from opposite sides cancel; m |u⁺ − u⁻|/τ, whatever the pressing."""
        change = self.contacts.momentum_change(self.answer.impulse, len(self.snapshot))
        return np.asarray(np.hypot(*change.T) / self.window, dtype=np.float64)

    def inside(self) -> NDArray[np.bool_]:
        """Who has not passed the line of the exit, (n,)."""
        beyond = (self.snapshot.position - np.array(self.drive.door_start_m)) @ np.array(self.drive.outward)
        return np.asarray(beyond < 0)

    def distance(self) -> Floats:
        """From the middle of the exit to each person's centre, (n,) m."""
        return np.asarray(np.hypot(*self._from_exit().T), dtype=np.float64)

    def angle_degrees(self) -> Floats:
        """Direction of each person seen from the middle of the exit, (n,): 0 straight into the room, ±90 along the wall."""
        x, y = self._from_exit().T
        out_x, out_y = self.drive.outward
        return np.asarray(np.degrees(np.arctan2(y * out_x - x * out_y, -(x * out_x + y * out_y))))

    def largest(self, values: Floats) -> int:
        """The index of the person inside who has the largest value (n,)."""
        return int(np.argmax(np.where(self.inside(), values, -np.inf)))

    def overlap_share(self) -> float:
        """The largest overlap over the mean diameter."""
        return float(max(-self.contacts.gap.min(initial=0.0), 0.0) / (2 * self.snapshot.radius.mean()))

    def rings(self) -> Integers:
        """Ring of each person, (n,): 0 within a metre of the middle of the exit, then 1, …; −1 for those outside."""
        return np.where(self.inside(), (self.distance() / RING_M).astype(np.int64), -1)

    def _from_exit(self) -> Floats:
        middle = 0.5 * (np.array(self.drive.door_start_m) + np.array(self.drive.door_end_m))
        return np.asarray(self.snapshot.position - middle)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One random arch in numbers. Forces in N, of people inside: mean_N and largest_N of the sum of normal magnitudes,
    largest_resultant_N of the vector sum, with the places (m from the middle of the exit, degrees) of both maxima and of
    the largest contact force. lower_N, upper_N: proven interval of the largest sum of magnitudes over all percussions that
    the mechanics allows (nan: not proven). redundant: contacts − rank of C. near_share: people in the neighbourhood of the
    exit. reach_m: the farthest person. profile: ring means of the sum of magnitudes over mean_N.
    """

    people: int
    seed: int
    solved: bool
    contacts: int
    redundant: int
    overlap_share: float
    near_share: float
    reach_m: float
    mean_N: float  # noqa: N815  (the unit is newton)
    largest_N: float  # noqa: N815
    lower_N: float  # noqa: N815
    upper_N: float  # noqa: N815
    distance_m: float
    angle_degrees: float
    largest_contact_N: float  # noqa: N815
    contact_distance_m: float
    largest_resultant_N: float  # noqa: N815
    resultant_distance_m: float
    profile: tuple[float, ...]

    @classmethod
    def of(cls, arch: Arch, seed: int) -> Sample:
        """The numbers of an arch."""
        carried, resultants, distance, inside = (
            arch.carried(), arch.resultants(), arch.distance(), arch.inside(),
        )  # fmt: skip
        most, most_resultant = arch.largest(carried), arch.largest(resultants)
        lower, upper = carried_interval(arch, most)
        forces = np.where(inside[arch.contacts.first], arch.normal_forces(), 0.0)
        strongest = int(np.argmax(forces))
        ring, mean = arch.rings(), float(carried[inside].mean())
        at_contact = arch.contacts.point[strongest] - arch.snapshot.position[arch.contacts.first[strongest]]
        at_contact = at_contact + arch._from_exit()[arch.contacts.first[strongest]]
        return cls(
            people=len(arch.snapshot),
            seed=seed,
            solved=arch.answer.status == "solved" and arch.answer.canonical,
            contacts=len(arch.contacts),
            redundant=determinacy(arch.contacts, len(arch.snapshot)).redundant,
            overlap_share=arch.overlap_share(),
            near_share=float((inside & (distance <= NEIGHBOURHOOD_M)).sum() / inside.sum()),
            reach_m=float(distance[inside].max()),
            mean_N=mean,
            largest_N=float(carried[most]),
            lower_N=lower,
            upper_N=upper,
            distance_m=float(distance[most]),
            angle_degrees=float(arch.angle_degrees()[most]),
            largest_contact_N=float(forces[strongest]),
            contact_distance_m=float(np.hypot(*at_contact)),
            largest_resultant_N=float(resultants[most_resultant]),
            resultant_distance_m=float(distance[most_resultant]),
            profile=tuple(
                float(carried[ring == r].mean() / mean) if (ring == r).any() else float("nan")
                for r in range(int(ring.max()) + 1)
            ),
        )


def carried_interval(arch: Arch, person: int) -> tuple[float, float]:
    """The proven interval (N) of the sum of normal magnitudes of a person, (nan, nan) where none could be proven."""
    try:
        found = interval(arch.contacts, arch.answer, weights_of_disk(arch.contacts, person))
    except (ProgramError, ValueError) as error:
        log.warning("no interval for person %d: %s", person, error)
        return float("nan"), float("nan")
    if found.status == IntervalStatus.UNPROVEN:
        return float("nan"), float("nan")
    return found.lower / arch.window, found.upper / arch.window


def gathered(scene: Scene, folder: Path, engine: str) -> Arch:
    """The last frame of the scene run by an engine; a finished run in the folder is taken as it is. Raises EngineError."""
    scene = scene.with_run(frames=1)
    record = run_engine(scene, engine, folder)
    bodies = folder / "bodies.dump"
    return Arch.of(scene, snapshot_of(open_bodies(bodies, record.time_step_s).trajectory[-1], bodies))


def installed_engine() -> str:
    """The first engine that is there. Raises EngineError if none is."""
    name = next((engine.NAME for engine in ENGINES if engine.find() is not None), None)
    if name is None:
        raise EngineError("no engine is installed to gather a crowd")
    return name


def seeded_scene(people: int, seed: int) -> Scene:
    """A random crowd like that of the scene `arch`, until all have arrived."""
    scene = make("arch", people, seed)
    stiffness = scene.contact.stiffness_N_per_m * max(1.0, people / PEOPLE) ** 0.5
    seconds = scene.run.duration_s * max(1.0, people / GATHERED) ** 0.5
    return scene.with_contact(stiffness_N_per_m=stiffness).with_run(duration_s=seconds)


def survey(runs: Path, progress: Progress | None = None) -> list[Sample]:
    """The arches of SEEDS, with the people of the scene, and those of SIZES. Raises EngineError."""
    wanted = [(PEOPLE, seed) for seed in SEEDS]
    wanted += [(people, seed) for people, count in SIZES.items() for seed in range(1, count + 1)]
    engine, samples, total, done = installed_engine(), [], sum(people for people, _ in wanted), 0
    for people, seed in wanted:
        folder = runs / "arch_seeds" / f"{engine}_n{people}_seed{seed}"
        samples.append(Sample.of(gathered(seeded_scene(people, seed), folder, engine), seed))
        done += people
        if progress:
            progress(f"random arches: {people} people, seed {seed}", done / total)
    return samples


def blocked(runs: Path, progress: Progress | None = None) -> list[Sample]:
    """The crowds of BLOCKED_SEEDS that an arch stopped: nobody inside has a right velocity beyond AT_REST_M_PER_S.
    Raises EngineError."""
    engine, samples = installed_engine(), []
    for done, seed in enumerate(BLOCKED_SEEDS, start=1):
        arch = gathered(make("jam", None, seed), runs / "jam_seeds" / f"{engine}_seed{seed}", engine)
        if np.hypot(*arch.answer.right_velocity[arch.inside()].T).max() < AT_REST_M_PER_S:
            samples.append(Sample.of(arch, seed))
        if progress:
            progress(f"blocked exits: seed {seed}", done / len(BLOCKED_SEEDS))
    return samples


def warnings_of(samples: Sequence[Sample]) -> list[str]:
    """What a reader of the samples has to know: answers that are not solved, maxima without a proven interval."""
    unsolved = [f"{s.people} people, seed {s.seed}" for s in samples if not s.solved]
    unproven = [f"{s.people} people, seed {s.seed}" for s in samples if np.isnan(s.lower_N)]
    out = []
    if unsolved:
        out.append("percussions not solved, or not canonical: " + "; ".join(unsolved))
    if unproven:
        out.append("no proven interval for the largest sum of magnitudes: " + "; ".join(unproven))
    return out


def seeds_table(samples: Sequence[Sample], caption: str) -> Table:
    """Mean, spread and range of each quantity over arches of one size."""
    quantities = (
        ("mean sum of normal magnitudes (N)", [s.mean_N for s in samples]),
        ("largest sum of normal magnitudes (N)", [s.largest_N for s in samples]),
        ("width of its interval (N)", [s.upper_N - s.lower_N for s in samples]),
        ("its distance from the middle of the exit (m)", [s.distance_m for s in samples]),
        ("its angle from the axis of the exit, size (°)", [abs(s.angle_degrees) for s in samples]),
        ("largest contact force (N)", [s.largest_contact_N for s in samples]),
        ("its distance (m)", [s.contact_distance_m for s in samples]),
        ("largest vector sum (N)", [s.largest_resultant_N for s in samples]),
        ("its distance (m)", [s.resultant_distance_m for s in samples]),
        ("redundant contacts", [float(s.redundant) for s in samples]),
        ("largest overlap / mean diameter", [s.overlap_share for s in samples]),
    )
    rows: list[Sequence[Cell]] = [
        (name, *(float(f(values)) for f in (np.mean, np.std, np.min, np.median, np.max)))
        for name, values in quantities
    ]
    head = ("quantity", "mean", "standard deviation", "least", "median", "largest")
    return Table(caption=caption, head=head, rows=rows)


def sizes_table(samples: Sequence[Sample]) -> Table:
    """Means over the arches of each number of people."""
    rows: list[Sequence[Cell]] = []
    for people in sorted({s.people for s in samples}):
        same = [s for s in samples if s.people == people]

        def mean(name: str, same: list[Sample] = same) -> float:
            return float(np.mean([getattr(s, name) for s in same]))

        largest = [s.largest_N for s in same]
        rows.append(
            (
                people, len(same), mean("reach_m"), mean("contacts") / people, mean("mean_N"), float(np.mean(largest)),
                float(np.std(largest)), mean("distance_m"), mean("largest_resultant_N"), mean("resultant_distance_m"),
                mean("redundant"), mean("overlap_share"), sum(s.solved for s in same),
            )
        )  # fmt: skip
    head = (
        "people", "arches", "farthest person (m)", "contacts a person", "mean sum of magnitudes (N)", "largest (N)",
        "standard deviation (N)", "its distance (m)", "largest vector sum (N)", "its distance (m)", "redundant contacts",
        "largest overlap / diameter", "solved",
    )  # fmt: skip
    return Table(caption="Means over random arches, by number of people", head=head, rows=rows)


def growth(samples: Sequence[Sample], values: Sequence[float]) -> float:
    """The exponent a of value ∝ N^a, by least squares in the logarithms."""
    return float(np.polyfit(np.log([s.people for s in samples]), np.log(values), 1)[0])


def seeds_picture(samples: Sequence[Sample]) -> Picture:
    """Where the maxima lie, and the sum of magnitudes against the distance, over arches of one size."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    places, profile = figure.subplots(1, 2)
    sums, vectors = [s.distance_m for s in samples], [s.resultant_distance_m for s in samples]
    bins = np.arange(0.0, max(sums + vectors) + 0.5, 0.5)
    places.hist(sums, bins, color=BLUE, edgecolor=BLACK, alpha=0.9, label="largest sum of magnitudes")
    places.hist(
        vectors, bins, color="none", edgecolor=ORANGE, lw=1.5, hatch="///", label="largest vector sum"
    )
    places.axvline(NEIGHBOURHOOD_M, color=BLACK, ls=":", label=f"{NEIGHBOURHOOD_M:g} m")
    places.set(xlabel="distance from the middle of the exit (m)", ylabel="arches")
    places.set_ylim(0, 1.45 * places.get_ylim()[1])
    places.legend(fontsize=8, loc="upper right")
    count = min(len(s.profile) for s in samples)
    values = np.array([s.profile[:count] for s in samples])
    ring = (np.arange(count) + 0.5) * RING_M
    profile.plot(ring, values.T, color=GREY, lw=0.7)
    profile.errorbar(
        ring, np.nanmean(values, 0), np.nanstd(values, 0), fmt="o-", color=BLUE, capsize=3,
        label="mean and standard deviation",
    )  # fmt: skip
    profile.set(
        xlabel="distance from the middle of the exit (m)", ylabel="sum of magnitudes / mean of the arch"
    )
    profile.set_ylim(bottom=0)
    profile.legend(fontsize=8)
    return Picture(
        name="fig_4_seeds",
        figure=figure,
        caption=f"{len(samples)} random arches of {samples[0].people} people. Left: distance of the person who carries most, "
        "as the sum of normal magnitudes (filled) and as the vector sum (hatched). Right: mean of the sum of magnitudes in "
        "rings of 1 m; grey: each arch.",
    )


def sizes_picture(samples: Sequence[Sample]) -> Picture:
    """How mean, maximum and the place of the maximum change with the number of people."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    forces, places = figure.subplots(1, 2)
    _error_bars(forces, samples, "largest_N", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(forces, samples, "mean_N", "o-", BLUE, "mean sum of magnitudes")
    _error_bars(forces, samples, "largest_resultant_N", "D:", BLACK, "largest vector sum")
    forces.set(yscale="log", xlabel="people", ylabel="force (N)")
    forces.set_ylim(top=20 * forces.get_ylim()[1])
    forces.legend(fontsize=8, loc="upper left")
    people = sorted({s.people for s in samples})
    for axes in (forces, places):
        axes.set_xscale("log")
        axes.set_xticks(people, [str(n) for n in people])
        axes.set_xticks([], minor=True)
    _error_bars(places, samples, "reach_m", "^-.", BLUE, "farthest person")
    _error_bars(places, samples, "distance_m", "s--", ORANGE, "largest sum of magnitudes")
    _error_bars(places, samples, "resultant_distance_m", "D:", BLACK, "largest vector sum")
    places.set(xlabel="people", ylabel="distance from the middle of the exit (m)")
    places.legend(fontsize=8, loc="upper left")
    return Picture(
        name="fig_4_sizes",
        figure=figure,
        caption="Means and standard deviations over random arches at the same density: forces, and where the largest are.",
    )


def _error_bars(
    axes: Axes, samples: Sequence[Sample], name: str, style: str, colour: str, label: str
) -> None:
    people = sorted({s.people for s in samples})
    values = [np.array([getattr(s, name) for s in samples if s.people == n]) for n in people]
    mean, spread = [v.mean() for v in values], [v.std() for v in values]
    axes.errorbar(people, mean, spread, fmt=style, color=colour, capsize=3, ms=5, label=label)
