"""What the paper says of its arch, judged on random ones and under other laws."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from analysis.compare.comparison import Comparison
from analysis.compare.statistics import statistics
from analysis.pages.section import Claim, Verdict
from analysis.pages.words import Words
from analysis.paper.discrete.fig4_arch.dissipation import EFFECTIVE_MASS, Maintained, Trial, changes
from analysis.paper.discrete.fig4_arch.random_crowds import Sample
from analysis.paper.discrete.pressed_crowd.arch import NEIGHBOURHOOD_M, RING_M, Arch

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


def places(words: Words, crowds: Crowds) -> list[Claim]:
    """Judge “the force is maximum in the neighbourhood of the exit” in each reading."""
    pressed = {kind: samples for kind, samples in crowds.items() if kind != BLOCKED}
    found = [place(words, pressed, name, quantity) for name, quantity in READINGS.items()]
    return [*found, rings(words, crowds)]


def _of_all(verdicts: Iterable[Verdict]) -> Verdict:
    """Holds where it does in every kind of crowd, fails where it does in every kind."""
    every = list(verdicts)
    holds, fails = (
        all(one == verdict for one in every) for verdict in (Verdict.HOLDS, Verdict.FAILS)
    )
    return Verdict.of(holds, not fails)


def place(words: Words, crowds: Crowds, distance: str, quantity: str) -> Claim:
    """Judge one reading in each kind of crowd: it holds where it does in all of the crowds, in part
    where in half of them or more."""
    found: list[dict[str, Any]] = []
    for kind, samples in crowds.items():
        at = np.array([getattr(s, distance) for s in samples])
        near, middle, far = (int((at <= radius).sum()) for radius in (NEIGHBOURHOOD_M, 2.0, 3.0))
        verdict = Verdict.of(near == len(at), 2 * near >= len(at))
        counts: dict[str, Any] = {"near": near, "middle": middle, "far": far, "all": len(at)}
        found.append(counts | {"kind": kind, "verdict": verdict, "median": np.median(at)})
    verdict = _of_all(kind["verdict"] for kind in found)
    return words.claim(
        "place", verdict, quantity=quantity, neighbourhood=NEIGHBOURHOOD_M, crowds=found
    )


def rings(words: Words, crowds: Crowds) -> Claim:
    """Judge the same of the mean sum of magnitudes in rings of 1 m: it holds if the ring at the
    exit has the largest mean in all of the crowds, in part if the largest lies within 2 m in half
    of them or more."""
    found: list[dict[str, Any]] = []
    for kind, samples in crowds.items():
        peaks = np.array([int(np.nanargmax(s.profile)) for s in samples])
        first, near = int((peaks == 0).sum()), int((peaks <= 1).sum())
        verdict = Verdict.of(first == len(peaks), 2 * near >= len(peaks))
        shown = range(min(3, *(len(s.profile) for s in samples)))
        levels = [float(np.nanmean([s.profile[ring] for s in samples])) for ring in shown]
        counts: dict[str, Any] = {"first": first, "near": near, "all": len(peaks)}
        found.append(counts | {"kind": kind, "verdict": verdict, "levels": levels})
    verdict = _of_all(kind["verdict"] for kind in found)
    return words.claim("rings", verdict, ring=RING_M, crowds=found)


def contact_forces(
    words: Words, kind: str, comparisons: Mapping[float, Sequence[Comparison]]
) -> Claim:
    """Judge “percussions are contact forces” against an engine's forces, by stiffness (N/m).

    In part where they agree to EXACT (rms) at the contacts whose force the mechanics fixes, whole
    where those of the stiffest contacts agree to ALIKE at all contacts, too."""
    found = []
    for stiffness, runs in sorted(comparisons.items()):
        numbers = [statistics(comparison) for comparison in runs]
        worst = {
            name: max(n[f"{name}_relative_difference"] for n in numbers)
            for name in ("determined", "contact", "disk_vector")
        }
        fixed, contacts = (
            sum(n[name] for n in numbers) for name in ("determined_contacts", "rigid_contacts")
        )
        counts = {"stiffness": stiffness, "runs": len(runs), "fixed": fixed, "contacts": contacts}
        found.append(counts | worst)
    exact = max(each["determined"] for each in found) < EXACT
    verdict = Verdict.of(exact and found[-1]["contact"] < ALIKE, exact)
    every = [comparison for runs in comparisons.values() for comparison in runs]
    moving = max(comparison.balance.unbalanced for comparison in every)
    return words.claim("contact_forces", verdict, kind=kind, found=found, moving=moving)


def maintained(words: Words, arch: Arch, pull: Maintained, crowds: Crowds) -> Claim:
    """Judge “contacts are maintained”: holds where none opens and none pulls, in part where few
    open."""
    opening, contacts = arch.opening(), len(arch.contacts)
    shares = {
        kind: sum(s.opening for s in samples) / sum(s.contacts for s in samples)
        for kind, samples in crowds.items()
    }
    few = max([opening / contacts, *shares.values()]) < FEW
    verdict = Verdict.of(opening == 0 and pull.pulling == 0, few)
    return words.claim("maintained", verdict, opening=opening, contacts=contacts, shares=shares)


def dissipation(words: Words, trials: Sequence[Trial]) -> Claim:
    """Judge “different behaviour” by k: holds where it shows up to the k at which a pair opens."""
    paper = [trial for trial in trials if trial.across]
    change = changes(paper)
    moderate = max(value for k, value in change.items() if k <= EFFECTIVE_MASS)
    strong = max(change.values())
    normal = changes([trial for trial in trials if not trial.across])[EFFECTIVE_MASS]
    without, at_pair = (
        next(t.forces for t in paper if t.dissipation == k) for k in (0.0, EFFECTIVE_MASS)
    )
    return words.claim(
        "dissipation",
        Verdict.of(moderate >= DIFFERENT, strong >= DIFFERENT),
        shown=[(k, value) for k, value in change.items() if k in SHOWN],
        effective=EFFECTIVE_MASS,
        moderate=moderate,
        contact=abs(at_pair.max() / without.max() - 1),
        mean=abs(at_pair.mean() / without.mean() - 1),
        normal=normal,
    )
