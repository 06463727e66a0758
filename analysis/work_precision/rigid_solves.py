"""The rigid model by each solver, and the rival force laws, on the start of a window: answers and
their cost."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from analysis.percussions.snapshot import percussions_of
from analysis.work_precision.point import PointStatus
from analysis.work_precision.window import Motion, Window
from nscd import find_contacts
from nscd.arrays import Floats
from nscd.percussions import Status
from nscd.rivals import LoehnerReading, SocialForceLaw, first_order, loehner_force, social_force
from nscd.solvers.ladder import SOLVERS

TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
# Social forces that are left out at each disk, at most, for each pair (N).
LEFT_OUT_N = 1e-3
# CPU time is the least of a few repetitions: as many as this (s) has room for.
REPEAT_SECONDS, REPEATS = 0.2, 5
STATUS = {
    Status.SOLVED: PointStatus.OK, Status.INACCURATE: PointStatus.INACCURATE, Status.FAILED: PointStatus.FAILED,
}  # fmt: skip
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solved:
    """An answer: solver and tolerance, its motion (rigid model, first-order model) or its forces (a
    force law: on each disk (n,2) N, and of each touching contact (k,) N), CPU seconds from the
    snapshot on, status and reason."""

    method: str
    solver: str
    tolerance: float | None
    motion: Motion | None
    disk_force: Floats | None
    contact_force: Floats | None
    cpu_seconds: float
    status: PointStatus
    reason: str


def solve_rigid(window: Window) -> list[Solved]:
    """Every solver at every tolerance."""
    return [_solve(window, solver, tolerance) for solver in SOLVERS for tolerance in TOLERANCES]


def _solve(window: Window, solver: str, tolerance: float) -> Solved:
    setting, snapshot = window.setting, window.scene.snapshot

    def call() -> tuple[Status, str, Floats]:
        # every quantity here follows from u⁺: which λ of several is of no matter
        answer = percussions_of(
            setting, snapshot, tolerance=tolerance, solver=solver, canonical=False
        ).answer
        return answer.status, answer.reason, answer.right_velocity

    (status, reason, right), seconds = timed(call)
    return Solved(
        method="rigid",
        solver=solver,
        tolerance=tolerance,
        motion=window.rigid_motion(right) if status != Status.FAILED else None,
        disk_force=None,
        contact_force=None,
        cpu_seconds=seconds,
        status=STATUS[status],
        reason=reason,
    )


def solve_rivals(window: Window) -> list[Solved]:
    """The rivals that give what is compared: the first-order model always, force laws for a driven
    crowd only, since a force is no impulse."""
    found = [_first_order(window)]
    if window.driven:
        found += [_social(window), *(_loehner(window, reading) for reading in LoehnerReading)]
    return found


def _first_order(window: Window) -> Solved:
    setting, snapshot = window.setting, window.scene.snapshot

    def call() -> tuple[Status, str, Floats]:
        contacts = setting.contacts(snapshot)
        answer = first_order(snapshot, contacts, left_velocity=window.left_velocity)
        return answer.status, answer.reason, answer.right_velocity

    (status, reason, right), seconds = timed(call)
    return Solved(
        method="first_order",
        solver="",
        tolerance=None,
        motion=window.rigid_motion(right) if status != Status.FAILED else None,
        disk_force=None,
        contact_force=None,
        cpu_seconds=seconds,
        status=STATUS[status],
        reason=reason,
    )


def _social(window: Window) -> Solved:
    scene, law = window.scene, SocialForceLaw()

    def call() -> tuple[Floats, Floats]:
        reach = law.reach(LEFT_OUT_N)
        pairs = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=reach)
        forces = social_force(scene.snapshot, pairs, law)
        touching = pairs.gap <= scene.analysis.contact_tolerance_m
        return forces.resultant(), forces.normal[touching]

    return _force_law("social_force", *timed(call))


def _loehner(window: Window, reading: LoehnerReading) -> Solved:
    scene = window.scene
    assert scene.drive is not None
    # f_max is not given by the law: what each wants to exert, m u_d/τ
    wish = scene.snapshot.mass * scene.drive.speed_m_per_s / scene.drive.relaxation_time_s

    def call() -> tuple[Floats, Floats]:
        near = scene.analysis.contact_tolerance_m
        pairs = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=near)
        forces = loehner_force(scene.snapshot, pairs, wish, reading, tolerance=near)
        return forces.resultant(), forces.on_first

    return _force_law(f"loehner_{reading}", *timed(call))


def _force_law(method: str, forces: tuple[Floats, Floats], seconds: float) -> Solved:
    return Solved(
        method=method,
        solver="",
        tolerance=None,
        motion=None,
        disk_force=forces[0],
        contact_force=forces[1],
        cpu_seconds=seconds,
        status=PointStatus.OK,
        reason="",
    )


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """What the call gives, and its CPU seconds, compilation not counted: the least of a few."""
    answer = call()
    best, spent = np.inf, 0.0
    for _ in range(REPEATS):
        started = time.process_time()
        answer = call()
        seconds = time.process_time() - started
        best, spent = min(best, seconds), spent + seconds
        if spent > REPEAT_SECONDS:
            break
    return answer, best
