"""What the paper says of its arch, judged on random ones and under other laws."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
# Changes of the sums of magnitudes beyond this are another behaviour.
DIFFERENT = 0.1
# Contacts are maintained in part where fewer than this share of them open.
FEW = 0.1
SHOWN = (10.0, 37.5, 300.0, 1e3, 1e4)  # kg, of the dissipations


def places(words: Words, samples: Sequence[Sample]) -> list[Claim]:
    """Judge “the force is maximum in the neighbourhood of the exit” in each reading."""
    found = [place(words, samples, name, quantity) for name, quantity in READINGS.items()]
    return [*found, rings(words, samples, "crowds that flow")]


def place(words: Words, samples: Sequence[Sample], distance: str, quantity: str) -> Claim:
    """Judge one reading: it holds where it does in all of the arches, in part where in half of them
    or more."""
    at = np.array([getattr(s, distance) for s in samples])
    near = int((at <= NEIGHBOURHOOD_M).sum())
    verdict = Verdict.of(near == len(at), 2 * near >= len(at))
    return words.claim(
        "place",
        verdict,
        quantity=quantity,
        neighbourhood=NEIGHBOURHOOD_M,
        within={r: int((at <= r).sum()) for r in (NEIGHBOURHOOD_M, 2.0, 3.0)},
        at=at,
        median=np.median(at),
        share=np.mean([s.near_share for s in samples]),
        reach=np.mean([s.reach_m for s in samples]),
    )


def rings(words: Words, samples: Sequence[Sample], kind: str) -> Claim:
    """Judge the same of the mean sum of magnitudes in rings of 1 m: it holds if the ring at the
    exit has the largest mean in all of the samples, in part if the largest lies within 2 m in half
    of them or more."""
    peaks = np.array([int(np.nanargmax(s.profile)) for s in samples])
    first, near = int((peaks == 0).sum()), int((peaks <= 1).sum())
    shown = min(3, min(len(s.profile) for s in samples))
    return words.claim(
        "rings",
        Verdict.of(first == len(peaks), first == len(peaks) or 2 * near >= len(peaks)),
        kind=kind,
        ring=RING_M,
        first=first,
        near=near,
        arches=len(peaks),
        levels=[float(np.nanmean([s.profile[ring] for s in samples])) for ring in range(shown)],
    )


def maintained(words: Words, arch: Arch, pull: Maintained) -> Claim:
    """Judge “contacts are maintained”: holds where none opens and none pulls."""
    opening, contacts = arch.opening(), len(arch.contacts)
    held = opening == 0 and pull.pulling == 0
    verdict = Verdict.of(held, held or opening < FEW * contacts)
    return words.claim("maintained", verdict, opening=opening, contacts=contacts)


def dissipation(words: Words, trials: Sequence[Trial]) -> Claim:
    """Judge “different behaviour” by k: holds where it shows up to the k at which a pair opens."""
    paper = [trial for trial in trials if trial.across]
    change = changes(paper)
    moderate = max(value for k, value in change.items() if k <= EFFECTIVE_MASS)
    strong = max(change.values())
    at_pair = next(t for t in paper if t.dissipation == EFFECTIVE_MASS).forces.max()
    return words.claim(
        "dissipation",
        Verdict.of(moderate >= DIFFERENT, strong >= DIFFERENT),
        shown=[(k, value) for k, value in change.items() if k in SHOWN],
        effective=EFFECTIVE_MASS,
        moderate=moderate,
        contact=abs(at_pair / paper[0].forces.max() - 1),
    )
