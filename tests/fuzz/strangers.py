"""What comes from elsewhere, and what is made of it: trajectories of every format, floors, a pushed
row, contact problems, films, parts of tables."""

from __future__ import annotations

import io
import json
import tempfile
from pathlib import Path

from tests.forked import as_program, in_fork
from tests.walkers import archive, base_of, walkers

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests/data/trajectories"
# name → what the command line must say of it
STATED = {
    "metres.txt": (), "centimetres.txt": (), "bare.txt": ("--unit", "m", "--frame-rate", "10"),
    "table.csv": ("--unit", "m"), "crowdit.csv": (), "pathfinder.csv": (), "pathfinder.json": (),
    "viswalk.pp": (), "steps.traj": ("--frame-rate", "10"), "jupedsim.sqlite": (), "archive.h5": (),
}  # fmt: skip
FLOOR = "POLYGON ((0 0, 6 0, 6 5, 0 5, 0 0), (3 2, 3.5 2, 3.5 3, 3 3, 3 2))"


def trajectories():
    """Name → content of the same walkers in every format."""
    found = {path.name: path.read_bytes() for path in HERE.iterdir() if path.name in STATED}
    head = "pedestrianId-PID1 simTime endTime-PID1 startX-PID1 startY-PID1 endX-PID1 endY-PID1"
    steps = [(i, f / 10, f / 10 + 0.1, x, y, x, y + 0.1) for i, f, x, y in walkers()]
    text = "\n".join([head, *(" ".join(f"{cell:.4g}" for cell in row) for row in steps)]) + "\n"
    return found | {
        "steps.traj": text.encode(),
        "jupedsim.sqlite": jupedsim(),
        "archive.h5": archive(io.BytesIO(), floor=FLOOR).getvalue(),
    }


def jupedsim():
    """The content of a trajectory of JuPedSim with its floor."""
    with tempfile.TemporaryDirectory() as folder:
        return base_of(Path(folder) / "one", walkers(), geometry=[FLOOR]).read_bytes()


def floors():
    """Name → content of a floor, and how `new` is told its doors."""
    ring = [[0, 0], [6, 0], [6, 5], [0, 5], [0, 0]]
    door = ("--door", "6,2,6,3")

    def box(x, y, width, height):
        return {"type": "RECTANGLE", "x": x, "y": y, "width": width, "height": height}

    bounds = {"x": 0.0, "y": 0.0, "width": 7.0, "height": 6.0}
    topography = {
        "attributes": {"bounds": bounds, "boundingBoxWidth": 0.5, "bounded": True},
        "obstacles": [{"id": 1, "shape": box(3.0, 2.0, 0.5, 1.0)}],
        "targets": [{"id": 7, "shape": box(6.0, 2.0, 0.5, 1.0)}],
        "sources": [{"id": 3, "shape": box(1, 1, 3, 3), "targetIds": [7], "spawnNumber": 30}],
    }
    scenario = {"name": "hall", "scenario": {"topography": topography}}
    polygon = {"type": "Polygon", "coordinates": [ring]}
    return {
        "floor.wkt": (FLOOR.encode(), door),
        "floor.geojson": (json.dumps(polygon).encode(), door),
        "floor.sqlite": (jupedsim(), door),
        "floor.scenario": (json.dumps(scenario).encode(), ()),
    }


def pushed_row(random):
    """Heads of a row: the first walks at 1 m/s from 0.2 s on, the others stand."""
    rows = ["id,frame,time,x,y,Weight_kg,Gender"]
    for person in range(random.choice((2, 3))):
        for frame in range(34):
            walked = max(frame / 25 - 0.2, 0.0) if not person else 0.0
            position = 0.45 * person + walked
            rows.append(f"{person},{frame},{frame / 25:.2f},{position:.3f},0.0,80.0,male")
    return ("\n".join(rows) + "\n").encode()


def made_by(words, files, name):
    """The content of a file that a command makes of others."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        for path, content in files.items():
            (here / path).write_bytes(content)
        status, message, _ = in_fork(lambda: as_program(words, here), 600)
        assert status == 0, message
        made = here / name
        if made.is_dir():
            return {str(p.relative_to(here)): p.read_bytes() for p in made.iterdir()}
        return made.read_bytes()
