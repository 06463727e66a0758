"""Frames of a film: which are shown, the forces and pressures of each, and how far those are known."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from analysis.compare.comparison import Match, keys_of, match_contacts
from analysis.dumps import EngineContacts
from analysis.dumps.windows import Window
from analysis.percussions.setting import FORCE
from analysis.percussions.snapshot import SnapshotPercussions, bounds_of, intervals_of, states_of
from analysis.scene.rigid_bodies import people_of
from analysis.scene.scene import Scene
from analysis.scene.schema import Reconciliation
from analysis.studies.exposure.limits import Quantity
from analysis.studies.exposure.loads import MEASURES, loads_of, near_door, people_above, values_of
from nscd import Snapshot
from nscd.arrays import Floats, Indices, Mask
from nscd.indeterminacy.intervals import weights_of_disk
from nscd.indeterminacy.linear import ProgramError
from nscd.percussions import Status

# About so many frames, evenly spread, where none are asked for; of ensembles, which take seconds each.
USUAL, SAMPLED = 50, 5
FORM = re.compile(r"(?P<first>\d{0,9})(?P<range>:(?P<last>\d{0,9})(:(?P<step>\d{1,9}))?)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRange:
    """Choose every `step`-th frame from the first to the last, both included.

    first, last: those of the file where left out
    step: about 50 frames where left out, 5 of ensembles
    ensemble: show the mean and 90 % of all admissible percussions, not one of them and bounds"""

    first: int | None = None
    last: int | None = None
    step: int | None = None
    ensemble: bool = False

    @classmethod
    def parse(cls, text: str) -> FrameRange:
        """Read `150:250:5` (every fifth from 150 to 250), `150:250`, `150:` or `150`.

        Raises ValueError for anything else."""
        found = FORM.fullmatch(text)
        if not found or not text:
            raise ValueError(f"--frames: {text}. Write first:last:step, such as 150:250:5")
        first = int(found["first"]) if found["first"] else None
        last = int(found["last"]) if found["last"] else None
        step = int(found["step"] or 1)
        frames = cls(first=first, last=last if found["range"] else first, step=step)
        if step < 1 or (frames.first or 0) > (frames.last or 10**9):
            raise ValueError(f"--frames: {text}. Write first to last, with a step of at least 1")
        return frames

    def of(self, numbers: Sequence[int] | Indices, file: Path) -> list[int]:
        """List the frames to show of a file that has those of these growing numbers.

        Raises ValueError naming the file for frames that it has not."""
        there = np.asarray(numbers, dtype=np.int64)
        first, last = int(there[0]), int(there[-1])
        start = first if self.first is None else self.first
        end = last if self.last is None else self.last
        requested = there[(there >= start) & (there <= end)]
        if self.step:
            requested = requested[(requested - start) % self.step == 0]
        else:
            usual = SAMPLED if self.ensemble else USUAL
            requested = requested[:: max(1, round((len(requested) - 1) / (usual - 1)))]
        if not (first <= start <= end <= last and len(requested)):
            wanted = f"{start} to {max(start, end)}"
            usual = int(np.median(np.diff(there))) if len(there) > 1 else 1
            by = f", every {usual}" if usual > 1 else ""
            raise ValueError(f"--frames: {wanted}, but {file} has frames {first} to {last}{by}")
        return [int(one) for one in requested]


# Of more open contacts than this only walls and pressure have bounds: each contact and each person
# is a linear program of its own, a fifth of a second in a jam of 300 people.
MOST_OPEN = 100
Bounds = tuple[float, float]
TAILS = 0.05, 0.95
NONE: Bounds = (float("nan"), float("nan"))


def bounds_at(
    scene: Scene, found: SnapshotPercussions, values: Mapping[str, float]
) -> tuple[Indices, Floats, dict[str, Bounds]]:
    """Find what the mechanics leaves open in a frame: of each rigid contact whether it is determined
    (k,), as 1, 0, or −1 where that is not known, and its bounds (2,k) N (N·s), NaN where there is
    none or none was computed; and the bounds of the headline numbers `values`.

    Of the largest contact force and the largest load of a person the high bound is attained. With
    friction, or where the frame is not solved, no bounds are computed."""
    k, window = len(found.contacts), found.window or 1.0
    indeterminacy = bounds_of(found, False)
    determined = indeterminacy.determined
    is_open, nothing = determined == 0, np.full((2, k), np.nan)
    exact = {key: (value, value) for key, value in values.items()}
    if not k and found.solution.status == "solved":
        return determined, nothing, exact
    if found.solution.friction is not None or (determined < 0).any() or not k:
        return determined, nothing, dict.fromkeys(values, NONE)
    if not is_open.any():
        return determined, np.tile(np.hypot(*found.pressing.T), (2, 1)), exact
    many = is_open.sum() > MOST_OPEN
    if not many:
        indeterminacy = bounds_of(found, True)
    bounds = np.array([indeterminacy.lower, indeterminacy.upper]) / window
    if many:
        bounds[:, is_open] = np.nan
    try:
        return determined, bounds, _headline_bounds(scene, found, bounds, is_open, values)
    except ProgramError:
        return determined, bounds, dict.fromkeys(values, NONE)


def _headline_bounds(
    scene: Scene, found: SnapshotPercussions, bounds: Floats, is_open: Mask, keys: Iterable[str]
) -> dict[str, Bounds]:
    """The bounds of the headline numbers of a frame, of whose contacts some are open."""
    contacts, now, window = found.contacts, found.snapshot, found.window or 1.0
    people, of = people_of(now)
    intervals = intervals_of(found)[1]

    def linear(weights: Floats) -> Bounds:
        low, high = intervals.ends(weights)
        return low / window, high / window

    def at_door() -> Bounds:
        """Of the mean pressure on people near the door, in which contacts weigh in 1/m."""
        near = near_door(scene, people)
        fraction = (near / (2 * np.pi * people.radius * max(1, int(near.sum()))))[of]
        pairs = ~contacts.is_wall
        weights: Floats = fraction[contacts.first].copy()
        weights[pairs] += fraction[contacts.second[pairs]]
        return linear(weights)

    def person() -> Bounds:
        """Of the largest load of a person: only who may carry most is asked."""
        low, high, touched = (
            np.bincount(of, contacts.sum_at_disks(each.astype(np.float64), len(now)), len(people))
            for each in (*bounds, is_open)
        )
        ends = (float(low[touched == 0].max(initial=0.0)), float(high[touched == 0].max(initial=0.0)))
        for one in np.argsort(-high):
            if touched[one] and high[one] > min(ends):
                disks = np.flatnonzero(of == one).tolist()
                span = linear(np.sum([weights_of_disk(contacts, disk) for disk in disks], axis=0))
                ends = max(ends[0], span[0]), max(ends[1], span[1])
        return ends

    found_by: dict[str, Callable[[], Bounds]] = {
        "walls": lambda: linear(contacts.is_wall.astype(np.float64)),
        "pressure_door": at_door,
        "contact_largest": lambda: (float(bounds[0].max()), float(bounds[1].max())),
        "person_largest": person,
    }
    sums = ("walls", "pressure_door")
    finite = not np.isnan(bounds[0]).any()
    return {key: found_by[key]() if finite or key in sums else NONE for key in keys}


# What a film follows; of an impact, which has no forces and no door, only those of SHOCK.
SHOCK = {
    "contact_largest": "largest percussion",
    "person_largest": "sum of percussions on the most loaded person",
    "walls": "sum of percussions on all walls",
}
HEADLINES: Mapping[str, Quantity] = {key: MEASURES[key] for key in (*SHOCK, "pressure_door")}
# Of a filmed crowd also how many people, in per cent, were moved by more than this share of a
# radius to be disks.
FAR = 0.5
MOVED_FAR = "moved_far_percent"
# The models of a frame: what an engine wrote, and the percussions of the same snapshot.
ENGINE, RIGID = "engine", "percussions"
# The engine of a reel of a dump that has its own contact forces.
OWN = "own"
NOBODY = EngineContacts(
    first=np.zeros(0, dtype=np.int64),
    second=np.zeros(0, dtype=np.int64),
    is_wall=np.zeros(0, dtype=bool),
    normal=np.zeros((0, 2)),
    overlap=np.zeros(0),
    force=np.zeros((0, 2)),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """Hold one instant of a film.

    found: the percussions; None where people could not be moved apart
    matched: the contacts of both models, forces in N (of an impact percussions in N·s)
    determined: (k,) of the percussions: 1, 0, or −1 where that is not known
    bounds: (2,k) of the percussions, NaN where there is none or none was computed
    values: of each model, HEADLINES, how many people are above each limit, and MOVED_FAR: (3,) the
        value, and the least and the largest that the mechanics allows, NaN where that is not known"""

    number: int  # of the frame in its file
    time: float  # s
    found: SnapshotPercussions | None = None
    matched: Match | None = None
    determined: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    bounds: Floats = field(default_factory=lambda: np.zeros((2, 0)))
    values: Mapping[str, Mapping[str, Floats]] = field(default_factory=dict)
    status: str = Status.SOLVED  # of the percussions, with the reason where they are not solved
    reason: str = ""
    head_positions: Floats | None = None  # (n,2) m, where people were filmed; None of a run
    account: Reconciliation | None = None  # what was done to them

    @property
    def now(self) -> Snapshot:
        """The people of a frame that has some."""
        assert self.found is not None
        return self.found.snapshot

    @property
    def people(self) -> Snapshot:
        """The same as one disk each."""
        return people_of(self.now)[0]

    @property
    def match(self) -> Match:
        """The contacts of a frame that has people."""
        assert self.matched is not None
        return self.matched

    def unit(self, model: str) -> str:
        """Name the unit of what contacts carry in a model."""
        return FORCE if model == ENGINE or self.found is None else self.found.unit

    def has(self, model: str) -> Mask:
        """Tell which contacts (k,) a model has."""
        return self.match.in_penalty if model == ENGINE else self.match.in_rigid

    def size(self, model: str) -> Floats:
        """Give the magnitudes (k,) of what contacts carry in a model, in its unit."""
        return np.asarray(np.hypot(*self.vector(model).T))

    def vector(self, model: str) -> Floats:
        """Give what the first body gives to the second (k,2) in a model, in its unit."""
        return self.match.penalty if model == ENGINE else self.match.rigid


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Animation:
    """Hold the frames of one run, or of a filmed crowd with one radius."""

    title: str  # as a page names it
    engine: str  # its name in commands; OWN of a dump; nothing where there are percussions only
    scene: Scene  # walls and drive
    frames: Sequence[Frame]
    radius: float | None = None  # m, of a filmed crowd
    ensemble: bool = False  # see Frames
    shift: int = 0  # what was added to the ids of its file, since those of disks begin at 1
    since: float = 0.0  # s, from when on frames count in the numbers beside it

    @property
    def models(self) -> list[str]:
        """List the models that its frames have. Places of the rigid engine are those after its
        steps, where those who pressed each other may be millimetres apart: it has its own forces
        only (docs/results/film.md)."""
        if self.engine == "rigid":
            return [ENGINE]
        return [ENGINE, RIGID] if self.engine else [RIGID]

    @property
    def shown(self) -> list[Frame]:
        """List the frames that have people."""
        return [frame for frame in self.frames if frame.found is not None]

    @property
    def typical(self) -> Frame:
        """Find the frame of the median largest force above 0 in the first model, of those that count."""
        largest = [frame.size(self.models[0]).max(initial=0.0) for frame in self.shown]
        counted = [
            (size, n)
            for n, (size, frame) in enumerate(zip(largest, self.shown, strict=True))
            if frame.time >= self.since and size > 0
        ]
        if counted:
            return self.shown[sorted(counted)[len(counted) // 2][1]]
        return max(self.shown, key=lambda frame: len(frame.now) > 0)

    @property
    def unsolved(self) -> list[Frame]:
        """List the frames whose percussions are not solved."""
        if RIGID not in self.models:
            return []
        return [frame for frame in self.frames if frame.status != Status.SOLVED]

    def track(self, model: str, key: str) -> Floats:
        """Follow a number of a model over the frames, (f,3) as in `Frame.values`; NaN where the
        percussions are not solved and where a frame does not have it."""
        nothing, unsolved = np.full(3, np.nan), self.unsolved if model == RIGID else []
        return np.array(
            [nothing if one in unsolved else one.values.get(model, {}).get(key, nothing) for one in self.frames]
        )


def window_of(match: Match, now: Snapshot, model: str) -> Window:
    """Take what a model says of an instant as a window of one second, whose impulses (N·s) are the
    forces (N); of the percussions of an impact it has these."""
    has, vector = (match.in_penalty, match.penalty) if model == ENGINE else (match.in_rigid, match.rigid)
    keys = np.column_stack([match.ids, match.is_wall])[has]
    one = Window(start=now.time - 1.0, end=now.time, now=now, keys=keys, impulse=vector[has])
    return one.of_people()


def _measured(scene: Scene, match: Match, found: SnapshotPercussions, model: str) -> dict[str, float]:
    """Measure a model at an instant: HEADLINES, and of forces who is above each limit."""
    window = window_of(match, found.snapshot, model)
    loads = loads_of(scene, window)
    values = values_of(scene, window, loads)
    named = {key: values[key] for key in HEADLINES if key in values}
    return named if model == RIGID and found.unit != FORCE else named | people_above(loads)


def sampled_at(scene: Scene, found: SnapshotPercussions, match: Match) -> tuple[Match, Floats, dict[str, Floats]]:
    """Give the contacts of a frame with the mean of all admissible percussions, the 5 % and 95 %
    quantiles (2,k) of each contact's magnitude, and the mean and these quantiles of all that is
    measured; NaN in place of quantiles where the sampling has not converged, or there is none."""
    k, measured, drawn = (len(found.contacts), _measured(scene, match, found, RIGID), states_of(found))
    if drawn is None or not drawn[0].converged.all():
        unknown = {key: np.array([value, *NONE]) for key, value in measured.items()}
        return match, np.full((2, k), np.nan), unknown
    (x, y), rows = found.contacts.normal.T, np.searchsorted(match.keys, keys_of(found))
    normal, across = np.moveaxis(drawn[0].draws.reshape(-1, 2, k), 1, 0) / (found.window or 1.0)
    every = np.stack([normal * x - across * y, normal * y + across * x], -1)

    def with_forces(vector: Floats) -> Match:
        rigid = match.rigid.copy()
        rigid[rows] += vector - found.pressing  # beside them those of arms
        return replace(match, rigid=rigid)

    of = [list(_measured(scene, with_forces(one), found, RIGID).values()) for one in every]
    spans = np.vstack([np.mean(of, 0), np.quantile(of, TAILS, 0)]).T
    ends = np.asarray(np.quantile(np.hypot(normal, across), TAILS, 0))
    return with_forces(every.mean(0)), ends, dict(zip(measured, spans, strict=True))


def frame_of(
    scene: Scene,
    number: int,
    found: SnapshotPercussions,
    engine: EngineContacts | None = None,
    *,
    ensemble: bool | None = False,
    positions: Floats | None = None,
    account: Reconciliation | None = None,
) -> Frame:
    """Make a frame of percussions and, of a run, of the engine's contacts; ensemble: see `FrameRange`. None:
    without bounds, which a film of rigid runs does not show."""
    match = match_contacts(found, engine or NOBODY, np.zeros(len(found.contacts), dtype=bool))
    models = [RIGID] if engine is None else [RIGID, ENGINE]
    measured = {model: _measured(scene, match, found, model) for model in models}
    rigid = measured[RIGID]
    if ensemble and len(found.contacts):
        match, ends, spans = sampled_at(scene, found, match)
        indeterminacy = bounds_of(found, False).determined
        of_values = {key: (low, high) for key, (_, low, high) in spans.items()}
        rigid |= {key: mean for key, (mean, _, _) in spans.items()}
    elif ensemble is None:
        indeterminacy, of_values = bounds_of(found, False).determined, {}
        ends = np.full((2, len(found.contacts)), np.nan)
    else:
        headlines = {key: rigid[key] for key in HEADLINES if key in rigid}
        indeterminacy, ends, of_values = bounds_at(scene, found, headlines)
    if positions is not None:
        far = np.hypot(*(found.snapshot.position - positions).T) > FAR * found.snapshot.radius
        rigid[MOVED_FAR] = 100.0 * float(far.mean())
    rows, k = np.searchsorted(match.keys, keys_of(found)), len(match.ids)
    determined, bounds = np.full(k, -1), np.full((2, k), np.nan)
    determined[rows], bounds[:, rows] = indeterminacy, ends
    values = {
        model: {
            key: np.array([value, *(of_values if model == RIGID else {}).get(key, (value, value))])
            for key, value in every.items()
        }
        for model, every in measured.items()
    }
    for every in values.values():
        for one in every.values():
            one[~np.isfinite(one)] = np.nan
    return Frame(
        number=number,
        time=found.snapshot.time,
        found=found,
        matched=match,
        determined=determined,
        bounds=bounds,
        values=values,
        status=str(found.solution.status),
        reason=found.solution.reason,
        head_positions=positions,
        account=account,
    )
