"""The soft-contact model integrated to high accuracy without any engine: the reference of the
time-stepping methods, kept on disk since it takes as long as an engine's run. And the engines' own
scheme on the same model, which tells their error without running them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import DOP853

from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.work_precision.soft_model import SoftModel
from analysis.work_precision.window import Motion
from nscd.arrays import Floats

TOLERANCE = 1e-7
# How much tighter the second integration is, whose difference from the first is the error bar.
TIGHTER = 0.01
MOST_STEPS = 400_000
# Counts up whenever `soft_reference` comes to give other numbers.
EDITION = 1


class ReferenceError(RuntimeError):
    """A reference that could not be computed; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoftReference:
    """The soft model at the end of the scene's run.

    motion: its answer.
    looser: the same with a tolerance 100 times looser; their difference bounds the error as long as
    the integration converges.
    steps: of the integration."""

    motion: Motion
    looser: Motion
    steps: int


def soft_reference(scene: Scene, tolerance: float = TOLERANCE) -> SoftReference:
    """Integrate the soft model of the scene over its run by DOP853 (Hairer, Nørsett, Wanner,
    Solving Ordinary Differential Equations I, II.5), twice. Raises ReferenceError, and what
    `SoftModel` raises."""
    (looser, _), reach = _reaching(scene, lambda reach: _integrate(scene, tolerance, reach))
    motion, steps = _integrate(scene, TIGHTER * tolerance, reach)
    return SoftReference(motion=motion, looser=looser, steps=steps)


def leapfrog(scene: Scene) -> Motion:
    """Integrate the soft model with the scene's time step as both engines do: positions move with
    the velocity of the half step, and so do dashpots see the one of half a step before. Raises what
    `SoftModel` raises."""
    return _reaching(scene, lambda reach: _step(scene, reach))[0][0]


def kept_reference(scene: Scene, path: Path) -> SoftReference | str:
    """Take the soft reference of the scene from `path`.npz, or compute and keep it there; return
    why there is none, in words, where it could not be computed."""
    file, key = path.with_name(path.name + ".npz"), f"{scene.digest()} {TOLERANCE} {EDITION}"
    if found := kept(file, key):
        motion, looser = (
            Motion(displacement=found[f"{name}_displacement"], velocity=found[f"{name}_velocity"])
            for name in ("motion", "looser")
        )
        return SoftReference(motion=motion, looser=looser, steps=int(found["steps"]))
    try:
        made = soft_reference(scene)
    except ReferenceError as error:
        return str(error)
    arrays = {
        f"{name}_{field}": getattr(getattr(made, name), field)
        for name in ("motion", "looser")
        for field in ("displacement", "velocity")
    }
    keep(file, key, {"steps": made.steps, **arrays})
    return made


def _speed(scene: Scene) -> float:
    """About how fast anybody gets (m/s)."""
    speed = float(np.abs(scene.snapshot.velocity).max(initial=0.0))
    speed += float(np.hypot(*scene.acceleration())) * scene.run.duration_s
    if scene.drive is None:
        return speed
    share = scene.run.duration_s / scene.drive.relaxation_time_s
    return max(speed, scene.drive.speed_m_per_s * share)


def _reaching(
    scene: Scene, integrate: Callable[[float], tuple[Motion, int]]
) -> tuple[tuple[Motion, int], float]:
    """What `integrate` gives with contacts looked for as far (m) as it takes, and how far: a crowd
    can squeeze somebody out faster than anybody wants to walk."""
    reach = 2.0 * (_speed(scene) * scene.run.duration_s + 1e-4)
    while True:
        found = integrate(reach)
        farthest = 2.0 * float(np.hypot(*found[0].displacement[1].T).max())
        if not farthest > 0.9 * reach:
            return found, reach
        reach = max(2.0 * reach, 1.5 * farthest)


def _step(scene: Scene, reach: float) -> tuple[Motion, int]:
    model, penalty = SoftModel(scene, reach), penalty_of(scene)
    start = np.array(scene.snapshot.position)
    moved, velocity = np.zeros_like(start), np.array(scene.snapshot.velocity)
    dt, acceleration = penalty.time_step, np.empty_like(start)
    model.accelerate(acceleration, start, velocity)
    velocity += 0.5 * dt * acceleration
    frames = []
    for step in range(1, penalty.steps + 1):
        before = start + moved
        moved += dt * velocity
        _stay_inside(scene, model, before, start + moved)
        model.accelerate(acceleration, start + moved, velocity)
        if step in (penalty.steps // 2, penalty.steps):
            frames.append((moved.copy(), velocity + 0.5 * dt * acceleration))
        velocity += dt * acceleration
    displacement, velocities = (np.stack(part) for part in zip(*frames, strict=True))
    return Motion(displacement=displacement, velocity=velocities), penalty.steps


def _integrate(scene: Scene, tolerance: float, reach: float) -> tuple[Motion, int]:
    snapshot, model = scene.snapshot, SoftModel(scene, reach)
    n = len(snapshot)
    period = float(
        np.sqrt(snapshot.mass.max() / max(scene.contact.stiffness_N_per_m, scene.contact.at_walls))
    )
    least = tolerance * _speed(scene)

    # displacements in lengths of a period, so that one tolerance (a speed) serves both halves
    def slope(_: float, state: Floats) -> Floats:
        moved, velocity = state[: 2 * n].reshape(n, 2), state[2 * n :].reshape(n, 2)
        out = np.empty_like(state)
        np.divide(state[2 * n :], period, out=out[: 2 * n])
        position = snapshot.position + period * moved
        model.accelerate(out[2 * n :].reshape(n, 2), position, velocity)
        return out

    start = np.concatenate([np.zeros(2 * n), snapshot.velocity.ravel()])
    states, steps = [], 0
    for begin, end in ((0.0, 0.5), (0.5, 1.0)):
        span = begin * scene.run.duration_s, end * scene.run.duration_s
        solver = DOP853(slope, span[0], start, span[1], rtol=tolerance, atol=least)
        while solver.status == "running":
            before = snapshot.position + period * solver.y[: 2 * n].reshape(n, 2)
            message = solver.step()
            steps += 1
            after = snapshot.position + period * solver.y[: 2 * n].reshape(n, 2)
            _stay_inside(scene, model, before, after)
            if solver.status == "failed" or steps > MOST_STEPS:
                raise ReferenceError(f"{scene.name}: {message or f'no end after {steps} steps'}")
        start = solver.y
        states.append(start.reshape(2, n, 2))
    moved = period * np.stack([state[0] for state in states])
    return Motion(displacement=moved, velocity=np.stack([state[1] for state in states])), steps


def _stay_inside(scene: Scene, model: SoftModel, before: Floats, after: Floats) -> None:
    if model.passes_a_wall(before, after):
        raise ReferenceError(f"{scene.name}: the centre of a disk has passed a wall")
