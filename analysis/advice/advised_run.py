"""Advice put to use: which methods are there, and the scene as it is run with advised settings."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

from analysis.advice.asked import asked_error
from analysis.advice.choice import Candidate, advise, window_of
from analysis.advice.library import stored_library
from analysis.advice.price import lasts
from analysis.advice.words import headline
from analysis.engines import ENGINES, EngineError
from analysis.engines import engine as find_engine
from analysis.scene.scene import Scene

RIGID = "rigid"
# With fewer steps than these between two frames, the step would be shortened by too much.
FEW_STEPS = 10


def methods_here(asked: Sequence[str] | None = None) -> tuple[str, ...]:
    """The methods asked for; all that are installed by default. Raises ValueError for an unknown
    one."""
    if not asked:
        return RIGID, *(engine.NAME for engine in ENGINES if engine.find())
    known = (RIGID, *(engine.NAME for engine in ENGINES))
    for name in asked:
        if name not in known:
            raise ValueError(f"method: unknown {name!r}; there are: {', '.join(known)}")
    return tuple(dict.fromkeys(asked))


def scene_within(
    scene: Scene, error: str, engine_name: str | None = None
) -> tuple[Scene, str, str]:
    """The scene to run, the engine (the cheapest that is installed by default) and the choice in
    words, for an error such as `5%` of what each disk receives, against the rigid model. Raises
    ValueError naming the best where nothing reaches it, and EngineError where there is no
    engine."""
    if engine_name is not None:
        find_engine(engine_name)
    engines = [engine_name] if engine_name else [name for name in methods_here() if name != RIGID]
    if not engines:
        raise EngineError("no engine: nothing can run the scene; see: percussions doctor")
    advice = advise(
        scene, asked_error(error), methods=engines, whole_run=True, library=stored_library()
    )
    if advice.choice is None:
        raise ValueError(f"error: {headline(advice)}")
    words = headline(advice)
    advised = advised_scene(scene, advice.choice)
    if advised.run.time_step_s != advice.choice.time_step_s:
        words += (
            f"; it runs with Δt = {advised.run.time_step_s:.3g} s, since frames fall on whole steps"
        )
    if scene.drive is not None:
        # in a run people collide: the force at an instant is no mean over a window
        words += (
            f"; the error is that of mean forces over {window_of(scene):g} s of a crowd pressed "
            "together, not of an instant"
        )
    return advised, advice.choice.method, words


def advised_scene(scene: Scene, candidate: Candidate) -> Scene:
    """Return the scene with the law, stiffness and time step of an engine's candidate.

    An impact lasts as many √(m/k) as in the scene. The step is shortened a little, so that frames
    fall on steps: by less than a tenth, with fewer frames than the scene's where it must be."""
    assert candidate.stiffness_N_per_m is not None
    assert candidate.time_step_s is not None
    stiffness, step = candidate.stiffness_N_per_m, candidate.time_step_s
    duration = lasts(scene, stiffness, True, window_of(scene))
    steps = ceil(duration / step - 1e-9)
    frames = scene.run.frames
    interval = ceil(steps / frames)
    if interval < FEW_STEPS:
        frames = ceil(steps / interval)
    return scene.with_contact(law=candidate.law, stiffness_N_per_m=stiffness).with_run(
        duration_s=duration, frames=frames, time_step_s=duration / (interval * frames)
    )
