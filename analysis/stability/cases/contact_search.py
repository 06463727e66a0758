"""Contacts that an engine's search has not found in time: too small a skin, lists renewed too
seldom."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.stability.case import Axis, Case, Cell, Outcome
from analysis.stability.crowds import MASS_KG, PERIOD_S, RADIUS_M, STIFFNESS_N_PER_M, line, scene_of
from analysis.stability.motion import GAIN, QUANTITIES, common_cell, read_motion, undriven_cell
from analysis.stability.trial import Edit, try_engine

SPEED_M_PER_S = 1.0
SKIN_LINE = "neigh_modify every 1 delay 0 check yes binsize 1.0"
STEP_S = 0.1 * PERIOD_S
CHECKED = "lammps, checks each step"


def skin_attempt(skin: float, row: str, folder: Path) -> Cell:
    """Two disks that meet, each at SPEED_M_PER_S, and start just outside the skin (m) of a
    neighbour list that the row says when to renew."""
    gap = skin * (1 + 1e-6)
    places = line(2, 2 * RADIUS_M + gap)
    velocity = [[SPEED_M_PER_S, 0.0], [-SPEED_M_PER_S, 0.0]]
    duration = (gap + 4 * RADIUS_M) / SPEED_M_PER_S
    scene = scene_of(places, velocity, duration=duration, frames=100, time_step=STEP_S)
    if row.startswith("lammps"):
        edits = [
            Edit(
                file="crowd.in", old="variable skin index 0.1", new=f"variable skin index {skin!r}"
            )
        ]
        if row != CHECKED:
            every = f"neigh_modify every {_every(row)} delay 0 check no binsize 1.0"
            edits.append(Edit(file="crowd.in", old=SKIN_LINE, new=every))
    else:
        edits = [Edit(file="crowd.py", old="SKIN_M = 0.04", new=f"SKIN_M = {skin!r}")]
    name = row.replace(" ", "").replace(",", "_")
    trial = try_engine(scene, row.split(",")[0], folder / name / f"{skin:.9g}", edits)
    motion = read_motion(trial, scene)
    passed = len(motion.position) and motion.position[-1, 1, 0] < motion.position[-1, 0, 0]
    if passed and not motion.gain > 1 + GAIN:
        reason = "the disks passed through each other"
        return common_cell(skin, row, trial, motion, Outcome.INACCURATE, reason)
    return undriven_cell(skin, row, trial, motion)


def _every(row: str) -> int:
    return int(row.rsplit(" ", 1)[1])


def skin_theory(row: str) -> float:
    """The skin below which a contact is noticed so late, with the overlap δ = 2vNΔt − skin, that it
    adds GAIN to the energy.

    ½μu² + ½k x(t)x(t+Δ), with u the velocity between t and t + Δ and x the overlap, is what
    leapfrog keeps for a spring: with the last step before the contact, of 2vΔt, it adds ½kδ(δ −
    2vΔt)."""
    if "every" not in row:
        return float("nan")
    path = 2 * SPEED_M_PER_S * STEP_S
    added = 2 * GAIN * MASS_KG * SPEED_M_PER_S**2 / STIFFNESS_N_PER_M
    late = path / 2 + np.sqrt(path**2 / 4 + added)
    return float(_every(row) * path - late)


def skin(quick: bool) -> Case:
    """Skins that are too small."""
    rows = [CHECKED, "lammps, every 30", "yade, verletDist"]
    if not quick:
        rows = [
            CHECKED,
            "lammps, every 10",
            "lammps, every 30",
            "lammps, every 100",
            "lammps, every 400",
            rows[2],
        ]
    return Case(
        name="skin",
        title="Contacts lost by the search",
        fails="LAMMPS with lists renewed every N steps unchecked: contacts are noticed late (energy from nothing) or never",
        columns=Axis(
            label="skin of the neighbour list (m)",
            values=(0.01, 0.03, 0.1)
            if quick
            else (0.001, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.4, 0.9),
        ),
        rows=Axis(label="engine, renewal of its list", values=tuple(rows)),
        quantities=QUANTITIES,
        attempt=skin_attempt,
        fails_as=(Outcome.ENERGY_GAIN,),
        theory=skin_theory,
        edge="2vNΔt − δ with ½kδ(δ − 2vΔt) = 5 % of the energy",
        words=(
            "Two disks meet, each at 1 m/s, and start just outside the skin. The product's own deck renews its list as soon "
            "as a disk has moved by half a skin, so that any skin serves (the first row), and YADE's collider does the same "
            "with its verletDist. A list that is renewed every N steps without a check (neigh_modify … check no) misses what "
            "comes closer in between than the skin.",
        ),
    )
