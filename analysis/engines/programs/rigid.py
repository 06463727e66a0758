"""The program of the rigid engine: a scene from start to end, by Moreau–Jean steps.

    python -m analysis.engines.programs.rigid scene.toml --out FOLDER --step 0.005

The dumps are those of the other engines. A rigid contact has percussions and no forces, so a force
in contacts.dump is its percussion since the frame before over that time, and impulses.dump has the
percussion itself (N·s). Where the folder holds dumps of the same run, it goes on after their last
whole frame, to the same digits."""

import argparse
import contextlib
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import numpy as np

from analysis.dumps import DumpError, index_dump, open_bodies, snapshot_of
from analysis.dumps.bodies import JOINED
from analysis.dumps.contacts import CONTACT_COLUMNS
from analysis.engines.energy import CSV, DUMP, Account, kinetic, of_step
from analysis.engines.guard import STOPPED_STATUS
from analysis.engines.rigid import timing, tolerance_of
from analysis.scene.scene import Scene, read_scene
from analysis.support.write_frames import IMPULSE_COLUMNS, write_frame
from nscd import Snapshot
from nscd.arrays import Floats
from nscd.stepping import Motion, Push, StepError, WindowImpulses, WindowSums
from nscd.stepping.motion import segments_of

BODIES, CONTACTS, IMPULSES, _ = NAMES = ("bodies.dump", "contacts.dump", "impulses.dump", DUMP)
BODY_COLUMNS: tuple[str, ...] = (
    "id", "type", "x", "y", "z", "radius", "mass", "vx", "vy", "vz", "omegaz", "fx", "fy",
)  # fmt: skip
# s: who keep their distance look where the others are at frames, and so often after them.
RENEWED_S = 0.05
DRIVE_COLUMNS = ("drive_x", "drive_y")


def main(words: Sequence[str] | None = None) -> int:
    """Run the scene; return the exit status, 3 where a step has no answer."""
    parser = argparse.ArgumentParser(description="Run a scene with the rigid engine.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--step", type=float, default=None)
    parser.add_argument("--threads", type=int, default=1)
    args = parser.parse_args(words)
    scene = read_scene(args.scene)
    if args.step:
        scene = scene.with_run(rigid_step_s=args.step)
    args.out.mkdir(parents=True, exist_ok=True)
    step, state = _last_frame(args.out, scene)
    mode = "a" if step else "w"
    with contextlib.ExitStack() as stack:
        opened = [(args.out / name).open(mode, encoding="utf-8") for name in (*NAMES, CSV)]
        motion = motion_of(scene, state)
        motion.threads = args.threads
        return _Run(motion, scene, step, *map(stack.enter_context, opened)).to_the_end()


def motion_of(scene: Scene, state: Snapshot) -> Motion:
    """Make the motion of a scene from a state on."""
    drive, (h, frames) = scene.drive, (timing(scene).time_step, timing(scene).frame_interval)
    every, latest = max(1, int(RENEWED_S / h + 1e-9)), [(-1, state.velocity)]

    def desired(position: Floats) -> Floats:
        assert drive is not None
        if not drive.keeps_distance:
            return drive.desired_velocity(position, state.ids, motion.time, state.radius)
        # a run that goes on from a frame knows no more than that
        step = int(motion.time / h + 1e-6)
        drawn_step = step - step % frames % every
        if latest[0][0] != drawn_step:
            latest[0] = drawn_step, drive.desired_velocity(position, state.ids, step * h, state.radius)
        return latest[0][1]

    motion = Motion(
        state,
        scene.wall_segments(),
        step=timing(scene).time_step,
        push=Push(
            desired=desired if drive else None,
            relaxation_time=drive.relaxation_time_s if drive else np.inf,
            acceleration=scene.acceleration(),
            arms=scene.contact.arms,
        ),
        restitution=scene.contact.restitution,
        friction=scene.contact.friction,
        tolerance=tolerance_of(scene),
    )
    return motion


def _last_frame(out: Path, scene: Scene) -> tuple[int, Snapshot]:
    """The step and the state after which to go on: of the last frame that all dumps have whole,
    which then end with it; else of the start."""
    full = []
    for name in NAMES:
        try:
            full.append(_cut(out / name, "ATOMS" if name == BODIES else "ENTRIES"))
        except (DumpError, OSError):
            return 0, scene.snapshot
    last = min(ends[-1][0] for ends in full if ends) if all(full) else 0
    if not last:
        return 0, scene.snapshot
    for name, ends in zip(NAMES, full, strict=True):
        with (out / name).open("r+b") as file:
            file.truncate(dict(ends)[last])
    # a row is written before the frames of its step
    with (out / CSV).open("r+b") as table:
        rows = itertools.islice(table, 2 + last // timing(scene).frame_interval)
        table.truncate(sum(map(len, list(rows))))
    trajectory = open_bodies(out / BODIES, timing(scene).time_step).trajectory
    return last, snapshot_of(trajectory[len(trajectory) - 1])


def _cut(path: Path, kind: str) -> list[tuple[int, int]]:
    """Step and end in the file of each whole frame; a file that breaks off is cut to those."""
    while True:
        try:
            frames = index_dump(path, kind).frames
            return [(frame.step, frame.offset + frame.length) for frame in frames]
        except DumpError:
            content = path.read_bytes()
            start = content.rfind(b"ITEM: TIMESTEP")
            if start <= 0:
                raise
            path.write_bytes(content[:start])


class _Run:
    """A motion that writes its frames."""

    def __init__(self, motion: Motion, scene: Scene, step: int, *files: IO[str]) -> None:
        self.scene, self.timing, self.step = scene, timing(scene), step
        self.bodies, self.contacts, self.impulses, losses, table = files
        self.motion = motion
        energy = kinetic(self.motion.snapshot()) + self._stored() if step else None
        self.account = Account(table, losses, energy)

    def to_the_end(self) -> int:
        """Step to the end of the scene; return the exit status."""
        every, h = self.timing.frame_interval, self.timing.time_step
        if self.step:
            _say(f"RESUMED at t = {self.step * h:.6g} s (step {self.step})")
        windows = WindowSums(len(self.scene.snapshot), self.step * h)
        before = self.motion.velocity.copy()
        try:
            if not self.step:
                moved = self.motion.separate()
                if moved:
                    _say(f"overlapping disks were pushed apart, by {moved:.3g} m at most")
                self._write(windows.close(0.0), before)
            while self.step < self.timing.steps:
                done = self.motion.advance()
                windows.add(done.neighbours, done.reaction, done.friction)
                if done.arms:
                    windows.add(*done.arms)
                lost = of_step(self.scene.snapshot, done.neighbours, done.energy)
                self.account.add(done.energy.drive, done.energy.weight, lost)
                self.step += 1
                if self.step % every == 0:
                    self._write(windows.close(self.step * h), before)
                    # a run that goes on from this frame does not know them either
                    self.motion.forget()
                    before = self.motion.velocity.copy()
        except StepError as error:
            where = f"t = {self.step * h:.6g} s (step {self.step})"
            _say(f"GUARD unsolved at {where}: {error}")
            return STOPPED_STATUS
        return 0

    def _stored(self) -> float:
        """The energy of arms (J)."""
        motion, arms = self.motion, self.scene.contact.arms
        if arms is None:
            return 0.0
        walls = segments_of(self.scene.wall_segments())
        return float(arms.energy(arms.reached(motion.position, motion.radius, walls)[0].gap).sum())

    def _write(self, window: WindowImpulses, before: Floats) -> None:
        """A frame of each dump: the window that ends now, and the velocity (n,2) m/s at its
        start."""
        disks, motion, step = self.scene.snapshot, self.motion, self.step
        duration = window.duration or np.inf
        time, now = step * self.timing.time_step, motion.snapshot()
        self.account.write(step, time, moving := kinetic(now), self._stored())
        none = np.zeros(len(disks))
        mean_force = disks.mass[:, None] * (motion.velocity - before) / duration
        columns = [disks.ids, np.ones(len(disks), int), *motion.position.T, none, disks.radius]
        columns += [disks.mass, *motion.velocity.T, none, motion.spin, *mean_force.T]
        names, moves = BODY_COLUMNS, motion.velocity
        if (bodies := disks.bodies) is not None:
            names = names + JOINED
            moves = bodies.mean(moves, disks.mass)[bodies.number]
            columns += [part[bodies.number] for part in (bodies.ids, bodies.inertia)]
        if drive := self.scene.drive:
            desired = drive.desired_velocity(now.centres, disks.ids, time, disks.radius)
            names = names + DRIVE_COLUMNS
            push = disks.mass[:, None] * (desired - moves) / drive.relaxation_time_s
            columns += [*push.T]
        write_frame(self.bodies, "ATOMS", step, names, columns)
        # the smaller id first; numbers of walls from 1
        wall, first = window.is_wall, disks.ids[window.first]
        second = np.where(wall, window.second + 1, disks.ids[np.where(wall, 0, window.second)])
        swapped = ~wall & (first > second)
        sign = np.where(swapped, -1.0, 1.0)[:, None]
        pairs = [np.where(swapped, second, first), np.where(swapped, first, second), wall]
        impulse = sign * window.impulse
        write_frame(self.impulses, "ENTRIES", step, IMPULSE_COLUMNS, [*pairs, *impulse.T])
        # through arms people push at a gap, an overlap below 0
        overlap = -window.gap if self.scene.contact.arms else np.maximum(0.0, -window.gap)
        table = [*pairs, *(sign * window.normal).T, overlap, *(impulse / duration).T]
        write_frame(self.contacts, "ENTRIES", step, CONTACT_COLUMNS, table)
        _say(f"{step:10d} {time:.6g} {len(disks)} {moving:.8g}")


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
