"""All points of a scene: every method with every setting, and the two errors of each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from analysis.study import Progress
from analysis.work_precision.kept import kept_reference
from analysis.work_precision.machine import machine
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.rigid_reference import RigidReference, rigid_reference
from analysis.work_precision.rigid_solves import Solved, solve_rigid, solve_rivals
from analysis.work_precision.soft_reference import SoftReference
from analysis.work_precision.soft_runs import Setting, SoftRun, run_folder, run_soft, scene_of
from analysis.work_precision.window import (
    CONTACT_FORCE,
    DISK_FORCE,
    WALL_FORCE,
    Quantity,
    Window,
    relative_error,
)
from analysis.work_precision.workers import Task, do_all
from nscd.bodies import Floats

# A sum over the walls below this share of what the disks carry is rounding.
NOTHING = 1e-9
# A run that ended, but is wrong by more than all of it, is no answer.
WRONG = 1.0
Values = dict[Quantity, Floats]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """The points of a window, the rigid reference, and the references that failed, in words."""

    window: Window
    rigid: RigidReference
    quantities: tuple[Quantity, ...]
    points: tuple[Point, ...]
    warnings: tuple[str, ...]


def measure(
    window: Window,
    name: str,
    settings: Sequence[Setting],
    folder: Path,
    executor: Executor,
    progress: Progress | None = None,
) -> Measured:
    """Run all settings of the engines, all solvers and the rivals on a window of the scene `name`.

    Runs and references are kept in the folder and taken from there the next time; solutions, which take a fraction of a
    second, are made anew.
    """
    pairs = sorted({(s.law, s.stiffness_N_per_m) for s in settings})
    variants = [window.variant(*pair) for pair in pairs]
    size = len(window.scene.snapshot)
    tasks = [
        # an integration costs about as much as a run with a fifth of the safe step
        Task(
            call=kept_reference,
            arguments=(variant, folder / f"reference_{law}_k{stiffness:.6g}"),
            work=5 * _work(window, Setting(engine="", law=law, stiffness_N_per_m=stiffness, share=1.0)),
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
        Task(call=call, arguments=(window,), work=2e5 + 1e3 * size) for call in (solve_rigid, solve_rivals)
    ]
    tasks.append(
        Task(
            call=rigid_reference,
            arguments=(window.scene.snapshot, window.contacts, window.left_velocity),
            work=1e5 + size**2,
        )
    )
    results = do_all(tasks, executor, f"{name}: {size} disks", progress)
    references: dict[tuple[str, float], SoftReference | str] = dict(
        zip(pairs, results[: len(pairs)], strict=True)
    )
    soft: list[SoftRun] = results[len(pairs) : -3]
    solved: list[Solved] = [*results[-3], *results[-2]]
    rigid: RigidReference = results[-1]
    book = _Book(window=window, name=name, rigid=rigid)
    points = [*book.of_soft(soft, references), *book.of_solved(solved)]
    warnings = [
        f"reference {law}, k = {k:.3g} N/m: {r}" for (law, k), r in references.items() if isinstance(r, str)
    ]
    return Measured(
        window=window,
        rigid=rigid,
        quantities=tuple(book.exact),
        points=tuple(points),
        warnings=tuple(warnings),
    )


def _work(window: Window, setting: Setting) -> float:
    """Particle-steps, and what starting a process is worth."""
    scene = scene_of(window, setting)
    steps = scene.run.duration_s / (scene.run.time_step_s or 1.0)
    return 3e5 + len(scene.snapshot) * steps


class _Book:
    """The rigid reference of a window in all quantities, and points measured against it."""

    def __init__(self, *, window: Window, name: str, rigid: RigidReference) -> None:
        self.window, self.name = window, name
        self.stiffness = window.scene.contact.stiffness_N_per_m
        exact = window.quantities(window.rigid_motion(rigid.right_velocity), self.stiffness)
        largest = max(float(np.abs(v).max(initial=0.0)) for q, v in exact.items() if q.unit != "m")
        self.exact = {
            q: v for q, v in exact.items() if q.unit == "m" or np.abs(v).max(initial=0.0) > NOTHING * largest
        }
        bounds = window.bounds(rigid.bound)
        self.bar = {q: bounds[q] / float(np.sqrt((v**2).mean())) for q, v in self.exact.items()}

    def of_soft(
        self, runs: Sequence[SoftRun], references: dict[tuple[str, float], SoftReference | str]
    ) -> Iterator[Point]:
        """Points of engine runs: numerical error from the reference of their law and stiffness."""
        for run in runs:
            k = run.setting.stiffness_N_per_m
            reference = references[run.setting.law, k]
            own = looser = None
            if isinstance(reference, SoftReference):
                own, looser = (self.window.quantities(m, k) for m in (reference.motion, reference.looser))
            given = self.window.quantities(run.motion, k) if run.motion is not None else None
            for quantity, exact in self.exact.items():
                numerical, model, bar, total = None, None, None, None
                if own is not None and looser is not None:
                    bar = relative_error(looser[quantity], own[quantity], exact)
                    model = relative_error(own[quantity], exact, exact)
                if given is not None:
                    total = relative_error(given[quantity], exact, exact)
                    if own is not None:
                        numerical = relative_error(given[quantity], own[quantity], exact)
                status, reason = run.status, run.reason
                if status == PointStatus.OK and numerical is not None and not numerical <= WRONG:
                    status = PointStatus.INACCURATE
                    reason = (
                        f"the run ended as if all were well, but is wrong by {numerical:.2g} times the whole"
                    )
                elif status == PointStatus.OK and isinstance(reference, str):
                    reason = f"no numerical error: {reference}"
                yield Point(
                    scene=self.name,
                    disks=len(self.window.scene.snapshot),
                    method=run.setting.engine,
                    law=run.setting.law,
                    solver="",
                    time_step_s=run.time_step_s,
                    time_step_share=run.setting.share,
                    stiffness_N_per_m=k,
                    tolerance=None,
                    cpu_seconds=run.cpu_seconds,
                    quantity=quantity.name,
                    unit=quantity.unit,
                    numerical_error=numerical,
                    numerical_bar=bar,
                    model_error=model,
                    model_bar=None if bar is None else bar + self.bar[quantity],
                    total_error=total,
                    status=status,
                    reason=reason,
                    machine=run.machine,
                    date=run.date,
                )

    def of_solved(self, answers: Sequence[Solved]) -> Iterator[Point]:
        """Points of the rigid model (its error is numerical) and of the rivals (theirs is the model's)."""
        today, here = datetime.now(UTC).date().isoformat(), machine()
        for answer in answers:
            given = self._values(answer)
            for quantity, exact in self.exact.items():
                if given is not None and quantity not in given:
                    continue
                error = None if given is None else relative_error(given[quantity], exact, exact)
                ours = answer.method == "rigid"
                yield Point(
                    scene=self.name,
                    disks=len(self.window.scene.snapshot),
                    method=answer.method,
                    law="",
                    solver=answer.solver,
                    time_step_s=None,
                    time_step_share=None,
                    stiffness_N_per_m=None,
                    tolerance=answer.tolerance,
                    cpu_seconds=answer.cpu_seconds,
                    quantity=quantity.name,
                    unit=quantity.unit,
                    numerical_error=error if ours else None,
                    numerical_bar=self.bar[quantity] if ours else None,
                    model_error=0.0 if ours else error,
                    model_bar=0.0 if ours else self.bar[quantity],
                    total_error=error,
                    status=answer.status,
                    reason=answer.reason,
                    machine=here,
                    date=today,
                )

    def _values(self, answer: Solved) -> Values | None:
        if answer.motion is not None:
            return self.window.quantities(answer.motion, self.stiffness)
        if answer.disk_force is None or answer.contact_force is None:
            return None
        return {
            CONTACT_FORCE: answer.contact_force,
            DISK_FORCE: answer.disk_force.ravel(),
            WALL_FORCE: -answer.disk_force.sum(0),
        }
