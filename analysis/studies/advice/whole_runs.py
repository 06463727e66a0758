"""Advice for whole runs: the cheapest engine and setting whose measured error of a mean over time is within
what is asked; and for crowds as soft as people, whether rigid disks still answer."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

from analysis.engines import engine
from analysis.engines import softness as how_soft
from analysis.engines.price import expected_seconds
from analysis.pages.bodies import ladder
from analysis.pages.numbers import interval, percent, seconds, signed
from analysis.scene.law import AS_HERTZ
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.studies.advice.library import similarity_of
from analysis.studies.work_precision.point import read_points
from analysis.studies.work_precision.whole_runs import RIGID, RunSetting, WholeRunPoint

FILE = "whole_runs.json"
# What the product brings along (benchmarks/converge.py).
STORED = Path(__file__).with_name(FILE)
# Asked of the command, and the statistics that answer.
QUANTITIES = {
    "arrest-load": ("walls_arrest", "load on all walls from 0.5 to 1 s after a start from rest"),
    "mean-wall-load": ("walls", "mean load on all walls over the second half of a run"),
    "mean-contact-force": ("contact_mean", "mean contact force over the second half of a run"),
    "contact-force-95": ("contact_95", "95 % contact force over the second half of a run"),
    "flow": ("flow", "people through the door per second in the second half of a run"),
}
# What was measured on one scene is taken for another that is no farther from it than one doubling
# of one number, and in which people push as hard to this factor.
FARTHEST, PUSH = 1.0, 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionCandidate:
    """Hold a setting on the scene.

    bias, crowds: what was measured, and on how many crowds"""

    setting: RunSetting  # as it is run on this scene
    error: float  # share, what was measured at most: the farther end of the 90 % interval
    bias: float
    crowds: int
    cpu_seconds: float  # s, what a whole run should cost

    @property
    def words(self) -> str:
        """Say it in one line."""
        return (
            f"{self.setting.title}: error at most {percent(self.error, 2)} (found "
            f"{percent(self.bias, 2)} on {self.crowds} crowds), {seconds(self.cpu_seconds)} CPU"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionAdvice:
    """Hold what was asked and what is advised."""

    scene: Scene
    quantity: str
    requested: float
    choice: MotionCandidate | None  # None where nothing that was measured is within the error
    found: Sequence[MotionCandidate]  # all candidates, from cheap to dear
    measured: Sequence[WholeRunPoint]
    why_not: str = ""  # why nothing is known; "" where something is

    def content(self) -> dict[str, object]:
        """Give it as advice.json has it."""
        about = {"scene": self.scene.name, "quantity": self.quantity, "asked_error": self.requested}
        outcome = {"found": self.found, "why_not": self.why_not, "measured": self.measured}
        return about | {"choice": self.choice} | outcome


def advise_motion(
    scene: Scene, error: float, quantity: str, methods: Sequence[str], own: Path | None = None
) -> MotionAdvice:
    """Choose the cheapest engine that was measured to be within the error; own: a file of whole
    runs of this very scene, read instead of the stored one.

    Raises ValueError for a scene with friction, and for whole runs of another scene."""
    points = read_points(own or STORED, WholeRunPoint)
    if own and points and points[0].scene != scene.name:
        raise ValueError(f"{own}: whole runs of {points[0].scene}, not of {scene.name}")
    name = QUANTITIES[quantity][0]
    measured = [point for point in points if point.quantity == name]
    why_not = _why_not(scene, measured, own is not None)
    found: list[MotionCandidate] = []
    if not why_not:
        found = sorted(_candidates(scene, measured, methods), key=lambda one: one.cpu_seconds)
    within = (one for one in found if one.error <= error)
    return MotionAdvice(
        scene=scene,
        quantity=quantity,
        requested=error,
        choice=next(within, None),
        found=found,
        measured=measured,
        why_not=why_not,
    )


def _why_not(scene: Scene, measured: Sequence[WholeRunPoint], own: bool) -> str:
    """Why what was measured says nothing of the scene; nothing where it does."""
    if scene.drive is None:
        return f"{scene.name} is an impact: it has no steady motion"
    if not measured:
        return "it was not measured"
    if scene.drive.keeps_distance:
        return "drive.time_gap_s: nobody kept a distance in what was measured"
    if own:
        return ""
    base = make(measured[0].scene)
    far = similarity_of(scene).distance(similarity_of(base))
    if far > FARTHEST:
        return f"{scene.name} is not like {base.name}, which was measured (distance {far:.2g})"
    times = scene.mean_push / base.mean_push
    if not 1 / PUSH <= times <= PUSH:
        return f"people push {times:.2g} times as hard as in {base.name}, which was measured"
    if scene.run.duration_s < measured[0].duration_s:
        return (
            f"it was measured on runs of {measured[0].duration_s:g} s, and run.duration_s is "
            f"{scene.run.duration_s:g}: a crowd that has just met differs more"
        )
    return ""


def _candidates(
    scene: Scene, measured: Sequence[WholeRunPoint], methods: Sequence[str]
) -> Iterator[MotionCandidate]:
    """Settings with an interval; steps of the rigid engine as shares of what a scene's speed and
    radius make its own."""
    base = make(measured[0].scene)
    longer = engine(RIGID).timing(scene).safe_time_step / engine(RIGID).timing(base).safe_time_step
    for point in measured:
        if point.method not in methods or point.error is None or point.bias is None:
            continue
        setting = point.setting
        if setting.step_s is not None:
            setting = dataclasses.replace(setting, step_s=setting.step_s * longer)
        made = setting.of(scene)
        yield MotionCandidate(
            setting=setting,
            error=point.error,
            bias=point.bias,
            crowds=point.crowds,
            cpu_seconds=expected_seconds(made, point.method),
        )


def motion_lines(advice: MotionAdvice) -> list[str]:
    """Write the question, the choice and every candidate, a line each."""
    words = QUANTITIES[advice.quantity][1]
    lines = [f"{advice.scene.name}: {words}, within {percent(advice.requested, 2)}"]
    if advice.why_not:
        return [*lines, f"nothing is known: {advice.why_not}"]
    if advice.choice is not None:
        lines.append(f"advised: {advice.choice.words}")
    else:
        best = min(advice.found, key=lambda one: one.error, default=None)
        reaches = f". The best, {best.words}" if best else ": no method asked about was measured"
        lines.append(f"nothing that was measured reaches {percent(advice.requested, 2)}{reaches}")
    lines += ["", "measured, from cheap to dear (an error at most: the end of a 90 % interval):"]
    lines += [f"{'→' if one == advice.choice else ' '} {one.words}" for one in advice.found]
    first = advice.measured[0]
    reference = next((point.setting.title for point in advice.measured if point.reference), "")
    lines.append(
        f"errors from {reference}, on runs of {first.scene} over {first.duration_s:g} s. "
        f"Measured on {first.machine}, {first.date}"
    )
    return lines


# Asked of the command, and the quantities of the measured ladder that answer.
OF_BODIES = {
    "mean-wall-load": "wall_load",
    "mean-person-load": "person_mean",
    "contact-force-95": "contact_95",
    "largest-person-load": "person_largest",
    "flow": "flow",
    "door-density": "density",
}
# Walls are never softer than this s makes them: else people pass them.
WALLS = 3.5
# The body whose force has a law of its own.
CHEST = "chest"


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyAdvice:
    """Hold what was asked of a crowd as soft as people, and what is advised.

    rigid: by how much rigid disks are above such bodies; None where that was not measured"""

    scene: Scene
    quantity: str
    requested: float
    body: how_soft.Body
    softness: tuple[float, float]  # s with the stiffest and with the softest of these bodies
    rigid: how_soft.RigidOver | None
    engine: str  # that answers, "" where none does
    command: str  # that runs it
    cpu_seconds: float  # s, what the run should cost

    def content(self) -> dict[str, object]:
        """Give it as advice.json has it."""
        return {
            "scene": self.scene.name,
            "quantity": self.quantity,
            "asked_error": self.requested,
            "body": self.body,
            "softness": self.softness,
            "rigid_over_body": self.rigid,
            "engine": self.engine or None,
            "command": self.command or None,
            "cpu_seconds": self.cpu_seconds if self.engine else None,
        }


def advise_bodies(
    scene: Scene, error: float, quantity: str, methods: Sequence[str], body: str
) -> BodyAdvice:
    """Choose the cheapest way to a mean over time of a crowd whose bodies are as stiff as a source
    says: rigid disks where they were measured to be within the error of it, else an engine with
    springs of that stiffness.

    Raises ValueError for a quantity, a body or a scene that has no answer."""
    choices = how_soft.known_bodies()
    if body not in choices:
        raise ValueError(f"body: unknown {body!r}. There are: {', '.join(choices)}")
    if quantity not in OF_BODIES:
        raise ValueError(
            f"quantity: {quantity} is not known of soft bodies. There are: {', '.join(OF_BODIES)}"
        )
    if scene.drive is None:
        raise ValueError(f"body: {scene.name} is an impact, and s is of a crowd that is driven")
    hardest, softest = how_soft.softness_of(scene, choices[body])
    found = how_soft.rigid_over_soft(softest, hardest)
    rigid = None if found is None else found[OF_BODIES[quantity]]
    offered = []
    if rigid and rigid.worst <= error and "rigid" in methods:
        offered.append((expected_seconds(scene, "rigid"), "rigid", ""))
    soft, words = soft_run(scene, choices[body])
    for name in methods:
        if name != "rigid" and softest <= valid_to(quantity):
            offered.append((expected_seconds(soft, name), name, words))
    cost, engine, words = min(offered, default=(0.0, "", ""))
    return BodyAdvice(
        scene=scene,
        quantity=quantity,
        requested=error,
        body=choices[body],
        softness=(hardest, softest),
        rigid=rigid,
        engine=engine,
        command=f"percussions run {scene.name} --engine {engine}{words}" if engine else "",
        cpu_seconds=cost,
    )


def valid_to(quantity: str) -> float:
    """Give the largest s of a soft run that answers: forces need disks that do not overlap by a
    radius."""
    return how_soft.NO_CROWD if quantity in ("flow", "door-density") else how_soft.WITH_CARE


def soft_run(scene: Scene, body: how_soft.Body) -> tuple[Scene, str]:
    """Give a driven scene with bodies as stiff as a source says, and the options of its run: the
    law of chests, or the geometric mean of its stiffnesses with walls that hold."""
    if body.name == CHEST:
        return scene.with_contact(law=AS_HERTZ), f" --law {AS_HERTZ}"
    drive, disks = scene.drive, scene.snapshot
    assert drive is not None
    push = drive.push(float(disks.mass.sum()))
    k = float(f"{sqrt(body.low_N_per_m * body.high_N_per_m):.2g}")
    walls = float(f"{max(k, push / (WALLS * float(disks.radius.mean()))):.2g}")
    made = scene.with_contact(law="hooke", stiffness_N_per_m=k, wall_stiffness_N_per_m=walls)
    return made, f" --stiffness {k:g} --wall-stiffness {walls:g}"


def body_lines(advice: BodyAdvice) -> Iterator[str]:
    """Write the question, what rigid disks would say, and the choice, a line each."""
    body, rigid = advice.body, advice.rigid
    stiffness = interval([end / 1000 for end in (body.low_N_per_m, body.high_N_per_m)])
    softest = advice.softness[1]
    yield (
        f"{advice.scene.name}: {advice.quantity} of bodies of {stiffness} kN/m ({body.words}, "
        f"{body.source}), within {percent(advice.requested, 2)}"
    )
    yield f"s = N F/(k r) = {interval(advice.softness, 2)}: {how_soft.judged(softest)}"
    if rigid is None:
        yield "rigid disks: not measured against bodies so soft"
    else:
        within = "within" if rigid.worst <= advice.requested else "not within"
        yield (
            f"rigid disks: {signed(rigid.mean)} ({signed(rigid.low)} to {signed(rigid.high)}), "
            f"{within} {percent(advice.requested, 2)}"
        )
    if advice.engine:
        yield f"advised: {advice.command} (about {seconds(advice.cpu_seconds)} CPU)"
    elif softest > valid_to(advice.quantity):
        yield "advised: nothing. Fewer people, a smaller push or larger radii make it a crowd"
    else:
        yield "advised: nothing: no method asked about answers for bodies so soft"


def ladder_lines(scene: Scene) -> Iterator[str]:
    """Say of a driven crowd what rigid disks over- or understate at the stiffness of people."""
    bodies, rows = ladder(scene)
    yield "at the stiffness of people, by how much rigid disks are above such bodies:"
    for column, (name, stiffness, soft) in enumerate(bodies, start=1):
        yield f"  {name}, {stiffness} kN/m, s = {soft}:"
        if len({row[column] for row in rows}) == 1:
            yield f"    {rows[0][column]}"
        else:
            yield from (f"    {row[0]}: {row[column]}" for row in rows)
    names = ", ".join(how_soft.known_bodies())
    yield f"for a run with such bodies: --body, one of {names}"
