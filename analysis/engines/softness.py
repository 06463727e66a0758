"""How soft a crowd is: the total drive over stiffness times radius, s = N F/(k r)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources
from typing import Literal

from pydantic import TypeAdapter

from analysis.scene.scene import Scene

# Measured with crowds of 75 to 1,200 at 2·10³ to 10⁸ N/m: below SOUND nobody is deeper than 0.35 r
# in another once the flow is steady; above DOUBTFUL a crowd stands more than a third denser; at
# NO_CROWD disks flow through each other.
SOUND, DOUBTFUL, NO_CROWD = 6.0, 17.0, 50.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Say how stiff bodies are by one source.

    low_N_per_m, high_N_per_m: N/m, of a contact between two people
    words, what: who says so in short, and what of
    source, read: where from, and whether read first-hand, in an excerpt or second-hand
    """

    name: str
    words: str
    low_N_per_m: float  # noqa: N815  (the unit is newton)
    high_N_per_m: float  # noqa: N815
    what: str
    source: str
    read: Literal["first-hand", "excerpt", "second-hand"]


def known_bodies() -> dict[str, Body]:
    """Read the ladder of stiffness of people, softest first, by name (bodies.toml)."""
    text = resources.files(__package__).joinpath("bodies.toml").read_text(encoding="utf-8")
    found = TypeAdapter(list[Body]).validate_python(tomllib.loads(text)["body"])
    return {one.name: one for one in found}


def softness(scene: Scene, stiffness: float | None = None) -> float:
    """Compute s of a driven crowd, at the scene's stiffness (N/m) or another; 0 without a drive.

    F is the mean push m U/τ of a person, r the mean radius."""
    if scene.drive is None:
        return 0.0
    disks, drive = scene.snapshot, scene.drive
    total = float(disks.mass.sum()) * drive.speed_m_per_s / drive.relaxation_time_s
    k = scene.contact.stiffness_N_per_m if stiffness is None else stiffness
    return total / (k * float(disks.radius.mean()))


def softness_warning(scene: Scene) -> str | None:
    """Say before a run that its crowd is too soft; None where it is not."""
    s = softness(scene)
    if s < SOUND:
        return None
    what = (
        "doubtful: it will stand denser than people do"
        if s < DOUBTFUL
        else "not sound: people will be deep in each other"
        if s < NO_CROWD
        else "no crowd: disks will flow through each other"
    )
    return (
        f"the total push over stiffness times radius is {s:.2g} "
        f"(contact.stiffness_N_per_m = {scene.contact.stiffness_N_per_m:.3g}): {what} (below "
        f"{SOUND:g} sound, to {DOUBTFUL:g} doubtful, above {NO_CROWD:g} no crowd)"
    )
