"""Advice put to use: which methods are there, and the scene as it is run with advised settings."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.advice.candidates import Candidate, timing_of
from analysis.advice.choice import advise
from analysis.advice.library import stored_library
from analysis.advice.question import Question, asked_error
from analysis.advice.words import headline
from analysis.engines import EngineError
from analysis.engines import engine as find_engine
from analysis.scene.scene import Scene
from analysis.work_precision.soft_runs import LAWS, soft_engines
from analysis.work_precision.window import Window

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
