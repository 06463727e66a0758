"""Barrier loads: a crowd that stands pressed against a wall at the depth of a row of the Green
Guide's table, its steady load and the shock of its arrival apart, in three models.

    nice -n 19 python benchmarks/crowds/barrier.py FOLDER

A lane 4 m wide, people of ANSUR II, no friction. They start from rest at 47 on 10 m² and close up
(once and a half the time of the last one's way, and 4 s). For 4 s more they are pressed. There are
as many as make the pressed crowd as deep as the row says (found by trial, of seed 0), and each
pushes with what makes the crowd's push that of the row: 1 kN per m² of pressed crowd. The last rows
have the push of 213 N a person that the table implies at its own density. Prints a table: loads per
metre of wall as shares of the row's, median and range over seeds. Runs that are in the
folder are taken as they are."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.dumps.windows import RunWindows, Window
from analysis.engines.run import EngineRun
from analysis.scene.anthropometry import apart, bodies_of
from analysis.scene.scene import Scene
from analysis.scene.schema import Analysis, ContactModel, Drive, Room, Run, Wall
from benchmarks.machine import head, line, options
from nscd import Snapshot, Walls
from nscd.arrays import Floats

# Green Guide, Table 11.2, lowest slope: 1 kN per m of barrier for each metre of depth.
DEPTHS_M, ROW_N_PER_M2 = (2.0, 3.0, 4.0, 5.0), 1000.0
DENSITY, PRESSED, WIDTH = 4.7, 8.7, 4
ROW_PUSH_N, MEAN_KG = ROW_N_PER_M2 / DENSITY, 76.3
# A tenth of the people may stand farther back.
TAU_S, STEADY_S, WITHIN = 0.5, 4.0, 0.9
SEEDS, TRIALS, NEAR = 5, 4, 0.02
MODELS: Mapping[str, tuple[str, dict[str, object]]] = {
    "LAMMPS, 10⁶ N/m": ("lammps", {}),
    "LAMMPS, a chest": ("lammps", {"law": "body_hertz"}),
    "rigid": ("rigid", {}),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Choose a crowd."""

    depth: float  # m, of the pressed crowd
    people: int  # how many
    push: float  # N, of each
    model: str  # of MODELS

    @property
    def speed(self) -> float:
        """Give the speed (m/s) at which somebody of the mean mass walks who is not held up."""
        return self.push * TAU_S / MEAN_KG

    @property
    def press_s(self) -> float:
        """Give how long (s) they close up before the loads are steady."""
        way = self.people / (DENSITY * WIDTH) - self.depth
        return float(np.ceil(1.5 * max(way, 0.0) / self.speed)) + 4.0

    def run(self, seed: int, out: Path) -> EngineRun:
        """Give the run of a seed, in a folder of its own."""
        name, changes = MODELS[self.model]
        words = [f"{self.depth:g}", str(self.people), f"{self.push:.0f}", str(seed), name]
        folder = out / "_".join([*words, *map(str, changes.values())])
        made = self._scene(seed).with_contact(**changes)
        return EngineRun(scene=made, engine=name, folder=folder)

    def _scene(self, seed: int) -> Scene:
        disks, end = crowd(self.people, seed), self.press_s + STEADY_S
        room = Room(
            title="A crowd before a barrier",
            source="Green Guide, Table 11.2",
            walls=lane(self.people),
            drive=Drive(
                speed_m_per_s=self.push * TAU_S / float(disks.mass.mean()),
                relaxation_time_s=TAU_S,
                door_start_m=(0, 0),
                door_end_m=(0, WIDTH),
                outward=(1, 0),
            ),
            contact=ContactModel(stiffness_N_per_m=1e6, restitution=0.1),
            run=Run(duration_s=end, frames=round(10 * end), impulses=True),
            analysis=Analysis(kind="driven"),
        )
        return Scene.of(room, name=f"barrier_{self.depth:g}", snapshot=disks)


def crowd(count: int, seed: int) -> Snapshot:
    """Draw people at 4.7 per m² behind the wall x = 0: on a grid, moved by up to 0.1 m, pushed
    apart where they overlap."""
    depth = count / (DENSITY * WIDTH)
    random = np.random.default_rng([seed, 6])
    rows = int(np.ceil(depth * np.sqrt(DENSITY)))
    across = int(np.ceil(count / rows))
    place = np.stack(np.divmod(np.arange(count), across), axis=1) + 0.5
    place = place * [-depth / rows, WIDTH / across] + random.uniform(-0.1, 0.1, (count, 2))
    radius, mass = bodies_of("ANSUR II", count, seed)
    disks = Snapshot(position=place, velocity=np.zeros_like(place), radius=radius, mass=mass)
    walls = Walls(
        start=np.array([wall.start_m for wall in lane(count)]),
        end=np.array([wall.end_m for wall in lane(count)]),
    )
    return apart(disks, walls)


def lane(count: int) -> tuple[Wall, ...]:
    """Give the wall, metre by metre, and the sides of the lane, longer than so many people need."""
    back = -count / (DENSITY * WIDTH) - 3
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
    late, row = end > case.press_s + 1e-9, ROW_N_PER_M2 * case.depth
    steady, before = load[late], load[~late]
    worst = steady.mean(0).argmax()
    values = [steady.mean(), steady.mean(0).max(), steady[:, worst].max()]
    values += [before.mean(1).max(), before.max()]
    return [depth, *(float(value) / row for value in values)]


def found_case(depth: float, model: str, out: Path, push: float | None = None) -> Case:
    """Find how many people stand as deep when pressed; by trial, of seed 0."""
    people = round(PRESSED * depth * WIDTH)
    for _ in range(TRIALS):
        each = push or ROW_N_PER_M2 * depth * WIDTH / people
        case = Case(depth=depth, people=people, push=each, model=model)
        now = loads(case.run(0, out))[2]
        if abs(now / depth - 1) <= NEAR:
            break
        people = round(people * depth / now)
    return case


def main() -> None:
    """Run all, and print the table."""
    out = options(__doc__, "out").out
    names = ["depth (m)", "row (kN/m)", "model", "people", "push (N)", "depth when pressed (m)"]
    names += ["pressed: whole wall", "worst metre", "its largest 0.1 s"]
    names += ["arrival: whole wall, 0.1 s", "worst metre, 0.1 s", "deepest overlap (r)"]
    print(head(*names))
    asked: list[tuple[float, float | None]] = [(depth, None) for depth in DEPTHS_M]
    for depth, push in [*asked, (3.0, ROW_PUSH_N)]:
        for model in MODELS:
            case = found_case(depth, model, out, push)
            runs = [case.run(seed, out) for seed in range(1, SEEDS + 1)]
            rows = np.array([measured(case, run) for run in runs])
            deep = max(run.record().overlap_largest for run in runs)
            cells = [f"{depth:g}", f"{depth * ROW_N_PER_M2 / 1000:g}", model, str(case.people)]
            cells += [f"{case.push:.0f}", *map(_cell, rows.T), f"{deep:.2f}"]
            print(line(cells), flush=True)


def _cell(values: Floats) -> str:
    """Median and range."""
    return f"{np.median(values):.2f} ({values.min():.2f} – {values.max():.2f})"


if __name__ == "__main__":
    main()
