"""All points of a scene: every method with every setting, and the two errors of each."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from analysis.support.parallel import Task, do_all
from analysis.support.progress import Progress
from analysis.work_precision.continuum_ladder import ContinuumLadder, continuum_ladder
from analysis.work_precision.point import Point
from analysis.work_precision.points_of import Book
from analysis.work_precision.rigid_reference import RigidReference, rigid_reference
from analysis.work_precision.rigid_solves import Solved, solve_rigid, solve_rivals
from analysis.work_precision.soft_reference import SoftReference, kept_reference
from analysis.work_precision.soft_runs import Setting, SoftRun, run_folder, run_soft, scene_of
from analysis.work_precision.window import Quantity, Window


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """The points of a window, the rigid reference, why there is no continuum (empty if there is),
    and the references that failed, in words."""

    window: Window
    rigid: RigidReference
    quantities: tuple[Quantity, ...]
    points: tuple[Point, ...]
    no_continuum: str
    warnings: tuple[str, ...]


def measure(
    window: Window,
    name: str,
    settings: Sequence[Setting],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
    *,
    mesh_sides: Sequence[float] = (),
) -> Measured:
    """Run all settings of the engines, all solvers, the rivals and, on meshes of these sides (in
    mean radii, falling), the continuum on a window of the scene `name`.

    Runs and references are kept in the folder and taken from there the next time; solutions, which
    take a fraction of a second, are made anew."""
    pairs = sorted({(s.law, s.stiffness_N_per_m) for s in settings})
    variants = [window.variant(*pair) for pair in pairs]
    size = len(window.scene.snapshot)
    tasks = [
        # an integration costs about as much as a run with a fifth of the safe step
        Task(
            call=kept_reference,
            arguments=(variant, folder / f"reference_{law}_k{stiffness:.6g}"),
            work=5
            * _work(window, Setting(engine="", law=law, stiffness_N_per_m=stiffness, share=1.0)),
        )
        for (law, stiffness), variant in zip(pairs, variants, strict=True)
    ]
    tasks += [
        Task(
            call=run_soft,
            arguments=(scene_of(window, setting), setting, run_folder(folder, setting)),
            work=_work(window, setting),
        )
        for setting in settings
    ]
    tasks += [
        Task(call=call, arguments=(window,), work=2e5 + 1e3 * size)
        for call in (solve_rigid, solve_rivals)
    ]
    tasks.append(
        Task(
            call=rigid_reference,
            arguments=(window.scene.snapshot, window.contacts, window.left_velocity),
            work=1e5 + size**2,
        )
    )
    tasks.append(
        Task(
            call=continuum_ladder,
            arguments=(window, mesh_sides, folder / "continuum"),
            work=1e6 + 2e4 * size if window.driven and mesh_sides else 0.0,
        )
    )
    results = do_all(tasks, executor, f"{name}: {size} disks", progress)
    references: dict[tuple[str, float], SoftReference | str] = dict(
        zip(pairs, results[: len(pairs)], strict=True)
    )
    soft: list[SoftRun] = results[len(pairs) : -4]
    solved: list[Solved] = [*results[-4], *results[-3]]
    rigid: RigidReference = results[-2]
    continuum: ContinuumLadder = results[-1]
    book = Book(window=window, name=name, rigid=rigid)
    points = [
        *book.of_soft(soft, references),
        *book.of_solved(solved),
        *book.of_continuum(continuum),
    ]
    warnings = [
        f"reference {law}, k = {k:.3g} N/m: {r}"
        for (law, k), r in references.items()
        if isinstance(r, str)
    ]
    return Measured(
        window=window,
        rigid=rigid,
        quantities=tuple(book.exact),
        points=tuple(points),
        no_continuum=continuum.reason,
        warnings=tuple(warnings),
    )


def _work(window: Window, setting: Setting) -> float:
    """Particle-steps, and what starting a process is worth."""
    scene = scene_of(window, setting)
    steps = scene.run.duration_s / (scene.run.time_step_s or 1.0)
    return 3e5 + len(scene.snapshot) * steps
