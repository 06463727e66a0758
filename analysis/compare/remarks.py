"""What a reader of a comparison must know, in sentences."""

import math

import numpy as np

from analysis.compare.comparison import Comparison
from analysis.dumps.impulses import FRAMES_NEEDED_FROM
from analysis.engines.rigid import NAME as RIGID

# Overlap over mean radius that a twentieth of the contacts may exceed: at 0.03 the loads of people
# in a snapshot of `arch` already differ by a third from its percussions.
DEEP = 0.03
# Restitutions that differ by less are the same to a reader.
ALIKE = 0.01


def remarks(comparison: Comparison) -> list[str]:
    """Say where the two models are not alike, and which numbers are not sharp."""
    record, law = comparison.record, comparison.law
    contact, words = comparison.scene.contact, []
    if record.engine == RIGID:
        words.append(
            "a rigid contact has no force at an instant: the engine's forces are means since the "
            "frame before, not like with like; compare two runs by windows"
        )
    if contact.friction != law.friction:
        words.append(
            f"the engine's contacts have friction {contact.friction:g}, the percussions "
            f"{law.friction:g}: the difference of the laws is in every number"
        )
    elif law.frictional:
        match = comparison.match
        words.append(
            f"both models have friction {law.friction:g}: the balance leaves forces open where "
            f"contacts stick, {int(match.determined.sum())} of {len(match.determined)} are "
            "determined"
        )
    if comparison.percussions.window is not None:
        deep = deep_overlap(comparison)
        if deep > DEEP:
            words.append(
                "this snapshot is not comparable contact by contact: of its overlaps one in twenty "
                f"is deeper than {deep:.2g} of the mean radius (at most {DEEP:g}), and percussions of so "
                "soft a crowd are not its forces; compare the run with a rigid one over windows: "
                "percussions compare RUN RIGID_RUN --window 0.1"
            )
    if comparison.percussions.window is None:
        rigid = law.restitution or 0.0
        if abs(contact.restitution - rigid) > ALIKE:
            words.append(
                f"the engine's contacts have restitution {contact.restitution:g}, the percussions "
                f"{rigid:g}: the difference of the laws is in every number"
            )
        least, most = record.restitution_least, record.restitution_most
        if max(abs(contact.restitution - least), abs(contact.restitution - most)) > ALIKE:
            words.append(
                f"restitution {contact.restitution:g} was asked; the engine's contacts have "
                f"{least:.3g} to {most:.3g}, since one dashpot serves all masses"
            )
        error = comparison.balance.closure_error
        if math.isfinite(error) and error > FRAMES_NEEDED_FROM:
            words.append(
                f"the impulses ∫f dt miss the momentum that disks gain by up to {error:.1%}; about "
                f"{comparison.balance.frames_needed} frames (run.frames) would make it "
                f"{FRAMES_NEEDED_FROM:.0%}"
            )
    return words


def deep_overlap(comparison: Comparison) -> float:
    """Return the overlap, over the mean radius, that one in twenty of the engine's contacts
    exceeds."""
    overlap = -comparison.match.contacts.gap[comparison.match.in_penalty]
    pressed = overlap[overlap > 0]
    radius = float(comparison.snapshot.radius.mean())
    return float(np.quantile(pressed, 0.95)) / radius if len(pressed) else 0.0
