"""Contacts that an engine's search has not found in time: too small a skin, lists renewed too
seldom."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.scene.scene import Run
from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.cells import ENGINE_QUANTITIES, GAIN, engine_cell, undriven_cell
from analysis.stability.crowds import (
    MASS_KG,
    PERIOD_S,
    RADIUS_M,
    STIFFNESS_N_PER_M,
    disks,
    line,
    scene_of,
)
from analysis.stability.frames import run_frames
from analysis.stability.trial import Edit

SPEED_M_PER_S = 1.0
STEP_S, FRAMES = 0.1 * PERIOD_S, 100
RENEWAL = "neigh_modify every 1 delay 0 check yes binsize 1.0"


@dataclass(frozen=True, slots=True)
class Search:
    """A row: the engine, and every how many steps its list is renewed unchecked; None: as its own
    deck or script has it, which checks each step."""

    engine: str
    every: int | None = None

    def __str__(self) -> str:
        checked = "checks each step" if self.engine == "lammps" else "verletDist"
        return f"{self.engine}, {f'every {self.every}' if self.every else checked}"

    def edits(self, skin: float) -> list[Edit]:
        """Give the engine's input another skin (m), and its renewal."""
        if self.engine == "yade":
            return [Edit(file="crowd.py", old="SKIN_M = 0.04", new=f"SKIN_M = {skin!r}")]
        old = "variable skin index "
        edits = [Edit(file="crowd.in", old=f"{old}0.1", new=f"{old}{skin!r}")]
        if self.every:
            unchecked = f"neigh_modify every {self.every} delay 0 check no binsize 1.0"
            edits.append(Edit(file="crowd.in", old=RENEWAL, new=unchecked))
        return edits


def attempt(skin: float, row: Search, folder: Path) -> Cell:
    """Let two disks meet, each at SPEED_M_PER_S, that start just outside the skin (m) of the row's
    neighbour list."""
    gap = skin * (1 + 1e-6)
    between = np.ceil((gap + 4 * RADIUS_M) / SPEED_M_PER_S / (FRAMES * STEP_S)) * STEP_S
    scene = scene_of(
        disks(line(2, 2 * RADIUS_M + gap), [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]]),
        Run(duration_s=FRAMES * between, frames=FRAMES, time_step_s=STEP_S),
    )
    frames = run_frames(scene, row.engine, folder, row.edits(skin))
    passed = len(frames.position) and frames.position[-1, 1, 0] < frames.position[-1, 0, 0]
    if passed and not frames.gain > 1 + GAIN:
        reason = "the disks passed through each other"
        return engine_cell(frames, Outcome.INACCURATE, reason)
    return undriven_cell(frames)


def theory(row: Search) -> float:
    """Compute the skin below which a contact is noticed so late, with the overlap
    δ = 2vNΔt − skin, that it adds GAIN to the energy.

    ½μu² + ½k x(t)x(t+Δ), with u the velocity between t and t + Δ and x the overlap, is what
    leapfrog keeps for a spring: with the last step before the contact, of 2vΔt, it adds ½kδ(δ −
    2vΔt)."""
    if row.every is None:
        return float("nan")
    path = 2 * SPEED_M_PER_S * STEP_S
    added = 2 * GAIN * MASS_KG * SPEED_M_PER_S**2 / STIFFNESS_N_PER_M
    late = path / 2 + np.sqrt(path**2 / 4 + added)
    return float(row.every * path - late)


def case(quick: bool) -> Case:
    """Make the case."""
    every = (30,) if quick else (10, 30, 100, 400)
    full = (0.001, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.9)
    unchecked = (Search("lammps", steps) for steps in every)
    return Case(
        name="skin",
        columns=Axis("skin of the neighbour list (m)", (0.01, 0.03, 0.1) if quick else full),
        rows=Axis("engine, renewal of its list", (Search("lammps"), *unchecked, Search("yade"))),
        quantities=ENGINE_QUANTITIES,
        attempt=attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=theory,
    )
