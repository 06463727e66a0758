"""Advice for whole runs: the cheapest engine and setting whose measured error of a mean over time
is within what is asked."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from analysis.advice.library import expected_seconds, likeness_of
from analysis.engines import engine
from analysis.pages.numbers import percent, seconds
from analysis.scene.scene import Scene
from analysis.scene.shipped_scenes import make
from analysis.support.files import write_json
from analysis.support.reading import read_text
from analysis.work_precision.point import points_of_text
from analysis.work_precision.whole_runs import RIGID, Setting, WholeRunPoint

FILE = "whole_runs.json"
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

    setting: Setting  # as it is run on this scene
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
    asked: float
    choice: MotionCandidate | None  # None where nothing that was measured is within the error
    found: Sequence[MotionCandidate]  # all candidates, from cheap to dear
    measured: Sequence[WholeRunPoint]
    why_not: str = ""  # why nothing is known; "" where something is


def stored_whole_runs() -> list[WholeRunPoint]:
    """Read the whole runs that the product brings along (benchmarks/converge.py)."""
    text = (files("analysis.advice") / FILE).read_text(encoding="utf-8")
    return points_of_text(text, FILE, WholeRunPoint)


def advise_motion(
    scene: Scene, error: float, quantity: str, methods: Sequence[str], own: Path | None = None
) -> MotionAdvice:
    """Choose the cheapest engine that was measured to be within the error; own: a file of whole
    runs of this very scene, read instead of the stored one.

    Raises ValueError for a scene with friction, and for whole runs of another scene."""
    points = stored_whole_runs()
    if own:
        points = points_of_text(read_text(own), str(own), WholeRunPoint)
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
        asked=error,
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
    if own:
        return ""
    base = make(measured[0].scene)
    far = likeness_of(scene).distance(likeness_of(base))
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
    lines = [f"{advice.scene.name}: {words}, within {percent(advice.asked, 2)}"]
    if advice.why_not:
        return [*lines, f"nothing is known: {advice.why_not}"]
    if advice.choice is not None:
        lines.append(f"advised: {advice.choice.words}")
    else:
        best = min(advice.found, key=lambda one: one.error, default=None)
        reaches = f". The best, {best.words}" if best else ": no method asked about was measured"
        lines.append(f"nothing that was measured reaches {percent(advice.asked, 2)}{reaches}")
    lines += ["", "measured, from cheap to dear (an error at most: the end of a 90 % interval):"]
    lines += [f"{'→' if one == advice.choice else ' '} {one.words}" for one in advice.found]
    first = advice.measured[0]
    reference = next((point.setting.title for point in advice.measured if point.reference), "")
    lines.append(
        f"errors from {reference}, on runs of {first.scene} over {first.duration_s:g} s. "
        f"Measured on {first.machine}, {first.date}"
    )
    return lines


def write_motion_advice(advice: MotionAdvice, folder: Path) -> Path:
    """Write advice.json into the folder, whole or not at all; return its path."""
    content = {
        "scene": advice.scene.name,
        "quantity": advice.quantity,
        "asked_error": advice.asked,
        "choice": dataclasses.asdict(advice.choice) if advice.choice else None,
        "found": [dataclasses.asdict(one) for one in advice.found],
        "why_not": advice.why_not,
        "measured": [dataclasses.asdict(point) for point in advice.measured],
    }
    write_json(folder / "advice.json", content)
    return folder / "advice.json"
