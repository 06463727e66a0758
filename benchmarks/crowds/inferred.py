"""Does what `percussions infer` says hold? Crowds of its own law, and of three others, in 20 rooms.

    python -m benchmarks.crowds.inferred [--rooms 20] [--first 0] [--runs 600] [--others 4]

Rooms have five shapes: a door in the middle or at the end of a side, a corridor, an L, a funnel. In each
crowds are drawn from the prior. Each is inferred from all others (leave-one-out): the share of 90 %
intervals that hold the truth, and their mean widths as a share of the prior's. Then crowds of other laws:
everybody pushes with 30 N for ever; everybody walks at full speed until they touch; JuPedSim's social
force model. How many are said not to fit, and how many forces are wrong and not said."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence

import numpy as np
import shapely

from analysis.scene.new_scene import Crowd, from_geometry
from analysis.scene.scene import SceneError
from analysis.studies.infer.crowd import (
    AFTER_S,
    OF_BODIES,
    PRIOR,
    Ran,
    Site,
    crowd_of,
    gate_of,
    shown,
    simulate,
    waiting,
)
from analysis.studies.infer.inference import (
    FITS,
    RUNS,
    SOFT_N,
    comparable,
    gathered,
    infer,
    one_run,
    uniform,
)
from analysis.studies.infer.posterior import Reference
from analysis.studies.infer.tracks import STEP_S, departures, span_of
from analysis.support.machine import cores
from analysis.support.parallel import Task, do_all, workers
from nscd.arrays import Floats

SHAPES = ("middle", "end", "corridor", "L", "funnel")
LAWS = ("30 N for ever", "full speed until they touch", "social force")
MASS_KG, PUSH_N, LASTS_S, BODY_N_PER_M = 75.0, 30.0, 20.0, 120_000.0
SHOWN = ("contact_N", "wall_N", "push_share")


def site_of(number: int) -> Site:
    """The room of a number, its people where they wait, and how long they are watched."""
    random, shape = np.random.default_rng([4711, number]), SHAPES[number % len(SHAPES)]
    door, people = random.uniform(0.8, 1.4), int(random.integers(24, 37))
    length, width = random.uniform(4, 8), random.uniform(3, 6)
    if shape == "corridor":
        width = random.uniform(1.8, 2.6)
    floor, low = shapely.box(-length, 0, 0, width), (width - door) / 2
    if shape == "end":
        low = 0.3
    elif shape == "L":
        floor = floor.union(shapely.box(-2, 0, 0, width + 3))
    elif shape == "funnel":
        floor = shapely.Polygon([(0, low - 0.3), (0, low + door + 0.3), (-2, width), (-length, width), (-length, 0), (-2, 0)])
    made = from_geometry(shape, floor, ((0.0, low), (0.0, low + door)), Crowd(people=10, radius=0.15))
    gate = gate_of(made, shape, np.array([[-0.5, low + door / 2]]))
    start: Floats = waiting(gate, people, number)
    return Site(
        room=made, gate=gate, people=people, span=span_of(people), duration_s=LASTS_S, start=start
    )


def other(site: Site, number: int, kind: str) -> Ran | None:
    """A crowd of another law; None where it clogs or cannot be placed."""
    drawn = crowd_of(uniform(50, number))
    if kind == LAWS[2]:
        return social(site, drawn, number)
    speed, soon = drawn["speed_m_per_s"], drawn["relaxation_time_s"]
    tau = MASS_KG * speed / PUSH_N if kind == LAWS[0] else soon
    selected = {name: drawn[name] for name in OF_BODIES}
    return simulate(site, selected | {"speed_m_per_s": speed, "relaxation_time_s": tau}, 9000 + number)


def social(site: Site, drawn: dict[str, float], number: int) -> Ran | None:
    """A crowd of JuPedSim's social force model; its contact forces are 120 kN/m times overlaps."""
    import jupedsim as jps

    gate, radius = site.gate, drawn["radius_m"]
    beyond = [gate.start, gate.end, gate.end + 4 * gate.outward, gate.start + 4 * gate.outward]
    out = shapely.Polygon([beyond[0] - 0.01 * gate.outward, beyond[1] - 0.01 * gate.outward, *beyond[2:]])
    simulation = jps.Simulation(model=jps.SocialForceModel(body_force=BODY_N_PER_M), dt=0.01,
                                geometry=gate.floor.union(out))  # fmt: skip
    exit_ = shapely.Polygon([each + 3 * gate.outward for each in beyond[:2]] + beyond[2:])
    end = simulation.add_exit_stage(exit_)
    journey = simulation.add_journey(jps.JourneyDescription([end]))
    walls = shapely.unary_union([shapely.LineString([w.start_m, w.end_m]) for w in site.room.walls])
    agents: dict[int, int] = {}
    assert site.start is not None
    for position in site.start:
        at = jps.SocialForceModelAgentParameters(
            position=tuple(position), journey_id=journey, stage_id=end, radius=radius, mass=MASS_KG,
            desired_speed=drawn["speed_m_per_s"], reaction_time=drawn["relaxation_time_s"])  # fmt: skip
        agents[simulation.add_agent(at)] = len(agents)
    tracks, loads, after = [site.start], [(0.0, 0.0)], AFTER_S
    while after > 0 and len(tracks) < 2 * LASTS_S / STEP_S:
        pressed, on_walls = np.zeros((len(agents), len(agents))), 0.0
        for _ in range(10):
            simulation.iterate()
            now = np.full_like(site.start, np.nan)
            for agent in simulation.agents():
                now[agents[agent.id]] = agent.position
            distance = np.linalg.norm(now[:, None] - now, axis=2) + np.diag(np.full(len(now), np.inf))
            pressed += np.nan_to_num(np.maximum(2 * radius - distance, 0)) * BODY_N_PER_M / 10
            at = shapely.distance(walls, shapely.points(now[np.isfinite(now[:, 0])]))
            on_walls += float(np.maximum(radius - at, 0).sum()) * BODY_N_PER_M / 10
        tracks.append(now)
        loads.append((float(pressed.max()), on_walls))
        after -= STEP_S * (np.isfinite(departures(gate, np.array(tracks))).sum() > site.span[1])
    return None if after > 0 else shown(site, np.array(tracks), np.array(loads), drawn["sway_m"], number)


def _try(site: Site, number: int, kind: str) -> Ran | None:
    try:
        return other(site, number, kind)
    except (SceneError, RuntimeError):  # JuPedSim: too near to a wall or to each other
        return None


def judged(site: Site, one: Ran, ran: Sequence[Ran | None], seed: int) -> str:
    """What is said of a crowd of another law."""
    names, statistics, coordinates = gathered(site, one.statistics, ran, seed)
    every = Reference(coordinates, comparable(names, statistics))
    crowd = comparable(names, np.array([one.statistics[name] for name in names]))
    if every.misfit(crowd) >= FITS:
        return "said not to fit"
    low, _, high = np.exp(every.posterior(crowd).quantiles()[:, len(PRIOR)]) - SOFT_N
    return "right" if low <= one.contact_N <= high else "wrong and not said"


def main() -> None:
    """Print a line for each room, and one for each law."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rooms", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--others", type=int, default=4)
    args = parser.parse_args()
    every, ends = [], {kind: Counter[str]() for kind in LAWS}
    with workers(cores()) as pool:
        for number in range(args.first, args.first + args.rooms):
            site, seed, name = site_of(number), 1 + number, SHAPES[number % len(SHAPES)]
            tasks = [Task(call=one_run, arguments=(site, seed, k), work=1.0) for k in range(args.runs)]
            ran = do_all(tasks, pool, "simulations", None)
            own = infer(site, next(one.statistics for one in ran if one), ran, seed)
            every.append([each[key] for key in SHOWN for each in (own.coverage, own.usual)])
            print(f"{number} {name}, {site.people} people: " + ", ".join(
                f"{key} in {own.coverage[key]:.2f}, width {own.usual[key]:.2f}" for key in SHOWN))  # fmt: skip
            numbers = range(args.others * number, args.others * (number + 1))
            tasks = [Task(call=_try, arguments=(site, k, kind), work=1.0) for kind in LAWS for k in numbers]
            for task, one in zip(tasks, do_all(tasks, pool, "others", None), strict=True):
                ends[task.arguments[2]][judged(site, one, ran, seed) if one else "no crowd"] += 1
            print("  " + "; ".join(f"{kind}: {dict(ends[kind])}" for kind in LAWS), flush=True)
            found = [f(np.array(every), axis=0).round(2) for f in (np.mean, np.min, np.max)]
            print("  rooms so far: " + ", ".join(
                f"{key} {what} {mean} ({low}–{high})" for (key, what), mean, low, high in zip(
                    [(key, what) for key in SHOWN for what in ("holds", "width")], *found, strict=True)),
                flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
