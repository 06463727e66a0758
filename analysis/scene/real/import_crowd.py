"""A scene from a real crowd: one frame of a trajectory, its heads made disks, the overlaps
reconciled; and further frames made crowds alike."""

import json
import textwrap
from bisect import bisect
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pedpy
import shapely

from analysis.scene.anthropometry import Varied
from analysis.scene.placement import rooms_of
from analysis.scene.real.separate import OverlapError, reconcile
from analysis.scene.real.trajectory import FARTHEST_M, HeadPositions, Recording, TrajectoryError
from analysis.scene.scene import Room, Scene, SceneError, read_room
from analysis.scene.schema import OtherFrames, Reconciliation
from analysis.support.files import write_text
from nscd import Snapshot, Walls, find_contacts
from nscd.arrays import Floats, Indices, Mask
from nscd.segments import lengths

# People farther than this from everyone have cells of this radius in the Voronoi densities.
CELL_RADIUS_M = 0.8
FREE_MARGIN_M = 10.0
SMALLEST_RADIUS_M, LARGEST_RADIUS_M = 0.05, 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImportedCrowd:
    """A scene and where its people's heads were: heads (n,2) m, in the order of its disks."""

    scene: Scene
    head_positions: Floats
    report: Reconciliation

    @property
    def statement(self) -> str:
        """What was done to the crowd, in one paragraph."""
        return self.report.statement

    def write(self, folder: Path) -> Path:
        """Write the scene, and `<name>.reconciliation.json` with the report and the place of each
        person's head and disk; return the path of the scene file."""
        snapshot = self.scene.snapshot
        content: dict[str, object] = self.report.model_dump(exclude_none=True) | {
            "statement": self.statement,
            "id": snapshot.ids.tolist(),
        }
        for kind, points in (("head", self.head_positions), ("disk", snapshot.position)):
            content |= {f"{kind}_{axis}_m": points[:, i].tolist() for i, axis in enumerate("xy")}
        path = self.scene.write(folder)
        lines = [
            f'"{key}": {json.dumps(value, ensure_ascii=False)}' for key, value in content.items()
        ]
        write_text(
            folder / f"{self.scene.name}.reconciliation.json", "{\n" + ",\n".join(lines) + "\n}\n"
        )
        return path


def import_crowd(
    tracked: HeadPositions,
    *,
    radius: float,
    room: Path,
    mass: float = 75.0,
    name: str | None = None,
    varied: Varied | None = None,
) -> ImportedCrowd:
    """Put the people of one frame as disks into the room of a TOML file.

    tracked: of `read_heads`
    radius: m
    mass: kg
    varied: how people differ; nobody does where left out
    name: of the scene; the room's where left out

    People outside the polygon of walls and door (where there are walls) are left out. The others
    are moved as little as possible until no disks overlap (see `reconcile`); they keep the
    velocities of their heads. Ids below 1 are counted from 1, which the notes of the scene say.
    Local densities are left out of the report where their Voronoi cells cannot be computed.

    Raises TrajectoryError, SceneError or OverlapError naming the file, the frame and the person or
    the key."""
    sizes = _bodies(radius, mass, varied or Varied(), len(tracked.ids))
    stated, comment = read_room(room, (float(sizes[0].mean()), float(sizes[1].mean())))
    crowd, area, shifted = _placed(tracked, sizes, stated, str(room), name=name or room.stem)
    comment += shifted
    density = _densities(crowd.head_positions, crowd.scene.snapshot.position, area)
    report = Reconciliation.model_validate(crowd.report.model_dump() | density)
    notes = comment + "\n" + textwrap.fill(report.statement, 110, break_long_words=False)
    scene = crowd.scene.model_copy(update={"notes": notes.strip(), "reconciliation": report})
    scene = scene.round_walls()
    scene.check(tracked.origin)
    return replace(crowd, scene=scene, report=report)


def place_crowd(
    tracked: HeadPositions,
    *,
    radius: float,
    room: Scene,
    origin: str,
    mass: float = 75.0,
    before: ImportedCrowd | None = None,
) -> ImportedCrowd:
    """Do as `import_crowd`, without notes and local densities.

    room: a scene with nobody in it; origin: its file, for messages
    before: the crowd of a frame shortly before, with the same ids; people are then moved apart from
        where its disks would be, so that contacts do not jump from one frame to the next"""
    sizes = _bodies(radius, mass, Varied(), len(tracked.ids))
    return _placed(tracked, sizes, room, origin, name=room.name, before=before)[0]


def _placed(
    tracked: HeadPositions,
    sizes: tuple[Floats, Floats],
    stated: Room,
    room: str,
    *,
    name: str,
    before: ImportedCrowd | None = None,
) -> tuple[ImportedCrowd, shapely.Polygon, str]:
    """The crowd with radii (m) and masses (kg), its room's polygon, and what to say of its ids;
    room: as messages name it."""
    radii, masses = sizes
    if stated.drive is not None and stated.drive.goals:
        raise SceneError(f"{room}: drive.goals: a real crowd goes to one door here")
    area = _area(stated, room, tracked.position)
    inside = shapely.contains_xy(area, tracked.position)
    selected, radii, masses = _inside(tracked, inside, room), radii[inside], masses[inside]
    # LAMMPS counts from 1, many trajectories from 0
    first = 0 if selected.ids.min() > 0 else 1 - int(selected.ids.min())
    walls = stated.wall_segments()
    outward = None if stated.drive is None else np.array(stated.drive.outward)
    start = None if before is None else _moved_on(before, selected.ids + first, selected.position, area)
    try:
        arranged = reconcile(selected.position, radii, walls, stated.door(), outward, start)
    except (OverlapError, ValueError) as error:
        raise OverlapError(f"{tracked.origin}: {error}") from None
    snapshot = Snapshot(
        position=arranged.position,
        velocity=selected.velocity.round(6),
        radius=radii,
        mass=masses,
        ids=selected.ids + first,
    )
    scene = Scene.of(stated, name=name, snapshot=snapshot)
    try:  # who stops may be elsewhere now
        (scene.with_drive(stops=()) if scene.drive and scene.drive.stops else scene).check(
            tracked.origin
        )
    except SceneError as error:
        why = str(error).removeprefix(f"{tracked.origin}: ")
        raise SceneError(
            f"{tracked.origin}: {len(radii)} people of radius {radii.mean():.3g} m do not fit into "
            f"{Path(room).name}: moved apart, {why}. A smaller radius may help"
        ) from None
    report = Reconciliation(
        file=tracked.file.name,
        frame=tracked.frame,
        people=len(radii),
        left_out=int((~inside).sum()),
        radius_m=round(float(radii.mean()), 6),
        radius_sd_m=round(float(radii.std()), 6) if np.ptp(radii) else None,
        velocity_window_s=tracked.window_s,
        linearisations=arranged.linearisations,
        **_changes(selected.position, snapshot, walls, stated.analysis.contact_tolerance_m),
    )
    comment = f"\nIds of disks are those of the people plus {first}.\n" if first else ""
    return ImportedCrowd(scene=scene, head_positions=selected.position, report=report), area, comment


def _bodies(radius: float, mass: float, varied: Varied, people: int) -> tuple[Floats, Floats]:
    """Radii (m) and masses (kg) of people; SceneError for what is out of range."""
    if not SMALLEST_RADIUS_M <= radius <= LARGEST_RADIUS_M:
        raise SceneError(
            f"radius: {radius:g} m. Between {SMALLEST_RADIUS_M:g} and {LARGEST_RADIUS_M:g} m is "
            "needed"
        )
    if not 0 < mass < 1000:
        raise SceneError(f"mass: {mass:g} kg. Between 0 and 1000 kg is needed")
    try:
        return varied.bodies(radius, mass, people)
    except ValueError as error:
        raise SceneError(str(error)) from None


def _moved_on(before: ImportedCrowd, ids: Indices, positions: Floats, area: shapely.Polygon) -> Floats:
    """The disks of an earlier crowd, moved as their heads have moved since, (n,2) m; at their heads
    those who were not there, or whom this would take out of the room."""
    snapshot, start = before.scene.snapshot, positions.copy()
    _, now, then = np.intersect1d(ids, snapshot.ids, return_indices=True)
    start[now] += snapshot.position[then] - before.head_positions[then]
    return np.where(shapely.contains_xy(area, start)[:, None], start, positions)


def _inside(tracked: HeadPositions, inside: Mask, room: str) -> HeadPositions:
    """The heads inside the walls. Raises TrajectoryError for none, or one without a velocity."""
    if not inside.any():
        raise TrajectoryError(f"{tracked.origin}: {_nobody(tracked.position, room)}")
    selected = replace(
        tracked,
        ids=tracked.ids[inside],
        position=tracked.position[inside],
        velocity=tracked.velocity[inside],
    )
    if not np.isfinite(selected.velocity).all():
        person = selected.ids[int(np.argmin(np.isfinite(selected.velocity).all(axis=1)))]
        raise TrajectoryError(
            f"{tracked.origin}: person {person} is not seen over {tracked.window_s:g} s: no velocity"
        )
    return selected


def _area(stated: Room, path: str, positions: Floats) -> shapely.Polygon:
    """The polygon that walls and door bound; without walls, a box with room for everyone."""
    if not stated.walls:
        return shapely.box(*(positions.min(0) - FREE_MARGIN_M), *(positions.max(0) + FREE_MARGIN_M))
    area = shapely.union_all(rooms_of(positions, stated.wall_segments(), stated.door()))
    if not isinstance(area, shapely.Polygon) or area.is_empty:
        raise SceneError(f"{path}: walls: with the door they must enclose one room")
    return area


def who_is_inside(recording: Recording, room: Room, origin: str) -> tuple[set[int], str]:
    """Find the frames in which somebody is inside the walls of a room, and say in a line how the
    trajectory looks, and who is never inside.

    origin: the file of the room, for messages

    Raises TrajectoryError where nobody ever is."""
    good = (recording.data[["x", "y"]].abs() <= FARTHEST_M).all(axis=1)
    data = recording.data[good]
    position, plausibility = data[["x", "y"]].to_numpy(), recording.plausibility
    rooms = rooms_of(position, room.wall_segments(), room.door()) if room.walls else []
    if not rooms or not good.any():
        return set(recording.numbers.tolist()), plausibility.line()
    inside = shapely.contains_xy(shapely.union_all(rooms), position)
    if not inside.any():
        raise TrajectoryError(f"{recording.file}: {_nobody(position, origin)}")
    out = data.id.nunique() - data.id[inside].nunique()
    # a place that is none is refused where its frame is read
    occupied = {*data.frame[inside].tolist(), *recording.data.frame[~good].tolist()}
    empty = len(recording.numbers) - len(occupied)
    sentences = [f"{out} people outside"] if out else []
    sentences += [f"nobody inside in {empty} frames (0 N)"] if empty else []
    return occupied, plausibility.line(*sentences)


def _nobody(positions: Floats, room: str) -> str:
    (x0, y0), (x1, y1) = positions.min(0), positions.max(0)
    return (
        f"nobody is inside the walls of {room}: heads between ({x0:g}, {y0:g}) and ({x1:g}, {y1:g}) "
        "m. Is the unit right (m, cm)?"
    )


def _changes(positions: Floats, after: Snapshot, walls: Walls, tolerance: float) -> dict[str, Any]:
    """The measured numbers of the report, rounded to a micrometre, so that every machine gives the
    same digits."""
    before = Snapshot(position=positions, radius=after.radius, mass=after.mass)
    in_contact, left = (
        find_contacts(snapshot, walls, tolerance=tolerance) for snapshot in (before, after)
    )
    overlapping = in_contact.gap < 0
    overlap = -in_contact.gap[overlapping & ~in_contact.is_wall]
    move = after.position - positions
    moved = lengths(move)
    mean_x, mean_y = move.mean(0)
    numbers = {
        "overlap_before_largest_m": overlap.max(initial=0.0),
        "overlap_before_mean_m": overlap.mean() if len(overlap) else 0.0,
        "overlap_before_sum_m": overlap.sum(),
        "overlap_after_m": np.maximum(-left.gap, 0.0).max(initial=0.0),
        "moved_mean_m": moved.mean(),
        "moved_rms_m": np.sqrt((moved * moved).mean()),
        "moved_largest_m": moved.max(),
        "moved_share_over_1_cm": (moved > 0.01).mean(),
        "moved_mean_x_m": mean_x,
        "moved_mean_y_m": mean_y,
    }
    counts = {
        "overlaps_before": len(overlap),
        "wall_overlaps_before": int((overlapping & in_contact.is_wall).sum()),
        "contacts_after": int((~left.is_wall).sum()),
        "wall_contacts_after": int(left.is_wall.sum()),
    }
    return {key: round(float(value), 6) + 0.0 for key, value in numbers.items()} | counts


def _densities(positions: Floats, disks: Floats, area: shapely.Polygon) -> dict[str, float]:
    """Mean and highest decile (1/m²) of the local densities before and after; nothing where GEOS
    fails on a Voronoi cell, as it does for some touching disks of one radius."""
    try:
        found = {"before": _voronoi(positions, area), "after": _voronoi(disks, area)}
    except shapely.errors.GEOSException:
        return {}
    return {
        f"density_{when}_{name}_per_m2": round(float(value), 6)
        for when, each in found.items()
        for name, value in (("mean", each.mean()), ("decile", np.quantile(each, 0.9)))
    }


def _voronoi(position: Floats, area: shapely.Polygon) -> Floats:
    """1/m² of each person: one over the area of the Voronoi cell, cut at CELL_RADIUS_M and at the
    walls, by PedPy."""
    table = pd.DataFrame(
        {"id": np.arange(len(position)), "frame": 0, "x": position[:, 0], "y": position[:, 1]}
    )
    cells = pedpy.compute_individual_voronoi_polygons(
        traj_data=pedpy.TrajectoryData(data=table, frame_rate=1.0),
        walkable_area=pedpy.WalkableArea(area),
        cut_off=pedpy.Cutoff(radius=CELL_RADIUS_M, quad_segments=8),
    )
    density: Floats = cells["density"].to_numpy(dtype=np.float64)
    return density


def with_other_frames(
    imported: ImportedCrowd,
    recording: Recording,
    count: int,
    apart_s: float,
    make: Callable[[int], ImportedCrowd],
) -> tuple[ImportedCrowd, list[str]]:
    """Let a scene have the crowds of other frames of its film; return it and, for each frame of
    which no crowd can be made, why.

    count, apart_s: how many, and s between two; see `frames_near`
    make: makes a crowd of the frame of a number"""
    report = imported.report
    found, crowds, refused, reasons = [], [], [], []
    for number in frames_near(report.frame, recording, count, apart_s):
        try:
            crowd = make(number).scene.snapshot
        except (TrajectoryError, SceneError, OverlapError) as error:
            refused.append(number)
            reasons.append(str(error))
        else:
            found.append(number)
            crowds.append(crowd)
    if not found and not refused:
        return imported, []
    start = recording.time_of(report.frame)
    after = [round(recording.time_of(number) - start, 6) for number in found]
    others = OtherFrames(
        frames=tuple(found),
        after_s=tuple(after),
        data=OtherFrames.files(imported.scene.name, found),
        refused=tuple(refused),
    )
    changes = {"other_frames": others, "other_crowds": tuple(crowds)}
    return replace(imported, scene=imported.scene.model_copy(update=changes)), reasons


def frames_near(frame: int, recording: Recording, count: int, apart_s: float) -> list[int]:
    """List the numbers of so many other frames, nearest first, each `apart_s` from the next; nearer
    to each other, evenly, where the film is too short, and fewer where it has not so many."""
    numbers = recording.numbers
    at, last = int(np.searchsorted(numbers, frame)), len(numbers) - 1

    def near(step: int) -> tuple[range, range]:
        return range(at - step, -1, -step), range(at + step, last + 1, step)

    wanted = max(1, round(min(apart_s / recording.step_s, last)))
    # the largest step, from `wanted` down, that leaves room for so many
    steps = range(wanted, 0, -1)
    index = bisect(steps, -1, key=lambda step: sum(map(len, near(step))) - count)
    every = (index_of for side in near(steps[min(index, len(steps) - 1)]) for index_of in side[:count])
    return [int(numbers[one]) for one in sorted(every, key=lambda one: abs(one - at))[:count]]
