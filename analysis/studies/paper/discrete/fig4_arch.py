"""Figure 4: a crowd pressed to an exit, its seeds, and what the dissipation changes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.compare.comparison import Comparison, relative_difference, statistics
from analysis.compare.study import Study
from analysis.engines import EngineError
from analysis.engines.run import EngineRun
from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE, label, legend_below, panels, ticks_at
from analysis.pages.section import Cell, Claim, Section, Table, Verdict
from analysis.pages.words import Words
from analysis.scene.scene import Scene, read_scene
from analysis.scene.shipped_scenes import make
from analysis.studies.paper.discrete import pressed_crowd
from analysis.studies.paper.discrete.engine_runs import SeededRun, each, seeded_runs
from analysis.studies.paper.discrete.pressed_crowd import NEIGHBOURHOOD_M, RING_M, Arch, Blocked
from analysis.studies.paper.solutions import grouped, unsolved, with_progress
from analysis.support.parallel import Progress
from nscd import ContactLaw
from nscd.arrays import Floats
from nscd.indeterminacy.determinacy import determinacy

# kg; two people of 75 kg have the effective mass 37.5 kg
DISSIPATIONS = (0.0, 1.0, 3.0, 10.0, 30.0, 37.5, 100.0, 300.0, 1e3, 1e4)
EFFECTIVE_MASS = 37.5


def maintained_forces(arch: Arch) -> Floats:
    """Find what the equality W λ = C u⁻ (paper (2), (8)) asks of an arch: (k,) N, its shortest
    solution λ/τ, by the dense M^(-1/2) Cᵀ, which does not square the condition as W does."""
    root = np.sqrt(np.repeat(arch.snapshot.mass, 2))
    matrix = arch.contacts.normal_matrix(len(arch.snapshot)).toarray().T / root[:, None]
    reaction = np.linalg.lstsq(matrix, root * arch.left_velocity.ravel(), rcond=1e-10)[0]
    return np.asarray(reaction / arch.window)


class Trial(NamedTuple):
    """The arch under a law.

    lower, upper: N, the proven interval of Σ λ/τ at the person who carries most
    energy_share: ΔE/E⁻ of the impact: −1 where all of the left velocity's energy is lost, > 0 where
        energy was gained"""

    dissipation: float  # kg, k
    across: bool  # whether k acts across contacts too, as the paper's single k does
    arch: Arch  # with the answer under that law
    most: int  # the person who carries most
    lower: float
    upper: float
    forces: Floats  # (k,) N, n·p/τ
    reactions: Floats  # (k,) N, λ/τ
    energy_share: float


def dissipation_trials(arch: Arch, dissipations: Sequence[float] = DISSIPATIONS) -> list[Trial]:
    """Solve the arch with each k, along and across the contacts (paper (1)) and along the normals
    only."""
    before = 0.5 * float(arch.snapshot.mass @ (arch.left_velocity**2).sum(1))

    def trial(across: bool, k: float) -> Trial:
        law = ContactLaw(dissipation=k, tangential_dissipation=None if across else 0.0)
        solution = arch.under(law)
        tried = replace(arch, solution=solution)
        maximum = tried.person_of_most(tried.carried())
        forces = tried.normal_forces(), solution.reaction / arch.window
        bounds = pressed_crowd.carried_interval(tried, maximum)
        return Trial(k, across, tried, maximum, *bounds, *forces, solution.energy_change / before)

    return [trial(*case) for case in product((True, False), dissipations)]


def changes(trials: Sequence[Trial]) -> Mapping[float, float]:
    """Measure how far the sums of magnitudes are from those of the first trial (rms), by k (kg)."""
    start = trials[0].arch.carried()
    return {t.dissipation: relative_difference(start, t.arch.carried()) for t in trials}


SEEDS: Sequence[int] = range(1, 21)
# people → arches, beside those of SEEDS
SIZES: Mapping[int, int] = {150: 3, 300: 3, 1200: 3, 2400: 3, 5000: 3}
PEOPLE = 594
# Larger crowds press harder and gather later: stiffer, so that disks overlap alike, and later, so
# that all have arrived.
GATHERED = 2000


Sample = Mapping[str, Any]
"""One random arch in numbers, by `sample_of`."""


def sample_of(arch: Arch, seed: int) -> Sample:
    """Compute the numbers of an arch: of its people inside, forces (N) and their distances (m) from
    the middle of the exit.

    reach_m: of the farthest person. mean_N, largest_N, distance_m, angle_degrees: of the sum of
    normal magnitudes at a person. lower_N, upper_N: the largest sum of magnitudes over all
    percussions that the mechanics allows lies between them (nan: not proven).
    largest_contact_N, contact_distance_m: of the force of a contact. largest_resultant_N,
    resultant_distance_m: of the vector sum at a person. solved: whether the percussions are solved,
    and canonical. opening: contacts that open. redundant: contacts − rank of C. overlap_share: the
    largest overlap over the mean diameter. profile: (rings,) means of the sum of magnitudes in
    rings of 1 m, over mean_N."""
    carried, resultants = arch.carried(), arch.resultants()
    distance, inside = arch.distance(), arch.inside()
    maximum, most_resultant = arch.person_of_most(carried), arch.person_of_most(resultants)
    lower, upper = pressed_crowd.carried_interval(arch, maximum)
    forces = np.where(inside[arch.contacts.first], arch.normal_forces(), 0.0)
    strongest, mean = int(np.argmax(forces)), float(carried[inside].mean())
    at_contact = arch.contacts.point[strongest] - arch.door_middle
    return {
        "people": len(arch.snapshot),
        "seed": seed,
        "solved": arch.solution.status == "solved" and arch.solution.canonical,
        "contacts": len(arch.contacts),
        "opening": arch.opening(),
        "redundant": determinacy(arch.contacts, len(arch.snapshot)).redundant,
        "overlap_share": arch.overlap_share(),
        "reach_m": float(distance[inside].max()),
        "mean_N": mean,
        "largest_N": float(carried[maximum]),
        "lower_N": lower,
        "upper_N": upper,
        "distance_m": float(distance[maximum]),
        "angle_degrees": float(arch.angle_degrees()[maximum]),
        "largest_contact_N": float(forces[strongest]),
        "contact_distance_m": float(np.hypot(*at_contact)),
        "largest_resultant_N": float(resultants[most_resultant]),
        "resultant_distance_m": float(distance[most_resultant]),
        "profile": [
            float(at.mean() / mean) if len(at) else float("nan") for at in arch.by_ring(carried)
        ],
    }


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
    crowds = ((f"n{n}_seed{seed}", seed, seeded_scene(n, seed)) for n, seed in wanted)
    return seeded_runs(crowds, runs / "arch_seeds")


def survey(runs: Path, warnings: list[str], progress: Progress | None = None) -> list[Sample]:
    """Compute the random arches; one whose run fails is a warning."""
    wanted = with_progress(survey_runs(runs), "random arches", progress)
    return each(wanted, lambda run: sample_of(pressed_crowd.gathered(run), run.seed), warnings)


def heaps(progress: Progress | None = None) -> list[Sample]:
    """Compute the heaps of SEEDS, with the people of the scene."""
    seeds = with_progress(SEEDS, "heaps", progress)
    return [sample_of(pressed_crowd.grown(PEOPLE, seed), seed) for seed in seeds]


def warnings_of(samples: Sequence[Sample]) -> list[str]:
    """List what a reader of the samples has to know: answers that are not solved, maxima without a
    proven interval."""
    kinds = {
        "percussions not solved, or not canonical": [s for s in samples if not s["solved"]],
        "no proven interval for the largest sum of magnitudes": [
            s for s in samples if np.isnan(s["lower_N"])
        ],
    }
    return [
        f"{what}: {'; '.join('{people} people, seed {seed}'.format_map(s) for s in some)}"
        for what, some in kinds.items()
        if some
    ]


BIN_M = 0.5
# What is averaged over the arches of each number of people.
SIZED = (
    "reach_m", "contacts", "mean_N", "largest_N", "distance_m", "largest_resultant_N",
    "resultant_distance_m", "redundant", "overlap_share",
)  # fmt: skip


def dissipation(trials: Sequence[Trial]) -> Figure:
    """Draw percussions and reactions against the dissipation k: along and across, along only."""
    figure, axes = panels(10.5, 4.2, 1, 2, sharey=True, grid="major")
    ticks = [0, 1, 10, 100, 1e3, 1e4]
    for axis, across in zip(axes, (True, False), strict=True):
        _forces(axis, [trial for trial in trials if trial.across == across])
        axis.axvline(EFFECTIVE_MASS, color=GREY, lw=1)
        at = {"xycoords": ("data", "axes fraction"), "fontsize": 8, "ha": "right", "rotation": 90}
        axis.annotate("m_eff", (EFFECTIVE_MASS, 0.5), **at)
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xticks(ticks, ["0", "1", "10", "100", "1000", "10000"])
        title = "k along and across the contacts (paper)" if across else "k along the normals only"
        label(axis, "dissipation k (kg)", title=title, xlim=(-0.1, 1.5e4))
    axes[0].set(ylabel="force (kN)", ylim=(0, None))
    legend_below(figure, axes[0], 6)
    return figure


def _forces(axis: Axes, trials: Sequence[Trial]) -> None:
    series = (
        ("largest n·p/τ", [t.forces.max() for t in trials], "s-", ORANGE),
        ("95 % of n·p/τ", [np.quantile(t.forces, 0.95) for t in trials], "D-", BLUE),
        ("mean n·p/τ", [t.forces.mean() for t in trials], "o-", BLACK),
        ("largest λ/τ", [t.reactions.max() for t in trials], "s--", ORANGE),
        ("mean λ/τ", [t.reactions.mean() for t in trials], "o--", BLACK),
    )
    for words, values, style, colour in series:
        face = "none" if "--" in style else colour
        kilonewton, k = np.array(values) / 1e3, [trial.dissipation for trial in trials]
        axis.plot(k, kilonewton, style, color=colour, mfc=face, ms=5, label=words)


def seeds(crowds: Mapping[str, Sequence[Sample]]) -> Figure:
    """Draw where the maxima lie, and the sum of magnitudes against the distance, a row for each
    kind of crowd."""
    figure, every = panels(9.5, 3.2 * len(crowds) + 0.4, len(crowds), 2, sharex="col")
    for position, profile, (kind, samples) in zip(
        every[::2], every[1::2], crowds.items(), strict=True
    ):
        _draw_positions(position, samples)
        _profile(profile, samples)
        for axes in (position, profile):
            x = "distance from the middle of the exit (m)" if axes in every[-2:] else ""
            label(axes, x, title=f"{len(samples)} {kind}")
    label(every[0], legend="upper right")
    label(every[1], legend="best")
    return figure


def _draw_positions(axes: Axes, samples: Sequence[Sample]) -> None:
    sums, vectors = (_numbers(samples, f"{of}distance_m") for of in ("", "resultant_"))
    bins = np.arange(0.0, max(*sums, *vectors) + BIN_M, BIN_M).tolist()
    filled: dict[str, Any] = {"color": BLUE, "edgecolor": BLACK, "alpha": 0.9}
    hatched: dict[str, Any] = {"color": "none", "edgecolor": ORANGE, "lw": 1.5, "hatch": "///"}
    axes.hist(sums, bins, **filled, label="largest sum of magnitudes")
    axes.hist(vectors, bins, **hatched, label="largest vector sum")
    axes.axvline(NEIGHBOURHOOD_M, color=BLACK, ls=":", label=f"{NEIGHBOURHOOD_M:g} m")
    axes.set_ylabel("crowds")
    axes.locator_params(axis="y", integer=True)
    axes.set_ylim(0, 1.45 * axes.get_ylim()[1])


def _profile(axes: Axes, samples: Sequence[Sample]) -> None:
    count = min(len(s["profile"]) for s in samples)
    values = np.array([s["profile"][:count] for s in samples])
    ring = (np.arange(count) + 0.5) * RING_M
    axes.plot(ring, values.T, color=GREY, lw=0.7)
    mean, spread = np.nanmean(values, 0), np.nanstd(values, 0)
    words = "mean and standard deviation"
    axes.errorbar(ring, mean, spread, fmt="o-", color=BLUE, capsize=3, label=words)
    label(axes, y="sum of magnitudes / mean", ylim=(0, None))


def sizes(samples: Sequence[Sample]) -> Figure:
    """Draw how mean, maximum and the place of the maximum change with the number of people."""
    figure, (forces, distances) = panels(9.5, 3.8, 1, 2)
    groups = _by_people(samples)
    for axes, name, style, colour, words in (
        (forces, "largest_N", "s--", ORANGE, "largest sum of magnitudes"),
        (forces, "mean_N", "o-", BLUE, "mean sum of magnitudes"),
        (forces, "largest_resultant_N", "D:", BLACK, "largest vector sum"),
        (distances, "reach_m", "^-.", BLUE, "farthest person"),
        (distances, "distance_m", "s--", ORANGE, "largest sum of magnitudes"),
        (distances, "resultant_distance_m", "D:", BLACK, "largest vector sum"),
    ):
        values = [_numbers(same, name) for same in groups.values()]
        means, spreads = [v.mean() for v in values], [v.std() for v in values]
        appearance = {"fmt": style, "color": colour, "capsize": 3, "ms": 5, "label": words}
        axes.errorbar(list(groups), means, spreads, **appearance)
    label(forces, y="force (N)", log="y")
    forces.set_ylim(top=20 * forces.get_ylim()[1])
    label(distances, y="distance from the middle of the exit (m)")
    for axes in (forces, distances):
        label(axes, "people", log="x", legend="upper left")
        ticks_at(axes, groups)
    return figure


# Readings of “the force is maximum”: the distance of the maximum, and what is meant.
READINGS = {
    "resultant_distance_m": "the vector sum of a person's contact forces",
    "distance_m": "the sum of the normal magnitudes at a person",
    "contact_distance_m": "the force of a single contact",
}
# Kinds of random crowds.
HEAPS = "heaps, whose exit has just opened"
FLOWING = "crowds that have flowed for 2 s"
BLOCKED = "crowds at rest behind a blocked exit"
Crowds = Mapping[str, Sequence[Sample]]
# Relative differences (rms) below which p/τ is an engine's force, and is like it.
EXACT, ALIKE = 1e-3, 0.1
# Changes of the sums of magnitudes beyond this are another behaviour.
DIFFERENT = 0.1
# Contacts are maintained in part where fewer than this share of them open.
FEW = 0.1
SHOWN = (10.0, 37.5, 300.0, 1e3, 1e4)  # kg, of the dissipations


def positions(words: Words, crowds: Crowds) -> list[Claim]:
    """Judge “the force is maximum in the neighbourhood of the exit” in each reading."""
    pressed = {kind: samples for kind, samples in crowds.items() if kind != BLOCKED}
    found = [position_claim(words, pressed, name, quantity) for name, quantity in READINGS.items()]
    return [*found, rings(words, crowds)]


def _in_each(
    words: Words, block: str, crowds: Crowds, judge: Callable[..., Any], **values: Any
) -> Claim:
    """Judge each kind of crowd; it holds where it does in every kind, fails where it does in every
    kind."""
    found = [{"kind": kind, "all": len(some)} | judge(some) for kind, some in crowds.items()]
    verdicts = {kind["verdict"] for kind in found}
    verdict = verdicts.pop() if len(verdicts) == 1 else Verdict.PARTLY
    return words.claim(block, verdict, crowds=found, **values)


def position_claim(words: Words, crowds: Crowds, distance: str, quantity: str) -> Claim:
    """Judge one reading in each kind of crowd: it holds where it does in all of the crowds, in part
    where in half of them or more."""

    def judge(samples: Sequence[Sample]) -> dict[str, Any]:
        at = _numbers(samples, distance)
        near = int((at <= NEIGHBOURHOOD_M).sum())
        verdict = Verdict.of(near == len(at), 2 * near >= len(at))
        return {"near": near, "verdict": verdict, "median": np.median(at)}

    values = {"quantity": quantity, "neighbourhood": NEIGHBOURHOOD_M}
    return _in_each(words, "place", crowds, judge, **values)


def rings(words: Words, crowds: Crowds) -> Claim:
    """Judge the same of the mean sum of magnitudes in rings of 1 m: it holds if the ring at the
    exit has the largest mean in all of the crowds, in part if the largest lies within 2 m in half
    of them or more."""

    def judge(samples: Sequence[Sample]) -> dict[str, Any]:
        peaks = np.array([int(np.nanargmax(s["profile"])) for s in samples])
        first, near = int((peaks == 0).sum()), int((peaks <= 1).sum())
        verdict = Verdict.of(first == len(peaks), 2 * near >= len(peaks))
        return {"first": first, "near": near, "verdict": verdict}

    return _in_each(words, "rings", crowds, judge, ring=RING_M)


def contact_forces(
    words: Words, kind: str, comparisons: Mapping[float, Sequence[Comparison]]
) -> Claim:
    """Judge “percussions are contact forces” against an engine's forces, by stiffness (N/m).

    In part where they agree to EXACT (rms) at the contacts whose force the mechanics fixes, whole
    where those of the stiffest contacts agree to ALIKE at all contacts, too."""
    found: list[dict[str, float]] = []
    for stiffness, runs in sorted(comparisons.items()):
        numbers = [statistics(comparison) for comparison in runs]
        one = {"stiffness": stiffness, "fixed": sum(n["determined_contacts"] for n in numbers)}
        one["contacts"] = sum(n["rigid_contacts"] for n in numbers)
        for name in ("determined", "contact"):
            one[name] = max(n[f"{name}_relative_difference"] for n in numbers)
        found.append(one)
    exact = max(each["determined"] for each in found) < EXACT
    verdict = Verdict.of(exact and found[-1]["contact"] < ALIKE, exact)
    return words.claim("contact_forces", verdict, kind=kind, found=found)


def maintained(words: Words, arch: Arch, crowds: Crowds) -> Claim:
    """Judge “contacts are maintained”: holds where none opens and none pulls, in part where few
    open."""
    opening, contacts, force = arch.opening(), len(arch.contacts), maintained_forces(arch)
    pulling = int((force < -1e-9 * np.abs(force).max()).sum())
    fractions = {
        kind: sum(s["opening"] for s in samples) / sum(s["contacts"] for s in samples)
        for kind, samples in crowds.items()
    }
    few = max([opening / contacts, *fractions.values()]) < FEW
    verdict = Verdict.of(opening == 0 and pulling == 0, few)
    counts = {"opening": opening, "pulling": pulling, "contacts": contacts}
    return words.claim("maintained", verdict, shares=fractions, **counts)


def dissipation_claim(words: Words, trials: Sequence[Trial]) -> Claim:
    """Judge “different behaviour” by k: holds where it shows up to the k at which a pair opens."""
    paper = [trial for trial in trials if trial.across]
    change = changes(paper)
    moderate = max(value for k, value in change.items() if k <= EFFECTIVE_MASS)
    strong = max(change.values())
    shown = [(k, value) for k, value in change.items() if k in SHOWN]
    verdict = Verdict.of(moderate >= DIFFERENT, strong >= DIFFERENT)
    return words.claim("dissipation", verdict, shown=shown)


def dissipation_table(words: Words, trials: Sequence[Trial]) -> Table:
    """Tabulate forces, interval and energy by dissipation."""
    rows: list[Sequence[Cell]] = []
    for trial in trials:
        force, reaction, solution = trial.forces, trial.reactions, trial.arch.solution
        forces = force.mean(), np.quantile(force, 0.95), force.max(), force.min()
        reactions = reaction.mean(), reaction.max()
        pressed = trial.arch.carried()[trial.most], trial.arch.distance()[trial.most]
        numbers = *forces, *reactions, *pressed, trial.upper - trial.lower, trial.energy_share
        acts = "along and across" if trial.across else "along only"
        status = "; ".join([str(solution.status), *solution.warnings])
        rows.append((acts, trial.dissipation, status, *map(float, numbers)))
    return words.table("table_dissipation", rows)


def seeds_table(words: Words, kind: str, samples: Sequence[Sample]) -> Table:
    """Tabulate mean, spread and range of each quantity over arches of one size."""
    columns = {name: _numbers(samples, name) for name in samples[0] if name != "profile"}
    quantities = (
        ("mean sum of normal magnitudes (N)", columns["mean_N"]),
        ("largest sum of normal magnitudes (N)", columns["largest_N"]),
        ("width of its interval (N)", columns["upper_N"] - columns["lower_N"]),
        ("its distance from the middle of the exit (m)", columns["distance_m"]),
        ("its angle from the axis of the exit, size (°)", abs(columns["angle_degrees"])),
        ("largest contact force (N)", columns["largest_contact_N"]),
        ("its distance (m)", columns["contact_distance_m"]),
        ("largest vector sum (N)", columns["largest_resultant_N"]),
        ("its distance (m)", columns["resultant_distance_m"]),
        ("share of contacts that open", columns["opening"] / columns["contacts"]),
        ("redundant contacts", columns["redundant"]),
        ("largest overlap / mean diameter", columns["overlap_share"]),
    )
    measures = (np.mean, np.std, np.min, np.median, np.max)
    rows: list[Sequence[Cell]] = [
        (quantity, *(float(measure(of)) for measure in measures)) for quantity, of in quantities
    ]
    return words.table("table_seeds", rows, kind=kind, shown=samples)


def sizes_table(words: Words, samples: Sequence[Sample]) -> Table:
    """Tabulate means over the arches of each number of people."""
    rows: list[Sequence[Cell]] = []
    for people, same in _by_people(samples).items():
        reach, contacts, mean, largest, at, vector, vector_at, redundant, overlap = (
            float(_numbers(same, name).mean()) for name in SIZED
        )
        forces = mean, largest, float(_numbers(same, "largest_N").std()), at, vector, vector_at
        packing = redundant, overlap, sum(s["solved"] for s in same)
        rows.append((people, len(same), reach, contacts / people, *forces, *packing))
    return words.table("table_sizes", rows)


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowd by every engine, and the random ones; without an engine none of the latter."""
    wanted = pressed_crowd.arch_runs(read_scene("arch"), runs) + survey_runs(runs)
    return wanted + pressed_crowd.blocked_runs(runs)


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build figure 4. `runs` keeps the engine runs; an engine that is missing becomes a warning."""
    try:
        found = pressed_crowd.arch_study(read_scene("arch"), runs, progress)
    except EngineError as error:
        return pressed_crowd.without_crowd("4", Words(__name__).text("title"), str(error))
    missing: list[str] = []
    samples = survey(runs, missing, progress)
    jams = [jam for jam in pressed_crowd.blocked(runs, missing, progress) if jam.at_rest]
    section = _section(found, samples, jams, heaps(progress))
    return replace(section, warnings=[*missing, *section.warnings])


def _section(
    found: Study, samples: Sequence[Sample], jams: Sequence[Blocked], grown: Sequence[Sample]
) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    trials = dissipation_trials(arch)
    soft = [jam for jam in jams if jam.stiffness == pressed_crowd.STIFFNESSES[0]]
    crowds = {
        HEAPS: grown,
        FLOWING: [s for s in samples if s["people"] == PEOPLE],
        BLOCKED: [sample_of(jam.arch, jam.seed) for jam in soft],
    }
    crowds = {kind: some for kind, some in crowds.items() if some}
    words = Words(__name__, arch=arch, grown=grown)
    crowd = pressed_crowd.crowd_parts(arch, found, "fig_4_", "arch")
    (snapshot, engines), (maxima, by_engine) = crowd.pictures, crowd.tables
    pictures = [
        snapshot,
        words.picture("fig_4_dissipation", dissipation(trials)),
        engines,
        words.picture("fig_4_seeds", seeds(crowds)),
    ]
    every = [maxima, dissipation_table(words, trials), by_engine]
    every += [seeds_table(words, kind, some) for kind, some in crowds.items()]
    if len(_by_people(samples)) > 1:
        pictures.append(words.picture("fig_4_sizes", sizes(samples)))
        every.append(sizes_table(words, samples))
    stiffness = found.scene.contact.stiffness_N_per_m
    stiffnesses = pressed_crowd.STIFFNESSES
    at_rest = {k: [jam.comparison for jam in jams if jam.stiffness == k] for k in stiffnesses}
    return words.section(
        "4",
        crowd=crowd.words[0],
        stopped=(len(soft), len(pressed_crowd.BLOCKED_SEEDS)),
        pictures=pictures,
        tables=every,
        claims=[
            *([contact_forces(words, BLOCKED, at_rest)] if all(at_rest.values()) else ()),
            contact_forces(words, "a crowd that flows", {stiffness: found.comparisons}),
            *positions(words, crowds),
            maintained(words, arch, crowds),
            dissipation_claim(words, trials),
        ],
        warnings=[*crowd.warnings, *warnings_of([*samples, *grown]), *_trial_warnings(trials)],
    )


def _numbers(samples: Sequence[Sample], name: str) -> Floats:
    return np.array([s[name] for s in samples], dtype=np.float64)


def _by_people(samples: Sequence[Sample]) -> dict[int, list[Sample]]:
    """The arches of each number of people, fewest first."""
    return dict(sorted(grouped(samples, itemgetter("people")).items()))


def _trial_warnings(trials: Sequence[Trial]) -> list[str]:
    names = (f"k = {t.dissipation:g} kg{'' if t.across else ', normal only'}" for t in trials)
    named = [(name, t.arch.solution) for name, t in zip(names, trials, strict=True)]
    return unsolved(named) + [f"{name}: {words}" for name, a in named for words in a.warnings]
