"""Candidates: methods with their settings on a scene, what each promises and what it should
cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

from analysis.advice.error_curves import Curves
from analysis.advice.library import Entry
from analysis.advice.price import price_of
from analysis.advice.question import Question
from analysis.advice.safety import Safety
from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.work_precision.point import Method
from analysis.work_precision.soft_runs import STIFFER
from analysis.work_precision.window import Window

# Longer steps, as shares of the safe one, can survive the window and heat the crowd unnoticed in a
# longer run.
LONGEST = 4.0
# With fewer steps than these between two frames, the step would be shortened by too much.
FEW_STEPS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate(Method):
    """A method with a setting on the scene.

    time_step_s: s, as it is run; time_step_share: of the safe one, at most.
    numerical_error, model_error: expected.
    promised_error: their sum with safety factors.
    cpu_seconds: s, what it should cost."""

    numerical_error: float
    model_error: float
    promised_error: float
    cpu_seconds: float


@dataclass(frozen=True, slots=True)
class Timing:
    """How long a run lasts (s), and in how many frames and steps."""

    duration_s: float
    frames: int
    steps: int

    @property
    def step_s(self) -> float:
        """The time step (s)."""
        return self.duration_s / self.steps


def timing_of(scene: Scene, stiffness: float, step_s: float, whole_run: bool) -> Timing:
    """Give the timing of the window, or of the scene's whole run, at a stiffness (N/m) with steps
    of at most step_s, shortened a little so that frames fall on them.

    An impact is over sooner, ∝ 1/√k. A window has two frames. A run has fewer than the scene's
    where the step would be shortened by a tenth or more."""
    duration = Window(scene=scene).duration(stiffness)
    if scene.drive is not None and whole_run:
        duration = scene.run.duration_s
    steps = ceil(duration / step_s - 1e-9)
    frames = scene.run.frames if whole_run else 2
    interval = ceil(steps / frames)
    if whole_run and interval < FEW_STEPS:
        frames = ceil(steps / interval)
    return Timing(duration, frames, interval * frames)


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """What is known of a scene for a question: the curves to read, the factors between what is read
    and what is promised, and the entries that prices are fitted to."""

    scene: Scene
    question: Question
    curves: Curves
    safety: Safety
    priced: Sequence[Entry]

    def candidates(self) -> Iterator[Candidate]:
        """Yield the candidates of every method asked about. Against the model the rigid one is
        another model, and no candidate."""
        for method in self.question.methods:
            if method == "rigid" and self.question.against == "rigid":
                yield from self._rigid()
            for law in self.question.laws(method, self.scene):
                yield from self._soft(method, law)

    def _rigid(self) -> Iterator[Candidate]:
        for solver, tolerance in self.curves.rigid_settings():
            errors = self.curves.rigid(solver, tolerance)
            if errors is not None:
                yield Candidate(
                    method="rigid",
                    solver=solver,
                    tolerance=tolerance,
                    numerical_error=errors.numerical,
                    model_error=0.0,
                    promised_error=self.safety.rigid * errors.numerical,
                    cpu_seconds=self.curves.rigid_seconds(solver, tolerance),
                )

    def _soft(self, method: str, law: str) -> Iterator[Candidate]:
        scene, question, likeness = self.scene, self.question, self.curves.likeness
        free, price = question.against == "rigid", price_of(method, law, self.priced)
        shares = [share for share in self.curves.shares(method, law) if share <= LONGEST]
        # an impact is the same at every stiffness, only sooner over
        for stiffer in STIFFER if free and likeness.driven else (1.0,):
            stiffness = stiffer * scene.contact.stiffness_N_per_m
            stiff = scene.with_contact(law=law, stiffness_N_per_m=stiffness)
            safe, hardness = penalty_of(stiff).safe_time_step, likeness.hardness * stiffer**0.5
            for share in shares:
                errors = self.curves.soft(method, law, share, hardness)
                if errors is None or price is None:
                    continue
                model = self.safety.model * errors.model if free else 0.0
                timing = timing_of(scene, stiffness, share * safe, question.whole_run)
                yield Candidate(
                    method=method,
                    law=law,
                    time_step_s=timing.step_s,
                    time_step_share=share,
                    stiffness_N_per_m=stiffness,
                    numerical_error=errors.numerical,
                    model_error=errors.model,
                    promised_error=self.safety.numerical * errors.numerical + model,
                    cpu_seconds=price.of(len(scene.snapshot) * timing.steps),
                )
