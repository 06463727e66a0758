"""The chart of a scene: its points, every method with every setting, and cost against the number of
disks."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import MAKERS, make
from analysis.studies.work_precision import soft
from analysis.studies.work_precision import window as windows
from analysis.studies.work_precision.continuum import COARSE, SIDES, continuum_ladder
from analysis.studies.work_precision.point import Method, Point, PointStatus
from analysis.studies.work_precision.rigid_solves import solve_rigid, solve_rivals
from analysis.support.parallel import Progress, Task, do_all, workers

# What starting a process is worth, in particle-steps.
START = 3e5
# An integration costs about as much as so many runs with the safe step.
INTEGRATION = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """What was measured on a window of a scene.

    scaling: the points of cost against size; none for a scene of fixed size, or a quick chart."""

    scene: Scene  # as it was given
    window: windows.Window
    rigid: windows.RigidReference  # the rigid reference
    quantities: tuple[windows.Quantity, ...]
    points: tuple[Point, ...]
    no_continuum: str  # why there is no continuum; "" if there is
    warnings: tuple[str, ...]  # what went wrong on the way
    scaling: tuple[Point, ...] = ()
    quick: bool = False  # whether it was measured with few settings

    @property
    def mesh_sides(self) -> tuple[float, ...]:
        """Sides of the triangles of the continuum, in mean radii."""
        return COARSE if self.quick else SIDES


def measure(
    window: windows.Window,
    name: str,
    settings: Sequence[Method],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
    mesh_sides: Sequence[float] = (),
) -> Measured:
    """Run all settings of the engines, all solvers, the rivals and, on meshes of these sides (in
    mean radii, falling), the continuum on a window of the scene `name`.

    Runs and references are kept in the folder and reused the next time; solutions, which take a
    fraction of a second, are computed again."""
    pairs = sorted({(s.law, s.stiffness_N_per_m or 0.0) for s in settings})
    groups = {
        "models": [_integration(window, folder, *pair) for pair in pairs],
        "runs": [
            Task(call=soft.run_soft, arguments=(window, one, folder), work=_work(window, one))
            for one in settings
        ],
        **_solutions(window, folder, mesh_sides),
    }
    tasks = [task for group in groups.values() for task in group]
    label = f"{name}: {len(window.scene.snapshot)} disks"
    results = iter(do_all(tasks, executor, label, progress))
    done = {name: [next(results) for _ in group] for name, group in groups.items()}
    models: dict[tuple[str, float | None], windows.Converged] = dict(
        zip(pairs, done["models"], strict=True)
    )
    (rigid,), ((continuum, no_continuum),) = done["rigid"], done["continuum"]
    solutions = [replace(run, model=models[run.law, run.stiffness_N_per_m]) for run in done["runs"]]
    solutions += [solution for solved in done["solved"] for solution in solved]
    judge = windows.Judge(window=window, name=name, rigid=rigid)
    failed = [(law, k, models[law, k].why) for law, k in pairs if models[law, k].own is None]
    return Measured(
        scene=window.scene,
        window=window,
        rigid=rigid,
        quantities=tuple(judge.exact),
        points=tuple(p for solution in (*solutions, *continuum) for p in judge.points(solution)),
        no_continuum=no_continuum,
        warnings=tuple(f"reference {law}, k = {k:.3g} N/m: {why}" for law, k, why in failed),
    )


def _integration(window: windows.Window, folder: Path, law: str, stiffness: float) -> Task:
    setting = Method(method="", law=law, stiffness_N_per_m=stiffness, time_step_share=1.0)
    return Task(
        call=soft.kept_reference,
        arguments=(window, law, stiffness, folder),
        work=INTEGRATION * _work(window, setting),
    )


def _solutions(
    window: windows.Window, folder: Path, mesh_sides: Sequence[float]
) -> dict[str, list[Task]]:
    size = len(window.scene.snapshot)
    inputs = (window.scene.snapshot, window.contacts, window.left_velocity, window.law)
    meshed = (window, mesh_sides, folder / "continuum")
    work = 1e6 + 2e4 * size if window.driven and mesh_sides else 0.0
    return {
        "solved": [
            Task(call=call, arguments=(window,), work=2e5 + 1e3 * size)
            for call in (solve_rigid, solve_rivals)
        ],
        "rigid": [Task(call=windows.rigid_reference, arguments=inputs, work=1e5 + size**2)],
        "continuum": [Task(call=continuum_ladder, arguments=meshed, work=work)],
    }


def _work(window: windows.Window, setting: Method) -> float:
    """Particle-steps, and what starting a process is worth."""
    scene = soft.scene_of(window, setting)
    steps = scene.run.duration_s / (scene.run.time_step_s or 1.0)
    return START + len(scene.snapshot) * steps


ACCURACY = 0.01
LINES, CROWDS = (5, 10, 20, 40, 80), (75, 150, 300, 600)
# Cost against size: of the middle stiffness of the chart.
SIZES = soft.Grid(stiffer=soft.STIFFER[len(soft.STIFFER) // 2 :][:1], step_fractions=(1.0, 4.0, 8.0))


def build_chart(
    scene: Scene,
    runs: Path,
    *,
    quick: bool = False,
    processes: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Measured:
    """Measure a scene with all engines that are there, all solvers, the rivals and the continuum;
    quick: with few settings, and in one size.

    Everything that takes long is kept in runs/work_precision/<scene>: a build that was interrupted
    goes on where it stopped. Raises ValueError as `workers` and `prepare_window` do."""
    folder = (runs / "work_precision" / scene.name).absolute()
    engines = soft.soft_engines()
    missing = [name for name in soft.LAWS if name not in engines]
    sides = COARSE if quick else SIDES
    with workers(processes, scheduler) as executor:
        window = soft.prepare_window(scene, folder, progress)
        settings = list(soft.settings_of(window, engines, soft.QUICK if quick else soft.FULL))
        measured = measure(window, scene.name, settings, folder, executor, progress, sides)
        sizes = () if quick else tuple(scaling(scene, engines, folder, executor, progress))
    absent = [f"{name} is not found: it is not on the chart" for name in missing]
    warnings = (*absent, *measured.warnings)
    return replace(measured, scene=scene, scaling=sizes, warnings=warnings, quick=quick)


def scaling(
    scene: Scene,
    engines: Sequence[str],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
) -> Iterator[Point]:
    """Yield for each size and method the cheapest point whose numerical error, of what the disks
    receive, is within ACCURACY. A method without such a point at a size is left out there; none of a
    scene of fixed size, or one of the user's."""
    sizes = CROWDS if scene.drive else LINES
    for size in sizes if scene.name in MAKERS else ():
        path = folder / f"{size}_disks"
        window = soft.prepare_window(make(scene.name, size), path)
        settings = list(soft.settings_of(window, engines, SIZES))
        made = measure(window, scene.name, settings, path, executor, progress, SIDES)
        yield from cheapest(p for p in made.points if p.quantity.startswith("disk_"))


def cheapest(points: Iterable[Point], accuracy: float = ACCURACY) -> list[Point]:
    """Choose of each method the cheapest point whose numerical error is within the accuracy."""
    best: dict[str, Point] = {}
    for point in (p for p in points if p.status == PointStatus.OK and p.cpu_seconds is not None):
        if point.numerical_error is not None and point.numerical_error <= accuracy:
            best[point.key] = min(
                best.get(point.key, point), point, key=lambda p: p.cpu_seconds or 0
            )
    return list(best.values())
