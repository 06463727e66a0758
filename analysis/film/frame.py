"""One frame of a film: the contacts of its models, and what they say with its ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.compare.match import Match, keys_of, match_contacts
from analysis.dumps import EngineContacts
from analysis.dumps.windows import Window
from analysis.exposure.counts import exposure_values
from analysis.film.ends import openness_at
from analysis.motion.series import MEASURES, Measure, values_of
from analysis.percussions.setting import FORCE
from analysis.percussions.snapshot import SnapshotPercussions
from analysis.scene.account import Reconciliation
from analysis.scene.scene import Scene
from nscd import Snapshot
from nscd.arrays import Flags, Floats, Indices
from nscd.percussions import Status

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

    low, high: NaN where there is no end, or none was computed
    """

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

    number: of the frame in its file
    time: s
    found: the percussions; None where people could not be moved apart
    match: the contacts of both models, forces in N (of an impact percussions in N·s)
    determined: (k,) of the percussions: 1, 0, or −1 where that is not known
    lower, upper: (k,) the ends of the percussions, NaN where there is none or none was computed
    values: of each model, HEADLINES, how many people are above each limit, and MOVED_FAR
    status: of the percussions, with the reason where they are not solved
    heads: (n,2) m, where people were filmed; None of a run
    account: what was done to them
    """

    number: int
    time: float
    found: SnapshotPercussions | None = None
    match: Match | None = None
    determined: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    lower: Floats = field(default_factory=lambda: np.zeros(0))
    upper: Floats = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Mapping[str, Ends]] = field(default_factory=dict)
    status: str = Status.SOLVED
    reason: str = ""
    heads: Floats | None = None
    account: Reconciliation | None = None

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
    """Hold the frames of one run, or of a filmed crowd with one radius.

    title: as a page names it
    engine: its name in commands; nothing of a filmed crowd
    scene: walls and drive
    radius: m, of a filmed crowd
    shift: what was added to the ids of its file, since those of disks begin at 1
    """

    title: str
    engine: str
    scene: Scene
    frames: Sequence[Frame]
    radius: float | None = None
    shift: int = 0

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
