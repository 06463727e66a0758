"""Runs as PedPy's trajectories, and density and speed before the door by PedPy's own methods."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import shapely

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.engines.record import read_finished
from analysis.scene.rigid_bodies import people_of
from analysis.scene.scene import Scene
from analysis.studies.exposure.loads import NEAR_M
from analysis.support.extras import load
from nscd.arrays import Floats

# s: a speed is the way of so long. Frames in which cells are made: at most so many, evenly.
SPEED_S, FRAMES = 0.2, 40
# m: no cell reaches further from its person, as at an import.
CELL_RADIUS_M = 1.0


def trajectory(folder: Path) -> Any:
    """Give a finished run as `pedpy.TrajectoryData`: the people of every frame (of a body of several
    disks its centre), m.

    Raises MissingExtraError without PedPy, EngineError where no run ended there, and DumpError where
    its frames are not evenly apart."""
    pedpy, pandas = load("pedpy"), load("pandas")
    _, record = read_finished(folder)
    frames = [snapshot_of(one) for one in open_bodies(folder / "bodies.dump", record.time_step_s).trajectory]
    intervals = np.diff([one.time for one in frames])
    if not len(intervals) or np.ptp(intervals) > 1e-6 * intervals[0]:
        raise DumpError(f"{folder}: its frames are not evenly apart, which PedPy needs")
    people = [people_of(one)[0] for one in frames]
    positions = np.concatenate([one.position for one in people])
    number = np.repeat(np.arange(len(people)), [len(one) for one in people])
    ids = np.concatenate([one.ids for one in people])
    table = pandas.DataFrame({"id": ids, "frame": number, "x": positions[:, 0], "y": positions[:, 1]})
    return pedpy.TrajectoryData(table, frame_rate=float(1 / intervals.mean()))


def before_door(folder: Path, scene: Scene) -> Any:
    """Measure a finished run by PedPy within 2 m before the own door, at up to 40 evenly spaced
    moments: a data frame of `time_s`, `density_per_m2` and `speed_m_per_s` by Voronoi cells, and
    `classic_density_per_m2`.

    Cells end at the walls where these and the doors enclose the people. Raises as `trajectory`, and
    ValueError where there is no door."""
    pedpy, pandas = load("pedpy"), load("pandas")
    if scene.drive is None or not scene.drive.has_door:
        raise ValueError(f"{scene.name}: density before a door, and there is none")
    every = trajectory(folder)
    floor, area = _floor(scene, every.data[["x", "y"]].to_numpy()), _half_disk(scene)
    step = max(1, round(SPEED_S * every.frame_rate))
    speed = pedpy.compute_individual_speed(
        traj_data=every, frame_step=step, speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED
    )
    last = int(every.data["frame"].max())
    some = np.unique(np.linspace(0, last, min(last + 1, FRAMES)).round().astype(int))
    data = every.data[every.data["frame"].isin(some)]
    inside = data[shapely.contains_xy(floor, data["x"], data["y"])].drop(columns="point", errors="ignore")
    measured = area & floor
    if inside.empty or measured.area == 0.0:
        raise ValueError(f"{scene.name}: nobody is before the door")
    tracks = pedpy.TrajectoryData(inside.reset_index(drop=True), frame_rate=every.frame_rate)
    position = pedpy.MeasurementArea(measured)
    cells = pedpy.compute_individual_voronoi_polygons(
        traj_data=tracks, walkable_area=pedpy.WalkableArea(floor),
        cut_off=pedpy.Cutoff(radius=CELL_RADIUS_M, quad_segments=8),
    )  # fmt: skip
    density, parts = pedpy.compute_voronoi_density(individual_voronoi_data=cells, measurement_area=position)
    moving = pedpy.compute_voronoi_speed(
        traj_data=tracks, individual_voronoi_intersection=parts, individual_speed=speed,
        measurement_area=position,
    )  # fmt: skip
    classic = pedpy.compute_classic_density(traj_data=tracks, measurement_area=position)
    columns = {
        "density_per_m2": density.reset_index().set_index("frame")["density"],
        "speed_m_per_s": moving.reset_index().set_index("frame")["speed"],
        "classic_density_per_m2": classic.reset_index().set_index("frame")["density"],
    }
    found = pandas.DataFrame(columns).dropna().reset_index()
    found = found[found["frame"].isin(some)].reset_index(drop=True)
    found.insert(0, "time_s", found.pop("frame") / every.frame_rate)
    return found


def _half_disk(scene: Scene) -> Any:
    """Within 2 m of the middle of the own door, on its inner side."""
    assert scene.drive is not None
    middle, (x, y) = np.mean(scene.drive.door, axis=0), scene.drive.outward
    side = np.array([[-y, x], [y, -x]]) * 2 * NEAR_M
    inner = np.concatenate([middle + side, middle + side[::-1] - 2 * NEAR_M * np.array([x, y])])
    return shapely.Point(middle).buffer(NEAR_M, quad_segs=64) & shapely.Polygon(inner)


def _floor(scene: Scene, positions: Floats) -> Any:
    """The floor that walls and doors enclose and on which people start, else a box round them all."""
    assert scene.drive is not None
    lines = [(wall.start_m, wall.end_m) for wall in scene.walls] + scene.drive.gates
    noded = shapely.union_all(shapely.linestrings(np.array(lines)))
    rooms = shapely.polygonize([*getattr(noded, "geoms", [noded])]).geoms
    start = shapely.multipoints(scene.people.position)
    floor = shapely.union_all([one for one in rooms if one.intersects(start)])
    if floor.geom_type == "Polygon" and floor.intersects(shapely.Point(np.mean(scene.drive.door, axis=0)).buffer(0.1)):
        return floor
    (x0, y0), (x1, y1) = positions.min(0) - NEAR_M, positions.max(0) + NEAR_M
    return shapely.box(x0, y0, x1, y1)
