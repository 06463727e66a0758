"""Barrier loads: a crowd that stands pressed against a wall at the depth and on the slope of a row of
the Green Guide's table, its steady load and the shock of its arrival apart.

    nice -n 19 python benchmarks/crowds/barrier.py FOLDER

A lane 4 m wide, 47 people on 10 m² (masses of ANSUR II), no friction. Disks as wide as shoulders
fill the ground at that density; their radii are multiplied until the pressed crowd is as deep as
the row says (found by trial, of seed 0), so that it stays so deep. Each pushes with what the row
implies, load / depth / density: the weight along the slope as a body force, and the rest walking. They
start from rest, close up for 4 s, and are pressed for 4 s more. Prints a table: loads per metre of
wall as shares of the row's, median and range over seeds. Runs that are in the folder are taken as they
are."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from analysis.dumps.windows import RunWindows, Window
from analysis.engines.run import EngineRun
from analysis.scene.anthropometry import bodies_of, separated
from analysis.scene.drive import Drive
from analysis.scene.scene import Scene
from analysis.scene.schema import GRAVITY, Analysis, BodyForce, ContactModel, Room, Run, Wall
from benchmarks.machine import head, line, options
from nscd import Snapshot, Walls
from nscd.arrays import Floats

# Green Guide, Table 11.2: loads (N per m of barrier), and the depths (m) of the crowds that give them
# on slopes (degrees). That the first row is flat is our reading.
LOADS = (5000.0, 4000.0, 3400.0, 3000.0, 2000.0)
DEPTHS_M: Mapping[int, tuple[float, ...]] = {
    0: (5.0, 4.0, 3.3, 3.0, 2.0),
    10: (4.3, 3.4, 2.9, 2.6, 1.7),
    15: (3.8, 3.0, 2.6, 2.3, 1.5),
    20: (3.4, 2.7, 2.3, 2.0, 1.3),
    25: (3.1, 2.5, 2.1, 1.8, 1.2),
}
DENSITY, WIDTH, MEAN_KG = 4.7, 4, 76.3
ENDS = ("start_m", "end_m")
# Disks of the area of an ellipse of breadth and depth, made as wide as shoulders: 0.240 m.
SHOULDERS, SPACING = 1.38, 2.4
# A tenth of the people may stand farther back.
TAU_S, CLOSE_UP_S, STEADY_S, WITHIN = 0.5, 4.0, 4.0, 0.9
SEEDS, TRIALS, NEAR = 5, 4, 0.02
MODELS: Mapping[str, tuple[str, dict[str, object]]] = {
    "rigid": ("rigid", {}),
    "LAMMPS, 10⁶ N/m": ("lammps", {}),
    "LAMMPS, a chest": ("lammps", {"law": "body_hertz"}),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Choose a crowd."""

    slope: int  # degrees, of DEPTHS_M
    load: float  # N/m, of LOADS
    model: str  # of MODELS
    wider: float = SHOULDERS  # what radii are multiplied by

    @property
    def depth(self) -> float:
        """Give how deep (m) the crowd of the row is."""
        return DEPTHS_M[self.slope][LOADS.index(self.load)]

    @property
    def push(self) -> float:
        """Give the push (N) of each that the row implies, the weight along the slope included."""
        return self.load / self.depth / DENSITY

    @property
    def walk(self) -> float:
        """Give what of that push is not the weight along the slope (N)."""
        return self.push - MEAN_KG * GRAVITY * math.sin(math.radians(self.slope))

    def run(self, seed: int, out: Path) -> EngineRun:
        """Give the run of a seed, in a folder of its own."""
        name, changes = MODELS[self.model]
        words = [f"{self.slope}", f"{self.load:.0f}", f"{self.wider:.3f}", str(seed), name]
        folder = out / "_".join([*words, *map(str, changes.values())])
        made = self._scene(seed).with_contact(**changes)
        return EngineRun(scene=made, engine=name, folder=folder)

    def _scene(self, seed: int) -> Scene:
        disks, end = self.crowd(seed), CLOSE_UP_S + STEADY_S
        slope = BodyForce(slope_deg=float(self.slope), downhill=(1.0, 0.0)) if self.slope else None
        speed = self.walk * TAU_S / float(disks.mass.mean())
        door = {"door_start_m": (0, 0), "door_end_m": (0, WIDTH), "outward": (1, 0)}
        drive = Drive(speed_m_per_s=speed, relaxation_time_s=TAU_S, **door)
        room = Room(
            title="A crowd before a barrier",
            source="Green Guide, Table 11.2",
            walls=lane(self.depth),
            drive=drive,
            body_force=slope,
            contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1),
            run=Run(duration_s=end, frames=round(10 * end), impulses=True),
            analysis=Analysis(kind="driven"),
        )
        return Scene.of(room, name=f"barrier_{self.slope}_{self.load:.0f}", snapshot=disks)

    def crowd(self, seed: int) -> Snapshot:
        """Draw people behind the wall x = 0: on a grid, moved a little, pushed apart where they still
        overlap. The masses are multiplied to have the mean of everybody."""
        count = round(DENSITY * WIDTH * self.depth)
        random = np.random.default_rng([seed, 6])
        radius, mass = bodies_of("ANSUR II", count, seed)
        across = int(WIDTH / (SPACING * self.wider * radius.mean()))
        index = np.stack(np.divmod(np.arange(count), across), axis=1) + 0.5
        index *= WIDTH / across * np.array([-1, 1])
        index += random.uniform(-0.05, 0.05, (count, 2))
        mass *= MEAN_KG / mass.mean()
        disks = Snapshot(position=index, radius=self.wider * radius, mass=mass)
        walls = lane(self.depth)
        start, end = (np.array([getattr(wall, key) for wall in walls]) for key in ENDS)
        return separated(disks, Walls(start=start, end=end))


def lane(depth: float) -> tuple[Wall, ...]:
    """Give the wall, metre by metre, and the sides of the lane, longer than the crowd needs."""
    back = -3 * depth - 3
    front = [Wall(name=f"front_{y}", start_m=(0, y), end_m=(0, y + 1)) for y in range(WIDTH)]
    sides = [Wall(name=f"side_{y}", start_m=(back, y), end_m=(0, y)) for y in (0, WIDTH)]
    return (*front, *sides)


def depth_of(window: Window) -> float:
    """Give the depth (m) of a crowd of even density, nine tenths of which are as near to the wall
    as those of this one."""
    return float(np.quantile(-window.now.position[:, 0], WITHIN) / WITHIN)


def loads(run: EngineRun) -> tuple[Floats, Floats, float]:
    """Give the ends of the windows (s), the load (w, metres) N/m of the wall, and the depth (m) at
    the end."""
    end, found, depth = [], [], 0.0
    for window in RunWindows(run.folder, run.record().time_step_s).between_frames():
        row = np.zeros(WIDTH)
        front = window.is_wall & (window.keys[:, 1] <= WIDTH)
        size = np.abs(window.impulse[front, 0]) / window.duration
        np.add.at(row, window.keys[front, 1] - 1, size)
        end.append(window.end)
        found.append(row)
        depth = depth_of(window)
    return np.array(end), np.array(found), depth


def measured(case: Case, run: EngineRun) -> list[float]:
    """Give the depth (m) and, as shares of the row's load: pressed, the whole wall, the worst metre
    and its largest 0.1 s; while they close up, the largest 0.1 s of the whole wall and of a
    metre."""
    end, load, depth = loads(run)
    late = end > CLOSE_UP_S + 1e-9
    steady, before = load[late], load[~late]
    worst = steady.mean(0).argmax()
    values = [steady.mean(), steady.mean(0).max(), steady[:, worst].max()]
    values += [before.mean(1).max(), before.max()]
    return [depth, *(float(value) / case.load for value in values)]


def found_case(case: Case, out: Path) -> Case:
    """Find how wide people are who stand as deep when pressed; by trial, of seed 0."""
    for _ in range(TRIALS):
        now = loads(case.run(0, out))[2]
        if abs(now / case.depth - 1) <= NEAR:
            break
        case = replace(case, wider=round(case.wider * math.sqrt(case.depth / now), 3))
    return case


def main() -> None:
    """Run all, and print the table."""
    args = options(__doc__, "out", models=dict(MODELS), loads=LOADS)
    points: list[tuple[int, Floats]] = []
    names = ["slope (°)", "row (kN/m)", "depth (m)", "model", "push (N)", "of it walking (N)"]
    names += ["mean radius (m)", "depth when pressed (m)", "pressed: whole wall", "worst metre"]
    names += ["its largest 0.1 s", "arrival: whole wall, 0.1 s", "worst metre, 0.1 s"]
    print(head(*names, "deepest overlap (r)"))
    for slope, load, model in itertools.product(DEPTHS_M, args.loads, args.models):
        case = found_case(Case(slope=slope, load=load, model=model), args.out)
        runs = [case.run(seed, args.out) for seed in range(1, SEEDS + 1)]
        rows = np.array([measured(case, run) for run in runs])
        deep = max(run.record().overlap_largest for run in runs)
        radius = np.mean([run.scene.snapshot.radius.mean() for run in runs])
        cells = [str(slope), f"{load / 1000:g}", f"{case.depth:g}", model, f"{case.push:.0f}"]
        cells += [f"{case.walk:.0f}", f"{radius:.3f}", *map(_cell, rows.T), f"{deep:.2f}"]
        print(line(cells), flush=True)
        points.append((slope, rows))
    picture(points).savefig(args.out / "barrier.png")


def picture(points: Sequence[tuple[int, Floats]]) -> Figure:
    """Draw the worst metre of each row, pressed and at arrival: median and range over its crowds."""
    figure = Figure(figsize=(8, 4), layout="constrained", dpi=120)
    axes = figure.subplots()
    slopes = [slope for slope, _ in points]
    rank = [slopes[:n].count(slope) for n, slope in enumerate(slopes)]
    names = ("pressed, mean of 4 s", "arrival, worst 0.1 s")
    for column, name, colour in zip((2, 5), names, ("#0072b2", "#d55e00"), strict=True):
        shown = [np.quantile(rows[:, column], [0.5, 0.0, 1.0]) for _, rows in points]
        middle, low, high = np.array(shown).T
        x = np.array(slopes) + 0.6 * np.array(rank) + (0.25 if column == 5 else 0.0)
        errors = [middle - low, high - middle]
        axes.errorbar(x, middle, errors, fmt="o", ms=4, color=colour, label=name)
    axes.axhline(1.0, color="0.5", lw=1)
    axes.set(xlabel="slope (°); loads of the table from 5.0 to 2.0 kN/m")
    axes.set(ylabel="load / design load", ylim=0)
    axes.set_xticks(list(DEPTHS_M))
    axes.legend(frameon=False, loc="lower right")
    return figure


def _cell(values: Floats) -> str:
    """Median and range."""
    return f"{np.median(values):.2f} ({values.min():.2f} – {values.max():.2f})"


if __name__ == "__main__":
    main()
