"""LAMMPS' raw contact dumps (pairs.dump, wall_NAME.dump) merged into the one contact dump that
every engine gives.

`compute pair/local` evaluates forces with the velocities at the end of a step, where the step
itself used those of its middle; with a dashpot this differs by the order of the time step in motion
(7 % of the largest force in a crowd that is running together, none at rest). For the linear law the
force of the step is therefore recomputed here, from the overlap and the velocities v - dt f/(2m),
so that the contact forces on a disk sum up to the force that moved it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps import CONTACT_COLUMNS, DumpError, DumpIndex, index_dump
from analysis.engines.penalty import Penalty, penalty_of
from analysis.scene.contact import BODY, body_force
from analysis.scene.scene import Scene
from analysis.support.files import whole_file
from nscd.arrays import Floats, Indices

_ROW = "%d %d %d %.17g %.17g %.17g %.17g %.17g\n"


def merge_contacts(folder: Path, scene: Scene) -> None:
    """Write contacts.dump from bodies.dump, pairs.dump and one wall_NAME.dump a wall (numbered in
    the scene's order), frame by frame, and remove the last two. Forces are those that the first
    exerts on the second."""
    bodies = index_dump(folder / "bodies.dump")
    pairs = index_dump(folder / "pairs.dump", "ENTRIES")
    touching = [index_dump(folder / f"wall_{wall.name}.dump") for wall in scene.walls]
    if any(other.steps != bodies.steps for other in (pairs, *touching)):
        raise DumpError(f"{folder}/bodies.dump: not the frames of the contact dumps")
    with pairs.path.open(encoding="utf-8") as file:
        box = "".join([file.readline() for _ in range(8)][4:8])
    law = _PairLaw(scene, penalty_of(scene), bodies)
    with whole_file(folder / "contacts.dump") as out:
        for frame, step in enumerate(pairs.steps):
            tables = [law.rows(pairs.table(frame), frame)]
            tables += [
                _wall_rows(wall.table(frame), number, scene.contact.law == BODY)
                for number, wall in enumerate(touching, start=1)
            ]
            rows = np.concatenate(tables)
            rows = rows[rows[:, 5] > 0] + 0.0  # no negative zeros
            rows = rows[np.lexsort((rows[:, 1], rows[:, 0], rows[:, 2]))]
            out.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ENTRIES\n{len(rows)}\n{box}")
            out.write(f"ITEM: ENTRIES {' '.join(CONTACT_COLUMNS)}\n")
            out.writelines(_ROW % tuple(row) for row in rows.tolist())
    for index in (pairs, *touching):
        index.path.unlink()


@dataclass(frozen=True, slots=True)
class _PairLaw:
    scene: Scene
    penalty: Penalty
    bodies: DumpIndex

    def rows(self, table: Floats, frame: int) -> Floats:
        """Contact rows of the raw table: ids, distance, normal and tangential force on the first,
        first minus second."""
        disks = self.bodies.table(frame)
        rank = np.searchsorted(disks[:, self.bodies.columns.index("id")], table[:, :2])
        radius = disks[:, self.bodies.columns.index("radius")]
        normal = -table[:, 7:9] / table[:, 2:3]
        overlap = radius[rank].sum(1) - table[:, 2]
        normal_force, tangential = -table[:, 3:5], -table[:, 5:7]
        approach = (self._middle_velocity(disks, frame, rank) * normal).sum(1)
        if self.scene.contact.law == BODY:
            elastic = body_force(overlap, np.zeros(len(overlap), bool))
            size = elastic + self.penalty.damping * np.maximum(0.0, approach)
            normal_force = size[:, None] * normal
        elif self.scene.contact.law == "hooke":
            size = np.maximum(
                0.0, self.penalty.stiffness * overlap + self.penalty.damping * approach
            )
            normal_force = size[:, None] * normal
            tangential = self._slide(tangential, np.hypot(*table[:, 3:5].T), size)
        force = normal_force + tangential
        turn = np.where(table[:, 0] < table[:, 1], 1.0, -1.0)[:, None]
        return np.column_stack(
            [
                np.sort(table[:, :2], axis=1),
                np.zeros(len(table)),
                turn * normal,
                overlap,
                turn * force,
            ]
        )

    def _slide(self, tangential: Floats, size_at_end: Floats, size: Floats) -> Floats:
        """Tangential forces (k,2) N with the limit of friction at the normal force of the step, not
        of its end."""
        length = np.hypot(*tangential.T)
        friction = self.penalty.friction
        slides = (length >= friction * size_at_end * (1 - 1e-12)) | (length > friction * size)
        # a direction first, from numbers near one: the ratio of forces overflows where this one is
        # next to nothing, and its length has no digits there
        largest = np.abs(tangential).max(axis=1)
        direction = tangential / np.where(largest > 0, largest, 1.0)[:, None]
        direction /= np.maximum(np.hypot(*direction.T), 1.0)[:, None]
        limited = (friction * size)[:, None] * direction
        return np.where((slides & (length > 0))[:, None], limited, tangential)

    def _middle_velocity(self, disks: Floats, frame: int, rank: Indices) -> Floats:
        """Velocity of the first relative to the second in the middle of the step that ends at this
        frame."""
        get = [
            disks[:, self.bodies.columns.index(name)] for name in ("vx", "vy", "fx", "fy", "mass")
        ]
        half = 0.5 * self.penalty.time_step if self.bodies.steps[frame] else 0.0
        velocity = np.column_stack(
            [get[0] - half * get[2] / get[4], get[1] - half * get[3] / get[4]]
        )
        relative: Floats = velocity[rank[:, 0]] - velocity[rank[:, 1]]
        return relative


def _wall_rows(table: Floats, number: int, body: bool) -> Floats:
    """Contact rows of a raw wall table: id, x, y, radius, force on the disk, point of contact; the
    spring of the law `body` is not in that force."""
    to_wall = table[:, 6:8] - table[:, 1:3]
    distance = np.hypot(*to_wall.T)
    normal = to_wall / distance[:, None]
    ones = np.ones(len(table))
    overlap, force = table[:, 3] - distance, -table[:, 4:6]
    if body:
        force = force + body_force(overlap, ones > 0)[:, None] * normal
    return np.column_stack([table[:, 0], number * ones, ones, normal, overlap, force])
