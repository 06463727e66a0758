"""Frames of a film: which are shown, the forces and pressures of each, and how far those are known."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Match, keys_of, match_contacts
from analysis.dumps import EngineContacts
from analysis.dumps.windows import Window
from analysis.exposure.exposure import exposure_values
from analysis.motion.study import MEASURES, Measure, near_door, values_of
from analysis.percussions.setting import FORCE
from analysis.percussions.snapshot import SnapshotPercussions
from analysis.percussions.table import openness_of
from analysis.scene.scene import Scene
from analysis.scene.schema import Reconciliation
from nscd import Snapshot
from nscd.arrays import Flags, Floats, Indices
from nscd.indeterminacy.admissible import Admissible, ProgramError
from nscd.indeterminacy.intervals import Intervals, weights_of_disk
from nscd.percussions import Status

# About so many frames, evenly spread, where none are asked for.
USUAL = 50
FORM = re.compile(r"(?P<first>\d{0,9})(?P<range>:(?P<last>\d{0,9})(:(?P<step>\d{1,9}))?)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """Choose every `step`-th frame from the first to the last, both included.

    first, last: those of the file where left out"""

    first: int | None = None
    last: int | None = None
    step: int | None = None  # about 50 frames where left out

    @classmethod
    def parse(cls, text: str) -> Frames:
        """Read `150:250:5` (every fifth from 150 to 250), `150:250`, `150:` or `150`.

        Raises ValueError for anything else."""
        found = FORM.fullmatch(text)
        if not found or not text:
            raise ValueError(f"--frames: {text}; first:last:step is needed, such as 150:250:5")
        first = int(found["first"]) if found["first"] else None
        last = int(found["last"]) if found["last"] else None
        step = int(found["step"] or 1)
        frames = cls(first=first, last=last if found["range"] else first, step=step)
        if step < 1 or (frames.first or 0) > (frames.last or 10**9):
            raise ValueError(f"--frames: {text}; from first to last, with a step of at least 1")
        return frames

    def of(self, first: int, last: int, file: Path) -> range:
        """List the numbers of the frames of a file that has them from first to last.

        Raises ValueError naming the file for frames that it has not."""
        start = first if self.first is None else self.first
        end = last if self.last is None else self.last
        if not first <= start <= end <= last:
            asked = f"{start} to {max(start, end)}"
            raise ValueError(f"--frames: {asked}; {file} has frames {first} to {last}")
        step = self.step or max(1, round((end - start) / (USUAL - 1)))
        return range(start, end + 1, step)


# Of more open contacts than this only walls and pressure have ends: each contact and each person
# is a linear program of its own, a fifth of a second in a jam of 300 people.
MOST_OPEN = 100
NONE = (float("nan"), float("nan"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Openness:
    """Hold what the mechanics leaves open in a frame.

    lower, upper: (k,) N (N·s), NaN where there is no end or none was computed"""

    determined: list[int]  # (k,) 1, 0, or −1 where that is not known
    lower: Floats
    upper: Floats
    values: Mapping[str, tuple[float, float]]  # low and high of each headline number


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


# What a film follows; of an impact, which has no door, only those of SHOCK.
SHOCK = ("contact_largest", "person_largest", "walls")
HEADLINES: Mapping[str, Measure] = {key: MEASURES[key] for key in (*SHOCK, "pressure_door")}
# Of a filmed crowd also how many people, in per cent, were moved by more than this share of a
# radius to be disks.
FAR = 0.5
MOVED_FAR = "moved_far_percent"
# The models of a frame: what an engine wrote, and the percussions of the same snapshot.
ENGINE, RIGID = "engine", "percussions"
NOBODY = EngineContacts(
    first=np.zeros(0, dtype=np.int64),
    second=np.zeros(0, dtype=np.int64),
    is_wall=np.zeros(0, dtype=bool),
    normal=np.zeros((0, 2)),
    overlap=np.zeros(0),
    force=np.zeros((0, 2)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """Hold a number between the least and the largest that the mechanics allows.

    low, high: NaN where there is no end, or none was computed"""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, value: float, ends: tuple[float, float] | None) -> Ends:
        """Make the ends of a number; of one that is not open it is both."""
        low, high = (end if np.isfinite(end) else np.nan for end in ends or (value, value))
        return cls(value=value, low=low, high=high)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """Hold one instant of a film.

    found: the percussions; None where people could not be moved apart
    match: the contacts of both models, forces in N (of an impact percussions in N·s)
    determined: (k,) of the percussions: 1, 0, or −1 where that is not known
    lower, upper: (k,) the ends of the percussions, NaN where there is none or none was computed
    values: of each model, HEADLINES, how many people are above each limit, and MOVED_FAR"""

    number: int  # of the frame in its file
    time: float  # s
    found: SnapshotPercussions | None = None
    match: Match | None = None
    determined: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    lower: Floats = field(default_factory=lambda: np.zeros(0))
    upper: Floats = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Mapping[str, Ends]] = field(default_factory=dict)
    status: str = Status.SOLVED  # of the percussions, with the reason where they are not solved
    reason: str = ""
    heads: Floats | None = None  # (n,2) m, where people were filmed; None of a run
    account: Reconciliation | None = None  # what was done to them

    def unit(self, model: str) -> str:
        """Name the unit of what contacts carry in a model."""
        return FORCE if model == ENGINE or self.found is None else self.found.unit

    def has(self, model: str) -> Flags:
        """Tell which contacts (k,) a model has."""
        assert self.match is not None
        return self.match.in_penalty if model == ENGINE else self.match.in_rigid

    def size(self, model: str) -> Floats:
        """Give the magnitudes (k,) of what contacts carry in a model, in its unit."""
        assert self.match is not None
        vector = self.match.penalty if model == ENGINE else self.match.rigid
        return np.asarray(np.hypot(*vector.T))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reel:
    """Hold the frames of one run, or of a filmed crowd with one radius."""

    title: str  # as a page names it
    engine: str  # its name in commands; nothing of a filmed crowd
    scene: Scene  # walls and drive
    frames: Sequence[Frame]
    radius: float | None = None  # m, of a filmed crowd
    shift: int = 0  # what was added to the ids of its file, since those of disks begin at 1

    @property
    def models(self) -> list[str]:
        """List the models that its frames have. Places of the rigid engine are those after its
        steps, where those who pressed each other may be millimetres apart: it has its own forces
        only (docs/results/film.md)."""
        if self.engine == "rigid":
            return [ENGINE]
        return [ENGINE, RIGID] if self.engine else [RIGID]

    @property
    def unsolved(self) -> list[Frame]:
        """List the frames whose percussions are not solved."""
        if RIGID not in self.models:
            return []
        return [frame for frame in self.frames if frame.status != Status.SOLVED]


def window_of(match: Match, now: Snapshot, model: str) -> Window:
    """Take what a model says of an instant as a window of one second, whose impulses (N·s) are the
    forces (N); of the percussions of an impact it has these."""
    has, vector = (
        (match.in_penalty, match.penalty) if model == ENGINE else (match.in_rigid, match.rigid)
    )
    keys = np.column_stack([match.ids, match.is_wall])[has]
    return Window(start=now.time - 1.0, end=now.time, now=now, keys=keys, impulse=vector[has])


def values_at(
    scene: Scene, match: Match, found: SnapshotPercussions, model: str
) -> dict[str, float]:
    """Measure a model at an instant: HEADLINES, and of forces who is above each limit."""
    window = window_of(match, found.snapshot, model)
    values = values_of(scene, window)
    named = {key: values[key] for key in HEADLINES if key in values}
    if model == RIGID and found.unit != FORCE:
        return named
    return named | exposure_values(scene, window)


def frame_of(
    scene: Scene,
    number: int,
    found: SnapshotPercussions,
    engine: EngineContacts | None = None,
    *,
    heads: Floats | None = None,
    account: Reconciliation | None = None,
) -> Frame:
    """Make a frame of percussions and, of a run, of the contacts that its engine wrote."""
    k = len(found.contacts)
    match = match_contacts(found, engine or NOBODY, np.zeros(k, dtype=bool))
    measured = {RIGID: values_at(scene, match, found, RIGID)}
    if engine is not None:
        measured[ENGINE] = values_at(scene, match, found, ENGINE)
    if heads is not None:
        far = np.hypot(*(found.snapshot.position - heads).T) > FAR * found.snapshot.radius
        measured[RIGID][MOVED_FAR] = 100.0 * float(far.mean())
    known = openness_at(
        scene, found, {key: measured[RIGID][key] for key in HEADLINES if key in measured[RIGID]}
    )
    rows, k = np.searchsorted(match.keys, keys_of(found)), len(match.ids)
    determined, lower, upper = np.full(k, -1), np.full(k, np.nan), np.full(k, np.nan)
    determined[rows], lower[rows], upper[rows] = known.determined, known.lower, known.upper
    return Frame(
        number=number,
        time=found.snapshot.time,
        found=found,
        match=match,
        determined=determined,
        lower=lower,
        upper=upper,
        values={
            model: {
                key: Ends.of(value, known.values.get(key) if model == RIGID else None)
                for key, value in values.items()
            }
            for model, values in measured.items()
        },
        status=str(found.answer.status),
        reason=found.answer.reason,
        heads=heads,
        account=account,
    )
