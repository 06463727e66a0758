"""What the paper says of its arches, judged on random ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import kruskal

from analysis.pages.section import Claim, Verdict
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import NEIGHBOURHOOD_M, RING_M, Arch
from analysis.paper.discrete.fig4_fig5_arches.random_crowds import Sample
from nscd.arrays import Floats


def place_claim(samples: Sequence[Sample], distance: str, quantity: str) -> Claim:
    """“The force is maximum in the neighbourhood of the exit”: holds where it does in all of the
    arches, in part where in half of them or more."""
    places = np.array([getattr(s, distance) for s in samples])
    near = int((places <= NEIGHBOURHOOD_M).sum())
    verdict = (
        Verdict.HOLDS
        if near == len(places)
        else Verdict.PARTLY
        if 2 * near >= len(places)
        else Verdict.FAILS
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
    """The same of the mean sum of magnitudes in rings of 1 m: it holds if the ring at the exit has
    the largest mean in all of the samples, in part if the largest lies within 2 m in half of them
    or more."""
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
    """“Not uniform with respect to the distance to the exit”: the rings of 1 m differ beyond chance
    (Kruskal–Wallis, p < 10⁻³) and their means by half or more; in part if only the first is so."""
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
