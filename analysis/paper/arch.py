"""Figures 4 and 5 of the paper: a crowd pressed to an exit, with equal and with unequal masses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from scipy.stats import kruskal

from analysis.charts import BLACK, BLUE, ENGINE_NAMES, GREY, ORANGE, engine_label
from analysis.compare import Comparison, correlation, relative_difference
from analysis.engines import ENGINES, EngineError
from analysis.paper.arch_seeds import (
    BLOCKED_SEEDS,
    NEIGHBOURHOOD_M,
    PEOPLE,
    RING_M,
    Arch,
    Sample,
    blocked,
    carried_interval,
    growth,
    seeds_picture,
    seeds_table,
    sizes_picture,
    sizes_table,
    survey,
    warnings_of,
)
from analysis.paper.section import Cell, Claim, Picture, Progress, Section, Table, Verdict
from analysis.scene import Scene, read_scene
from analysis.study import Study, study
from nscd import ContactLaw, Percussions, Snapshot
from nscd.bodies import Floats
from nscd.indeterminacy import admissible_determinacy, determinacy

# kg; two people of 75 kg have the effective mass 37.5 kg
DISSIPATIONS = (0.0, 1.0, 3.0, 10.0, 30.0, 37.5, 100.0, 300.0, 1e3, 1e4)
EFFECTIVE_MASS = 37.5


def build(runs: Path, progress: Progress | None = None) -> list[Section]:
    """The sections of Figs. 4 and 5. `runs` keeps the engine runs; an engine that is missing becomes a warning."""
    scenes = [read_scene(name) for name in ("arch", "arch_masses")]
    studies = [_study(scene, runs, progress) for scene in scenes]
    samples: list[Sample] = []
    jams: list[Sample] = []
    missing: list[str] = []
    try:
        samples = survey(runs, progress)
        jams = blocked(runs, progress)
    except EngineError as error:
        missing.append(f"random arches: {error}")
    sections = []
    for number, scene, found in zip(("4", "5"), scenes, studies, strict=True):
        if isinstance(found, str):
            sections.append(
                Section(
                    number=number, title=scene.title, words=(), pictures=(), tables=(), differs=(), warnings=(found,)
                )
            )  # fmt: skip
        elif number == "4":
            sections.append(_equal(found, samples, jams, missing))
        else:
            sections.append(_unequal(found, None if isinstance(studies[0], str) else studies[0]))
    return sections


def _study(scene: Scene, runs: Path, progress: Progress | None) -> Study | str:
    try:
        engines = [engine.NAME for engine in ENGINES]
        return study(scene, engines, [scene.contact.stiffness_N_per_m], runs, progress)
    except EngineError as error:
        return str(error)


def _equal(
    found: Study, samples: Sequence[Sample], jams: Sequence[Sample], missing: Sequence[str]
) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    trials = dissipation_trials(arch)
    pull = Maintained.of(arch)
    opening = arch.contacts.approach_velocity(arch.answer.right_velocity) < -1e-6
    same = [s for s in samples if s.people == PEOPLE]
    pictures = [
        snapshot_picture(arch, "fig_4_arch"), _dissipation_picture(trials), engines_picture(found.comparisons, "fig_4_engines"),
    ]  # fmt: skip
    tables = [_maxima_table(arch), _dissipation_table(trials), _engines_table(found.comparisons)]
    claims = [
        _maintained_claim(len(arch.contacts), int(opening.sum()), pull),
        _dissipation_claim(trials),
    ]
    words = _snapshot_words(arch, found)
    if same:
        pictures.append(seeds_picture(same))
        tables.append(
            seeds_table(same, f"{len(same)} random arches of {PEOPLE} people of 75 kg, still flowing")
        )
        claims = [
            place_claim(same, "resultant_distance_m", "the vector sum of a person's contact forces"),
            place_claim(same, "distance_m", "the sum of the normal magnitudes at a person"),
            place_claim(same, "contact_distance_m", "the force of a single contact"),
            ring_claim(same, "crowds that flow"),
            *claims,
        ]
    if jams:
        tables.append(
            seeds_table(
                jams,
                f"Exits that an arch really blocks: {jams[0].people} disks of 0.30 m (scene `jam`), "
                f"{len(jams)} of {len(BLOCKED_SEEDS)} crowds came to rest",
            )
        )
        claims.append(ring_claim(jams, "crowds at rest behind a blocked exit"))
    if len({s.people for s in samples}) > 1:
        pictures.append(sizes_picture(samples))
        tables.append(sizes_table(samples))
        words.append(_growth_words(samples))
    gained = sum(t.arch.answer.energy_change > 0 for t in trials)
    words.append(
        f"Energy was gained in {gained} of {len(trials)} impacts with dissipation k from 0 to "
        f"{DISSIPATIONS[-1]:g} kg; the balance closes to {max(t.arch.answer.energy_error for t in trials):.0e}."
    )
    printed = arch.left_velocity - arch.contacts.momentum_change(
        arch.answer.reaction[:, None] * arch.contacts.normal, len(arch.snapshot)
    )
    violation = float(arch.contacts.approach_velocity(printed).max())
    kept = float(arch.contacts.approach_velocity(arch.answer.right_velocity).max())
    differs = [
        f"(7) prints u⁺ = u⁻ + Cᵀλ. With these λ the disks would run into each other at up to {violation:.3g} m/s; "
        f"u⁺ = u⁻ − M⁻¹Cᵀλ leaves at most {kept:.1e} m/s.",
        f"(8) keeps every contact closed, W λ = C u⁻. Its shortest solution pulls in {pull.pulling} of "
        f"{len(arch.contacts)} contacts, by up to {pull.strongest_N / 1e3:.3g} kN ({pull.total_N / 1e3:.4g} kN in all), and "
        f"pushes with up to {pull.push_N / 1e3:.3g} kN. With 0 ≤ λ ⟂ −C u⁺ ≥ 0 nothing pulls, the largest push is "
        f"{arch.normal_forces().max() / 1e3:.3g} kN, and {int(opening.sum())} contacts open. (8) is also badly conditioned: the "
        f"least singular value of C M^(-1/2) is {pull.spread:.1e} of the largest, and W squares that. "
        f"`ContactLaw(maintained=True)` answers: {pull.answer.status}, residual {pull.answer.residual:.1e}.",
        "A percussion is not a force: f = p/τ with the relaxation time τ of the drive, which the paper leaves out.",
        "“Norm of the contact force applied on each pedestrian” can be the vector sum or the sum of magnitudes: both are shown.",
        "The paper prints neither positions nor radii, and not how its arch came about. This crowd was gathered by a penalty "
        "model and is still flowing, so that overlaps of up to "
        f"{arch.overlap_share():.2g} of a diameter stand in the positions; the percussions take overlapping disks as touching.",
        "4d does not say which k were tried, nor whether k acts across contacts too: both are shown.",
    ]
    return Section(
        number="4",
        title="An arch at the exit, equal masses",
        words=words,
        pictures=pictures,
        tables=tables,
        differs=differs,
        claims=claims,
        warnings=[*found.warnings, *missing, *warnings_of(samples), *_trial_warnings(trials), *_own_warnings(arch)],
    )  # fmt: skip


def _unequal(found: Study, equal: Study | None) -> Section:
    arch = Arch.of(found.scene, found.comparisons[0].snapshot)
    archs = {"unequal masses": arch}
    tables = [_maxima_table(arch), _engines_table(found.comparisons)]
    words = _snapshot_words(arch, found)
    if equal is not None:
        other = Arch.of(equal.scene, equal.comparisons[0].snapshot)
        archs["equal masses"] = other
        swapped = Arch.of(equal.scene, _with_masses(other.snapshot, found.scene.snapshot))
        inside = other.inside()
        a, b = other.carried()[inside], swapped.carried()[inside]
        words.append(
            f"On the arch of equal masses itself, the unequal masses alone (mean {swapped.snapshot.mass.mean():.1f} kg) change "
            f"the sums of magnitudes by {relative_difference(a, b):.0%} (rms; correlation {correlation(a, b):.3f}), their mean "
            f"from {a.mean():.0f} to {b.mean():.0f} N and their maximum from {a.max() / 1e3:.1f} to {b.max() / 1e3:.1f} kN "
            f"({swapped.answer.status})."
        )
    tables.append(_rings_table(archs))
    return Section(
        number="5",
        title="An arch at the exit, unequal masses",
        words=words,
        pictures=[
            snapshot_picture(arch, "fig_5_arch_masses"),
            _rings_picture(archs),
            engines_picture(found.comparisons, "fig_5_engines"),
        ],
        tables=tables,
        differs=[
            "The paper does not print the masses: whole kilograms, uniform between 50 and 100 kg.",
            "“The pressure” is taken as the sum of the normal magnitudes at a person.",
        ],
        claims=[
            uniformity_claim(arch, np.hypot(*arch.answer.right_velocity.T), "the speed on the right", "m/s"),
            uniformity_claim(arch, arch.carried(), "the pressure", "N"),
        ],
        warnings=[*found.warnings, *_own_warnings(arch)],
    )  # fmt: skip


def _with_masses(snapshot: Snapshot, source: Snapshot) -> Snapshot:
    """The snapshot with the masses that the people of the same ids have in `source`."""
    assert snapshot.ids is not None
    assert source.ids is not None
    order = np.argsort(source.ids)
    return replace(snapshot, mass=source.mass[order][np.searchsorted(source.ids[order], snapshot.ids)])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maintained:
    """What the equality W λ = C u⁻ (paper (2), (8)) asks of an arch. Of its shortest solution λ/τ: how many contacts are
    pulling, strongest_N and total_N of the pulls, push_N the largest push; spread: least over largest singular value of
    C M^(-1/2), zeros left out; answer: the percussions with `maintained=True`."""

    pulling: int
    strongest_N: float  # noqa: N815  (the unit is newton)
    total_N: float  # noqa: N815
    push_N: float  # noqa: N815
    spread: float
    answer: Percussions

    @classmethod
    def of(cls, arch: Arch) -> Maintained:
        """By singular values of the dense M^(-1/2) Cᵀ, which do not square the condition as W does."""
        root = np.sqrt(np.repeat(arch.snapshot.mass, 2))
        matrix = arch.contacts.normal_matrix(len(arch.snapshot)).toarray().T / root[:, None]
        reaction, _, rank, values = np.linalg.lstsq(matrix, root * arch.left_velocity.ravel(), rcond=1e-10)
        force = reaction / arch.window
        pulls = np.minimum(force, 0.0)
        return cls(
            pulling=int((force < -1e-9 * np.abs(force).max()).sum()),
            strongest_N=float(-pulls.min()),
            total_N=float(-pulls.sum()),
            push_N=float(force.max()),
            spread=float(values[rank - 1] / values[0]),
            answer=arch.under(ContactLaw(maintained=True)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """The arch under a law: dissipation k (kg), whether it acts across contacts too (the paper's single k), the arch with
    that answer, and the proven interval (N) of Σ λ/τ at the person who carries most."""

    dissipation: float
    across: bool
    arch: Arch
    most: int
    lower: float
    upper: float

    @property
    def forces(self) -> Floats:
        """n·p/τ (k,) N."""
        return self.arch.normal_forces()

    @property
    def reactions(self) -> Floats:
        """λ/τ (k,) N."""
        return self.arch.answer.reaction / self.arch.window

    @property
    def energy_share(self) -> float:
        """ΔE/E⁻ of the impact: −1 where all of the left velocity's energy is lost, > 0 where energy was gained."""
        mass, left = self.arch.snapshot.mass, self.arch.left_velocity
        return self.arch.answer.energy_change / (0.5 * float(mass @ (left**2).sum(1)))


def dissipation_trials(arch: Arch, dissipations: Sequence[float] = DISSIPATIONS) -> list[Trial]:
    """The arch with each k, along and across the contacts (paper (1)) and along the normals only."""
    trials = []
    for across in (True, False):
        for k in dissipations:
            law = ContactLaw(dissipation=k, tangential_dissipation=None if across else 0.0)
            tried = replace(arch, answer=arch.under(law))
            most = tried.largest(tried.carried())
            lower, upper = carried_interval(tried, most)
            trials.append(
                Trial(dissipation=k, across=across, arch=tried, most=most, lower=lower, upper=upper)
            )
    return trials


def place_claim(samples: Sequence[Sample], distance: str, quantity: str) -> Claim:
    """“The force is maximum in the neighbourhood of the exit”: holds where it does in all of the arches, in part where
    in half of them or more."""
    places = np.array([getattr(s, distance) for s in samples])
    near = int((places <= NEIGHBOURHOOD_M).sum())
    verdict = (
        Verdict.HOLDS if near == len(places) else Verdict.PARTLY if 2 * near >= len(places) else Verdict.FAILS
    )
    within = [f"{r:g} m in {int((places <= r).sum())}" for r in (2.0, 3.0)]
    return Claim(
        where="2.3.1, Fig. 4",
        statement=f"“the force is maximum in the neighborhood of the exit”, read as {quantity}",
        verdict=verdict,
        reason=f"The maximum is within {NEIGHBOURHOOD_M:g} m of the middle of the exit in {near} of {len(places)} random "
        f"arches (within {', within '.join(within)}); {np.mean([s.near_share for s in samples]):.1%} of the people are there. "
        f"Its distance: median {np.median(places):.2f} m, from {places.min():.2f} to {places.max():.2f} m, in crowds that "
        f"reach to {np.mean([s.reach_m for s in samples]):.1f} m.",
    )


def ring_claim(samples: Sequence[Sample], kind: str) -> Claim:
    """The same of the mean sum of magnitudes in rings of 1 m: it holds if the ring at the exit has the largest mean in all
    of the samples, in part if the largest lies within 2 m in half of them or more."""
    peaks = np.array([int(np.nanargmax(s.profile)) for s in samples])
    first, near = int((peaks == 0).sum()), int((peaks <= 1).sum())
    part = Verdict.PARTLY if 2 * near >= len(peaks) else Verdict.FAILS
    rings = range(min(3, min(len(s.profile) for s in samples)))
    level = [f"{np.nanmean([s.profile[ring] for s in samples]):.2f}" for ring in rings]
    return Claim(
        where="2.3.1, Fig. 4",
        statement=f"“the force is maximum in the neighborhood of the exit”, read as the mean over people, {kind}",
        verdict=Verdict.HOLDS if first == len(peaks) else part,
        reason=f"Of the means of rings of {RING_M:g} m, that within 1 m of the middle of the exit is the largest in {first} of "
        f"{len(peaks)} arches, one within 2 m in {near}. Means of the first rings over the mean of the arch: "
        f"{', '.join(level)}.",
    )


def uniformity_claim(arch: Arch, values: Floats, quantity: str, unit: str) -> Claim:
    """“Not uniform with respect to the distance to the exit”: the rings of 1 m differ beyond chance (Kruskal–Wallis,
    p < 10⁻³) and their means by half or more; in part if only the first is so."""
    ring = arch.rings()
    groups = [values[ring == r] for r in range(int(ring.max()) + 1) if (ring == r).sum() >= 5]
    means = np.array([group.mean() for group in groups])
    chance = float(kruskal(*groups).pvalue) if np.ptp(np.concatenate(groups)) > 0 else 1.0
    ratio = float(means.max() / max(means.min(), np.finfo(float).tiny)) if means.max() > 0 else 1.0
    scatter = float(np.mean([group.std() / group.mean() for group in groups if group.mean() > 0]))
    verdict = Verdict.FAILS
    if chance < 1e-3:
        verdict = Verdict.HOLDS if ratio >= 1.5 else Verdict.PARTLY
    return Claim(
        where="2.3.1, Fig. 5",
        statement="“neither the speed on the right nor the pressure are uniform with respect to the distance to the exit”: "
        + quantity,
        verdict=verdict,
        reason=f"Means of rings of {RING_M:g} m lie between {means.min():.3g} and {means.max():.3g} {unit}, a factor of "
        f"{ratio:.1f} (equal rings: p = {chance:.1e}, Kruskal–Wallis); people at the same distance differ by {scatter:.0%} "
        "(standard deviation over mean).",
    )


def _maintained_claim(contacts: int, opening: int, pull: Maintained) -> Claim:
    held = opening == 0 and pull.pulling == 0
    return Claim(
        where="2.1, (2), (8)",
        statement="“For a dense crowd, contacts are maintained”: C u⁺ = 0",
        verdict=Verdict.HOLDS if held else Verdict.PARTLY if opening < 0.1 * contacts else Verdict.FAILS,
        reason=f"{opening} of {contacts} contacts open when reactions only push. Held shut, {pull.pulling} of them pull, "
        f"with up to {pull.strongest_N / 1e3:.3g} kN.",
    )


def _dissipation_claim(trials: Sequence[Trial]) -> Claim:
    paper = [t for t in trials if t.across]
    start = paper[0].arch.carried()
    change = {t.dissipation: relative_difference(start, t.arch.carried()) for t in paper}
    moderate = max(value for k, value in change.items() if k <= EFFECTIVE_MASS)
    strong = max(change.values())
    verdict = Verdict.HOLDS if moderate >= 0.1 else Verdict.PARTLY if strong >= 0.1 else Verdict.FAILS
    at_pair = next(t for t in paper if t.dissipation == EFFECTIVE_MASS).forces.max()
    listed = "; ".join(
        f"{value:.1%} at {k:g} kg" for k, value in change.items() if k in (10.0, 37.5, 300.0, 1e3, 1e4)
    )
    return Claim(
        where="2.3.1, Fig. 4d",
        statement="“different behavior according to the calibration of the coefficient of dissipation k”",
        verdict=verdict,
        reason=f"The sums of magnitudes change from those at k = 0 by {listed} (rms). Up to k = m_eff = {EFFECTIVE_MASS:g} kg, "
        f"where a pair is still inelastic, the change is at most {moderate:.1%}; the largest force of a contact changes by "
        f"{abs(at_pair / paper[0].forces.max() - 1):.1%} there.",
    )


def _snapshot_words(arch: Arch, found: Study) -> list[str]:
    inside, distance = arch.inside(), arch.distance()
    near = inside & (distance <= 3.0)
    known = determinacy(arch.contacts, len(arch.snapshot))
    allowed = admissible_determinacy(arch.contacts, arch.answer)
    carried, resultant = arch.carried(), arch.resultants()
    most, most_vector = arch.largest(carried), arch.largest(resultant)
    lower, upper = carried_interval(arch, most)
    drive = arch.snapshot.mass * np.hypot(*arch.left_velocity.T) / arch.window
    back = found.comparisons[0]
    sure = int(allowed.determined.sum())
    where, where_vector = f"{distance[most]:.2f} m", f"{distance[most_vector]:.2f} m"
    fixed = "determined" if upper - lower < 1e-6 * upper else "not determined"
    return [
        f"{inside.sum()} of {len(inside)} people are still inside after {found.scene.analysis.time_s:g} s, "
        f"{near.sum() / (4.5 * np.pi):.1f} per m² within 3 m of the exit. Gathered by {_engine_name(back)}; "
        f"{back.unbalanced:.0%} of the drive still accelerates people.",
        "The vector sum at a person is m |u⁺ − u⁻|/τ, whatever the pressing: for people at rest it is the drive, "
        f"{drive.mean():.0f} N on average. Inside, its mean is {resultant[inside].mean():.0f} N, its maximum "
        f"{resultant[most_vector]:.0f} N at {where_vector} from the middle of the exit.",
        f"The sum of magnitudes shows the pressing: its mean is {carried[inside].mean():.0f} N, its maximum "
        f"{carried[most]:.0f} N at {where}, {arch.angle_degrees()[most]:.0f}° from the axis of the exit. The maximum lies in "
        f"the proven interval [{lower:.1f}, {upper:.1f}] N: it is {fixed}. Vector sums always are determined.",
        f"{len(arch.contacts)} contacts, rank {known.rank}: {known.redundant} redundant. Balance alone determines "
        f"{known.determined.sum()} forces, balance of forces that only push {sure}; the other {len(arch.contacts) - sure} "
        "are those of least elastic energy.",
    ]


def _growth_words(samples: Sequence[Sample]) -> str:
    def power(name: str) -> str:
        return f"N^{growth(samples, [getattr(s, name) for s in samples]):.2f}"

    return (
        f"With the number N of people the mean sum of magnitudes grows like {power('mean_N')}, the largest like "
        f"{power('largest_N')}, its distance from the exit like {power('distance_m')} (the crowd itself: {power('reach_m')}) and "
        f"the largest vector sum like {power('largest_resultant_N')}."
    )


def _own_warnings(arch: Arch) -> list[str]:
    found = arch.answer
    return (
        [] if found.status == "solved" else [f"percussions of the snapshot: {found.status}: {found.reason}"]
    )


def _trial_warnings(trials: Sequence[Trial]) -> list[str]:
    out = []
    for trial in trials:
        answer, name = (
            trial.arch.answer,
            f"k = {trial.dissipation:g} kg{'' if trial.across else ', normal only'}",
        )
        if answer.status != "solved":
            out.append(f"{name}: {answer.status}: {answer.reason}")
        out.extend(f"{name}: {warning}" for warning in answer.warnings)
    return out


def _engine_name(comparison: Comparison) -> str:
    record = comparison.record
    return f"{ENGINE_NAMES[record.engine]}, k = {comparison.scene.contact.stiffness_N_per_m:.3g} N/m"


def _maxima_table(arch: Arch) -> Table:
    rows: list[Sequence[Cell]] = []
    carried, resultant, inside = arch.carried(), arch.resultants(), arch.inside()
    for name, values in (("sum of normal magnitudes", carried), ("vector sum", resultant)):
        most = arch.largest(values)
        middle, high = (float(v) for v in np.quantile(values[inside], (0.5, 0.95)))
        rows.append(
            (
                name, float(values[inside].mean()), middle, high, float(values[most]), float(arch.distance()[most]),
                float(arch.angle_degrees()[most]), int(arch.snapshot.ids[most]),  # type: ignore[index]
            )
        )  # fmt: skip
    head = ("force on a person, p/τ", "mean (N)", "median (N)", "95 % (N)", "largest (N)", "its distance (m)",
            "its angle (°)", "person")  # fmt: skip
    return Table(caption="Forces on the people inside, percussions with k = 0", head=head, rows=rows)


def _rings_table(archs: dict[str, Arch]) -> Table:
    rows: list[Sequence[Cell]] = []
    for name, arch in archs.items():
        ring, speed = arch.rings(), np.hypot(*arch.answer.right_velocity.T)
        for r in range(int(ring.max()) + 1):
            at = ring == r
            if at.any():
                values = [float(v[at].mean()) for v in (speed, arch.carried(), arch.resultants())]
                rows.append((name, f"{r * RING_M:g} – {(r + 1) * RING_M:g}", int(at.sum()), *values))
    head = ("arch", "distance from the middle of the exit (m)", "people", "speed u⁺ (m/s)", "sum of magnitudes (N)",
            "vector sum (N)")  # fmt: skip
    return Table(caption="Means of rings", head=head, rows=rows)


def _dissipation_table(trials: Sequence[Trial]) -> Table:
    rows = []
    for trial in trials:
        force, reaction, answer = trial.forces, trial.reactions, trial.arch.answer
        rows.append(
            (
                "along and across" if trial.across else "along only", trial.dissipation, float(force.mean()),
                *(float(v) for v in np.quantile(force, (0.5, 0.95))), float(force.max()), float(force.min()),
                float(reaction.mean()), float(reaction.max()), float(trial.arch.carried()[trial.most]),
                float(trial.arch.distance()[trial.most]), float(trial.arch.angle_degrees()[trial.most]),
                trial.upper - trial.lower, answer.energy_change, trial.energy_share,
                "; ".join([str(answer.status), *answer.warnings]),
            )
        )  # fmt: skip
    head = ("k acts", "k (kg)", "n·p/τ: mean (N)", "median (N)", "95 % (N)", "largest (N)", "least (N)", "λ/τ: mean (N)",
            "largest (N)", "largest sum of magnitudes (N)", "its distance (m)", "its angle (°)",
            "width of the interval of its Σλ/τ (N)", "ΔE (J)", "ΔE / E⁻", "status")  # fmt: skip
    return Table(
        caption="Influence of the dissipation k, the same arch; pulls are dissipation at contacts that open",
        head=head,
        rows=rows,
    )


def _engines_table(comparisons: Sequence[Comparison]) -> Table:
    rows = []
    for comparison in comparisons:
        penalty, rigid = comparison.disk_sums()
        distance = Arch.of(comparison.scene, comparison.snapshot).distance()
        rows.append(
            (
                _engine_name(comparison), float(penalty.mean()), float(rigid.mean()), float(penalty.max()),
                float(distance[penalty.argmax()]), float(rigid.max()), float(distance[rigid.argmax()]),
                correlation(penalty, rigid), relative_difference(penalty, rigid), comparison.unbalanced,
                str(comparison.answer.status),
            )
        )  # fmt: skip
    head = ("engine", "mean (N)", "percussions: mean (N)", "largest (N)", "its distance (m)", "percussions: largest (N)",
            "its distance (m)", "correlation", "relative difference (rms)", "share of the drive that accelerates",
            "percussions")  # fmt: skip
    return Table(
        caption="Sum of normal magnitudes at each person, engine against percussions p/τ on the same snapshot",
        head=head,
        rows=rows,
    )


def snapshot_picture(arch: Arch, name: str) -> Picture:
    """Configuration, right velocities, and force on each person: vector sum and sum of magnitudes."""
    figure = Figure(figsize=(10.5, 11.0), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    speed = np.hypot(*arch.answer.right_velocity.T)
    panels = (
        ("(a) configuration and contact forces", None, "n·p/τ of a contact (N)"),
        ("(b) right velocity u⁺", speed, "speed (m/s)"),
        ("(c) force on each person: vector sum", arch.resultants(), "|Σ p|/τ (N)"),
        ("(c′) force on each person: sum of magnitudes", arch.carried(), "Σ |n·p|/τ (N)"),
    )
    for axis, (title, values, label) in zip(axes, panels, strict=True):
        shown = arch.normal_forces() if values is None else values[arch.inside()]
        norm = Normalize(0.0, float(np.quantile(shown, 0.99)))
        _draw_people(axis, arch, values, norm)
        axis.set_title(title, fontsize=10)
        figure.colorbar(ScalarMappable(norm, "viridis_r"), ax=axis, shrink=0.8, extend="max", label=label)
    _draw_forces(axes[0], arch)
    moving = speed > 0.05 * np.quantile(speed, 0.9)
    axes[1].quiver(
        *arch.snapshot.position[moving].T, *arch.answer.right_velocity[moving].T, angles="xy", scale_units="xy", scale=4.0,
        width=0.0025, color=BLACK,
    )  # fmt: skip
    for axis, values in zip(axes[2:], (arch.resultants(), arch.carried()), strict=True):
        most = arch.snapshot.position[arch.largest(values)]
        axis.annotate(
            "largest",
            most,
            (0.4, np.copysign(max(abs(most[1]) + 0.6, 1.6), most[1])),
            fontsize=9,
            arrowprops={"arrowstyle": "->", "color": BLACK, "lw": 1.5},
        )
    return Picture(
        name=name,
        figure=figure,
        caption="(a) The crowd and its percussions as forces p/τ. (b) Right velocities: arrows are a quarter of a second long. "
        "(c) Vector sum of the contact forces on each person: it balances the drive or accelerates, whatever the pressing. "
        " (c′) Sum of their normal magnitudes: how hard one is pressed. Colours end at the 99th percentile.",
    )


def _draw_people(axes: Axes, arch: Arch, values: Floats | None, norm: Normalize) -> None:
    position, radius = arch.snapshot.position, arch.snapshot.radius
    disks = PatchCollection(
        [Circle((x, y), r) for (x, y), r in zip(position, radius, strict=True)], edgecolor="#777777", linewidth=0.3
    )  # fmt: skip
    if values is None:
        disks.set_facecolor("#F4F4F4")
    else:
        disks.set(array=values, cmap="viridis_r", norm=norm)
    axes.add_collection(disks)
    (x0, y0), (x1, y1) = arch.drive.door_start_m, arch.drive.door_end_m
    along = np.array([x1 - x0, y1 - y0])
    ends = np.array([[x0, y0], [x1, y1]])
    walls = np.stack([ends, ends + 50.0 * np.stack([-along, along])], axis=1)
    axes.add_collection(LineCollection(list(walls), colors=BLACK, linewidths=2.5))
    reach = position[arch.inside()]
    low, high = reach.min(0) - 0.5, np.maximum(reach.max(0), (1.5, -np.inf)) + 0.5
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="y (m)")


def _draw_forces(axes: Axes, arch: Arch) -> None:
    contacts, force = arch.contacts, arch.normal_forces()
    start, end = arch.snapshot.position[contacts.first], contacts.point.copy()
    pairs = ~contacts.is_wall
    end[pairs] = arch.snapshot.position[contacts.second[pairs]]
    order, top = np.argsort(force), float(np.quantile(force, 0.99))
    axes.add_collection(
        LineCollection(
            list(np.stack([start, end], axis=1)[order]), array=force[order], cmap="viridis_r", norm=Normalize(0.0, top),
            linewidths=list(0.3 + 3.0 * np.clip(force[order] / top, 0.0, 1.2)),
        )
    )  # fmt: skip


def engines_picture(comparisons: Sequence[Comparison], name: str) -> Picture:
    """Sum of magnitudes at each person: percussions against each engine."""
    figure = Figure(figsize=(4.6 * len(comparisons), 5.0), layout="constrained")
    for number, comparison in enumerate(comparisons):
        axes = figure.add_subplot(1, len(comparisons), number + 1)
        penalty, rigid = (values / 1e3 for values in comparison.disk_sums())
        near = Arch.of(comparison.scene, comparison.snapshot).distance() <= NEIGHBOURHOOD_M
        top = 1.05 * float(max(penalty.max(), rigid.max()))
        axes.plot([0, top], [0, top], color=BLACK, lw=0.8, label="equal")
        axes.plot(penalty[~near], rigid[~near], "o", ms=3.5, mfc="none", mec=BLUE, mew=0.7, label="farther")
        axes.plot(
            penalty[near],
            rigid[near],
            "s",
            ms=5,
            color=ORANGE,
            mec=BLACK,
            mew=0.5,
            label=f"within {NEIGHBOURHOOD_M:g} m of the exit",
        )
        axes.set(
            xlim=(0, top), ylim=(0, top), aspect="equal", xlabel="engine (kN)", ylabel="percussions, p/τ (kN)"
        )
        axes.set_title(engine_label(comparison), fontsize=10)
        axes.legend(fontsize=8, loc="upper left")
    caption = "Sum of the normal magnitudes at each person: penalty models against percussions on the same snapshot."
    return Picture(name=name, figure=figure, caption=caption)  # fmt: skip


def _dissipation_picture(trials: Sequence[Trial]) -> Picture:
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    axes = figure.subplots(1, 2)
    ticks = [0, 1, 10, 100, 1e3, 1e4]
    for axis, across in zip(axes, (True, False), strict=True):
        chosen = [t for t in trials if t.across == across]
        k = [t.dissipation for t in chosen]
        series = (
            ("largest n·p/τ", [t.forces.max() for t in chosen], "s-", ORANGE),
            ("95 % of n·p/τ", [np.quantile(t.forces, 0.95) for t in chosen], "D-", BLUE),
            ("mean n·p/τ", [t.forces.mean() for t in chosen], "o-", BLACK),
            ("largest λ/τ", [t.reactions.max() for t in chosen], "s--", ORANGE),
            ("mean λ/τ", [t.reactions.mean() for t in chosen], "o--", BLACK),
            ("strongest pull, −n·p/τ", [max(-t.forces.min(), 0.0) for t in chosen], "v:", BLUE),
        )
        for label, values, style, colour in series:
            axis.plot(
                k,
                np.array(values) / 1e3,
                style,
                color=colour,
                mfc="none" if "--" in style else colour,
                ms=5,
                label=label,
            )
        axis.axvline(EFFECTIVE_MASS, color=GREY, lw=1)
        axis.annotate(
            "m_eff",
            (EFFECTIVE_MASS, 0.5),
            xycoords=("data", "axes fraction"),
            fontsize=8,
            ha="right",
            rotation=90,
        )
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xticks(ticks, ["0", "1", "10", "100", "1000", "10000"])
        axis.set(xlabel="dissipation k (kg)", ylabel="force (kN)", xlim=(-0.1, 1.5e4))
        axis.set_title(
            "k along and across the contacts (paper)" if across else "k along the normals only", fontsize=10
        )
        axis.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8)
    caption = (
        "(d) Normal percussions and reactions, as forces, against the dissipation k; people feel the whole p."
    )
    return Picture(name="fig_4_dissipation", figure=figure, caption=caption)  # fmt: skip


def _rings_picture(archs: dict[str, Arch]) -> Picture:
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2)
    styles = {"unequal masses": ("s-", ORANGE, "."), "equal masses": ("o--", BLUE, "x")}
    for name, arch in archs.items():
        style, colour, dot = styles[name]
        ring, inside, distance = arch.rings(), arch.inside(), arch.distance()
        for axis, values in zip(
            panels, (np.hypot(*arch.answer.right_velocity.T), arch.carried() / 1e3), strict=True
        ):
            axis.plot(distance[inside], values[inside], dot, ms=3, color=colour, alpha=0.35)
            held = [r for r in range(int(ring.max()) + 1) if (ring == r).any()]
            axis.plot([(r + 0.5) * RING_M for r in held], [values[ring == r].mean() for r in held], style, color=colour,
                      mec=BLACK, label=f"{name}: mean of rings of {RING_M:g} m")  # fmt: skip
    for axis, label in zip(panels, ("right speed |u⁺| (m/s)", "sum of normal magnitudes (kN)"), strict=True):
        axis.set(xlabel="distance from the middle of the exit (m)", ylabel=label, ylim=(0, None))
        axis.legend(fontsize=8, loc="upper right")
    caption = "Speed on the right and force against the distance to the exit; small dots: each person."
    return Picture(name="fig_5_rings", figure=figure, caption=caption)  # fmt: skip
