"""The central act: the percussions of one snapshot in one scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from analysis.percussions.setting import (
    FORCE,
    IMPULSE,
    LeftVelocity,
    Setting,
    Solved,
    law_of,
    left_velocity_of,
)
from analysis.percussions.table import dataframe
from analysis.scene.scene import Scene
from nscd import ContactLaw, Contacts, Snapshot, solve
from nscd.arrays import Floats
from nscd.show import as_html, draw
from nscd.solve import Search

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "FORCE",
    "IMPULSE",
    "LeftVelocity",
    "Setting",
    "SnapshotPercussions",
    "law_of",
    "left_velocity_of",
    "percussions_of",
]
# Left velocities that differ by less (relative to the largest) leave the closed contacts nearly as
# they were.
ALIKE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SnapshotPercussions(Solved):
    """Hold the rigid answer for one snapshot in its setting.

    setting, snapshot: what was solved, n disks
    contacts: the k that it has
    left_velocity: (n,2) m/s, u⁻
    window: s, the time that turns percussions into forces; None for an impact
    answer: percussions with their certificate"""

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row per contact, with the columns of contacts.csv."""
        return dataframe(self)

    def plot(self, axes: Any = None) -> Any:
        """Draw disks, walls and what the contacts carry into matplotlib axes; return them."""
        what = "contact force" if self.unit == FORCE else "percussion"
        return draw(
            self.snapshot,
            self.contacts,
            np.hypot(*self.pressing.T),
            label=f"{what} ({self.unit})",
            title=f"{self.answer.status}, residual {self.answer.residual:.0e}",
            walls=self.setting.walls,
            axes=axes,
        )

    def __repr__(self) -> str:
        return (
            f"<SnapshotPercussions: {len(self.snapshot)} disks, {len(self.contacts)} contacts, "
            f"largest {self.largest:.3g} {self.unit}, {self.answer.status}, "
            f"residual {self.answer.residual:.1e}>"
        )

    def _repr_html_(self) -> str:
        return as_html(repr(self)[1:-1], dataframe(self, openness="none"))


def percussions_of(
    scene: Scene | Setting,
    snapshot: Snapshot,
    law: ContactLaw | None = None,
    *,
    tolerance: float = 1e-8,
    solver: str = "auto",
    before: SnapshotPercussions | None = None,
    **search: Unpack[Search],
) -> SnapshotPercussions:
    """Compute the percussions of a snapshot in a scene: contacts, left velocity, solution, window.

    law: where left out inelastic, with the friction of the scene or setting
    tolerance, solver, search: of `nscd.solve`
    before: the answer of the frame before; where the same disks touch and are pressed alike, it
        makes the solution cheaper and does not change it

    Raises ValueError where the left velocity lacks a drive or a window, and what
    `Setting.contacts` and `solve` raise."""
    setting = Setting.of(scene) if isinstance(scene, Scene) else scene
    contacts = setting.contacts(snapshot)
    left, window = setting.left(snapshot)
    law = setting.law if law is None else law
    # who wants to go somewhere does not want to turn: a blocked crowd is at rest in its spins too
    still = law.frictional and setting.kind == "desired"
    answer = solve(
        replace(snapshot, spin=np.zeros(len(snapshot))) if still else snapshot,
        contacts,
        left_velocity=left,
        law=law,
        tolerance=tolerance,
        solver=solver,
        guess=before.answer if before and _alike(before, contacts, left) else None,
        **search,
    )
    return SnapshotPercussions(
        setting=setting,
        snapshot=snapshot,
        contacts=contacts,
        left_velocity=left,
        window=window,
        answer=answer,
    )


def _alike(before: SnapshotPercussions, contacts: Contacts, left: Floats) -> bool:
    """Whether the same disks touch as before, and are pressed alike."""
    earlier, pressed = before.contacts, before.left_velocity
    if len(left) != len(pressed) or not len(left):
        return False
    same = np.array_equal(earlier.first, contacts.first) and np.array_equal(
        earlier.second, contacts.second
    )
    return same and bool(np.abs(left - pressed).max() <= ALIKE * np.abs(left).max())
