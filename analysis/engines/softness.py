"""How soft a crowd is: the total drive over stiffness times radius, s = N F/(k r), and what that
changes."""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from math import ceil, floor, log10
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter

from analysis.scene.scene import Scene

# Measured with crowds of 75 to 1,200 at 2·10³ to 10⁸ N/m: below VALID nobody is deeper than 0.35 r
# in another once the flow is steady; above WITH_CARE a crowd stands more than a third denser, and
# disks overlap by about a radius, where the law of the overlap is none of two bodies; at NO_CROWD
# disks flow through each other.
VALID, WITH_CARE, NO_CROWD = 6.0, 17.0, 50.0
# Overlaps beyond this share of a radius are marked.
DEEP = 0.35


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Say how stiff bodies are by one source.

    low_N_per_m, high_N_per_m: N/m, of a contact between two people
    words, what: who says so in short, and what of
    source, read: where from, and whether read first-hand, in an excerpt or second-hand"""

    name: str
    words: str
    low_N_per_m: float  # noqa: N815  (the unit is newton)
    high_N_per_m: float  # noqa: N815
    what: str
    source: str
    read: Literal["first-hand", "excerpt", "second-hand"]


def known_bodies() -> dict[str, Body]:
    """Read the ladder of stiffness of people, softest first, by name (bodies.toml)."""
    found = TypeAdapter(list[Body]).validate_python(_file()["body"])
    return {one.name: one for one in found}


@functools.cache
def _file() -> dict[str, Any]:
    text = resources.files(__package__).joinpath("bodies.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidOver:
    """Hold by how much rigid disks are above soft bodies in a quantity, as a share."""

    words: str  # names the quantity
    mean: float
    low: float  # nine tenths of the crowds that were measured lie between low and high
    high: float

    @property
    def worst(self) -> float:
        """The largest error that a rigid answer has by it."""
        return max(-self.low, self.high)


def rigid_over_soft(softest: float, hardest: float) -> Mapping[str, RigidOver] | None:
    """Say how rigid disks over- or understate each quantity of a crowd whose s is between hardest
    and softest, by name; None where that was not measured, beyond s = 17.

    Between the crowds that were measured it is read in log s; below s = 0.35 it is that of 0.35."""
    table = _file()["soft_over_rigid"]
    log_softness = np.log(table["s"])
    if softest > table["s"][-1]:
        return None
    inside = (s for s in table["s"] if hardest < s < softest)
    positions = np.log([max(s, 1e-300) for s in (hardest, *inside, softest)])
    found = {}
    for one in table["quantity"]:
        # the end of the least is that of the most over it
        mean, low, high = (
            1 / (1 + np.interp(positions, log_softness, one[key])) for key in ("mean", "high", "low")
        )
        found[one["name"]] = RigidOver(
            words=one["words"],
            mean=float(np.sqrt(mean[0] * mean[-1])) - 1,
            low=float(low.min()) - 1,
            high=float(high.max()) - 1,
        )
    return found


def softness_of(scene: Scene, body: Body) -> tuple[float, float]:
    """Compute s of a driven crowd with the stiffest and with the softest bodies of a source."""
    return softness(scene, body.high_N_per_m), softness(scene, body.low_N_per_m)


def softness(scene: Scene, stiffness: float | None = None) -> float:
    """Compute s of a driven crowd, at the scene's stiffness (N/m) or another; 0 without a drive.

    F is the mean push m U/τ of a person, r the mean radius."""
    if scene.drive is None:
        return 0.0
    disks, drive = scene.snapshot, scene.drive
    total = drive.push(float(disks.mass.sum()))
    k = scene.contact.stiffness_N_per_m if stiffness is None else stiffness
    return total / (k * float(disks.radius.mean()))


def softest(scene: Scene) -> float:
    """Compute the least stiffness (N/m), of two digits, that a body has and s of a crowd allows."""
    body = next(iter(known_bodies().values())).low_N_per_m  # softest first
    minimum = max(softness(scene, 1.0) / VALID, body)
    digit = 10.0 ** (floor(log10(minimum)) - 1)
    return float(f"{ceil(minimum / digit) * digit:.2g}")


def chest() -> float:
    """Give the stiffness (N/m, of two digits) between the ends of that of two chests, by their
    geometric mean: the same in every crowd."""
    body = known_bodies()["chest"]
    return float(f"{(body.low_N_per_m * body.high_N_per_m) ** 0.5:.2g}")


def softness_warning(scene: Scene) -> str | None:
    """Say before a run that its crowd is too soft; None where it is not."""
    s = softness(scene)
    if s < VALID:
        return None
    worst = next(maximum for maximum in (NO_CROWD, WITH_CARE, VALID) if s >= maximum)
    more = f". Above {WITH_CARE:g} do not use forces" if worst == VALID else ""
    return (
        f"contact.stiffness_N_per_m: {scene.contact.stiffness_N_per_m:.3g} is soft: the total push is "
        f"s = {s:.2g} times stiffness times radius, above {worst:g}: {judged(s)}{more}"
    )


def judged(s: float) -> str:
    """Say what a crowd of this s is."""
    verdicts = {
        VALID: "valid",
        WITH_CARE: "use with care: people will stand denser than real ones do",
        NO_CROWD: "not valid for forces: people will be deep in each other",
    }
    other = "not a crowd: disks will flow through each other"
    return next((words for maximum, words in verdicts.items() if s < maximum), other)
