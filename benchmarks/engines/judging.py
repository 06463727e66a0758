"""What `audit` says of the files that a script of an engine wrote, and how its bodies crept or rose."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from analysis.dumps import open_bodies, snapshot_of
from analysis.percussions.audit import Audit, audit
from nscd import Snapshot, Walls

LONG = 99.0  # m, half the length of walls


class Verdict(NamedTuple):
    """Hold what is said of one scene in one engine. creep: m/s, along the floor; lift: m, above it; both
    largest of all bodies."""

    found: Audit
    creep: float
    lift: float

    @property
    def cell(self) -> str:
        """Give the verdict for a table: what is not explained where forces agree, else the fault."""
        found, known = self.found, [one for one in self.found.fits if one.name == ", ".join(self.found.faults)]
        if found.status == "unknown":
            return f"? {found.words.split(': ', 1)[1]}"
        if found.status == "agrees":
            return f"{found.fits[0].residual:.0e}"
        factor = f" ({1 / known[0].factor:.3g})" if known and {"factor", "substeps"} & {*found.faults} else ""
        return (", ".join(found.faults) or f"{found.residual:.0%} not explained") + factor


def walls_of(scene: dict[str, Any]) -> Walls:
    """Give the walls of a scene as segments."""
    point, normal = np.array(scene["walls"]).reshape(-1, 2, 2).swapaxes(0, 1)
    way = LONG * np.column_stack([-normal[:, 1], normal[:, 0]])
    return Walls(start=point - way, end=point + way)


def read(folder: Path, scene: dict[str, Any], step: float) -> tuple[list[Snapshot], list[dict[str, Any]]]:
    """Read the bodies and the contacts of a folder, with the normals of walls."""
    file = folder / "bodies.dump"
    trajectory = open_bodies(file, time_step=step).trajectory
    rows = pd.read_csv(folder / "contacts.csv").astype({"second": int, "is_wall": bool})
    out = -np.array(scene["walls"])[:, 2:]
    normal = np.where(rows.is_wall.to_numpy()[:, None], out[np.where(rows.is_wall, rows.second - 1, 0)], np.nan)
    rows[["nx", "ny"]] = normal
    of = dict([*rows.groupby("step")])
    tables = []
    for number in trajectory.steps:
        table = of.get(number, rows[:0])
        listed = {name: table[name].to_numpy() for name in ("first", "second", "is_wall", "fx", "fy")}
        tables.append(listed | {"normal": table[["nx", "ny"]].to_numpy()})
    return [snapshot_of(one, file) for one in trajectory], tables


def judged(folder: Path, scene: dict[str, Any], step: float) -> Verdict:
    """Judge the contacts of a folder; step: s, from frame to frame."""
    snapshots, tables = read(folder, scene, step)
    g = np.array(scene["gravity"])
    found = audit(snapshots, tables, external=lambda now: now.mass[:, None] * g, walls=walls_of(scene),
                  friction=scene["friction"] or None, time_step=step)  # fmt: skip
    x, y = np.array([one.position for one in snapshots]).transpose(2, 0, 1)
    creep = float(np.abs(x[-1] - x[0]).max() / (snapshots[-1].time - snapshots[0].time))
    return Verdict(found, creep, float((y - snapshots[0].radius).max()))
