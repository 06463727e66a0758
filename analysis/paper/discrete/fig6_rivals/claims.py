"""What the paper says of its rivals, each statement tried on the same chains and crowds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.compare.statistics import correlation, relative_difference
from analysis.pages.section import Claim, Verdict
from analysis.paper.discrete.fig6_rivals.on_chains import ChainForces, gap_that_carries
from analysis.paper.discrete.fig6_rivals.on_crowds import (
    FIRST_ORDER,
    PERCUSSIONS,
    PRINTED,
    SOCIAL,
    TEXT,
    ArchForces,
    WithoutOverlap,
)
from nscd.rivals import SocialForceLaw

ROUNDING = 1e-6
NOTICEABLE, LARGE = 0.01, 0.1


def verdict(*held: bool) -> Verdict:
    """Holds where every part held, in part where some did."""
    return Verdict.HOLDS if all(held) else Verdict.PARTLY if any(held) else Verdict.FAILS


def chain_claims(equal: ChainForces, unequal: ChainForces) -> list[Claim]:
    """Statements that a chain decides."""
    law = SocialForceLaw()
    special = relative_difference(equal.percussion, equal.first_order)
    unlike = relative_difference(unequal.percussion, unequal.first_order)
    touching = max(
        float(np.abs(chain.social / law.strength - 1).max()) for chain in (equal, unequal)
    )
    section = float(np.ptp(equal.social_section)) / law.strength
    rest = relative_difference(equal.percussion, equal.social_at_rest)
    low, high = float(equal.social_at_rest.min()), float(equal.social_at_rest.max())
    return [
        Claim(
            where="2.3.1",
            statement="By choosing the matrix inertia equal to the identity, eq. (4) is a special case of the "
            "proposed approach",
            verdict=verdict(special < ROUNDING),
            reason=f"For equal masses λ·m of (4), solved with λ ≥ 0, and the percussion differ by {special:.1e} "
            "(rms, relative) "
            f"along the chain; for {unequal.mass.min():g} to {unequal.mass.max():g} kg by {100 * unlike:.1f} %. The "
            "λ of (4) "
            "is a velocity: it becomes an impulse only by a mass, and there is one only if all masses are equal.",
        ),
        Claim(
            where="2.3.2",
            statement="In the constrained chain the contact force of (9) is constant throughout the chain, of intensity A",
            verdict=verdict(touching < ROUNDING, (high - low) / law.strength < LARGE),
            reason=f"At exact touch each contact gives A = {law.strength:g} N (relative error {touching:.0e}); with "
            "pairs that do "
            f"not touch, the force across a section varies by {100 * section:.2f} % of A. But a touching chain is "
            "not at rest under "
            f"(9): where its forces balance the drive they run from {low:,.0f} to {high:,.0f} N and differ from the "
            "percussions "
            f"by {100 * rest:.2f} % (rms), with gaps from {1e3 * equal.gap_at_rest.max():.0f} mm to "
            f"{1e3 * equal.gap_at_rest.min():.1f} mm. The constant comes from the geometry that was put in, not from "
            "the law.",
        ),
    ]


def mass_claim(unequal: ChainForces, arches: Sequence[ArchForces]) -> Claim:
    """Whether equal masses restrict the first-order model."""
    parts = [relative_difference(unequal.percussion, unequal.first_order)]
    first = unequal.first_order / unequal.percussion - 1
    worst = int(np.argmax(np.abs(first)))
    words = (
        f"With λ m̄/τ, chain of unequal masses: {100 * parts[0]:.1f} % (rms) per contact, at most "
        f"{100 * abs(first[worst]):.1f} % "
        f"(contact {worst + 1}); the wall's load is right, since it is the sum of all masses."
    )
    for arch in (a for a in arches if np.ptp(a.snapshot.mass) > ROUNDING * a.snapshot.mass.mean()):
        a, b = arch.by_law[PERCUSSIONS], arch.by_law[FIRST_ORDER]
        contact = relative_difference(a.contact, b.contact)
        carried = relative_difference(a.carried, b.carried)
        resultant = relative_difference(a.resultant.ravel(), b.resultant.ravel())
        parts += [contact, carried, resultant]
        words += (
            f" Crowd {arch.scene.name}: {100 * contact:.1f} % per contact (at most "
            f"{np.abs(b.contact - a.contact).max():,.0f} N), {100 * carried:.1f} % in the sum of magnitudes at a disk, "
            f"{100 * resultant:.1f} % in the vector sum; right velocities are {100 * arch.speed_difference:.1f} % of "
            "u_d off."
        )
    return Claim(
        where="2.3.1",
        statement='The hypothesis "pedestrians have the same mass m = 1 kg" is restrictive',
        verdict=verdict(max(parts) > NOTICEABLE, min(parts) > LARGE),
        reason=f"{words} It counts as holding where every difference is beyond {100 * LARGE:g} %, in part where one "
        "is beyond "
        f"{100 * NOTICEABLE:g} %.",
    )


def arch_claims(arch: ArchForces, apart: WithoutOverlap) -> list[Claim]:
    """Statements about the social force that a pressed crowd decides; `apart` is the same crowd
    without overlaps."""
    law = SocialForceLaw()
    percussion, social = arch.by_law[PERCUSSIONS].contact, arch.by_law[SOCIAL].contact
    over = float((percussion > law.strength).mean())
    depth = -gap_that_carries(max(float(percussion.max()), law.strength), law)
    spread = float(np.ptp(apart.contact)) / law.strength
    near = int((apart.beyond > 0.01 * law.strength).sum())
    from_beyond = 1 - float(apart.carried_by_touching.sum() / apart.carried.sum())
    uneven = float(apart.carried.std() / apart.carried.mean())
    thinner = 1 - float(apart.carried_apart.mean() / apart.carried.mean())
    return [
        Claim(
            where="2.3.2",
            statement="There is no overlap, so that by (9) the contact forces are constant independently of the masses, "
            "positions, desired velocities and the density of the crowd",
            verdict=verdict(
                max(spread, apart.friction / law.strength) < ROUNDING, max(uneven, thinner) < LARGE
            ),
            reason=f"On {arch.scene.name}, moved apart until nobody overlaps, {len(apart.contact)} touching contacts "
            "all give A "
            f"within {100 * spread:.0e} % with friction of {apart.friction:.2g} N (largest displacement "
            f"{1e3 * apart.moved:.0f} mm). But "
            f"{near} pairs that "
            f"do not touch still give more than 1 % of A, and {100 * from_beyond:.0f} % of what a disk carries comes "
            "from such pairs: the sum at a disk spreads by "
            f"{100 * uneven:.0f} % of its mean, and falls by {100 * thinner:.0f} % if all distances grow by 10 %. With the "
            f"overlaps of {arch.engine} ({-1e3 * arch.contacts.gap.min():.1f} mm at most) the contacts run from "
            f"{social.min():,.0f} to {social.max():,.0f} N and friction reaches {arch.sliding.max():,.0f} N.",
        ),
        Claim(
            where="2.3.2, Fig. 6",
            statement="In the evacuation by the social force model there is clearly no overlap between the pedestrians",
            verdict=verdict(
                over == 0.0, over < 0.5 and depth < 0.01 * 2 * float(arch.snapshot.radius.mean())
            ),
            reason=f"A contact without overlap gives at most A = {law.strength:g} N. In the pressed crowd "
            f"{100 * over:.0f} % of "
            f"the contacts must carry more (up to {percussion.max():,.0f} N); the largest needs {1e3 * depth:.0f} mm "
            "of overlap "
            f"under (9), {100 * depth / (2 * float(arch.snapshot.radius.mean())):.0f} % of a diameter. Counted as "
            "true in part where "
            "fewer than half of the contacts overlap and none by more than 1 % of a diameter.",
        ),
    ]


def correlation_claim(arch: ArchForces) -> Claim:
    """Whether the social force is blind to how the crowd presses."""
    reference, social = arch.by_law[PERCUSSIONS], arch.by_law[SOCIAL]
    value = correlation(reference.contact, social.contact)
    spread = float(social.contact.std() / social.contact.mean())
    true = float(reference.contact.std() / reference.contact.mean())
    return Claim(
        where="2.3.2",
        statement="The contact force of (9) of course is not realistic (it does not tell who is pressed)",
        verdict=verdict(value < 0.5, spread < 0.5 * true),
        reason=f"On {arch.scene.name} with {arch.engine}'s overlaps its correlation with the percussions is "
        f"{value:.2f}, as its "
        f"body force reads the overlaps that the pressing made, but it spreads by {100 * spread:.0f} % of its mean where "
        f"percussions spread by {100 * true:.0f} %: a floor of A hides the pressing. Its parts: a correlation below "
        "0.5; less "
        "than half the spread.",
    )


def surface_claim(overlap: float, radii: tuple[float, float], ratio: float) -> Claim:
    """Whether (9) sees the size of a contact: `ratio` of its forces at the same overlap (m) for
    disks of two radii (m)."""
    chord = [2 * float(np.sqrt(2 * r * (overlap / 2) - (overlap / 2) ** 2)) for r in radii]
    return Claim(
        where="2.3.2",
        statement="With deformable disks the forces should be calculated over the entire contact surface and not at "
        "a single "
        "point, as in (9)",
        verdict=verdict(abs(ratio - 1) < ROUNDING, abs(chord[1] / chord[0] - 1) > NOTICEABLE),
        reason=f"As a description of (9): at an overlap of {1e3 * overlap:g} mm, disks of {radii[0]:g} m and "
        f"{radii[1]:g} m feel "
        f"forces in the ratio {ratio:.6f}, though their contacts are {1e3 * chord[0]:.0f} and {1e3 * chord[1]:.0f} "
        "mm long. Only "
        "the depth counts, not the surface.",
    )


def loehner_claims(
    beyond: Mapping[str, tuple[float, float, float]], reach: float, jump: float
) -> list[Claim]:
    """Statements about (10); `beyond` as of `loehner_beyond_touch` up to a gap of `reach` (m),
    `jump` the ratio of the printed law's forces just beyond and at touch."""
    printed, text = beyond[PRINTED], beyond[TEXT]
    return [
        Claim(
            where="2.3.2",
            statement="By (10) the contact force can be non-zero even if no contact takes place",
            verdict=verdict(printed[0] > 0, text[0] > 0),
            reason=f"Pairs that do not touch, up to a gap of {reach:g} m, give {100 * printed[0]:.0f} % of the sum "
            "of all forces "
            f"as printed and {100 * text[0]:.0f} % with the cases exchanged. As printed the push grows {jump:.3f}-fold at "
            "the moment the "
            f"two part. And who gives is not who receives: f_ij/f_ji reaches {printed[1]:.2f} for unequal radii and "
            "masses.",
        ),
    ]
