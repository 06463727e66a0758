"""Is it a crowd? Flow, density, speed and forces of people who keep their distance, beside JuPedSim.

    python benchmarks/crowds/flows.py [--part doors|speeds|counterflow|clogging|shoulders|peers] [--seeds 3]

100 people in a room of 7 m × 6 m leave by a door. Flow is that between 10 and 90 % of the exits over
the width; density that of a square metre times the door's width, 0.5 to 1.5 m before it, in the
same time; the largest contact is its 90 % point over time. Intervals are the least and the most of
seeds."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import shapely

from analysis.engines.programs.rigid import motion_of
from analysis.scene.anthropometry import Varied
from analysis.scene.new_scene import Crowd, room
from analysis.scene.scene import Scene
from analysis.scene.waiting import opposing
from nscd import Snapshot

DOORS_M, SHARES = (0.8, 1.2, 1.6, 2.0, 2.4), (0.0, 0.1, 0.2, 0.4, 1.0)
DENSITIES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)  # people per m²
SPEED, RADIUS, STEP_S, LONGEST_S = 1.34, 0.18, 0.02, 120.0
LAW: dict[str, Any] = {
    "time_gap_s": 0.8, "heading_sd_rad": 0.2, "jostling_m_per_s": 0.06, "push_share": 0.0,
}  # fmt: skip


def crowd(seed: int, people: int = 100, friction: float = 0.0) -> Crowd:
    """A crowd of bodies of different sizes."""
    varied = Varied(radius_share=0.05, seed=seed)
    return Crowd(
        people=people, radius=RADIUS, speed=SPEED, relaxation=0.5, varied=varied, friction=friction
    )


def walking(scene: Scene, seed: int, **law: Any) -> Scene:
    """The scene with people who keep their distance."""
    return scene.with_drive(**LAW | law | {"seed": seed}).with_run(rigid_step_s=STEP_S)


def frames(scene: Scene, longest: float = LONGEST_S) -> Iterator[tuple[float, Any, Any, float]]:
    """Time (s), places, velocities and largest contact (N) after each step."""
    motion = motion_of(scene, scene.snapshot)
    motion.separate()
    while motion.time < longest:
        pressed = motion.advance().reaction
        yield motion.time, motion.position, motion.velocity, pressed.max(initial=0.0) / STEP_S


def through_door(steps: Any, width: float) -> tuple[float, float, float]:
    """Flow per m and s, density per m² and largest contact (N) of steps until 90 % are out."""
    gone, near, force = [], [], []
    for _, position, _, pressed in steps:
        gone.append(float((position[:, 0] >= 0).mean()))
        ahead = (position[:, 0] > -1.5) & (position[:, 0] < -0.5)
        near.append(float((ahead & (np.abs(position[:, 1]) < 0.5 * width)).sum()) / width)
        force.append(pressed)
        if gone[-1] >= 0.9:
            break
    first, last = (int(np.searchsorted(gone, fraction)) for fraction in (0.1, 0.9))
    if last >= len(gone):
        half = len(gone) // 2  # clogged
        return np.nan, float(np.mean(near[half:])), float(np.quantile(force[half:], 0.9))
    flow = 0.8 * len(position) / ((last - first) * STEP_S) / width
    now = slice(first, last)
    return flow, float(np.mean(near[now])), float(np.quantile(force[now], 0.9))


def interval(values: Any, digits: int = 2) -> str:
    """The least and the most of seeds."""
    lost = int(np.isnan(values).sum())
    if lost == len(values):
        return "all clogged"
    low, high = np.nanmin(values), np.nanmax(values)
    clogged = f" ({lost} clogged)" if lost else ""
    return f"{low:.{digits}g}–{high:.{digits}g}{clogged}"


def doors(seeds: int, friction: float = 0.0, widths: Any = DOORS_M, fractions: Any = SHARES) -> None:
    """Print flow, density and forces by width and share of push."""
    for width in widths:
        for fraction in fractions:
            found = []
            for seed in range(1, seeds + 1):
                scene = room("a", 7.0, 6.0, width, crowd(seed, friction=friction))
                found.append(through_door(frames(walking(scene, seed, push_share=fraction)), width))
            flow, density, force = np.transpose(found)
            print(f"{width} m | p {fraction} | {interval(flow)} per m s | {interval(density)} per m²"
                  f" | {interval(force)} N", flush=True)  # fmt: skip


def clogging(seeds: int) -> None:
    """Print the same with friction."""
    doors(seeds, 0.3, (0.8, 1.2), (0.0, 0.2, 1.0))


def _ring(density: float, seed: int) -> Scene:
    """People in a corridor without ends, 20 m × 2.4 m, who walk along it."""
    length, width = 20.0, 2.4
    number = round(density * length * width)
    random = np.random.default_rng(seed)
    rows = int(np.ceil(np.sqrt(number * (width - 2 * RADIUS) / length)))
    columns = int(np.ceil(number / rows))
    x, y = np.meshgrid((np.arange(columns) + 0.5) * length / columns - length,
                       (np.arange(rows) + 0.5) * (width - 2 * RADIUS) / rows - width / 2 + RADIUS)  # fmt: skip
    position = np.column_stack([x.ravel(), y.ravel()])[random.permutation(x.size)[:number]]
    scene = room("ring", length, width, width, crowd(seed, people=20))
    walls = [wall for wall in scene.walls if wall.start_m[1] == wall.end_m[1]]
    people = Snapshot(position=position, radius=np.full(number, RADIUS), mass=np.full(number, 75.0))
    assert scene.drive is not None
    return scene.model_copy(update={
        "walls": tuple(walls), "period_x_m": (-length, 0.0), "snapshot": people,
        "drive": type(scene.drive).model_validate(
            {"speed_m_per_s": SPEED, "relaxation_time_s": 0.5, "outward": (1.0, 0.0)}),
    })  # fmt: skip


def speeds(seeds: int) -> None:
    """Print speed against density, the published one (Weidmann 1993) beside it."""
    for density in DENSITIES:
        found = []
        for seed in range(1, seeds + 1):
            scene = walking(_ring(density, seed), seed)
            moving = [u[:, 0].mean() for t, _, u, _ in frames(scene, 30.0) if t > 15.0]
            found.append(np.mean(moving))
        published = SPEED * (1 - np.exp(-1.913 * (1 / density - 1 / 5.4)))
        print(f"{density} per m² | {interval(found)} m/s | Weidmann {published:.2f}", flush=True)


def counterflow(seeds: int) -> None:
    """Print how fast 25 and 25 people pass each other in a corridor of 2.4 m × 12 m."""
    for fraction in SHARES:
        found, out = [], []
        for seed in range(1, seeds + 1):
            scene = room("stream", 12.0, 2.4, opposing(12.0, 2.4), crowd(seed, people=50))
            scene, passed = walking(scene, seed, push_share=fraction), np.inf
            assert scene.drive is not None
            for time, position, _, _ in frames(scene, 60.0):
                gone = scene.drive.gone(position, scene.snapshot.ids)
                if gone.mean() >= 0.9:
                    passed = time
                    break
            found.append(passed)
            out.append(gone.mean())
        print(f"p {fraction} | 90 % through after {interval(found)} s | out {interval(out)}", flush=True)


# Of a body as wide as shoulders, over half its breadth: radius, and place across the chest.
BODY = ((0.42, -0.58), (0.5, 0.0), (0.42, 0.58))
CHEST_M, BODIES, GATES_M = 0.12, 30, (0.5, 0.65, 0.8)


def _turning(disks: Snapshot, seed: int) -> Snapshot:
    """Bodies of three disks, CHEST_M the widest, at the places of disks, who face a door ±0.5 rad."""
    position, n = disks.position, len(disks)
    angle = np.arctan2(*position.T[::-1]) + np.pi / 2
    angle += np.random.default_rng([seed, 8]).uniform(-0.5, 0.5, n)
    size, off = np.array(BODY).T * 2 * CHEST_M
    across = np.column_stack([np.cos(angle), np.sin(angle)])
    return Snapshot(
        position=(position[:, None] + off[:, None] * across[:, None]).reshape(-1, 2).round(9),
        radius=np.tile(size, n),
        mass=np.outer(disks.mass, size * size / (size * size).sum()).ravel(),
    ).joined(np.repeat(np.arange(1, n + 1), len(BODY)))


def shoulders(seeds: int) -> None:
    """Print flow, density and force of bodies with shoulders, of disks of half a chest's depth, and of
    disks of the bodies' area, through narrow gates."""
    area = 0.169  # m, radius
    for width in GATES_M:
        for fraction in (0.0, 0.2, 0.4):
            for name in ("bodies", "chests", "areas"):
                found = []
                for seed in range(1, seeds + 1):
                    scene = room("a", 5.0, 5.0, width, crowd(seed, people=BODIES))
                    disks = scene.snapshot
                    radius = np.full(BODIES, CHEST_M if name == "chests" else area)
                    people = Snapshot(position=disks.position, radius=radius, mass=disks.mass)
                    people = _turning(people, seed) if name == "bodies" else people
                    scene = scene.model_copy(update={"snapshot": people})
                    steps = frames(walking(scene, seed, push_share=fraction, time_gap_s=0.6), 60.0)
                    if name == "bodies":
                        steps = ((t, at[1::3], u, force) for t, at, u, force in steps)
                    found.append(through_door(steps, width))
                flow, density, force = np.transpose(found)
                print(f"{width} m | p {fraction} | {name} | {interval(flow * width)} per s"
                      f" | {interval(density)} per m² | {interval(force)} N", flush=True)  # fmt: skip


def _agents() -> Iterator[tuple[str, Any, Callable[..., Any]]]:
    """JuPedSim's models, and what makes an agent of each from place, exit and journey. It takes nobody
    nearer than the radii, and ours differ by a tenth."""
    import jupedsim as jps

    keys = {"radius": 0.9 * RADIUS, "time_gap": LAW["time_gap_s"], "desired_speed": SPEED}
    for version in ("", "V2", "V3"):
        name = "CollisionFreeSpeedModel" + version
        yield name, getattr(jps, name)(), partial(getattr(jps, name + "AgentParameters"), **keys)


def peers(seeds: int) -> None:
    """Print flow and density of JuPedSim's speed models in the same rooms, with their defaults."""
    import jupedsim as jps

    for name, model, agent in _agents():
        for width in DOORS_M:
            found = []
            for seed in range(1, seeds + 1):
                scene = room("a", 7.0, 6.0, width, crowd(seed))
                floor = shapely.union(shapely.box(-7, -3, 0, 3),
                                      shapely.box(-0.01, -width / 2, 1, width / 2))  # fmt: skip
                simulation = jps.Simulation(model=model, geometry=floor, dt=STEP_S)
                half = width / 2
                end = simulation.add_exit_stage(shapely.box(0.5, -half, 1, half))
                journey = simulation.add_journey(jps.JourneyDescription([end]))
                for position in scene.snapshot.position:
                    at = agent(position=tuple(position), journey_id=journey, stage_id=end)
                    simulation.add_agent(at)
                found.append(through_door(_steps(simulation, len(scene.snapshot)), width)[:2])
            flow, density = np.transpose(found)
            print(f"{name} | {width} m | {interval(flow)} per m s | {interval(density)} per m²",
                  flush=True)  # fmt: skip


def _steps(simulation: Any, people: int) -> Iterator[tuple[float, Any, None, float]]:
    """The same as `frames` of a simulation of JuPedSim; who has left stands behind the door."""
    while simulation.elapsed_time() < LONGEST_S:
        simulation.iterate()
        position = np.full((people, 2), 9.0)
        inside = [agent.position for agent in simulation.agents()]
        position[: len(inside)] = np.array(inside).reshape(-1, 2)
        yield simulation.elapsed_time(), position, None, 0.0


PARTS: dict[str, Callable[[int], None]] = {
    "doors": doors, "speeds": speeds, "counterflow": counterflow, "clogging": clogging,
    "shoulders": shoulders, "peers": peers,
}  # fmt: skip

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=PARTS)
    parser.add_argument("--seeds", type=int, default=3)
    args = parser.parse_args()
    for part, run in PARTS.items():
        if args.part in (None, part):
            print(f"{part}:", flush=True)
            run(args.seeds)
