"""The guard of a run: what the engines look for while they run, as their last words say it, and how
a stopped run ends.

The looking itself is done by the engines' own means (lammps_inputs/guard.in,
yade_scripts/crowd_guard.py), so that a plain run has it too. docs/results/guard.md derives the bounds."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from analysis.engines.record import FAILED, STOPPED, EngineError, RunRecord
from analysis.scene.scene import Scene
from nscd import find_contacts
from nscd.arrays import Floats

# The limits; the decks and the script hold the same numbers.
OVERLAP_SHARE = 0.5  # of the smaller radius
STEP_SHARE = 0.1  # of a disk's radius, in a step
ENERGY_SHARE = 0.05  # of the energy at the start and of everybody at the desired speed
MOMENTUM_SHARE = 1e-9  # of √(2 M E)
STOPPED_STATUS = 3
ADVICE = (
    "If disks were lost or moved too fast, give a smaller time step (run.time_step_s), "
    "or none: then it follows from the stiffness. Overlaps that are too deep need a stiffer contact."
)
_SAID = re.compile(r"^GUARD (\w+) at t = (\S+) s \(step (\d+)\): (.+)$")
_NOT_A_NUMBER = (
    "ERROR: Variable guard_kinetic: Non-numeric"  # how LAMMPS itself ends at the guard's question
)
_DEATHS = (
    (
        re.compile(r"ERROR: Lost atoms: original (\d+) current (\d+)"),
        "disks are lost: {0} at the start, {1} now",
    ),
    (re.compile(r"ERROR.*Non-numeric atom"), "a position is not a finite number"),
)


class RunStoppedError(EngineError):
    """A run that did not end well; `record` says how: exit_state, reason and stopped_at_s."""

    def __init__(self, message: str, record: RunRecord) -> None:
        super().__init__(message)
        self.record = record


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a guard said: kind (finite, lost, overlap, speed, energy or momentum), its words, time
    (s) and step."""

    kind: str
    words: str
    time_s: float
    step: int

    @classmethod
    def of(cls, lines: Iterable[str]) -> Verdict | None:
        """The verdict among the lines that an engine said, or None."""
        for line in lines:
            if said := _SAID.match(line):
                return cls(kind=said[1], words=said[4], time_s=float(said[2]), step=int(said[3]))
        return None


def stopped(record: RunRecord, verdict: Verdict) -> RunStoppedError:
    """The end of a run that its guard stopped."""
    ended = dataclasses.replace(
        record,
        exit_state=STOPPED,
        reason=f"{verdict.kind}: {verdict.words}",
        stopped_at_s=verdict.time_s,
    )
    return RunStoppedError(
        f"{record.engine}, {record.scene}, t = {verdict.time_s:.6g} s (step {verdict.step}): stopped by its guard: "
        f"{verdict.kind}: {verdict.words}. {ADVICE}",
        ended,
    )


def died(record: RunRecord, status: int | None, step: int, last: Iterable[str]) -> RunStoppedError:
    """The end of a run whose engine ended with a status other than 0: stopped by its guard, or by
    itself."""
    lines = list(last)
    verdict = Verdict.of(lines) if status == STOPPED_STATUS else None
    if verdict:
        return stopped(record, verdict)
    time_s = step * record.time_step_s
    if any(line.startswith(_NOT_A_NUMBER) for line in lines):
        words = "the kinetic energy is not a finite number"
        return stopped(record, Verdict(kind="finite", words=words, time_s=time_s, step=step))
    reason = f"{record.engine} ended with status {status}"
    message = (
        f"{record.engine} stopped with status {status} after step {step} "
        f"(t = {time_s:.6g} s) of {record.scene}. {ADVICE}"
    )
    for pattern, words in _DEATHS:
        if found := next((match for line in lines if (match := pattern.search(line))), None):
            reason = f"{words.format(*found.groups())} ({reason})"
            return RunStoppedError(
                f"{record.engine}, {record.scene}, after t = {time_s:.6g} s (step {step}): {reason}. {ADVICE}",
                dataclasses.replace(record, exit_state=FAILED, reason=reason, stopped_at_s=time_s),
            )
    ended = dataclasses.replace(record, exit_state=FAILED, reason=reason, stopped_at_s=time_s)
    return RunStoppedError(message + "\n  " + "\n  ".join(lines), ended)


def garbage(record: RunRecord, reason: str, step: int | None = None) -> RunStoppedError:
    """The end of a run that finished with status 0 and whose dumps cannot be right; `step`: of the
    first bad frame."""
    time_s = None if step is None else step * record.time_step_s
    where = "" if step is None else f", t = {time_s:.6g} s (step {step})"
    return RunStoppedError(
        f"{record.engine}, {record.scene}{where}: its dumps cannot be right: {reason}. {ADVICE}",
        dataclasses.replace(
            record, exit_state=FAILED, reason=f"{reason} (found in the dumps)", stopped_at_s=time_s
        ),
    )


def speed_most(scene: Scene) -> float:
    """The fastest speed that a scene asks for (m/s): at the start, or of its drive."""
    speed = float(np.hypot(*scene.snapshot.velocity.T).max())
    return max(speed, scene.drive.speed_m_per_s) if scene.drive else speed


def energy_besides(scene: Scene) -> float:
    """Energy at the start that is not the motion of the centres (J): spins, ½ I ω², and
    overlaps."""
    snapshot = scene.snapshot
    contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    overlap = np.maximum(0.0, -contacts.gap)
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    r, s = snapshot.radius[contacts.first], snapshot.radius[second]
    # against a wall the effective radius is the disk's own
    effective = np.where(contacts.is_wall, r, r * s / (r + s))
    spinning = 0.5 * float(snapshot.inertia @ snapshot.spin**2)
    return spinning + float(elastic_energy(scene, overlap, effective).sum())


def elastic_energy(scene: Scene, overlap: Floats, effective_radius: Floats) -> Floats:
    """Energy (k,) J of contacts of overlap δ (k,) m and effective radius R (k,) m: ½ k δ² (hooke),
    ⅖ K √R δ^2.5 (hertz)."""
    k = scene.contact.stiffness_N_per_m
    if scene.contact.law == "hooke":
        hooke: Floats = 0.5 * k * overlap**2
        return hooke
    # the stiffness of LAMMPS' hertz, whose force is K √(R δ) δ
    stiffness = k / (1.5 * np.sqrt(0.5 * 0.01) * float(scene.snapshot.radius.mean()))
    hertz: Floats = 0.4 * stiffness * np.sqrt(effective_radius) * overlap**2.5
    return hertz
