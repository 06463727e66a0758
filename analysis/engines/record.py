"""What an engine run was: run.json beside its dumps, and when an engine steps and writes."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from analysis.dumps import index_dump
from analysis.scene.fields import Count, FileName, Number, Positive
from analysis.scene.scene import Run, Scene, first_problem, read_scene
from analysis.support.files import write_json
from analysis.support.reading import UnreadableError, read_text

# More steps between two frames than this are nobody's intention.
UNCOUNTABLE = 1e200
# By this share a quotient of two times may miss the whole number that it is.
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Say when an engine steps and writes, and what restitution two bodies have.

    restitution_least, restitution_most: what is obtained over the masses
    stiffness, wall_stiffness: N/m, of disks and of walls; None of an engine without springs"""

    time_step: float  # s
    safe_time_step: float  # s
    steps: int  # of the whole run
    frame_interval: int  # steps between written frames
    damping_ratio: float  # of the heaviest disks; 0 of an engine without dashpots
    restitution_least: float
    restitution_most: float
    stiffness: float | None = None
    wall_stiffness: float | None = None


def divided(run: Run, longest_s: float) -> tuple[float, int]:
    """Return the time step (s) and the steps between two frames: a step of at most longest_s,
    shortened a little so that frames fall on the same instants whatever it is.

    Raises OverflowError where there are too many steps to count."""
    between_frames = run.duration_s / run.frames
    if not between_frames / longest_s < UNCOUNTABLE:
        raise OverflowError("too many steps to count")
    interval = max(1, int(np.ceil(between_frames / longest_s * (1 - ROUNDING))))
    step = between_frames / interval
    return (longest_s if abs(step - longest_s) <= ROUNDING * longest_s else step), interval


FILE = "run.json"
PREPARED, FINISHED = "prepared", "finished"
STOPPED = "stopped"  # by its guard
FAILED = "failed"  # the engine died, or its dumps cannot be right


NotNegative = Annotated[Number, Field(ge=0)]
# What a record has of a `Timing` under the same name.
AS_TIMED = ("steps", "frame_interval", "damping_ratio", "restitution_least", "restitution_most")


class EngineError(RuntimeError):
    """Refuse an engine that is missing, cannot run a scene, died or gave nonsense; the message says
    what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """Record one run of an engine on a scene (SI; restitutions of two bodies: see Timing).

    deck_digest: of the decks or scripts that make it
    dump_digests: SHA-256 of each dump that it left, by the name of the file
    record_digest: of all the rest of a finished run's record
    resumed_at_s: s, where the run went on from an interrupted one; its seconds are then those of
        the rest
    stiffness_N_per_m, wall_stiffness_N_per_m: N/m, of disks and of walls; none of an engine without
        springs
    overlap_largest: of the frames, as a share of the smaller radius
    exit_state: prepared, finished, stopped (by its guard) or failed (the engine died, or its dumps
        cannot be right)
    reason, stopped_at_s: why and when (s) one of the last two ended"""

    engine: str
    version: str
    scene: FileName
    scene_digest: str
    disks: Count
    time_step_s: Positive
    steps: Count
    frame_interval: Count
    damping_ratio: NotNegative
    restitution_least: NotNegative
    restitution_most: NotNegative
    stiffness_N_per_m: Positive | None = None  # noqa: N815  (the unit is newton)
    wall_stiffness_N_per_m: Positive | None = None  # noqa: N815
    overlap_largest: NotNegative = 0.0
    wall_seconds: NotNegative = 0.0
    cpu_seconds: NotNegative = 0.0
    deck_digest: str = ""
    dump_digests: dict[str, str] = field(default_factory=dict)
    record_digest: str = ""
    exit_state: str = PREPARED
    reason: str = ""
    stopped_at_s: Number | None = None
    resumed_at_s: Number | None = None

    @property
    def particle_steps(self) -> int:
        """Disks times steps: what the cost of a run grows with."""
        return self.disks * self.steps

    @classmethod
    def prepared(
        cls, engine: str, version: str, deck_digest: str, scene: Scene, timing: Timing
    ) -> RunRecord:
        """Begin the record of a run that is still to come."""
        return cls(
            engine=engine,
            version=version,
            deck_digest=deck_digest,
            scene=scene.name,
            scene_digest=scene.digest(),
            disks=len(scene.snapshot),
            time_step_s=timing.time_step,
            stiffness_N_per_m=timing.stiffness,
            wall_stiffness_N_per_m=timing.wall_stiffness,
            **{name: getattr(timing, name) for name in AS_TIMED},
        )

    def finished(self, folder: Path) -> RunRecord:
        """Complete the record of a run that has ended well and left its dumps in the folder."""
        digests = {path.name: _digest_of(path) for path in sorted(folder.glob("*.dump"))}
        ended = dataclasses.replace(self, exit_state=FINISHED, dump_digests=digests)
        return dataclasses.replace(ended, record_digest=ended._digest())

    def check_finished(self, folder: Path, scene: Scene) -> None:
        """Raise EngineError naming the file where the run has not ended, is not of this scene, or
        its folder is not as it left it."""
        path = folder / FILE
        if self.exit_state != FINISHED:
            raise EngineError(f"{path}: exit_state: {self.exit_state}. The run has not finished")
        found = {
            path: (self.record_digest, self._digest()),
            folder / "scene.toml": (self.scene_digest, scene.digest()),
        }
        for name in {"bodies.dump", "contacts.dump", *self.dump_digests}:
            found[folder / name] = (self.dump_digests.get(name, ""), _digest_of(folder / name))
        for file, (recorded, digest) in found.items():
            if recorded != digest:
                raise EngineError(
                    f"{file}: not as the run left it, by its digest in {FILE}. Run it again"
                )

    def check_beside(self, dump: Path, scene: Path | None) -> None:
        """Raise EngineError where the scene file beside a dump of bodies is not that of the run, or the
        dump is not as it left it, or has other disks or instants than it."""
        if scene and scene.exists() and read_scene(scene).digest() != self.scene_digest:
            raise EngineError(f"{scene}: not the scene of the run, by its digest in {FILE}")
        of_dump = self.dump_digests.get(dump.name, "")
        for file, recorded, digest in (
            (dump.parent / FILE, self.record_digest, self._digest()),
            (dump, of_dump, of_dump and _digest_of(dump)),
        ):
            if recorded not in ("", digest):
                raise EngineError(f"{file}: not as the run left it, by its digest in {FILE}")
        index = index_dump(dump)
        for step, count in zip(index.steps, index.counts, strict=True):
            if count != self.disks or step % self.frame_interval or step > self.steps:
                due = f"{self.disks}, every {self.frame_interval} steps up to {self.steps}"
                raise EngineError(f"{dump}, step {step}: {count} disks. {FILE} beside it has {due}")

    def _digest(self) -> str:
        """SHA-256 of the content but for this digest; whole numbers as floats where floats are."""
        content = dataclasses.asdict(dataclasses.replace(self, record_digest=""))
        same = dataclasses.asdict(_READER.validate_python(content))
        return hashlib.sha256(json.dumps(same, sort_keys=True).encode()).hexdigest()

    def write(self, folder: Path) -> None:
        """Write run.json into the folder, whole."""
        content = dataclasses.asdict(self) | {"particle_steps": self.particle_steps}
        write_json(folder / FILE, content)

    @classmethod
    def read(cls, folder: Path, *, even_stopped: bool = False) -> RunRecord:
        """Read run.json of a folder. Raises EngineError naming the file, and the key, for one that
        is missing or broken, and giving the reason for a run that did not end well, unless
        `even_stopped`."""
        path = folder / FILE
        try:
            record = _READER.validate_json(read_text(path), strict=True)
        except UnreadableError as error:
            raise EngineError(f"{error}. The folder holds no run") from None
        except ValidationError as error:
            raise EngineError(f"{path}: not the record of a run: {first_problem(error)}") from None
        if record.exit_state in (STOPPED, FAILED) and not even_stopped:
            raise EngineError(
                f"{folder}: the run {record.exit_state}"
                + ("" if record.stopped_at_s is None else f" at t = {record.stopped_at_s:.6g} s")
                + f": {record.reason}"
            )
        return record


def read_finished(folder: Path) -> tuple[Scene, RunRecord]:
    """Read the scene, with the name that the run has, and the record of a finished run. Raises
    EngineError and SceneError for a folder that does not hold one."""
    record = RunRecord.read(folder)
    scene = read_scene(folder / "scene.toml").model_copy(update={"name": record.scene})
    record.check_finished(folder, scene)
    return scene, record


def _digest_of(path: Path) -> str:
    try:
        # a pipe would be waited for
        if path.exists() and not path.is_file():
            raise EngineError(f"{path}: not a regular file. The folder holds no whole run")
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise EngineError(f"{path}: {error.strerror}. The folder holds no whole run") from None


_READER = TypeAdapter(RunRecord)
