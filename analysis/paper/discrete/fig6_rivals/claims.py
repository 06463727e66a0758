"""What the paper says of its rivals, each statement tried on the same chains and crowds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analysis.compare.statistics import correlation, relative_difference
from analysis.pages.section import Claim, Verdict
from analysis.pages.words import Words
from analysis.paper.discrete.fig6_rivals.chains import ChainForces
from analysis.paper.discrete.fig6_rivals.congestion import Congestion
from analysis.paper.discrete.fig6_rivals.crowds import (
    FIRST_ORDER,
    PERCUSSIONS,
    PRINTED,
    SOCIAL,
    TEXT,
    ArchForces,
    BeyondTouch,
    WithoutOverlap,
)
from analysis.paper.discrete.fig6_rivals.evacuation import DIAMETER_M, Evacuation
from nscd.rivals import SocialForceLaw

ROUNDING = 1e-6
# An overlap below this share of a diameter is not seen in a picture.
SEEN = 0.01
NOTICEABLE, LARGE = 0.01, 0.1
LAW = SocialForceLaw()


def special_case(words: Words, equal: ChainForces, unequal: ChainForces) -> Claim:
    """Judge whether (4) is the percussions where all masses are equal."""
    special, unlike = (relative_difference(c.percussion, c.first_order) for c in (equal, unequal))
    verdict = Verdict.of(special < ROUNDING)
    return words.claim("special_case", verdict, special=special, unlike=unlike, mass=unequal.mass)


def constant_in_a_chain(words: Words, equal: ChainForces, unequal: ChainForces) -> Claim:
    """Judge whether the social force is constant along a chain: touching, and at rest."""
    both = (equal, unequal)
    touching = max(float(np.abs(chain.social / LAW.strength - 1).max()) for chain in both)
    rest = equal.social_at_rest
    return words.claim(
        "constant_in_a_chain",
        Verdict.of(touching < ROUNDING, bool(np.ptp(rest) / LAW.strength < LARGE)),
        law=LAW,
        touching=touching,
        section=np.ptp(equal.social_section) / LAW.strength,
        rest=rest,
        difference=relative_difference(equal.percussion, rest),
        gap=1e3 * equal.gap_at_rest,
    )


def restrictive_mass(words: Words, unequal: ChainForces, arches: Sequence[ArchForces]) -> Claim:
    """Judge whether equal masses restrict the first-order model: it counts as holding where every
    difference is large, in part where one is noticeable."""
    chain = relative_difference(unequal.percussion, unequal.first_order)
    first = np.abs(unequal.first_order / unequal.percussion - 1)
    crowds = []
    parts = [chain]
    for arch in (a for a in arches if a.unequal_masses):
        a, b = arch.by_law[PERCUSSIONS], arch.by_law[FIRST_ORDER]
        each = {
            "contact": relative_difference(a.contact, b.contact),
            "carried": relative_difference(a.carried, b.carried),
            "resultant": relative_difference(a.resultant.ravel(), b.resultant.ravel()),
        }
        parts += each.values()
        most = np.abs(b.contact - a.contact).max()
        crowds.append(
            each | {"name": arch.scene.name, "most": most, "speed": arch.speed_difference}
        )
    return words.claim(
        "restrictive_mass",
        Verdict.of(max(parts) > NOTICEABLE, min(parts) > LARGE),
        chain=chain,
        first=first,
        crowds=crowds,
        large=LARGE,
        noticeable=NOTICEABLE,
    )


def complete_congestion(words: Words, found: Sequence[Congestion]) -> Claim:
    """Judge whether equal masses are why the first-order model stops everybody: it does on the
    blocked crowds, and percussions of unequal masses let somebody go."""
    draws = sum(len(one.unequal) for one in found)
    freed = sum(one.freed for one in found)
    return words.claim(
        "complete_congestion",
        Verdict.of(all(one.congests for one in found), 2 * freed >= draws),
        found=found,
        congests=sum(one.congests for one in found),
        draws=draws,
        freed=freed,
        fastest=max(max(one.unequal) for one in found),
    )


def constant_without_overlap(words: Words, arch: ArchForces, apart: WithoutOverlap) -> Claim:
    """Judge whether the social force is constant in a crowd without overlaps, `apart`."""
    spread = float(np.ptp(apart.contact)) / LAW.strength
    uneven = float(apart.carried.std() / apart.carried.mean())
    thinner = 1 - float(apart.carried_apart.mean() / apart.carried.mean())
    constant = max(spread, apart.friction / LAW.strength) < ROUNDING
    return words.claim(
        "constant_without_overlap",
        Verdict.of(constant, max(uneven, thinner) < LARGE),
        arch=arch,
        apart=apart,
        social=arch.by_law[SOCIAL].contact,
        spread=spread,
        near=int((apart.beyond > 0.01 * LAW.strength).sum()),
        beyond=1 - apart.carried_by_touching.sum() / apart.carried.sum(),
        uneven=uneven,
        thinner=thinner,
    )


def no_overlap(words: Words, evacuations: Sequence[Evacuation]) -> Claim:
    """Judge whether nobody overlaps in the evacuation by the social force model, at each desired
    speed: true where the deepest overlap of half of the looks at least is SEEN of a diameter or
    less."""
    found: list[dict[str, Any]] = []
    for speed in sorted({one.speed for one in evacuations}):
        mine = [one for one in evacuations if one.speed == speed]
        deepest = np.concatenate([one.deepest for one in mine])
        forces = np.concatenate([one.forces for one in mine])
        counts = {"speed": speed, "runs": len(mine), "touching": np.mean(deepest > 0)}
        sizes = {
            "median": np.median(deepest),
            "most": deepest.max(),
            "force": forces.max(initial=0),
        }
        found.append(counts | sizes)
    clear = [each["median"] <= SEEN * DIAMETER_M for each in found]
    verdict = Verdict.of(all(clear), any(clear))
    return words.claim("no_overlap", verdict, found=found, law=LAW, diameter=DIAMETER_M)


def unrealistic(words: Words, arch: ArchForces) -> Claim:
    """Judge whether the social force is blind to how the crowd presses."""
    reference, social = arch.by_law[PERCUSSIONS], arch.by_law[SOCIAL]
    value = correlation(reference.contact, social.contact)
    verdict = Verdict.of(value < 0.5, social.spread < 0.5 * reference.spread)
    return words.claim(
        "unrealistic", verdict, arch=arch, value=value, social=social, reference=reference
    )


def surface(words: Words, overlap: float, radii: tuple[float, float], ratio: float) -> Claim:
    """Judge whether (9) sees the size of a contact: `ratio` of its forces at the same overlap (m)
    for disks of two radii (m)."""
    half = 0.5 * overlap
    chords = [2 * float(np.sqrt(2 * radius * half - half**2)) for radius in radii]
    return words.claim(
        "surface",
        Verdict.of(abs(ratio - 1) < ROUNDING, abs(chords[1] / chords[0] - 1) > NOTICEABLE),
        overlap=1e3 * overlap,
        radii=radii,
        ratio=ratio,
        chords=[1e3 * chord for chord in chords],
    )


def non_zero_apart(
    words: Words, beyond: Mapping[str, BeyondTouch], reach: float, jump: float
) -> Claim:
    """Judge whether (10) acts without a contact; `beyond` up to a gap of `reach` (m), `jump` the
    ratio of the printed law's forces just beyond and at touch."""
    printed, text = beyond[PRINTED], beyond[TEXT]
    verdict = Verdict.of(printed.share > 0, text.share > 0)
    return words.claim(
        "non_zero_apart", verdict, printed=printed, text=text, reach=reach, jump=jump
    )
