"""Random crowds at an exit: how what people carry varies over arches, and with the number of
people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.paper.discrete.engine_runs import SeededRun, each, installed_engine
from analysis.paper.discrete.pressed_crowd.arch import NEIGHBOURHOOD_M, Arch, carried_interval
from analysis.paper.discrete.pressed_crowd.crowds import gathered, grown
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.support.progress import Progress
from nscd.indeterminacy.determinacy import determinacy

SEEDS: Sequence[int] = range(1, 21)
# people → arches, beside those of SEEDS
SIZES: Mapping[int, int] = {150: 3, 300: 3, 1200: 3, 2400: 3, 5000: 3}
PEOPLE = 594
# Larger crowds press harder and gather later: stiffer, so that disks overlap alike, and later, so
# that all have arrived.
GATHERED = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One random arch in numbers; of its people inside, distances from the middle of the exit.

    solved: whether the percussions are solved, and canonical
    opening: contacts that open
    redundant: contacts − rank of C
    overlap_share: the largest overlap over the mean diameter
    near_share: share of the people who are in the neighbourhood of the exit
    reach_m: m, of the farthest person
    mean_N, largest_N: N, of the sum of normal magnitudes at a person
    lower_N, upper_N: N, the largest sum of magnitudes over all percussions that the mechanics
        allows lies between them (nan: not proven)
    distance_m, angle_degrees: where the largest sum is
    largest_contact_N, contact_distance_m: N and m, the largest force of a contact
    largest_resultant_N, resultant_distance_m: N and m, the largest vector sum at a person
    profile: (rings,) means of the sum of magnitudes in rings of 1 m, over mean_N
    """

    people: int
    seed: int
    solved: bool
    contacts: int
    opening: int
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
        """Compute the numbers of an arch."""
        carried, resultants, distance, inside = (
            arch.carried(), arch.resultants(), arch.distance(), arch.inside(),
        )  # fmt: skip
        most, most_resultant = arch.largest(carried), arch.largest(resultants)
        lower, upper = carried_interval(arch, most)
        forces = np.where(inside[arch.contacts.first], arch.normal_forces(), 0.0)
        strongest = int(np.argmax(forces))
        ring, mean = arch.rings(), float(carried[inside].mean())
        at_contact = (
            arch.contacts.point[strongest] - arch.snapshot.position[arch.contacts.first[strongest]]
        )
        at_contact = at_contact + arch._from_exit()[arch.contacts.first[strongest]]
        return cls(
            people=len(arch.snapshot),
            seed=seed,
            solved=arch.answer.status == "solved" and arch.answer.canonical,
            contacts=len(arch.contacts),
            opening=arch.opening(),
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


def seeded_scene(people: int, seed: int) -> Scene:
    """Make a random crowd like that of the scene `arch`, until all have arrived."""
    scene = make("arch", people, seed)
    stiffness = scene.contact.stiffness_N_per_m * max(1.0, people / PEOPLE) ** 0.5
    seconds = scene.run.duration_s * max(1.0, people / GATHERED) ** 0.5
    return scene.with_contact(stiffness_N_per_m=stiffness).with_run(duration_s=seconds, frames=1)


def survey_runs(runs: Path) -> list[SeededRun]:
    """List the runs of `survey`: SEEDS with the people of the scene, and SIZES; none without an
    engine."""
    wanted = [(PEOPLE, seed) for seed in SEEDS]
    wanted += [(people, seed) for people, count in SIZES.items() for seed in range(1, count + 1)]
    engine, folder = installed_engine(), runs / "arch_seeds"
    return [
        SeededRun(
            scene=seeded_scene(people, seed),
            engine=engine,
            folder=folder / f"{engine}_n{people}_seed{seed}",
            seed=seed,
        )
        for people, seed in wanted
        if engine is not None
    ]


def survey(runs: Path, warnings: list[str], progress: Progress | None = None) -> list[Sample]:
    """Compute the random arches; one whose run fails is a warning."""
    wanted = survey_runs(runs)
    done, total = 0, sum(len(run.scene.snapshot) for run in wanted)

    def read(run: SeededRun) -> Sample:
        nonlocal done
        done += len(run.scene.snapshot)
        if progress:
            progress("random arches", done / total)
        return Sample.of(gathered(run), run.seed)

    return each(wanted, read, warnings)


def heaps(progress: Progress | None = None) -> list[Sample]:
    """Compute the heaps of SEEDS, with the people of the scene."""
    samples = []
    for done, seed in enumerate(SEEDS, start=1):
        samples.append(Sample.of(grown(PEOPLE, seed), seed))
        if progress:
            progress("heaps", done / len(SEEDS))
    return samples


def warnings_of(samples: Sequence[Sample]) -> list[str]:
    """List what a reader of the samples has to know: answers that are not solved, maxima without a
    proven interval."""
    unsolved = [f"{s.people} people, seed {s.seed}" for s in samples if not s.solved]
    unproven = [f"{s.people} people, seed {s.seed}" for s in samples if np.isnan(s.lower_N)]
    out = []
    if unsolved:
        out.append("percussions not solved, or not canonical: " + "; ".join(unsolved))
    if unproven:
        out.append("no proven interval for the largest sum of magnitudes: " + "; ".join(unproven))
    return out
