"""All points of a scene: every method with every setting, and the two errors of each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress
from analysis.work_precision.continuum.ladder import ContinuumLadder, continuum_ladder
from analysis.work_precision.point import Point
from analysis.work_precision.points_of import Converged, Judge
from analysis.work_precision.rigid_reference import RigidReference, rigid_reference
from analysis.work_precision.rigid_solves import solve_rigid, solve_rivals
from analysis.work_precision.soft_reference import SoftReference, kept_reference
from analysis.work_precision.soft_runs import SoftSetting, run_folder, run_soft, scene_of
from analysis.work_precision.window import Quantity, Window

# What starting a process is worth, in particle-steps.
START = 3e5
# An integration costs about as much as so many runs with the safe step.
INTEGRATION = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """What was measured on a window.

    rigid: the rigid reference.
    no_continuum: why there is no continuum; "" if there is.
    warnings: the references that failed, in words."""

    window: Window
    rigid: RigidReference
    quantities: tuple[Quantity, ...]
    points: tuple[Point, ...]
    no_continuum: str
    warnings: tuple[str, ...]


def measure(
    window: Window,
    name: str,
    settings: Sequence[SoftSetting],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
    mesh_sides: Sequence[float] = (),
) -> Measured:
    """Run all settings of the engines, all solvers, the rivals and, on meshes of these sides (in
    mean radii, falling), the continuum on a window of the scene `name`.

    Runs and references are kept in the folder and reused the next time; solutions, which take a
    fraction of a second, are computed again."""
    pairs = sorted({(s.law, s.stiffness_N_per_m) for s in settings})
    groups = {
        "references": [_integration(window, folder, *pair) for pair in pairs],
        "runs": [_run(window, folder, setting) for setting in settings],
        **_solutions(window, folder, mesh_sides),
    }
    tasks = [task for group in groups.values() for task in group]
    label = f"{name}: {len(window.scene.snapshot)} disks"
    results = iter(do_all(tasks, executor, label, progress))
    done = {name: [next(results) for _ in group] for name, group in groups.items()}
    references = dict(zip(pairs, done["references"], strict=True))
    (rigid,), (continuum,) = done["rigid"], done["continuum"]
    judge = Judge(window=window, name=name, rigid=rigid)
    return Measured(
        window=window,
        rigid=rigid,
        quantities=tuple(judge.exact),
        points=tuple(_points(judge, done, references, continuum)),
        no_continuum=continuum.reason,
        warnings=tuple(
            f"reference {law}, k = {k:.3g} N/m: {found}"
            for (law, k), found in references.items()
            if isinstance(found, str)
        ),
    )


def _integration(window: Window, folder: Path, law: str, stiffness: float) -> Task:
    setting = SoftSetting(engine="", law=law, stiffness_N_per_m=stiffness, share=1.0)
    return Task(
        call=kept_reference,
        arguments=(window.variant(law, stiffness), folder / f"reference_{law}_k{stiffness:.6g}"),
        work=INTEGRATION * _work(window, setting),
    )


def _run(window: Window, folder: Path, setting: SoftSetting) -> Task:
    return Task(
        call=run_soft,
        arguments=(scene_of(window, setting), setting, run_folder(folder, setting)),
        work=_work(window, setting),
    )


def _solutions(window: Window, folder: Path, mesh_sides: Sequence[float]) -> dict[str, list[Task]]:
    size = len(window.scene.snapshot)
    given = (window.scene.snapshot, window.contacts, window.left_velocity, window.law)
    meshed = (window, mesh_sides, folder / "continuum")
    work = 1e6 + 2e4 * size if window.driven and mesh_sides else 0.0
    return {
        "solved": [
            Task(call=call, arguments=(window,), work=2e5 + 1e3 * size)
            for call in (solve_rigid, solve_rivals)
        ],
        "rigid": [Task(call=rigid_reference, arguments=given, work=1e5 + size**2)],
        "continuum": [Task(call=continuum_ladder, arguments=meshed, work=work)],
    }


def _points(
    judge: Judge,
    done: dict[str, list[Any]],
    references: dict[tuple[str, float], SoftReference | str],
    continuum: ContinuumLadder,
) -> Iterator[Point]:
    window = judge.window
    models = {pair: _converged(window, pair[1], found) for pair, found in references.items()}
    for run in done["runs"]:
        model = models[run.setting.law, run.setting.stiffness_N_per_m]
        yield from judge.points(run.on(window), model)
    for answers in done["solved"]:
        for answer in answers:
            yield from judge.points(answer)
    for answer, model in continuum.judged():
        yield from judge.points(answer, model)


def _converged(window: Window, stiffness: float, found: SoftReference | str) -> Converged:
    wrong = "the run ended as if all were well, but is wrong"
    if isinstance(found, str):
        return Converged(why=found, wrong=wrong)
    return Converged(
        own=window.quantities(found.motion, stiffness),
        looser=window.quantities(found.looser, stiffness),
        wrong=wrong,
    )


def _work(window: Window, setting: SoftSetting) -> float:
    """Particle-steps, and what starting a process is worth."""
    scene = scene_of(window, setting)
    steps = scene.run.duration_s / (scene.run.time_step_s or 1.0)
    return START + len(scene.snapshot) * steps
