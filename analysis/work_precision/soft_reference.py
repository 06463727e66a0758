"""The soft-contact model solved to high accuracy without any engine: the reference of the
time-stepping methods, kept on disk since it takes as long as an engine's run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import DOP853

from analysis.engines.penalty import damping_ratio_for
from analysis.scene.scene import Scene
from analysis.support.cache import keep, kept
from analysis.work_precision.window import Motion
from nscd import find_contacts
from nscd.arrays import Floats

TOLERANCE = 1e-7
# How much tighter the second integration is, whose difference from the first is the error bar.
TIGHTER = 0.01
MOST_STEPS = 400_000
# Hertz contacts have the tangent stiffness asked for at an overlap of this share of the mean
# radius.
HERTZ_OVERLAP = 0.01
# Counts up whenever `soft_reference` comes to give other numbers.
EDITION = 1


class ReferenceError(RuntimeError):
    """A reference that could not be computed; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoftReference:
    """The motion of the soft model at the end of the scene's run, and the same with a tolerance 100
    times looser: their difference bounds the error as long as the integration converges."""

    motion: Motion
    looser: Motion
    steps: int


def soft_reference(scene: Scene, tolerance: float = TOLERANCE) -> SoftReference:
    """Integrate m dv/dt = Σ contact forces + m (u_d − v)/τ over the scene's run by DOP853 (Hairer,
    Nørsett, Wanner, Solving Ordinary Differential Equations I, II.5), twice.

    A contact pushes with max(0, kδ + cδ′) (hooke) or max(0, K √R δ^1.5 + √5 ζ √(m_eff K √(Rδ)) δ′)
    (hertz) while δ > 0. The dashpots are those of `penalty_of`, written anew from the law's
    definition. The drive acts continuously. Raises ValueError for friction, which has a memory that
    this integration does not keep, and ReferenceError."""
    if scene.contact.friction:
        raise ValueError(
            f"contact.friction: {scene.contact.friction:g}; charts are for frictionless contacts"
        )
    speed = float(np.abs(scene.snapshot.velocity).max(initial=0.0))
    if scene.drive is not None:
        speed = max(
            speed, scene.drive.speed_m_per_s * scene.run.duration_s / scene.drive.relaxation_time_s
        )
    # a crowd can squeeze somebody out faster than anybody wants to walk: contacts are looked for
    # farther until that is enough
    reach = 2.0 * (speed * scene.run.duration_s + 1e-4)
    while True:
        looser, _ = _integrate(scene, tolerance, speed, reach)
        farthest = 2.0 * float(np.hypot(*looser.displacement[1].T).max())
        if farthest <= 0.9 * reach:
            break
        reach = max(2.0 * reach, 1.5 * farthest)
    motion, steps = _integrate(scene, TIGHTER * tolerance, speed, reach)
    return SoftReference(motion=motion, looser=looser, steps=steps)


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


def _integrate(scene: Scene, tolerance: float, speed: float, reach: float) -> tuple[Motion, int]:
    snapshot = scene.snapshot
    n = len(snapshot)
    period = float(np.sqrt(snapshot.mass.max() / scene.contact.stiffness_N_per_m))
    first, second, wall = _candidates(scene, reach)
    law, drive = _law(scene), _drive(scene)
    segments = scene.wall_segments()

    # displacements in lengths of a period, so that one tolerance (a speed) serves both halves
    def slope(_: float, state: Floats) -> Floats:
        moved, velocity = state[: 2 * n].reshape(n, 2), state[2 * n :].reshape(n, 2)
        out = np.empty_like(state)
        position = snapshot.position + period * moved
        np.divide(state[2 * n :], period, out=out[: 2 * n])
        acceleration = out[2 * n :].reshape(n, 2)
        _contact_forces(
            acceleration, position, velocity, snapshot.radius, snapshot.mass, first, second, wall,
            segments.start, segments.end, *law,
        )  # fmt: skip
        acceleration /= snapshot.mass[:, None]
        if drive is not None:
            _add_drive(acceleration, position, velocity, *drive)
        return out

    start = np.concatenate([np.zeros(2 * n), snapshot.velocity.ravel()])
    states, steps = [], 0
    for begin, end in ((0.0, 0.5), (0.5, 1.0)):
        span = begin * scene.run.duration_s, end * scene.run.duration_s
        solver = DOP853(slope, span[0], start, span[1], rtol=tolerance, atol=tolerance * speed)
        while solver.status == "running":
            message = solver.step()
            steps += 1
            if solver.status == "failed" or steps > MOST_STEPS:
                raise ReferenceError(f"{scene.name}: {message or f'no end after {steps} steps'}")
        start = solver.y
        states.append(start.reshape(2, n, 2))
    moved = period * np.stack([state[0] for state in states])
    return Motion(displacement=moved, velocity=np.stack([state[1] for state in states])), steps


def _drive(scene: Scene) -> tuple[float, float, Floats, Floats, Floats, Floats] | None:
    """Speed, τ, target (start, end), a point of the door's line and where outward is."""
    drive = scene.drive
    if drive is None:
        return None
    start, end = (np.array(point) for point in drive.target())
    return (
        drive.speed_m_per_s,
        drive.relaxation_time_s,
        start,
        end,
        np.array(drive.door_start_m),
        np.array(drive.outward),
    )


def _candidates(scene: Scene, reach: float) -> tuple[Any, Any, Any]:
    """Pairs within reach (m): first, second; and the walls' second as −1 − wall number in
    `wall`."""
    near = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=reach)
    wall = np.where(near.is_wall, near.second, -1)
    return near.first.copy(), np.where(near.is_wall, 0, near.second), wall


def _law(scene: Scene) -> tuple[bool, float, float, float, float]:
    """Hertz or not; k or K; ζ; dashpots of pairs and walls (N·s/m)."""
    contact, mass = scene.contact, scene.snapshot.mass
    ratio = damping_ratio_for(contact.restitution)
    k = contact.stiffness_N_per_m
    heaviest = float(mass.max())
    if contact.law == "hertz":
        # two disks of mean radius r̄: R = r̄/2 and d(K √R δ^1.5)/dδ = k at δ = 0.01 r̄
        mean = float(scene.snapshot.radius.mean())
        stiffness = k / (1.5 * np.sqrt(0.5 * mean * HERTZ_OVERLAP * mean))
        return True, float(stiffness), ratio, 0.0, 0.0
    pair, wall = (2 * ratio * float(np.sqrt(k * m)) for m in (heaviest / 2, heaviest))
    return False, k, ratio, pair, wall


@njit(cache=True)
def _add_drive(
    acceleration: Any,
    x: Any,
    v: Any,
    speed: float,
    tau: float,
    start: Any,
    end: Any,
    door: Any,
    outward: Any,
) -> None:
    ax, ay = end[0] - start[0], end[1] - start[1]
    square = ax * ax + ay * ay
    for i in range(len(x)):
        s = 0.0
        if square > 0.0:
            s = min(1.0, max(0.0, ((x[i, 0] - start[0]) * ax + (x[i, 1] - start[1]) * ay) / square))
        dx, dy = start[0] + s * ax - x[i, 0], start[1] + s * ay - x[i, 1]
        distance = np.sqrt(dx * dx + dy * dy)
        beyond = (x[i, 0] - door[0]) * outward[0] + (x[i, 1] - door[1]) * outward[1]
        if beyond >= 0.0 or distance == 0.0:
            dx, dy, distance = outward[0], outward[1], 1.0
        acceleration[i, 0] += (speed * dx / distance - v[i, 0]) / tau
        acceleration[i, 1] += (speed * dy / distance - v[i, 1]) / tau


@njit(cache=True)
def _contact_forces(
    force: Any,
    x: Any,
    v: Any,
    radius: Any,
    mass: Any,
    first: Any,
    second: Any,
    wall: Any,
    start: Any,
    end: Any,
    hertz: bool,
    stiffness: float,
    ratio: float,
    pair_dashpot: float,
    wall_dashpot: float,
) -> None:
    force[:] = 0.0
    for c in range(len(first)):
        i, j, w = first[c], second[c], wall[c]
        if w < 0:
            dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
            sum_of_radii = radius[i] + radius[j]
            size = radius[i] * radius[j] / sum_of_radii
            m = mass[i] * mass[j] / (mass[i] + mass[j])
        else:
            ax, ay = end[w, 0] - start[w, 0], end[w, 1] - start[w, 1]
            s = ((x[i, 0] - start[w, 0]) * ax + (x[i, 1] - start[w, 1]) * ay) / (ax * ax + ay * ay)
            s = min(1.0, max(0.0, s))
            dx, dy = start[w, 0] + s * ax - x[i, 0], start[w, 1] + s * ay - x[i, 1]
            sum_of_radii, size, m = radius[i], radius[i], mass[i]
        distance = np.sqrt(dx * dx + dy * dy)
        overlap = sum_of_radii - distance
        if overlap <= 0.0:
            continue
        nx, ny = dx / distance, dy / distance
        vx, vy = v[i, 0], v[i, 1]
        if w < 0:
            vx, vy = vx - v[j, 0], vy - v[j, 1]
        approach = vx * nx + vy * ny
        if hertz:
            tangent = stiffness * np.sqrt(size * overlap)
            push = tangent * overlap + np.sqrt(5.0) * ratio * np.sqrt(m * tangent) * approach
        else:
            push = stiffness * overlap + (pair_dashpot if w < 0 else wall_dashpot) * approach
        if push <= 0.0:
            continue
        force[i, 0] -= push * nx
        force[i, 1] -= push * ny
        if w < 0:
            force[j, 0] += push * nx
            force[j, 1] += push * ny
