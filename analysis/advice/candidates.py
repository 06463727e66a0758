"""Candidates: methods with their settings on a scene, what each promises and what it should cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from analysis.advice.error_curves import Curves, Errors
from analysis.advice.library import Entry, Rates
from analysis.advice.pilot import Pilot
from analysis.advice.price import price_of
from analysis.advice.question import Question
from analysis.advice.safety import factor
from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.work_precision.soft_runs import LAWS, STIFFER
from analysis.work_precision.window import DRIVEN_SHARE, impact_window

# Longer steps, as shares of the safe one, can survive the window and heat the crowd unnoticed in a
# longer run.
LONGEST = 4.0
# With fewer steps than these between two frames, the step would be shortened by too much.
FEW_STEPS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A method with a setting on the scene; None or "" for what it does not have.

    time_step_s: s, as it is run; time_step_share: of the safe one, at most.
    numerical_error, model_error: expected.
    promised_error: their sum with safety factors.
    cpu_seconds: s, what it should cost."""

    method: str
    law: str = ""
    solver: str = ""
    time_step_s: float | None = None
    time_step_share: float | None = None
    stiffness_N_per_m: float | None = None  # noqa: N815  (the unit is newton)
    tolerance: float | None = None
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


def window_of(scene: Scene) -> float:
    """Give how long the window is (s) at the scene's own stiffness."""
    return DRIVEN_SHARE * scene.drive.relaxation_time_s if scene.drive else scene.run.duration_s


def timing_of(scene: Scene, stiffness: float, step_s: float, whole_run: bool) -> Timing:
    """Give the timing of the window, or of the scene's whole run, at a stiffness (N/m) with steps
    of at most step_s, shortened a little so that frames fall on them.

    An impact is over sooner, ∝ 1/√k. A window has two frames. A run has fewer than the scene's
    where the step would be shortened by a tenth or more."""
    if scene.drive is not None:
        duration = scene.run.duration_s if whole_run else window_of(scene)
    else:
        softer = scene.contact.stiffness_N_per_m / stiffness
        duration = scene.run.duration_s * float(np.sqrt(softer))
    steps = ceil(duration / step_s - 1e-9)
    frames = scene.run.frames if whole_run else 2
    interval = ceil(steps / frames)
    if whole_run and interval < FEW_STEPS:
        frames = ceil(steps / interval)
    return Timing(duration, frames, interval * frames)


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """What is known of a scene for a question: the curves to read, the rates of their safety
    factors (None: none are needed), and the entries that prices are fitted to."""

    scene: Scene
    question: Question
    curves: Curves
    rates: Rates | None
    entries: Sequence[Entry]

    @cached_property
    def pilot(self) -> Pilot | None:
        """An impact tried by the engines' own scheme; None where curves are read: of a driven
        crowd, or from a chart of the scene."""
        if self.scene.drive is not None or self.rates is None:
            return None
        return Pilot(window=impact_window(self.scene), load=self.curves.load)

    def candidates(self) -> Iterator[Candidate]:
        """Yield the candidates of every method asked about. Against the model the rigid one is
        another model, and no candidate."""
        for method in self.question.methods:
            if method != "rigid":
                yield from self._soft(method)
            elif self.question.against == "rigid":
                yield from self._rigid()

    def _rigid(self) -> Iterator[Candidate]:
        unsure = 1.0 if self.rates is None else factor(self.rates, self.curves, "rigid")
        for solver, tolerance in self.curves.rigid_settings():
            errors = self.curves.rigid(solver, tolerance)
            if errors is None:
                continue
            yield Candidate(
                method="rigid",
                solver=solver,
                tolerance=tolerance,
                numerical_error=errors.numerical,
                model_error=0.0,
                promised_error=unsure * errors.numerical,
                cpu_seconds=self.curves.rigid_seconds(solver, tolerance),
            )

    def _soft(self, method: str) -> Iterator[Candidate]:
        scene, own = self.scene, self.scene.contact.stiffness_N_per_m
        free = self.question.against == "rigid"
        for law in LAWS[method] if free else (scene.contact.law,):
            price = price_of(method, law, self.entries)
            if price is None:
                continue
            # an impact is the same at every stiffness, only sooner over
            for stiffer in STIFFER if free and self.pilot is None else (1.0,):
                stiffness = stiffer * own
                safe = penalty_of(
                    scene.with_contact(law=law, stiffness_N_per_m=stiffness)
                ).safe_time_step
                for share, errors, promise in self._errors(method, law, stiffer):
                    whole_run = self.question.whole_run
                    timing = timing_of(scene, stiffness, share * safe, whole_run)
                    yield Candidate(
                        method=method,
                        law=law,
                        time_step_s=timing.step_s,
                        time_step_share=share,
                        stiffness_N_per_m=stiffness,
                        numerical_error=errors.numerical,
                        model_error=errors.model,
                        promised_error=promise,
                        cpu_seconds=price.of(len(scene.snapshot) * timing.steps),
                    )

    def _errors(
        self, method: str, law: str, stiffer: float
    ) -> Iterator[tuple[float, Errors, float]]:
        """Shares of the safe time step with their errors, and what is promised."""
        free = self.question.against == "rigid"
        if self.pilot is not None:
            for share, errors in self.pilot.errors(law).items():
                promised = self.pilot.promise(errors)
                yield share, errors, promised.numerical + (promised.model if free else 0.0)
            return
        numerical, model = 1.0, 1.0
        if self.rates is not None:
            numerical, model = (
                factor(self.rates, self.curves, what) for what in ("numerical", "model")
            )
        hardness = self.curves.likeness.hardness * float(stiffer**0.5)
        for share in self.curves.shares(method, law):
            found = self.curves.soft(method, law, share, hardness) if share <= LONGEST else None
            if found is not None:
                promise = numerical * found.numerical + (model * found.model if free else 0.0)
                yield share, found, promise
