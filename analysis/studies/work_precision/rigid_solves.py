"""The rigid model by each solver, and the rival force laws, on the start of a window: answers and
their cost."""

import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from analysis.percussions.snapshot import percussions_of
from analysis.studies.work_precision.point import PointStatus
from analysis.studies.work_precision.window import (
    CONTACT_FORCE,
    DISK_FORCE,
    WALL_FORCE,
    MethodResult,
    Window,
)
from nscd import find_contacts, rivals
from nscd.arrays import Floats
from nscd.percussions import Percussions, Status
from nscd.solve import SOLVERS

# The others sweep over contacts that dissipate nothing.
DISSIPATIVE = ("auto", "interior_point", "active_set")
TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
# Social forces that are left out at each disk, at most, for each pair (N).
LEFT_OUT_N = 1e-3
# CPU time is the least of a few repetitions: as many as this (s) has room for.
REPEAT_SECONDS, REPEATS = 0.2, 5
STATUS = {
    Status.SOLVED: PointStatus.OK,
    Status.INACCURATE: PointStatus.INACCURATE,
    Status.FAILED: PointStatus.FAILED,
}
T = TypeVar("T")


def solve_rigid(window: Window) -> list[MethodResult]:
    """Solve by every solver that serves the law, at every tolerance."""

    def call(solver: str, tolerance: float) -> Percussions:
        # every quantity here follows from u⁺: which λ of several is of no matter
        return percussions_of(
            window.setting,
            window.scene.snapshot,
            window.law,
            tolerance=tolerance,
            solver=solver,
            canonical=False,
        ).solution

    return [
        _moved(window, partial(call, solver, tolerance), "rigid", solver, tolerance)
        for solver in (SOLVERS if window.law.restitution is None else DISSIPATIVE)
        for tolerance in TOLERANCES
    ]


def solve_rivals(window: Window) -> list[MethodResult]:
    """Solve by the rivals that give what is compared: the first-order model always, force laws for
    a driven crowd only, since a force is no impulse."""
    snapshot, setting = window.scene.snapshot, window.setting

    def call() -> rivals.FirstOrderAnswer:
        contacts = setting.contacts(snapshot)
        return rivals.first_order(snapshot, contacts, left_velocity=window.left_velocity)

    found = [_moved(window, call, "first_order")]
    if window.driven:
        laws = [("social_force", partial(_social, window))]
        laws += [(f"loehner_{r}", partial(_loehner, window, r)) for r in rivals.LoehnerReading]
        for method, law in laws:
            (on_disks, of_contacts), seconds = timed(law)
            values = {CONTACT_FORCE: of_contacts, DISK_FORCE: on_disks.ravel()}
            values[WALL_FORCE] = -on_disks.sum(0)
            found.append(MethodResult(method=method, cpu_seconds=seconds, values=values))
    return found


def _moved(
    window: Window,
    call: Callable[[], Percussions | rivals.FirstOrderAnswer],
    method: str,
    solver: str = "",
    tolerance: float | None = None,
) -> MethodResult:
    solution, seconds = timed(call)
    failed = solution.status == Status.FAILED
    return MethodResult(
        method=method,
        solver=solver,
        tolerance=tolerance,
        cpu_seconds=seconds,
        values=None if failed else window.rigid_values(solution.right_velocity),
        status=STATUS[solution.status],
        reason=solution.reason,
    )


def _social(window: Window) -> tuple[Floats, Floats]:
    """Forces on each disk (n,2) N and of each touching contact (k,) N."""
    scene, law = window.scene, rivals.SocialForceLaw()
    reach = law.reach(LEFT_OUT_N)
    pairs = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=reach)
    forces = rivals.social_force(scene.snapshot, pairs, law)
    in_contact = pairs.gap <= scene.analysis.contact_tolerance_m
    return forces.resultant(), forces.normal[in_contact]


def _loehner(window: Window, reading: rivals.LoehnerReading) -> tuple[Floats, Floats]:
    """The same by Löhner's law, whose f_max is what each wants to exert, m u_d/τ."""
    scene = window.scene
    assert scene.drive is not None
    wish = scene.drive.push(scene.snapshot.mass)
    near = scene.analysis.contact_tolerance_m
    pairs = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=near)
    forces = rivals.loehner_force(scene.snapshot, pairs, wish, reading, tolerance=near)
    return forces.resultant(), forces.on_first


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """Give what the call gives, and its CPU seconds, compilation not counted: the least of a
    few."""
    solution = call()
    best, spent = np.inf, 0.0
    for _ in range(REPEATS):
        started = time.process_time()
        solution = call()
        seconds = time.process_time() - started
        best, spent = min(best, seconds), spent + seconds
        if spent > REPEAT_SECONDS:
            break
    return solution, best
