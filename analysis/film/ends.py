"""How far the mechanics leaves a frame open: ends of its contacts and of its headline numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.motion.series import near_door
from analysis.percussions.snapshot import SnapshotPercussions
from analysis.percussions.table import openness_of
from analysis.scene.scene import Scene
from nscd.arrays import Floats
from nscd.indeterminacy.admissible import Admissible, ProgramError
from nscd.indeterminacy.intervals import Intervals, weights_of_disk

# Of more open contacts than this only walls and pressure have ends: each contact and each person
# is a linear program of its own, a fifth of a second in a jam of 300 people.
MOST_OPEN = 100
NONE = (float("nan"), float("nan"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Openness:
    """Hold what the mechanics leaves open in a frame.

    determined: (k,) 1, 0, or −1 where that is not known
    lower, upper: (k,) N (N·s), NaN where there is no end or none was computed
    values: low and high of each headline number
    """

    determined: list[int]
    lower: Floats
    upper: Floats
    values: Mapping[str, tuple[float, float]]


def openness_at(scene: Scene, found: SnapshotPercussions, values: Mapping[str, float]) -> Openness:
    """Find the ends of the contacts and of the headline numbers `values` of a frame.

    Of the largest contact force and the largest load of a person the high end is attained; the low
    end is a bound. With friction, or where the frame is not solved, no ends are computed."""
    k, window = len(found.contacts), found.window or 1.0
    known = openness_of(found, False)
    determined = [-1 if one is None else one for one in known.determined]
    open_count, nothing = determined.count(0), np.full(k, np.nan)
    if k == 0 and found.answer.status == "solved":
        return Openness(determined=[], lower=nothing, upper=nothing, values=_exact(values))
    if found.answer.friction is not None or -1 in determined or not k:
        none = dict.fromkeys(values, NONE)
        return Openness(determined=determined, lower=nothing, upper=nothing, values=none)
    if not open_count:
        size = np.hypot(*found.pressing.T)
        return Openness(determined=determined, lower=size, upper=size, values=_exact(values))
    if open_count <= MOST_OPEN:
        known = openness_of(found, True)
    lower, upper = (
        np.array([np.nan if end is None else end for end in ends], dtype=np.float64) / window
        for ends in (known.lower, known.upper)
    )
    is_open = np.array(determined) == 0
    if open_count > MOST_OPEN:
        lower[is_open] = upper[is_open] = np.nan
    try:
        ranges = _Ranges(scene, found, lower, upper, is_open)
        ends = {key: ranges.of(key) for key in values}
    except ProgramError:
        ends = dict.fromkeys(values, NONE)
    return Openness(determined=determined, lower=lower, upper=upper, values=ends)


def _exact(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return {key: (value, value) for key, value in values.items()}


class _Ranges:
    """The ends of the headline numbers of one frame."""

    def __init__(
        self,
        scene: Scene,
        found: SnapshotPercussions,
        lower: Floats,
        upper: Floats,
        is_open: np.ndarray[tuple[int], np.dtype[np.bool_]],
    ) -> None:
        self.scene, self.found, self.is_open = scene, found, is_open
        self.lower, self.upper = lower, upper
        self.intervals = Intervals(Admissible.of(found.contacts, found.answer))

    def of(self, key: str) -> tuple[float, float]:
        """Low and high of a number."""
        if key == "walls":
            return self._linear(self.found.contacts.is_wall.astype(np.float64))
        if key == "pressure_door":
            return self._linear(self._at_door())
        if np.isnan(self.lower).any():
            return NONE
        if key == "contact_largest":
            return float(self.lower.max()), float(self.upper.max())
        return self._person()

    def _linear(self, weights: Floats) -> tuple[float, float]:
        found, window = self.intervals.of(weights), self.found.window or 1.0
        return found.lower / window, found.upper / window

    def _at_door(self) -> Floats:
        """Weights (k,) of contacts in the mean pressure on people near the door (1/m)."""
        contacts, now = self.found.contacts, self.found.snapshot
        near = near_door(self.scene, now)
        share = near / (2 * np.pi * now.radius * max(1, int(near.sum())))
        pairs = ~contacts.is_wall
        weights: Floats = share[contacts.first].copy()
        weights[pairs] += share[contacts.second[pairs]]
        return weights

    def _person(self) -> tuple[float, float]:
        """The largest load of a person: only who may carry most is asked."""
        contacts, n = self.found.contacts, len(self.found.snapshot)
        low, high = (contacts.sum_at_disks(ends, n) for ends in (self.lower, self.upper))
        touched = contacts.sum_at_disks(self.is_open.astype(np.float64), n) > 0
        ends = (float(low[~touched].max(initial=0.0)), float(high[~touched].max(initial=0.0)))
        for disk in np.argsort(-high):
            if not touched[disk] or high[disk] <= min(ends):
                continue
            span = self._linear(weights_of_disk(contacts, int(disk)))
            ends = max(ends[0], span[0]), max(ends[1], span[1])
        return ends
