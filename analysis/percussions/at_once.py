"""The percussions of many frames in one compiled call, as the rows of a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.dumps import Bodies
from analysis.percussions.setting import Setting
from analysis.percussions.table import certificate, walls_of, when
from nscd.arrays import LARGEST
from nscd.frames import Asked, Disks, Found, solve_frames
from nscd.percussions import Status
from nscd.show import arrays


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FramesAtOnce:
    """Hold the answers of f frames.

    bodies, setting: what was solved
    found: contacts, and what they carry
    window: s, the time that turns percussions into forces; None for an impact
    """

    bodies: Bodies
    setting: Setting
    found: Found
    window: float | None

    def columns(self, first: int, end: int) -> dict[str, Any]:
        """Name the columns of the contacts of some frames, as `columns_of` does for one."""
        found, bodies = self.found, self.bodies
        start = found.start[first : end + 1]
        those = slice(start[0], start[-1])
        some = found._replace(
            first=found.first[those], second=found.second[those], is_wall=found.is_wall[those],
            normal=found.normal[those], gap=found.gap[those],
        )  # fmt: skip
        each = np.repeat(np.arange(first, end), np.diff(start))
        known = not np.isnan(bodies.times).any()
        cells = when(bodies.times[each] if known else None, np.array(bodies.steps)[each])
        cells |= arrays(bodies, some, found.reaction[those], found.impulse[those], self.window)
        cells |= walls_of(self.setting, some)
        return cells | certificate(
            str(Status.SOLVED), found.residual[each], found.velocity_error[each]
        )

    def largest(self, number: int) -> float:
        """Give the largest magnitude that a contact of a frame carries: N, or N·s in an impact."""
        impulse = self.found.impulse[slice(*self.found.start[number : number + 2].tolist())]
        return float(np.hypot(*(impulse / (self.window or 1.0)).T).max(initial=0.0))


def solve_at_once(bodies: Bodies, setting: Setting, tolerance: float) -> FramesAtOnce | None:
    """Solve frames without friction and dissipation; those that are not `answered` are left to
    `percussions_of`, and all of them where this gives None.

    Raises ValueError where the left velocity lacks a drive or a window."""
    left, window = setting.left(bodies)
    if not np.abs(left).max(initial=0.0) <= LARGEST:
        return None
    disks = Disks(bodies.start, bodies.ids, bodies.position, left, bodies.radius, bodies.mass)
    asked = Asked(setting.contact_tolerance, setting.largest_overlap, tolerance)
    found = solve_frames(disks, setting.walls, asked)
    return FramesAtOnce(bodies=bodies, setting=setting, found=found, window=window)
