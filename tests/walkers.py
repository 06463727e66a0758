"""Three people in a row, as the files of others have them: see tests/data/trajectories/README.md."""

import sqlite3

import h5py
import numpy as np

TABLE = "create table trajectory_data (id int, frame int, pos_x real, pos_y real)"
KINDS = [("id", "i8"), ("frame", "i8"), ("x", "f8"), ("y", "f8")]


def walkers():
    """Id, frame, x, y of each row."""
    return [(i, f, 0.5 * (i - 1), 0.1 * f) for i in (1, 2, 3) for f in range(5)]


def base_of(path, rows, *, table=TABLE, fps="10", geometry=(), floors=()):
    """A trajectory of JuPedSim, its floors as WKT, and the number of the floor of each frame."""
    base = sqlite3.connect(path)
    with base:
        base.execute(table)
        base.execute("create table metadata (key text, value text)")
        base.executemany("insert into metadata values (?, ?)", [("fps", fps), ("version", "2")])
        marks = ", ".join("?" * (table.count(",") + 1))
        base.executemany(f"insert into trajectory_data values ({marks})", rows)
        base.execute("create table geometry (hash integer, wkt text)")
        base.executemany("insert into geometry values (?, ?)", enumerate(geometry))
        if floors:
            base.execute("create table frame_data (frame integer, geometry_hash integer)")
            base.executemany("insert into frame_data values (?, ?)", enumerate(floors))
    base.close()
    return path


def archive(path, rows=None, kinds=KINDS, floor=None, **attributes):
    """A trajectory of the archive in Jülich, into a file or what is like one."""
    with h5py.File(path, "w") as file:
        made = file.create_dataset("trajectory", data=np.array(rows or walkers(), dtype=kinds))
        made.attrs.update({"fps": 10.0} | attributes)
        if floor:
            file.attrs["wkt_geometry"] = floor
    return path
