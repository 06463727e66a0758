"""Advice in words, and a scene as advised."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from analysis.advice.candidates import LOADS, Candidate, Question, asked_error, timing_of
from analysis.advice.choice import MOST_DISKS, Advice, advise
from analysis.advice.library import stored_library
from analysis.engines import EngineError
from analysis.engines import engine as find_engine
from analysis.pages.names import engine_name
from analysis.pages.numbers import percent, seconds
from analysis.scene.scene import Scene
from analysis.support.files import write_json
from analysis.work_precision.soft_runs import LAWS, soft_engines
from analysis.work_precision.window import Window


def setting(candidate: Candidate) -> str:
    """Write a method with its setting."""
    name = engine_name(candidate.method)
    if candidate.time_step_s is None:
        return f"{name}, solver {candidate.solver}, tolerance {candidate.tolerance:g}"
    return (
        f"{name}, {candidate.law}, k = {candidate.stiffness_N_per_m:.3g} N/m, "
        f"Δt = {candidate.time_step_s:.3g} s ({candidate.time_step_share:g} × safe)"
    )


def headline(advice: Advice) -> str:
    """Write the choice in one line; or that there is none, and the best that is reached."""
    quantity, best = advice.question.quantity, advice.best
    if (choice := advice.choice) is not None:
        return f"{setting(choice)}: error of {quantity} {_offer(choice)}"
    if best is None:
        return f"nothing is known of {quantity} in {advice.scene.name}: {_nothing_like(advice)}"
    return (
        f"nothing reaches {percent(advice.question.error, 2)} in {quantity}; the best, "
        f"{setting(best)}, promises {percent(best.promised_error, 2)}"
    )


def _nothing_like(advice: Advice) -> str:
    if advice.likeness.driven:
        return "no measured scene is enough like it"
    if advice.likeness.disks > MOST_DISKS:
        return f"an impact of more than {MOST_DISKS} disks is not tried"
    return "the mechanics does not determine it, or no method asked about could be tried"


def _offer(candidate: Candidate) -> str:
    promise = percent(candidate.promised_error, 2)
    return f"at most {promise}, {seconds(candidate.cpu_seconds)} CPU"


def report(advice: Advice, left: Sequence[str]) -> list[str]:
    """Write all lines: the question, the choice, the next better one, each method, the curve, where
    it was read, what was left out."""
    lines = [*_question(advice), "", *_choice(advice), "", *_curve(advice)]
    lines += [f"measured on {where}" for where in advice.measured]
    lines += ["", "left out of the model:", *(f"  {line}" for line in left)]
    return lines


def _question(advice: Advice) -> Iterator[str]:
    scene, question = advice.scene, advice.question
    disks, quantity = len(scene.snapshot), question.quantity
    yield f"{scene.name}: {disks} disks; {quantity}, {LOADS[quantity]},"
    against = "the rigid model (numerical and model error)"
    if question.against == "model":
        law = scene.contact.law
        against = f"{law} contacts of the scene's stiffness, exactly solved (numerical error)"
    yield f"within {percent(question.error, 2)} of {against}"


def _choice(advice: Advice) -> Iterator[str]:
    choice, better = advice.choice, advice.better
    if choice is None:
        yield headline(advice)
        return
    yield "advised: " + headline(advice)
    if better is None:
        yield "next better: nothing promises half that error"
    else:
        times = better.cpu_seconds / choice.cpu_seconds
        yield f"next better: {setting(better)}: {_offer(better)} ({times:.2g} times the price)"
    for other in advice.by_method:
        if other != choice:
            yield f"or with {setting(other)}: {_offer(other)}"


def _curve(advice: Advice) -> Iterator[str]:
    yield "the curve, from cheap to accurate:"
    yield f"  {'':<70}{'numerical':>12}{'model':>12}{'promised':>12}{'CPU':>10}"
    for c in advice.curve:
        errors = (c.numerical_error, c.model_error, c.promised_error)
        shown = "".join(f"{percent(error, 2):>12}" for error in errors)
        mark = "→" if c == advice.choice else " "
        yield f"{mark} {setting(c):<70}{shown}{seconds(c.cpu_seconds):>10}"
    scenes = ", ".join(f"{name} ({percent(weight, 2)})" for name, weight in advice.read)
    if advice.tried:
        yield "errors found on this very impact: solved here, and stepped through as engines do"
    elif advice.own:
        yield "read from the chart of this scene"
    else:
        yield f"read from the scenes most like it: {scenes}" if scenes else _nothing_like(advice)


def write_advice(advice: Advice, left: Sequence[str], folder: Path) -> Path:
    """Write advice.json into the folder, whole or not at all; return its path."""

    def one(candidate: Candidate | None) -> dict[str, Any] | None:
        return None if candidate is None else dataclasses.asdict(candidate)

    content = {
        "scene": advice.scene.name,
        "quantity": advice.question.quantity,
        "against": advice.question.against,
        "asked_error": advice.question.error,
        "likeness": dataclasses.asdict(advice.likeness),
        "choice": one(advice.choice),
        "next_better": one(advice.better),
        "best": one(advice.best),
        "by_method": [one(c) for c in advice.by_method],
        "curve": [one(c) for c in advice.curve],
        "read": [{"scene": name, "weight": weight} for name, weight in advice.read],
        "from_own_chart": advice.own,
        "tried": advice.tried,
        "measured": list(advice.measured),
        "left_out": list(left),
    }
    write_json(folder / "advice.json", content)
    return folder / "advice.json"


RIGID = "rigid"


def methods_here(asked: Sequence[str] | None = None) -> tuple[str, ...]:
    """Give the methods asked for; all that are installed by default. Raises ValueError for an
    unknown one."""
    if not asked:
        return RIGID, *soft_engines()
    known = (RIGID, *LAWS)
    for name in asked:
        if name not in known:
            raise ValueError(f"method: unknown {name!r}; there are: {', '.join(known)}")
    return tuple(dict.fromkeys(asked))


def scene_within(
    scene: Scene, error: str, engine_name: str | None = None
) -> tuple[Scene, str, str]:
    """Give the scene to run, the engine (the cheapest that is installed by default) and the choice
    in words, for an error such as `5%` of what each disk receives, against the rigid model.

    Raises ValueError for an engine without soft contacts, and naming the best where nothing reaches
    it; EngineError where there is no engine."""
    if engine_name is not None:
        find_engine(engine_name)
        if engine_name not in LAWS:
            raise ValueError(
                f"error: it is for {' and '.join(LAWS)}; {engine_name} has no stiffness"
            )
    engines = [engine_name] if engine_name else soft_engines()
    if not engines:
        raise EngineError("no engine: nothing can run the scene; see: percussions doctor")
    question = Question(error=asked_error(error), methods=tuple(engines), whole_run=True)
    advice = advise(scene, question, library=stored_library())
    words = headline(advice)
    if advice.choice is None:
        raise ValueError(f"error: {words}")
    if scene.drive is not None:
        window = Window(scene=scene).duration(scene.contact.stiffness_N_per_m)
        # in a run people collide: the force at an instant is no mean over a window
        words += (
            f"; the error is that of mean forces over {window:g} s of a crowd pressed "
            "together, not of an instant"
        )
    return advised_scene(scene, advice.choice), advice.choice.method, words


def advised_scene(scene: Scene, candidate: Candidate) -> Scene:
    """Give the scene with the law, stiffness and time step of an engine's candidate (of a whole
    run); an impact lasts as many √(m/k) as in the scene."""
    assert candidate.stiffness_N_per_m is not None
    assert candidate.time_step_s is not None
    stiffness = candidate.stiffness_N_per_m
    timing = timing_of(scene, stiffness, candidate.time_step_s, whole_run=True)
    return scene.with_contact(law=candidate.law, stiffness_N_per_m=stiffness).with_run(
        duration_s=timing.duration_s, frames=timing.frames, time_step_s=timing.step_s
    )
