"""The runs of a report: of its snapshots, and of crowds in motion with what nobody knows varied."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from analysis.compare.study import Study
from analysis.dumps import DumpError
from analysis.engines import PENALTY, EngineError
from analysis.engines.rigid import NAME as RIGID
from analysis.engines.run import EngineRun, run_folder
from analysis.engines.softness import chest, softest
from analysis.pages.names import bodies_label
from analysis.pages.numbers import significant
from analysis.scene.named_crowds import crowd_label, crowds_beside, with_crowd
from analysis.scene.scene import Scene, SceneError, is_shipped
from analysis.scene.shipped_scenes import variant, with_push, with_radius
from analysis.studies.film.export import film_runs
from analysis.studies.film.frame import Animation, FrameRange
from analysis.studies.motion.study import CROWD, Model, model_title
from analysis.support.parallel import Progress
from nscd.stepping import StepError

# The other friction, of people and walls alike; the smaller push, and the larger one of a scene that
# has it (N); how well radii are known (m).
FRICTION, PUSH_N, LARGE_N, RADIUS_M = 0.4, 100.0, 200.0, 0.01
# From so many replicates on all models have all; else what is varied has the fewest that can be
# compared.
MANY, FEW = 10, 3
# A push or stiffness that is nearer to the scene's own is no variation of it.
NEAR = 0.2


def moves(scene: Scene) -> bool:
    """Tell whether a scene goes on: it is driven, and no impact, which is over at once."""
    return scene.drive is not None and scene.analysis.kind != "impact"


def motion_of(
    scene: Scene, engines: Sequence[str], stiffnesses: Sequence[float], crowds: int, out: Path
) -> list[Model]:
    """List the models of a scene in motion, the rigid one first where it is among the engines, and
    then what varies one thing that nobody knows; none of a scene that does not move."""
    if not (moves(scene) and crowds):
        return []
    fewer = crowds if crowds >= MANY else min(crowds, max(FEW, crowds // 2))
    every = _own_noise([variant(scene, number) for number in range(crowds)])
    soft = next((each.NAME for each in PENALTY if each.NAME in engines), None)
    models = [_model(every, RIGID, out, "rigid")] if RIGID in engines else []
    if soft is not None:
        kinds = [(k, every) for k in stiffnesses]
        k = softest(scene)
        if scene.contact.law == "hooke" and k < min(stiffnesses) * (1 - NEAR):
            kinds.append((k, every[:fewer]))
        if scene.contact.law == "hooke" and chest() not in (one for one, _ in kinds):
            kinds.append((chest(), every[:fewer]))
        for k, some in kinds:
            made = [one.with_contact(stiffness_N_per_m=k) for one in some]
            factor = "bodies" if models else ""
            models.append(_model(made, soft, out, bodies_label(made[0]), factor))
    if not models:
        return []
    first = models[0].runs
    base = [run.scene for run in first[:fewer]]
    for factor, label, changed in _variations(scene, engines):
        try:
            varied = _own_noise([changed(one) for one in base])
        except (SceneError, StepError, ValueError):
            continue  # this crowd has no such variation: a law without friction, a full room
        name = label.replace(" ", "_").replace("−", "-")
        models.append(_model(varied, first[0].engine, out / name, label, factor))
    return models


def _own_noise(scenes: Sequence[Scene]) -> list[Scene]:
    """Give the people of each replicate a jostling of their own."""
    return [with_own_noise(one, number) for number, one in enumerate(scenes)]


def with_own_noise(scene: Scene, number: int) -> Scene:
    """Give the people of replicate `number` of a driven scene a jostling of their own."""
    assert scene.drive is not None
    return scene.with_drive(seed=scene.drive.seed + number) if scene.drive.noisy else scene


Variation = tuple[str, str, Callable[[Scene], Scene]]


def _pushes(scene: Scene, engines: Sequence[str]) -> Iterator[Variation]:
    """How hard people push: in rooms that are not the product's the other named crowds, which the
    rigid engine has, else another push."""
    assert scene.drive is not None
    doors = len(scene.drive.gates) == len(scene.drive.doors)
    if RIGID in engines and doors and not is_shipped(scene):
        for name, fraction, same in crowds_beside(scene):
            if not same:
                yield CROWD, crowd_label(name, fraction), partial(with_crowd, name=name, fraction=fraction)
        return
    own = float(scene.drive.push(scene.snapshot.mass).mean())
    push = PUSH_N if abs(own - PUSH_N) > NEAR * PUSH_N else LARGE_N
    yield "push", f"push {significant(push)} N", lambda one: with_push(one, push)


def _variations(scene: Scene, engines: Sequence[str]) -> Iterator[Variation]:
    """What is varied of the first model: the factor, in words, and how."""
    mu = 0.0 if scene.contact.friction else FRICTION
    yield "friction", f"friction {significant(mu)}", lambda one: one.with_contact(friction=mu)
    yield from _pushes(scene, engines)
    if float(scene.snapshot.radius.min()) > 2 * RADIUS_M:
        yield "radius", "radius − 1 cm", lambda one: with_radius(one, -RADIUS_M)
        yield "radius", "radius + 1 cm", lambda one: with_radius(one, RADIUS_M)


def _model(scenes: Sequence[Scene], name: str, out: Path, label: str, factor: str = "") -> Model:
    """Crowd by crowd, apart from the scene's own runs, which have no impulses."""
    made = [one.with_run(impulses=True) for one in scenes]
    title = model_title(made[0], name)
    if factor in (CROWD, "push", "radius"):
        title += f", {label}"
    runs = [replicate_run(one, name, out, index) for index, one in enumerate(made)]
    return Model(title=title, label=label, factor=factor, runs=runs)


def replicate_run(scene: Scene, name: str, out: Path, number: int) -> EngineRun:
    """Name the run of replicate `number` in the folder of its crowd."""
    return EngineRun(scene=scene, engine=name, folder=run_folder(out / f"crowd_{number}", scene, name))


def snapshot_runs(out: Path, models: Sequence[Model]) -> Path:
    """Return where the runs of a scene's snapshots are: those of crowd 0 of a scene in motion."""
    return out / "crowd_0" if models else out


def scenes_of(scene: Scene, soft: Sequence[str], models: Sequence[Model]) -> dict[str, Scene]:
    """Name the scene that each engine with springs runs for its snapshot: that of the models of that
    engine, with impulses. Those of YADE cost ten times the run, and nothing else needs them."""
    summing = {run.engine for model in models for run in model.runs}
    return {name: scene.with_run(impulses=True) if name in summing else scene for name in soft}


def runs_of(
    chosen: Sequence[tuple[Scene, Sequence[float]]],
    soft: Sequence[str],
    motions: Sequence[Sequence[Model]],
    out: Path,
) -> list[EngineRun]:
    """List every run that a report needs once: of the snapshots of each scene with its stiffnesses
    (N/m) by the engines with springs, and of its crowds in motion."""
    every = []
    for (scene, stiffnesses), models in zip(chosen, motions, strict=True):
        every += [
            EngineRun.of(one.with_contact(stiffness_N_per_m=k), name, snapshot_runs(out, models))
            for name, one in scenes_of(scene, soft, models).items()
            for k in sorted(stiffnesses)
        ]
        every += [run for model in models for run in model.runs]
    return list({run.folder: run for run in every}.values())


# Frames of the film of a first screen.
FRAMES = 20


def films_of(
    made: Study,
    models: Sequence[Model],
    out: Path,
    last_s: float,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Animation]:
    """Film the first run of the first model, which the bars are of, and of a study; nothing where
    one did not end well or no contact was made. last_s: how much of the end the bars are of."""
    step = max(1, made.scene.run.frames // FRAMES)
    folders = [model.runs[0].folder for model in models[:1]]
    for one in made.comparisons[:1]:
        scene = one.scene.model_copy(update={"name": made.scene.name})
        folders.append(run_folder(out, scene, one.record.engine))
    for chosen in filter(None, (list(dict.fromkeys(folders)), folders[1:])):
        with suppress(EngineError, DumpError, ValueError):  # frames at other times, too
            animations = film_runs(chosen, FrameRange(step=step), progress, executor)
            since = max(0.0, animations[0].frames[-1].time - last_s)
            return [replace(one, since=since) for one in animations]
    return []
