"""Soft runs over a window: their model, their reference, their points and where the window starts."""

import contextlib
import functools
import itertools
import logging
import resource
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853

from analysis.dumps import DumpError, open_bodies, snapshot_of
from analysis.engines import EngineError, engine, installed
from analysis.engines.penalty import damping_ratio_for, penalty_of
from analysis.engines.record import FINISHED
from analysis.engines.run import run_engine
from analysis.percussions.setting import law_of
from analysis.scene.real.separate import reconcile
from analysis.scene.scene import Scene
from analysis.studies.work_precision import window as windows
from analysis.studies.work_precision.point import Method, PointStatus
from analysis.support.cache import cached, store
from analysis.support.machine import machine
from analysis.support.parallel import Progress
from nscd import Snapshot, Walls, _core, find_contacts
from nscd.arrays import Floats, Indices
from nscd.contacts import connected


class SoftModel:
    """The accelerations of a scene's disks: contact forces + m (u_d − v)/τ, over m, and g.

    A contact pushes as its law says (`analysis.scene.law`) while δ > 0, and arms as `nscd.stepping`
    says. The dashpots are those of
    `penalty_of`, derived again from the law's definition. The drive acts continuously. Contacts are
    looked for among those that are within `reach` (m) at the start.

    Raises ValueError for friction, which has a memory that this model does not keep."""

    def __init__(self, scene: Scene, reach: float) -> None:
        if scene.contact.friction:
            raise ValueError(
                f"contact.friction: {scene.contact.friction:g}. "
                "Charts and advice are for frictionless contacts"
            )
        self._name, self._disks, walls = scene.name, scene.snapshot, scene.wall_segments()
        pairs = find_contacts(scene.snapshot, tolerance=reach)
        # not the walls of `find_contacts`: which of those that meet answers for a point changes
        # with the motion
        disk, wall = _nearby(scene.snapshot, walls, reach)
        # a wall's number in `wall`, −1 for a pair
        self._contacts = (
            np.concatenate([pairs.first, disk]),
            np.concatenate([pairs.second, np.zeros_like(disk)]),
            np.concatenate([np.full(len(pairs), -1), wall]),
            connected(walls),
        )
        self._law = _law(scene)
        self._drive, disks = scene.drive, self._disks
        self._legs = scene.drive.legs(disks.position, disks.ids) if scene.drive else ()
        self._acceleration, self._arms = np.array(scene.acceleration()), scene.contact.arms
        self._ends = np.array(walls.start), np.array(walls.end)

    def accelerate(self, out: Floats, position: Floats, velocity: Floats) -> None:
        """Write the acceleration (n,2) m/s² at positions (n,2) m and velocities (n,2) m/s into
        `out`."""
        disks = self._disks
        _core.soft_forces(
            out, position, velocity, disks.radius, disks.mass, *self._contacts, *self._law
        )
        if self._arms:
            out += self._arms.forces(position, disks.radius, self._contacts[3])
        out /= disks.mass[:, None]
        out += self._acceleration
        if self._drive is not None:
            drive = self._drive
            legs = drive.legs(position, disks.ids) if drive.way else self._legs
            pace = drive.speed_m_per_s, drive.relaxation_time_s
            _core.soft_drive(out, position, velocity, *pace, *legs)

    def stay_inside(self, before: Floats, after: Floats) -> None:
        """Raise ReferenceError where a centre that goes straight from `before` to `after` (n,2) m
        crosses a wall, whose force would then turn round."""
        if _core.crosses(before, after, *self._ends):
            raise ReferenceError(f"{self._name}: the centre of a disk has passed a wall")


def _nearby(snapshot: Snapshot, walls: Walls, reach: float) -> tuple[Indices, Indices]:
    """Disks and walls with gaps up to the reach (m), by (disk, wall): two arrays (k,)."""
    disk, wall = (index.ravel() for index in np.indices((len(snapshot), len(walls))))
    to_wall = walls.nearest_point(snapshot.position[disk], wall) - snapshot.position[disk]
    near = np.hypot(*to_wall.T) - snapshot.radius[disk] <= reach
    return disk[near], wall[near]


def _law(scene: Scene) -> tuple[Floats, bool]:
    """Springs and dashpot of pairs and of walls and ζ of the tangent (9,); whether the dashpot acts
    on approach alone."""
    contact, heaviest = scene.contact, float(scene.snapshot.mass.max())
    kind, on_approach = contact.kind.dashpot, contact.kind.dashpot == "apart"
    pair, wall = contact.elastic(float(scene.snapshot.radius.mean()))
    ratio = damping_ratio_for(contact.restitution**2 if on_approach else contact.restitution)
    dashpots = (
        0.0 if kind == "tangent" else 2 * ratio * float(np.sqrt(k * m))
        for k, m in ((contact.stiffness_N_per_m, heaviest / 2), (contact.at_walls, heaviest))
    )
    found = (*pair, next(dashpots), *wall, next(dashpots), ratio if kind == "tangent" else 0.0)
    return np.array(found), on_approach


TOLERANCE = 1e-7
# How much tighter the second integration is, whose difference from the first is the error bar.
TIGHTER = 0.01
MOST_REFERENCE_STEPS = 400_000
# Counts up whenever `soft_reference` comes to give other numbers.
EDITION = 1


class ReferenceError(RuntimeError):
    """A reference that could not be computed; the message says why."""


class SoftReference(NamedTuple):
    """The soft model at the end of the scene's run.

    looser: the same with a tolerance 100 times looser; their difference bounds the error as long as
    the integration converges."""

    motion: windows.SpringMotion  # its answer
    looser: windows.SpringMotion


def soft_reference(scene: Scene, tolerance: float = TOLERANCE) -> SoftReference:
    """Integrate the soft model of the scene over its run by DOP853 (Hairer, Nørsett, Wanner,
    Solving Ordinary Differential Equations I, II.5), twice. Raises ReferenceError, and what
    `SoftModel` raises."""
    looser, reach = _reaching(scene, lambda reach: _integrate(scene, tolerance, reach))
    return SoftReference(_integrate(scene, TIGHTER * tolerance, reach), looser)


def leapfrog(scene: Scene) -> windows.SpringMotion:
    """Integrate the soft model with the scene's time step as both engines do: positions move with
    the velocity of the half step, and so do dashpots see the one of half a step before. Raises what
    `SoftModel` raises."""
    return _reaching(scene, lambda reach: _step(scene, reach))[0]


def kept_reference(
    window: windows.Window, law: str, stiffness: float, folder: Path
) -> windows.Converged:
    """Give the soft model of a window, converged: as kept in the folder, or computed and kept
    there."""
    scene = window.variant(law, stiffness)
    file = folder / f"reference_{law}_k{stiffness:.6g}.npz"
    key = f"{scene.digest()} {TOLERANCE} {EDITION}"
    wrong = "the run ended as if all were well, but is wrong"
    if (found := cached(file, key)) is None:
        try:
            made = soft_reference(scene)._asdict()
        except ReferenceError as error:
            return windows.Converged(why=str(error), wrong=wrong)
        parts = [(name, field) for name in made for field in ("displacement", "velocity")]
        found = {f"{name}_{field}": getattr(made[name], field) for name, field in parts}
        store(file, key, found)
    own, looser = (
        window.quantities(
            windows.SpringMotion(found[f"{name}_displacement"], found[f"{name}_velocity"]), stiffness
        )
        for name in SoftReference._fields
    )
    return windows.Converged(own=own, looser=looser, wrong=wrong)


def _speed(scene: Scene) -> float:
    """About how fast anybody gets (m/s)."""
    speed = float(np.abs(scene.snapshot.velocity).max(initial=0.0))
    speed += float(np.hypot(*scene.acceleration())) * scene.run.duration_s
    if scene.drive is None:
        return speed
    fraction = scene.run.duration_s / scene.drive.relaxation_time_s
    return max(speed, scene.drive.speed_m_per_s * fraction)


def _reaching(
    scene: Scene, integrate: Callable[[float], windows.SpringMotion]
) -> tuple[windows.SpringMotion, float]:
    """What `integrate` gives with contacts looked for as far (m) as it takes, and how far: a crowd
    can squeeze somebody out faster than anybody wants to walk."""
    reach = 2.0 * (_speed(scene) * scene.run.duration_s + 1e-4)
    while True:
        found = integrate(reach)
        farthest = 2.0 * float(np.hypot(*found.displacement[1].T).max())
        if not farthest > 0.9 * reach:
            return found, reach
        reach = max(2.0 * reach, 1.5 * farthest)


def _step(scene: Scene, reach: float) -> windows.SpringMotion:
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
        model.stay_inside(before, start + moved)
        model.accelerate(acceleration, start + moved, velocity)
        if step in (penalty.steps // 2, penalty.steps):
            frames.append((moved.copy(), velocity + 0.5 * dt * acceleration))
        velocity += dt * acceleration
    return windows.SpringMotion(*(np.stack(part) for part in zip(*frames, strict=True)))


def _integrate(scene: Scene, tolerance: float, reach: float) -> windows.SpringMotion:
    snapshot, model = scene.snapshot, SoftModel(scene, reach)
    n = len(snapshot)
    stiffest = max(scene.contact.stiffness_N_per_m, scene.contact.at_walls)
    period = float(np.sqrt(snapshot.mass.max() / stiffest))
    minimum = tolerance * _speed(scene)

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
        solver = DOP853(slope, span[0], start, span[1], rtol=tolerance, atol=minimum)
        while solver.status == "running":
            before = snapshot.position + period * solver.y[: 2 * n].reshape(n, 2)
            message = solver.step()
            steps += 1
            after = snapshot.position + period * solver.y[: 2 * n].reshape(n, 2)
            model.stay_inside(before, after)
            if solver.status == "failed" or steps > MOST_REFERENCE_STEPS:
                raise ReferenceError(f"{scene.name}: {message or f'no end after {steps} steps'}")
        start = solver.y
        states.append(start.reshape(2, n, 2))
    moved = period * np.stack([state[0] for state in states])
    return windows.SpringMotion(moved, np.stack([state[1] for state in states]))


# Times the scene's stiffness. Those of people stand in analysis/engines/bodies.toml.
STIFFER = (1.0, 1e1, 1e2, 1e3, 1e4)
# Time steps as shares of the safe one, also far beyond where an explicit method is stable.
STEP_FRACTIONS = (1 / 64, 1 / 16, 1 / 4, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
# No run is longer than this; finer time steps of large crowds are left out.
MOST_PARTICLE_STEPS, MOST_STEPS = 2.0e7, 2.0e5
LAWS = {"lammps": ("hooke", "hertz"), "yade": ("hooke",)}
# The CPU time of a run is that of the children of this process: one at a time.
_one_at_a_time = threading.Lock()


def soft_engines() -> list[str]:
    """List the engines of soft contacts that are installed."""
    return [name for name in LAWS if engine(name).find()]


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Settings to try: stiffnesses (times the scene's), shares of the safe time step, and the
    shares of an engine that has others."""

    stiffer: tuple[float, ...] = STIFFER
    step_fractions: tuple[float, ...] = STEP_FRACTIONS
    of_engine: dict[str, tuple[float, ...]] = field(default_factory=dict)


FULL = Grid()
QUICK = Grid(stiffer=(1.0, 1e2), step_fractions=(1 / 4, 1.0, 4.0), of_engine={"yade": (1.0,)})


def settings_of(
    window: windows.Window, engines: Sequence[str], grid: Grid = FULL
) -> Iterator[Method]:
    """Yield all settings of a grid, short of those that would take too long."""
    n = len(window.scene.snapshot)
    own = window.scene.contact.stiffness_N_per_m
    for name in engines:
        fractions = grid.of_engine.get(name, grid.step_fractions)
        for law, stiffer, fraction in itertools.product(LAWS[name], grid.stiffer, fractions):
            setting = Method(
                method=name, law=law, stiffness_N_per_m=stiffer * own, time_step_share=fraction
            )
            steps = penalty_of(scene_of(window, setting)).steps
            if steps <= MOST_STEPS and n * steps <= MOST_PARTICLE_STEPS:
                yield setting


def scene_of(window: windows.Window, setting: Method) -> Scene:
    """Make the scene to run: two frames, and a time step at most `fraction` of the safe one that
    divides the window."""
    assert setting.stiffness_N_per_m
    assert setting.time_step_share
    variant = window.variant(setting.law, setting.stiffness_N_per_m)
    half = 0.5 * variant.run.duration_s
    steps = ceil(half / (setting.time_step_share * penalty_of(variant).safe_time_step) - 1e-9)
    return variant.with_run(time_step_s=half / steps)


def run_folder(folder: Path, setting: Method) -> Path:
    """Name where a run lives: folder/<engine>_<law>_k<stiffness>_dt<share>."""
    size = f"k{setting.stiffness_N_per_m:.6g}_dt{setting.time_step_share:.6g}"
    return folder / f"{setting.method}_{setting.law}_{size}"


def run_soft(window: windows.Window, setting: Method, folder: Path) -> windows.MethodResult:
    """Run the window with the setting's engine, or take what is in the folder: the finished run, or
    how it failed. Its CPU seconds are the engine's, start included.

    A run that fails is a result: its status and reason say so."""
    scene, path = scene_of(window, setting), run_folder(folder, setting)
    note = path.with_name(path.name + ".json")
    key = f"{scene.digest()} {_version(setting.method)}"
    stored = cached(note, key)
    done = stored and stored.get("status") == PointStatus.OK
    if stored is None or (done and not (path / "bodies.dump").exists()):
        stored = _run(scene, setting, path)
        store(note, key, stored)
    values, status, reason = None, PointStatus(stored["status"]), stored["reason"]
    if status == PointStatus.OK:
        try:
            stiffness = scene.contact.stiffness_N_per_m
            values = window.quantities(_motion(scene, path), stiffness)
        except (DumpError, EngineError) as error:
            status, reason = PointStatus.FAILED, str(error)
    return windows.MethodResult(
        **asdict(setting) | {"time_step_s": penalty_of(scene).time_step},
        values=values,
        **stored | {"status": status, "reason": reason},
    )


@functools.cache
def _version(name: str) -> str | None:
    """Asked once in a process: asking starts the engine."""
    return engine(name).version()


@contextlib.contextmanager
def _only_errors() -> Iterator[None]:
    """Without warnings of a run: a time step beyond the safe one is meant here."""
    log = logging.getLogger("analysis.engines.run")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


def _run(scene: Scene, setting: Method, folder: Path) -> dict[str, Any]:
    status, reason = PointStatus.OK, ""
    with _one_at_a_time, _only_errors():
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            record = run_engine(scene, setting.method, folder)
            seconds = record.cpu_seconds
            if record.exit_state != FINISHED:
                status, reason = PointStatus.FAILED, f"{setting.method}: {record.exit_state}"
        except (EngineError, DumpError) as error:
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            status, reason = PointStatus.FAILED, str(error).splitlines()[0]
    ended = {"status": str(status), "reason": reason, "cpu_seconds": seconds}
    return ended | {"machine": machine(), "date": windows.today()}


def _motion(scene: Scene, folder: Path) -> windows.SpringMotion:
    """The motion at the last two frames of the run."""
    trajectory = open_bodies(folder / "bodies.dump", penalty_of(scene).time_step).trajectory
    if len(trajectory) != 3:
        raise DumpError(f"{folder}: {len(trajectory)} frames where 3 are due")
    frames = [snapshot_of(trajectory[frame]) for frame in (1, 2)]
    moved = np.stack([frame.position for frame in frames]) - scene.snapshot.position
    return windows.SpringMotion(moved, np.stack([frame.velocity for frame in frames]))


def prepare_window(scene: Scene, folder: Path, progress: Progress | None = None) -> windows.Window:
    """Make the window of a scene; what it takes to find its start is kept in the folder.

    An impact and the frame of a real crowd are taken as they stand. Any other driven crowd is first
    run to the scene's instant of analysis by the first engine that there is; then disks that
    overlap are moved apart, as little as possible (see `reconcile`), since a stiffer contact would
    make an explosion of the same overlap. Raises ValueError as `check_chart` and `Window.check` do;
    EngineError where no engine can run it."""
    check_chart(scene)
    if scene.drive is None:
        window = windows.impact_window(scene)
    elif scene.reconciliation is not None:
        window = windows.driven_window(scene, scene.snapshot.position)
    else:
        window = windows.driven_window(scene, _pressed(scene, folder, progress))
    window.check()
    return window


def check_chart(scene: Scene) -> None:
    """Raise ValueError naming the field of a scene that charts are not for: friction, a body force,
    an impact of restitution 1, or one in which nobody presses anybody."""
    scene.check_plain("charts are")
    law_of(scene)
    if scene.drive is None:
        windows.impact_window(scene).check()


def pressing(scene: Scene) -> Scene | None:
    """Make the run that presses a crowd together; None of one that is taken as it stands."""
    if scene.drive is None or scene.reconciliation is not None:
        return None
    return scene.with_run(duration_s=scene.analysis.time_s, frames=1, time_step_s=None)


def _pressed(scene: Scene, folder: Path, progress: Progress | None) -> Floats:
    present = next(iter(soft_engines()), None)
    if present is None:
        raise EngineError(
            "no engine: the crowd cannot be pressed together. See: percussions doctor"
        )
    file, key = folder / "start.npz", f"{scene.digest()} {installed(present)}"
    if found := cached(file, key):
        return np.asarray(found["position"])
    start = pressing(scene)
    assert start is not None
    record = run_engine(start, present, folder / "start", progress)
    bodies = open_bodies(folder / "start" / "bodies.dump", record.time_step_s)
    end = snapshot_of(bodies.trajectory[-1])
    position = reconcile(end.position, end.radius, scene.wall_segments()).position
    store(file, key, {"position": position})
    return position
