"""The problems of the library: which there are, and how each is made."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal

from analysis.library.families import FAMILIES
from analysis.percussions import Setting, SnapshotPercussions, percussions_of
from analysis.percussions.table import Openness
from analysis.support.parts import load
from analysis.support.shipped import shipped
from nscd import ContactLaw, solve

# Asked of the answers that are kept; the file holds what was reached.
TOLERANCE = 1e-12
# Intervals of forces are proven by two linear programs a contact: up to so many disks without
# friction, and with friction, where each is a hundred times dearer.
INTERVALS, INTERVALS_WITH_FRICTION = 200, 60
# Frames of the shipped excerpt of a real crowd, and the radius of a person (m).
FRAMES, RADIUS_M = (400, 405, 410), 0.18
Family = Literal["heap", "jammed", "hexagonal", "masses", "chain", "gate", "push", "real"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Say which problem it is.

    family: of `analysis.library.families`, or real: a frame of the shipped excerpt
    size: how many disks are asked for; the frame of a real crowd
    friction: μ at all contacts
    seed: of the random numbers
    """

    family: Family
    size: int
    friction: float = 0.0
    seed: int = 1

    @property
    def name(self) -> str:
        """Name it: family, size, seed where it is not 1, friction in hundredths."""
        parts = [self.family, str(self.size)]
        parts += [f"seed{self.seed}"] if self.seed != 1 else []
        parts += [f"mu{round(100 * self.friction):03}"] if self.friction else []
        return "_".join(parts)

    def solve(self) -> SnapshotPercussions:
        """Make the problem and solve it as exactly as it goes."""
        if self.family == "real":
            return self._of_frame()
        case = FAMILIES[self.family](self.size, self.seed)
        law = ContactLaw(friction=self.friction)
        answer = solve(
            case.snapshot,
            case.contacts,
            left_velocity=case.left_velocity,
            law=law,
            tolerance=TOLERANCE,
        )
        names = tuple(str(number + 1) for number in range(len(case.walls)))
        setting = Setting(
            walls=case.walls, wall_names=names, friction=self.friction, left_velocity="dump"
        )
        return SnapshotPercussions(
            setting=setting,
            snapshot=case.snapshot,
            contacts=case.contacts,
            left_velocity=case.left_velocity,
            window=None,
            answer=answer,
        )

    def _of_frame(self) -> SnapshotPercussions:
        """A frame of the shipped excerpt before its gate."""
        load("pedpy")
        from analysis.scene.real.import_crowd import import_crowd
        from analysis.scene.real.trajectory import read_heads

        scenes = shipped("scenes")
        heads = read_heads(scenes / "gate_excerpt.txt", self.size)
        crowd = import_crowd(heads, radius=RADIUS_M, room=scenes / "rooms" / "gate.toml")
        setting = dataclasses.replace(Setting.of(crowd.scene), friction=self.friction)
        return percussions_of(setting, crowd.scene.snapshot, tolerance=TOLERANCE)

    def openness(self, disks: int) -> Openness:
        """Choose what is said of forces that balance may leave open."""
        most = INTERVALS_WITH_FRICTION if self.friction else INTERVALS
        return "ranges" if disks <= most else "determined"


def _listed() -> tuple[Problem, ...]:
    """List all problems, small ones of a family first."""
    found = []
    grown: tuple[Family, ...] = ("heap", "jammed", "hexagonal", "masses", "chain")
    for family in grown:
        found += [Problem(family=family, size=size) for size in (40, 150, 594, 2000, 5000)]
        # 2,000 unequal masses with friction are beyond every solver here
        rubbing = (40, 150, 594) if family == "masses" else (40, 150, 594, 2000)
        found += [Problem(family=family, size=size, friction=0.3) for size in rubbing]
    slides: tuple[Family, ...] = ("heap", "jammed", "hexagonal", "masses")
    found += [Problem(family=family, size=594, friction=0.1) for family in slides]
    for mu in (0.0, 0.3):
        found += [Problem(family="push", size=size, friction=mu) for size in (5, 20, 80)]
        found += [Problem(family="real", size=frame, friction=mu) for frame in FRAMES]
    return tuple(found)


PROBLEMS = _listed()
