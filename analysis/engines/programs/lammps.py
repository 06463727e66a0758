"""LAMMPS with a look at each step: the deck crowd.in, and the impulses of its contacts.

    python -m analysis.engines.programs.lammps DECKS -var … (the words of lmp but for -in and -log)

A contact that begins and ends between two frames is in none of them, and every tenth step may miss
much of a short impact. Here the forces of every step are summed, as the step itself uses them:
LAMMPS calls back after it has computed them, when velocities are those of the middle of the step.
The step of a frame counts half in the window that ends and half in the one that begins, so that the
impulses of a window are m (u_end − u_start) of each disk less what its drive gave."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.engines.programs.impulse_sums import ImpulseSums

# In the folder of the decks: names of walls, in the order of the scene.
WALLS = "impulse_walls.txt"
IDS, PAIRS, LOOK = "impulse_ids", "impulse_pairs", "impulse_look"
OUT = "impulses.dump"


def main(words: Sequence[str]) -> int:
    """Run the deck; return the exit status."""
    from lammps import lammps

    decks, *rest = words
    engine = lammps(cmdargs=["-log", "none", *rest, "-var", "run", "no"])
    engine.file(f"{decks}/crowd.in")
    engine.command(f"compute {IDS} all property/local patom1 patom2 cutoff radius")
    engine.command(f"compute {PAIRS} all pair/local fx fy p1 p2 cutoff radius")
    engine.command(f"fix {LOOK} all external pf/callback 1 1")
    walls = (Path(decks) / WALLS).read_text(encoding="utf-8").split()
    with (Path(engine.extract_variable("out")) / OUT).open("w", encoding="utf-8") as file:
        engine.set_fix_external_callback(LOOK, _Look(engine, walls, ImpulseSums(file)).step, None)
        engine.command(f"include {decks}/run.in")
    engine.close()
    return 0


class _Look:
    """What is done at each step of a running LAMMPS."""

    def __init__(self, engine: Any, walls: Sequence[str], sums: ImpulseSums) -> None:
        self.look, self.sums = engine.numpy, sums
        self.fixes = [f"wall_{name}" for name in walls]
        self.interval = int(engine.extract_variable("frame_interval"))
        self.time_step = float(engine.extract_variable("time_step"))

    def step(self, _: Any, number: int, count: int, tags: Any, *__: Any) -> None:
        """Sum what the contacts give in step `number`; at that of a frame, write it."""
        if number % self.interval:
            self._add(count, tags, 1.0)
            return
        if number:
            self._add(count, tags, 0.5)
        self.sums.write(number)
        self._add(count, tags, 0.5)

    def _add(self, count: int, tags: Any, share: float) -> None:
        """Add a share of the step's impulses: force times step, LAMMPS' being on the first body."""
        from lammps import LMP_STYLE_ATOM, LMP_STYLE_LOCAL, LMP_TYPE_ARRAY

        times = -share * self.time_step
        ids = self.look.extract_compute(IDS, LMP_STYLE_LOCAL, LMP_TYPE_ARRAY)
        if ids is not None and len(ids):
            parts = self.look.extract_compute(PAIRS, LMP_STYLE_LOCAL, LMP_TYPE_ARRAY)
            force = parts[:, :2] + parts[:, 2:]
            touching = (force != 0).any(axis=1)
            first, second = ids[touching].astype(np.int64).T
            self.sums.add(first, second, False, times * force[touching])
        for place, fix in enumerate(self.fixes, start=1):
            rows = self.look.extract_fix(fix, LMP_STYLE_ATOM, LMP_TYPE_ARRAY)[:count]
            pressed = np.flatnonzero(rows[:, 0])
            if len(pressed):
                first = tags[:count].ravel()[pressed].astype(np.int64)
                self.sums.add(first, np.full_like(first, place), True, times * rows[pressed, 1:3])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
