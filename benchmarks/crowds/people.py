"""What arms, and bodies of three disks, change in a crowd before a door: medians and ranges over seeds.

    nice -n 19 python benchmarks/crowds/people.py FOLDER [--what arms shoulders]

arms: the scene `arms` with reaches from 0 to 0.2 m, its last 4 s. shoulders: the scene `shoulders` with
120 people, and the same people as disks of the area that their three cover, seconds 1 to 6. By the rigid
engine, in windows of 0.1 s. Runs that are in the folder are taken as they are. Writes FOLDER/arms.png and
FOLDER/shoulders.png."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from analysis.engines.run import EngineRun
from analysis.pages.drawing import COLOURS, GRID, draw_disks, panels
from analysis.scene.rigid_bodies import shapes
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.studies.exposure.loads import read_exposure
from benchmarks.machine import options, ranges, table
from nscd import Snapshot

REACHES_M, PEOPLE, SEEDS = (0.0, 0.05, 0.1, 0.15, 0.2), 120, 5
SHOWN: Mapping[str, str] = {
    "contact_largest": "largest contact force (kN)",
    "contact_mean": "mean contact force (kN)",
    "person_largest": "largest sum on a person (kN)",
    "walls": "load on all walls (kN)",
    "density_door": "density within 2 m of the door (1/m²)",
    "flow": "flow through the door (1/s)",
}


def with_reach(scene: Scene, reach: float) -> Scene:
    """The scene with arms of another reach (m), and without for 0."""
    force = scene.contact.arm_force_N or 200.0
    return scene.with_contact(arm_reach_m=reach or None, arm_force_N=force if reach else None)


def as_disks(scene: Scene) -> Scene:
    """The scene with each person one disk of the area of the body."""
    crowd = scene.snapshot
    of = crowd.bodies
    assert of is not None
    radius = np.sqrt([shape.area / np.pi for shape in shapes(crowd)])
    disks = Snapshot(position=of.centre, radius=radius, mass=of.mass)
    return scene.model_copy(update={"name": "as_disks", "snapshot": disks})


def quantities(scene: Scene, folder: Path, last_s: float) -> list[float]:
    """What a crowd has in its last seconds, by SHOWN: means, and of largest ones the largest."""
    run = EngineRun(scene=scene, engine="rigid", folder=folder)
    run.record()
    loads = read_exposure(folder)
    last = loads.last(last_s)
    found = []
    for name, title in SHOWN.items():
        values = loads.values[name][last] / (1e3 if "(kN)" in title else 1.0)
        found.append(float(values.max() if name.endswith("largest") else values.mean()))
    return found


def arms(out: Path) -> str:
    """Measure arms of every reach, and draw forces as shares of those without."""
    made = [make("arms", seed=1 + seed).with_run(frames=60) for seed in range(SEEDS)]
    every = list(enumerate(made))
    found = np.array([[quantities(with_reach(one, r), out / f"{r:g}_{n}", 4.0) for n, one in every]
                      for r in REACHES_M])  # fmt: skip
    figure, (axes,) = panels(8.0, 4.5)
    fraction = found / np.median(found[0], axis=0)
    for index, name in enumerate(SHOWN.values()):
        if "(kN)" in name:
            low, middle, high = np.quantile(fraction[:, :, index], [0.0, 0.5, 1.0], axis=1)
            where = 100 * (np.array(REACHES_M) + 0.0015 * (index - 1.5))
            axes.errorbar(
                where, middle, [middle - low, high - middle], marker="o", capsize=3,
                color=COLOURS[index % len(COLOURS)], label=name.rpartition(" (")[0],
            )  # fmt: skip
    axes.set(xlabel="reach of arms (cm)", ylabel="over the median without arms", ylim=(0, None))
    axes.grid(color=GRID)
    axes.legend(fontsize="small")
    figure.savefig(out / "arms.png", dpi=120)
    rows = ([f"{reach:g}", *ranges(some)] for reach, some in zip(REACHES_M, found, strict=True))
    return table(["reach (m)", *SHOWN.values()], rows)


def shoulders(out: Path) -> str:
    """Measure bodies and disks, and draw those before the door at the start."""
    made = [make("shoulders", PEOPLE, 1 + seed).with_run(frames=60) for seed in range(SEEDS)]
    crowds = {"three disks": made, "one disk": list(map(as_disks, made))}
    figure, every = panels(9.0, 4.5, 1, 2)
    rows = []
    for axes, (title, scenes) in zip(every, crowds.items(), strict=True):
        draw_disks(axes, scenes[0].snapshot, COLOURS[0])
        axes.plot([0, 0], [-2, -0.5], [0, 0], [0.5, 2], color="k", lw=2)
        frame = {"xlim": (-3, 0.3), "ylim": (-2, 2), "aspect": "equal"}
        axes.set(title=title, xlabel="x (m)", ylabel="y (m)", **frame)
        folders = (out / f"{title[:3]}_{number}" for number in range(SEEDS))
        found = [quantities(one, path, 5.0) for one, path in zip(scenes, folders, strict=True)]
        rows.append([title, *ranges(found)])
    figure.savefig(out / "shoulders.png", dpi=120)
    return table(["people", *SHOWN.values()], rows)


def main() -> None:
    """Print the tables."""
    parts = {"arms": arms, "shoulders": shoulders}
    args = options(__doc__, "folder", what=parts)
    for name in args.what:
        print(parts[name](args.folder), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
