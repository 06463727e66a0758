"""An impact tried before it is run: every solver, and the engines' own scheme, on the very scene.

The error of an explicit scheme is of first order in Δt√(k/m): its dashpots see the velocity of half
a step before. How large it is no number of the scene tells. Pushes of one corridor with the same
damping ratio and as many contacts at once differ by a factor of 60, since it depends on which
contacts open and close again. But an impact is short, and the scheme is known: it costs less to
step through it here than to start an engine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from analysis.advice.question import Question
from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.work_precision.point import Point, PointStatus
from analysis.work_precision.points_of import Answer, Converged, Judge
from analysis.work_precision.rigid_reference import rigid_reference
from analysis.work_precision.rigid_solves import solve_rigid
from analysis.work_precision.soft_reference import ReferenceError, leapfrog, soft_reference
from analysis.work_precision.soft_runs import LAWS, SoftSetting, scene_of
from analysis.work_precision.window import impact_window
from nscd import ContactLaw

# Shares of the safe time step that are stepped through.
SHARES = (1 / 16, 1 / 4, 1.0, 4.0)
# Each with these lengths, as shares of it: which contacts let go between two steps depends on the
# length, and an engine shortens its steps to meet frames.
NEARBY = (1.0, 0.98, 0.93)
# An error that is promised to be smaller than this would be one of rounding, here or in a dump.
ROUNDING = 1e-9
NEARLY_ELASTIC = 1 - 1e-6
# A larger impact (disks, disks times safe time steps) would take longer to try than advice may.
MOST_DISKS, MOST_WORK = 600, 5e6


def tried(scene: Scene, question: Question) -> list[Point]:
    """Compute the points of an impact for a question's methods: the rigid model by each solver, and
    engines at SHARES of the safe time step with the scene's stiffness, their CPU seconds left out.

    Error bars are added to the errors. Raises ValueError as `Window.check`. Nothing is found for an
    impact too large to try, and of engines nothing where they have too many steps, or no
    reference."""
    snapshot, window = scene.snapshot, impact_window(scene)
    if len(snapshot) > MOST_DISKS:
        return []
    window.check()
    # errors are shares of the rigid model's percussions: of e = 1, which it has not, of e → 1
    elastic = question.against == "model" and scene.contact.restitution == 1
    bouncing = ContactLaw(restitution=NEARLY_ELASTIC) if elastic else window.law
    rigid = rigid_reference(snapshot, window.contacts, window.left_velocity, bouncing)
    judge = Judge(window=window, name=scene.name, rigid=rigid)
    found: list[Point] = []
    if "rigid" in question.methods and question.against == "rigid":
        found += [point for answer in solve_rigid(window) for point in judge.points(answer)]
    for law in LAWS["lammps"]:
        if engines := [m for m in question.methods if law in question.laws(m, scene)]:
            found += _stepped(judge, law, engines)
    return [_with_bars(point) for point in found]


def _stepped(judge: Judge, law: str, engines: Iterable[str]) -> Iterator[Point]:
    window = judge.window
    scene = window.scene.with_contact(law=law)
    steps = scene.run.duration_s / penalty_of(scene).safe_time_step
    if len(scene.snapshot) * steps > MOST_WORK:
        return
    stiffness = scene.contact.stiffness_N_per_m
    try:
        reference = soft_reference(window.variant(law, stiffness))
    except ReferenceError:
        return
    own, looser = (window.quantities(m, stiffness) for m in (reference.motion, reference.looser))
    model = Converged(own=own, looser=looser, wrong="the time step is too long: wrong")
    for share in SHARES:
        near: list[list[Point]] = []
        for times in NEARBY:
            setting = SoftSetting(
                engine="", law=law, stiffness_N_per_m=stiffness, share=times * share
            )
            with np.errstate(all="ignore"):
                values = window.quantities(leapfrog(scene_of(window, setting)), stiffness)
            answers = (
                Answer(
                    method=engine,
                    law=law,
                    time_step_share=share,
                    stiffness_N_per_m=stiffness,
                    cpu_seconds=None,
                    values=values,
                )
                for engine in engines
            )
            with np.errstate(all="ignore"):
                near.append([point for one in answers for point in judge.points(one, model)])
        yield from map(_cautious, *near)


def _cautious(*near: Point) -> Point:
    """One point of those of a setting: one that did not end well, or the one with the largest
    error, whose bar grows by how far the errors are apart."""
    for point in near:
        if point.status != PointStatus.OK or point.numerical_error is None:
            return point
    errors = [point.numerical_error or 0.0 for point in near]
    worst = near[int(np.argmax(errors))]
    spread = max(errors) - min(errors)
    return replace(worst, numerical_bar=(worst.numerical_bar or 0.0) + spread)


def _with_bars(point: Point) -> Point:
    if point.numerical_error is None or point.model_error is None:
        return point
    numerical = point.numerical_error + (point.numerical_bar or 0.0)
    return replace(
        point,
        numerical_error=numerical + ROUNDING if point.law else numerical,
        model_error=point.model_error + (point.model_bar or 0.0),
    )
