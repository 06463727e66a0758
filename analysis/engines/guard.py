"""The guard of a run: what the engines look for while they run, as their last words say it, and how
a stopped run ends.

The looking itself is done by the engines' own means (lammps_inputs/guard.in,
yade_scripts/crowd_guard.py), so that a plain run has it too. docs/results/guard.md derives the
bounds."""

from __future__ import annotations

import dataclasses
import re
import shutil
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from analysis.engines.process import killed_by
from analysis.engines.record import FAILED, STOPPED, EngineError, RunRecord
from analysis.scene.scene import Scene
from nscd import Snapshot, find_contacts
from nscd.arrays import Floats, Mask
from nscd.segments import lengths
from nscd.stepping.motion import segments_of

# The limits; the decks and the script hold the same numbers.
CENTRES_SHARE = 0.5  # of the smallest radius: no two centres are nearer
STEP_SHARE = 0.1  # of a disk's radius, in a step
ENERGY_SHARE = 0.05  # of the energy at the start and of everybody at the desired speed
MOMENTUM_SHARE = 1e-9  # of √(2 M E)
STOPPED_STATUS = 3
# as an engine says it (s)
TIME = r"(\d{1,12}(?:\.\d{0,12})?(?:e[+-]\d\d)?)"
_SHORTER = "Give a smaller time step (run.time_step_s), or none: then it follows from the stiffness"
# What helps, by the kind of what was found; where nothing is known to help, nothing is advised.
ADVICE = {
    "finite": _SHORTER,
    "lost": _SHORTER,
    "unsolved": "Give a shorter time step (run.rigid_step_s) or a larger tolerance "
    "(run.rigid_tolerance)",
    "speed": _SHORTER,
    "energy": _SHORTER,
    "momentum": _SHORTER,
    "overlap": "Give a stiffer contact (contact.stiffness_N_per_m), or a smaller time step where "
    "it is longer than the safe one",
    "wall": "Give stiffer walls (contact.wall_stiffness_N_per_m): they hold up to stiffness times "
    "radius",
}
_SAID = re.compile(
    rf"^GUARD ({'|'.join(ADVICE)}) at t = {TIME} s \(step (\d{{1,12}})\): (.+)$", re.ASCII
)
_NOT_A_NUMBER = (
    "ERROR: Variable guard_kinetic: Non-numeric"  # how LAMMPS itself ends at the guard's question
)
_LOST = re.compile(r"ERROR: Lost atoms: original (\d+) current (\d+)")
_NO_POSITION = re.compile(r"ERROR.*Non-numeric atom")
# Less than this is left on a disk that is full.
FULL_BYTES = 1 << 20


class RunStoppedError(EngineError):
    """A run that did not end well; `record` says how: exit_state, reason and stopped_at_s."""

    def __init__(
        self, record: RunRecord, message: str, step: int | None, advice: str = "", when: str = "t"
    ) -> None:
        time_s = record.stopped_at_s
        where = "" if time_s is None else f", {when} = {time_s:.6g} s (step {step})"
        words = f"{message}. {advice}" if advice else message
        super().__init__(f"{record.engine}, {record.scene}{where}: {words}")
        self.record = record


def verdict_of(lines: Iterable[str]) -> re.Match[str] | None:
    """Find the verdict among the lines that an engine said: its kind, time (s), step and words."""
    return next(filter(None, map(_SAID.match, lines)), None)


def died(
    record: RunRecord, status: int | None, step: int, last: Iterable[str], folder: Path
) -> RunStoppedError:
    """Return the end of a run whose engine ended with a status other than 0 while it worked in the
    folder: stopped by its guard, or by itself."""
    lines, time_s, kind, words = list(last), step * record.time_step_s, "", ""
    if status == STOPPED_STATUS and (message := verdict_of(lines)):
        kind, time_s, step, words = message[1], float(message[2]), int(message[3]), message[4]
    elif any(line.startswith(_NOT_A_NUMBER) for line in lines):
        kind, words = "finite", "the kinetic energy is not a finite number"
    if kind:
        reason = f"{kind}: {words}"
        ended = dataclasses.replace(record, exit_state=STOPPED, reason=reason, stopped_at_s=time_s)
        return RunStoppedError(ended, f"stopped by its guard: {reason}", step, ADVICE[kind])
    reason, advice = _cause(status, lines, folder)
    ended = dataclasses.replace(record, exit_state=FAILED, reason=reason, stopped_at_s=time_s)
    return RunStoppedError(ended, reason, step, advice, "after t")


def _cause(status: int | None, lines: list[str], folder: Path) -> tuple[str, str]:
    """Why an engine ended by itself, and what helps, both in words."""
    if full := full_disk(folder):
        return full, ""
    for line in lines:
        if found := _LOST.search(line):
            return f"disks are lost: {found[1]} at the start, {found[2]} now", ADVICE["lost"]
        if _NO_POSITION.search(line):
            return "a position is not a finite number", ADVICE["finite"]
    if words := killed_by(status):
        return words, ""
    message = next((line for line in reversed(lines) if "error" in line.lower()), "")
    message = message or next(reversed(lines), "")
    # where in its own source, and where in a folder that will be gone
    message = re.sub(r"\s*\((?:\S*/)?\w+\.(?:cpp|h):\d+\)", "", message).replace(f"{folder}/", "")
    return f"it ended with status {status}" + (f" and said: {message.strip()}" if message else ""), ""


def full_disk(folder: Path) -> str:
    """Say that the disk of the folder is full; nothing where it is not."""
    free = shutil.disk_usage(folder).free
    return f"no space is left on the disk of {folder.parent}" if free < FULL_BYTES else ""


def garbage(
    record: RunRecord, reason: str, step: int | None = None, kind: str = ""
) -> RunStoppedError:
    """Return the end of a run that finished with status 0 and whose dumps cannot be right; `step`:
    of the first bad frame; `kind`: as of a verdict."""
    time_s = None if step is None else step * record.time_step_s
    noted = f"{reason} (found in the dumps)"
    ended = dataclasses.replace(record, exit_state=FAILED, reason=noted, stopped_at_s=time_s)
    message = f"its dumps cannot be right: {reason}"
    return RunStoppedError(ended, message, step, ADVICE.get(kind, ""))


def speed_most(scene: Scene) -> float:
    """Return the fastest speed that a scene asks for (m/s): at the start, or of its drive, and what
    a body force adds: g τ with a drive, else g times the duration."""
    speed = float(lengths(scene.snapshot.velocity).max())
    lasts = scene.drive.relaxation_time_s if scene.drive else scene.run.duration_s
    added = float(lengths(np.array(scene.acceleration()))) * lasts
    return (max(speed, scene.drive.fastest) if scene.drive else speed) + added


def turning_inertia(disks: Snapshot) -> Floats:
    """Moments of inertia (n,) kg m² whose ½ I ω² the motion of the centres has not: of a disk, or its
    part by mass of its body's less Σ m |x − c|²."""
    if (of := disks.bodies) is None:
        return disks.inertia
    distance = disks.mass * ((disks.position - of.centre[of.number]) ** 2).sum(1)
    own = (of.inertia - np.bincount(of.number, distance)) / of.mass
    return np.asarray(disks.mass * own[of.number])


def energy_besides(scene: Scene) -> float:
    """Energy at the start that is not the motion of the centres (J): spins, ½ I ω², overlaps and
    arms."""
    snapshot, arms, reached = scene.snapshot, scene.contact.arms, 0.0
    if arms:
        walls = segments_of(scene.wall_segments())
        neighbours, _ = arms.reached(snapshot.position, snapshot.radius, walls)
        reached = float(arms.energy(neighbours.gap).sum())
    contacts = find_contacts(snapshot, scene.wall_segments(), tolerance=0.0)
    overlap = np.maximum(0.0, -contacts.gap)
    second = np.where(contacts.is_wall, contacts.first, contacts.second)
    radii = snapshot.radius[contacts.first], snapshot.radius[second]
    spinning = 0.5 * float(turning_inertia(snapshot) @ snapshot.spin**2)
    elastic = scene.contact.elastic(float(snapshot.radius.mean()))
    effective = effective_radius(*radii, contacts.is_wall)
    return spinning + reached + float(elastic.energy(overlap, effective, contacts.is_wall).sum())


def effective_radius(first: Floats, second: Floats, is_wall: Mask) -> Floats:
    """Effective radius R (k,) m of contacts of disks of radii r and s (k,) m: r s/(r + s), at a wall
    r."""
    return np.where(is_wall, first, first * second / (first + second))
