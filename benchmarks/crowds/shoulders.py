"""Shoulders: what bodies of three disks change in a crowd before a door, against disks.

    nice -n 19 python benchmarks/crowds/shoulders.py FOLDER

The scene `shoulders` with 120 people of several seeds, and the same people as disks of the area that
their three cover, by the rigid engine: medians and ranges over seeds of seconds 1 to 6, in windows of
0.1 s. Runs that are in the folder are taken as they are. Writes the picture FOLDER/shoulders.png."""

from pathlib import Path

import numpy as np

from analysis.dumps.windows import RunWindows
from analysis.engines.run import EngineRun
from analysis.pages.drawing import COLOURS, draw_disks, panels
from analysis.scene.rigid_bodies import shapes
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import head, line, options, ranges
from nscd import Snapshot

PEOPLE, SEEDS, LAST_S = 120, 5, 5.0
SHOWN = ("load on all walls (kN)", "largest contact force (kN)", "flow through the door (1/s)")


def as_disks(scene: Scene) -> Scene:
    """The scene with each person one disk of the area of the body."""
    crowd = scene.snapshot
    of = crowd.bodies
    assert of is not None
    radius = np.sqrt([shape.area / np.pi for shape in shapes(crowd)])
    disks = Snapshot(position=of.centre, radius=radius, mass=of.mass)
    return scene.model_copy(update={"name": "as_disks", "snapshot": disks})


def quantities(scene: Scene, folder: Path) -> list[float]:
    """What a crowd has in its last seconds, by SHOWN: means, and of the largest the largest."""
    record = EngineRun(scene=scene, engine="rigid", folder=folder).record()
    windows = [
        window
        for window in RunWindows(folder, record.time_step_s).between_frames()
        if window.start > scene.run.duration_s - LAST_S - 1e-9
    ]
    walls = [float(window.force[window.is_wall].sum()) for window in windows]
    largest = max(float(window.force.max(initial=0.0)) for window in windows)
    many = 1 if scene.snapshot.bodies is None else len(scene.snapshot) // len(scene.snapshot.bodies)
    inside = [float((window.now.position[:, 0] < 0).sum()) for window in (windows[0], windows[-1])]
    return [float(np.mean(walls)), largest, (inside[0] - inside[1]) / many / LAST_S]


def picture(crowds: list[Snapshot], path: Path) -> None:
    """The people before the door at the start, as bodies and as disks."""
    figure, axes = panels(9.0, 4.5, 1, 2)
    for (title, shown), crowd in zip(
        (("three disks", axes[0]), ("one disk", axes[1])), crowds, strict=True
    ):
        draw_disks(shown, crowd, COLOURS[0])
        shown.plot([0, 0], [-2, -0.5], [0, 0], [0.5, 2], color="k", lw=2)
        frame = {"xlim": (-3, 0.3), "ylim": (-2, 2), "aspect": "equal"}
        shown.set(title=title, xlabel="x (m)", ylabel="y (m)", **frame)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Print the table."""
    out: Path = options(__doc__, "folder").folder
    print(head("people", *SHOWN))
    made = [make("shoulders", PEOPLE, 1 + seed).with_run(frames=60) for seed in range(SEEDS)]
    for name, scenes in (("three disks", made), ("one disk", [as_disks(one) for one in made])):
        rows = [quantities(one, out / f"{name[:3]}_{n}") for n, one in enumerate(scenes)]
        print(line([name, *ranges(np.array(rows) / [1e3, 1e3, 1.0])]))
    picture([made[0].snapshot, as_disks(made[0]).snapshot], out / "shoulders.png")


if __name__ == "__main__":
    main()
