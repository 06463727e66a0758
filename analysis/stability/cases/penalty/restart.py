"""Runs that are cut in two."""

import dataclasses
from pathlib import Path

import numpy as np

from analysis.scene.scene import ContactModel, Run
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import engine_cell
from analysis.stability.crowds import (
    RADIUS_M,
    STIFFNESS_N_PER_M,
    disks,
    rhombus,
    rhombus_walls,
    scene_of,
)
from analysis.stability.frames import Frames, run_frames
from analysis.stability.trial import ENGINES
from nscd import Snapshot

ACROSS, HALF_S, STEPS = 3, 0.2, 1000
# In r: a dashpot that sees the velocity of half a step before changes by this much at most when it
# starts afresh.
SAME = 1e-5


def attempt(friction: float, engine: str, folder: Path) -> Cell:
    """Stir up a packing for 2 · HALF_S: in one run, and in two of which the second starts from what
    the dump of the first ends with."""
    velocity = np.random.default_rng(3).normal(size=(ACROSS**2, 2))
    first = scene_of(
        disks(rhombus(ACROSS), velocity),
        Run(duration_s=HALF_S, frames=5, time_step_s=HALF_S / STEPS),
        contact=ContactModel(
            stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=0.5, friction=friction
        ),
        walls=rhombus_walls(ACROSS),
    )
    whole = first.with_run(duration_s=2 * HALF_S, frames=10)
    in_one = run_frames(whole, engine, folder / "whole")
    half = run_frames(first, engine, folder / "first")
    second = first.model_copy(update={"snapshot": _last(half, first.snapshot)})
    in_two = run_frames(second, engine, folder / "second")
    apart = _apart(in_one, in_two)
    outcome = Outcome.STABLE if apart <= SAME else Outcome.INACCURATE
    cell = engine_cell(in_two, outcome, f"positions differ by {apart:.2g} r")
    return dataclasses.replace(cell, numbers=(apart,))


def _last(frames: Frames, start: Snapshot) -> Snapshot:
    """The disks of the last frame, spins included."""
    last = {name: getattr(frames, name)[-1] for name in ("position", "velocity", "spin")}
    return dataclasses.replace(start, **last)


def _apart(one: Frames, two: Frames) -> float:
    if one.trouble or two.trouble:
        return float("nan")
    return float(np.abs(one.position[-1] - two.position[-1]).max() / RADIUS_M)


def case(quick: bool) -> Case:
    """Make the case."""
    return Case(
        name="restart",
        columns=Axis("friction", (0.0, 0.5) if quick else (0.0, 0.01, 0.1, 0.3, 0.5, 1.0)),
        rows=Axis("engine", ENGINES),
        quantities=("difference of positions / r",),
        attempt=attempt,
        fails_as=(Outcome.INACCURATE,),
        values={"same": SAME},
    )
