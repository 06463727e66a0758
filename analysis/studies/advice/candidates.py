"""What is asked, and the settings that may answer it, each with its expected error and cost."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Literal

import numpy as np

from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.studies.advice.library import NEAR, Curves, Entry, Rates, price_of
from analysis.studies.work_precision.point import Method, PointStatus
from analysis.studies.work_precision.soft import LAWS, STIFFER
from analysis.studies.work_precision.window import Window
from nscd import find_contacts

Against = Literal["rigid", "model"]
LOADS = {
    "disk-load": "what each disk receives from its contacts",
    "contact-load": "what each contact carries",
    "wall-load": "what all walls together carry",
    "displacement": "where each disk goes",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What is asked.

    error: a share, at most; rms over all components relative to the rms of the rigid model's.
    against: `rigid`: numerical and model error count, and law and stiffness are free; `model`: the
    numerical error alone, with the scene's own law and stiffness.
    whole_run: whether prices and time steps are of the scene's whole run, or of its window."""

    error: float
    quantity: str = "disk-load"  # one of LOADS
    against: Against = "rigid"
    methods: tuple[str, ...] = ("rigid", "lammps", "yade")  # to choose from
    whole_run: bool = False

    @property
    def load(self) -> str:
        """How the names of the points of the quantity begin."""
        return self.quantity.split("-")[0]

    def laws(self, method: str, scene: Scene) -> tuple[str, ...]:
        """Give the contact laws that a method may have; none for the rigid model."""
        laws = LAWS.get(method, ())
        return laws if self.against == "rigid" else tuple({scene.contact.law} & set(laws))

    def check(self, scene: Scene) -> None:
        """Raise ValueError for a quantity that is unknown, or that the scene cannot have."""
        if self.quantity not in LOADS:
            raise ValueError(f"quantity: unknown {self.quantity!r}. There are: {', '.join(LOADS)}")
        if self.quantity == "displacement" and scene.drive is None:
            raise ValueError(
                f"quantity: displacement is for driven crowds, and {scene.name} is an impact, "
                "which takes no time"
            )
        if self.quantity == "wall-load":
            to_press = scene.drive is not None and scene.reconciliation is None
            contacts = find_contacts(
                scene.snapshot, scene.wall_segments(), tolerance=scene.analysis.contact_tolerance_m
            )
            if not scene.walls or not (to_press or contacts.is_wall.any()):
                raise ValueError(
                    f"quantity: wall-load: nobody touches a wall in scene {scene.name}"
                )


def asked_error(text: str) -> float:
    """Read `5%`, `5 %` or `0.05` as a share. Raises ValueError for what is no number above 0 and
    below 1 (100 %)."""
    number = text.strip()
    try:
        fraction = float(number[:-1]) / 100 if number.endswith("%") else float(number)
    except ValueError:
        fraction = float("nan")
    if not 0 < fraction < 1:
        raise ValueError(
            f"error: {text!r}. A share above 0 and below 1 is needed, such as 5% or 0.05"
        )
    return fraction


# So many of the errors that were predicted are to be within the factor: nearly all, since a choice
# is the best of many settings and so tends to be one whose error was predicted too low.
WITHIN = 0.98
# Errors below this are as good as none, those above this no use to anybody: neither says how safe a
# promise is.
NO_MATTER, NO_USE = 1e-4, 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Safety:
    """What expected errors are multiplied with before they are promised: the numerical and the
    model error of engines, and the numerical error of a solver (rigid)."""

    numerical: float = 1.0
    model: float = 1.0
    rigid: float = 1.0


# Of an impact that was tried: engines round otherwise, and shorten steps to meet frames.
TRIED = Safety(numerical=1.5, model=1.1)


def safety_of(rates: Rates, curves: Curves) -> Safety:
    """Compute the factors of curves that are read from other scenes: exp(rate · unlikeness), at
    least 1; infinite where there is no rate."""
    found, far = {}, dissimilarity(curves)
    for what in Safety.__dataclass_fields__:
        rate = rates.get(f"{curves.load}_{what}")
        # that others came out better than predicted is luck
        found[what] = float("inf") if rate is None else float(np.exp(max(rate, 0.0) * far))
    return Safety(**found)


def dissimilarity(curves: Curves) -> float:
    """Compute the weighted mean of NEAR + distance over the scenes read."""
    return sum(
        weight * (NEAR + curves.likeness.distance(entry.likeness)) for entry, weight in curves.read
    )


def rates_of(entries: Sequence[Entry]) -> Rates:
    """Compute rates that hold for WITHIN of the errors between NO_MATTER and NO_USE, each scene
    predicted from all others.

    The rate of one point is log(measured/expected)/unlikeness. Against promises that are made for
    one scene from many it errs on the safe side where the scene left out was the only one of its
    sort."""
    found: dict[str, list[float]] = {}
    for entry in entries:
        others = [other for other in entries if other is not entry]
        for load in sorted({point.load for point in entry.points}):
            curves = Curves(likeness=entry.likeness, load=load, entries=others)
            if not curves.read:
                continue
            far = dissimilarity(curves)
            for what, measured, expected in _predicted(entry, curves):
                rate = float(np.log(max(measured, NO_MATTER) / max(expected, NO_MATTER))) / far
                found.setdefault(f"{load}_{what}", []).append(rate)
    return {key: float(np.quantile(rates, WITHIN)) for key, rates in found.items()}


def _predicted(entry: Entry, curves: Curves) -> Iterable[tuple[str, float, float]]:
    """What, measured and expected error of every point that matters."""
    for point in entry.points:
        finite = point.status == PointStatus.OK and point.numerical_error is not None
        finite = finite and point.model_error is not None and point.load == curves.load
        if not finite or (point.error_sum or 0.0) > NO_USE:
            continue
        if point.method == "rigid":
            assert point.tolerance is not None
            if errors := curves.rigid(point.solver, point.tolerance):
                yield "rigid", point.numerical_error or 0.0, errors.numerical
        elif point.time_step_share is not None:
            errors = curves.soft(
                point.method, point.law, point.time_step_share, entry.hardness(point)
            )
            if errors:
                yield "numerical", point.numerical_error or 0.0, errors.numerical
                yield "model", point.model_error or 0.0, errors.model


# Longer steps, as shares of the safe one, can survive the window and heat the crowd unnoticed in a
# longer run.
LONGEST = 4.0
# With fewer steps than these between two frames, the step would be shortened by too much.
FEW_STEPS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate(Method):
    """A method with a setting on the scene.

    time_step_s: s, as it is run; time_step_share: of the safe one, at most."""

    numerical_error: float  # expected
    model_error: float  # expected
    promised_error: float  # their sum with safety factors
    cpu_seconds: float  # s, what it should cost


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
class AdviceContext:
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
        scene, question, similarity = self.scene, self.question, self.curves.likeness
        free, cost = question.against == "rigid", price_of(method, law, self.priced)
        fractions = [ratio for ratio in self.curves.fractions(method, law) if ratio <= LONGEST]
        # an impact is the same at every stiffness, only sooner over
        for stiffer in STIFFER if free and similarity.driven else (1.0,):
            stiffness = stiffer * scene.contact.stiffness_N_per_m
            stiff = scene.with_contact(law=law, stiffness_N_per_m=stiffness)
            safe, hardness = penalty_of(stiff).safe_time_step, similarity.hardness * stiffer**0.5
            for fraction in fractions:
                errors = self.curves.soft(method, law, fraction, hardness)
                if errors is None or cost is None:
                    continue
                model = self.safety.model * errors.model if free else 0.0
                timing = timing_of(scene, stiffness, fraction * safe, question.whole_run)
                yield Candidate(
                    method=method,
                    law=law,
                    time_step_s=timing.step_s,
                    time_step_share=fraction,
                    stiffness_N_per_m=stiffness,
                    numerical_error=errors.numerical,
                    model_error=errors.model,
                    promised_error=self.safety.numerical * errors.numerical + model,
                    cpu_seconds=cost.of(len(scene.snapshot) * timing.steps),
                )
