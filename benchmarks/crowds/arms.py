"""Arms: what the soft layer changes in a crowd before a door, medians over seeds.

    nice -n 19 python benchmarks/crowds/arms.py FOLDER

The scene `arms` of several seeds, by the rigid engine, with reaches from 0 to 0.2 m: medians and
ranges over seeds of the last 4 s, in windows of 0.1 s. Runs that are in the folder are taken as they
are. Writes the picture FOLDER/arms.png."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from analysis.engines.run import EngineRun
from analysis.exposure.loads import read_exposure
from analysis.pages.drawing import COLOURS, GRID, panels
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from benchmarks.machine import head, line, options, ranges

REACHES_M, SEEDS, LAST_S = (0.0, 0.05, 0.1, 0.15, 0.2), 5, 4.0
SHOWN: Mapping[str, str] = {
    "contact_largest": "largest contact force (N)",
    "contact_mean": "mean contact force (N)",
    "person_largest": "sum on the most loaded person (N)",
    "walls": "load on all walls (N)",
    "density_door": "density within 2 m of the door (1/m²)",
    "flow": "flow through the door (1/s)",
}


def with_reach(scene: Scene, reach: float) -> Scene:
    """The scene with arms of another reach (m), and without for 0."""
    force = scene.contact.arm_force_N or 200.0
    return scene.with_contact(arm_reach_m=reach or None, arm_force_N=force if reach else None)


def quantities(reach: float, seed: int, out: Path) -> list[float]:
    """What a crowd has in its last seconds, by SHOWN: means, and of largest ones the largest."""
    scene = with_reach(make("arms", seed=1 + seed).with_run(frames=60), reach)
    run = EngineRun(scene=scene, engine="rigid", folder=out / f"{reach:g}_{seed}")
    run.record()
    loads = read_exposure(run.folder)
    last = loads.last(LAST_S)
    ways = {name: np.max if name.endswith("largest") else np.mean for name in SHOWN}
    return [float(way(loads.values[name][last])) for name, way in ways.items()]


def picture(found: np.ndarray, path: Path) -> None:
    """Medians and ranges (reach, seed, quantity) against the reach, as shares of no arms."""
    figure: Figure
    figure, (axes,) = panels(8.0, 4.5)
    share = found / np.median(found[0], axis=0)
    for place, name in enumerate(SHOWN.values()):
        if "(N)" in name:
            low, middle, high = np.quantile(share[:, :, place], [0.0, 0.5, 1.0], axis=1)
            where = 100 * (np.array(REACHES_M) + 0.0015 * (place - 1.5))
            axes.errorbar(
                where, middle, [middle - low, high - middle], marker="o", capsize=3,
                color=COLOURS[place % len(COLOURS)], label=name.rpartition(" (")[0],
            )  # fmt: skip
    axes.set(xlabel="reach of arms (cm)", ylabel="over the median without arms", ylim=(0, None))
    axes.grid(color=GRID)
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=120)


def main() -> None:
    """Print the table."""
    out: Path = options(__doc__, "folder").folder
    found = np.array(
        [[quantities(reach, seed, out) for seed in range(SEEDS)] for reach in REACHES_M]
    )
    print(head("reach (m)", *SHOWN.values()))
    for reach, rows in zip(REACHES_M, found, strict=True):
        print(line([f"{reach:g}", *ranges(rows)]))
    picture(found, out / "arms.png")


if __name__ == "__main__":
    main()
