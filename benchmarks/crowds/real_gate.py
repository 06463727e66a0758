"""Does a crowd that keeps its distance go through a real gate as a filmed one did?

    python benchmarks/crowds/real_gate.py RUNS.csv --time-gap 0.75 --push 0 0.05 --jostling 0.06 0.1

Runs of the experiment CrowdQueue (Wuppertal 2018, doi 10.34735/ped.2018.1): a straight corridor,
in the middle of its end a gate that is 0.5 m wide and 0.95 m long, with bevels of 0.15 m. RUNS.csv
has the columns run, corridor_m, n, flow_per_s, density_per_m2, speed_m_s: seen there, as in
PedestrianDynamics/jupedsim-dakota-calibration. People start at 3 per m², 0.5 m before the gate.

Flow is over the line in the middle of the gate, from 10 to 90 % of the people; density and speed
(over 0.4 s) in the corridor, 0.65 to 2.65 m before the gate, in that time. Heads sway besides."""

import argparse
import csv
import itertools
from pathlib import Path

import numpy as np

from analysis.scene import Drive
from nscd import Snapshot, Walls
from nscd.stepping import Motion, Push

GATE_M, LINE_M, FRONT_M = -0.15, -0.6, (0.5, 2.5)  # y; people walk to −y
SPEED, STEP_S, EVERY = 1.55, 0.02, 2  # m/s, measured
SWAY_M, SWAYS, SWAY_HZ = 0.013, 6, (0.35, 0.8)  # of heads about tracks smoothed over 2 s


def gate(corridor, length=9.0):
    """The walls of a corridor so wide (m) and its gate."""
    half = 0.5 * corridor
    left = [(-half, length), (-half, 0.0), (-0.4, 0.0), (-0.25, GATE_M), (-0.25, -1.1)]
    lines = np.array([left, [(-x, y) for x, y in left]])
    return Walls(start=lines[:, :-1].reshape(-1, 2), end=lines[:, 1:].reshape(-1, 2))


def crowd(corridor, people, radius, seed):
    """People at random places, 3 per m², not yet apart."""
    half = 0.5 * corridor - radius
    low, high = (-half, GATE_M + 0.5), (half, GATE_M + 0.5 + people / 3.0 / corridor)
    place = np.random.default_rng(seed).uniform(low, high, (people, 2))
    return Snapshot(position=place, radius=np.full(people, radius), mass=np.full(people, 75.0))


def run(walls, people, law, seed=1, friction=0.0):
    """Times (f,) s, positions (f,n,2) m, and the largest contact force (N) of each step."""
    drive = Drive(
        speed_m_per_s=SPEED, door_start_m=(-0.25, GATE_M), door_end_m=(0.25, GATE_M),
        outward=(0.0, -1.0), seed=seed, **law,
    ).routed(walls, people.radius.max())  # fmt: skip
    ids, n = np.arange(1, len(people) + 1), len(people)
    way = lambda q: drive.desired_velocity(q, ids, motion.time, people.radius)  # noqa: E731
    push = Push(desired=way, relaxation_time=drive.relaxation_time_s)
    motion = Motion(people, walls, step=STEP_S, push=push, friction=friction)
    motion.separate()
    time, place, force = [], [], []
    while motion.time < 3.0 * n and (motion.position[:, 1] > LINE_M - 0.5).any():
        force.append(motion.advance().reaction.max(initial=0.0) / STEP_S)
        if len(force) % EVERY == 0:
            time.append(motion.time)
            place.append(motion.position.copy())
    return np.array(time), np.array(place), np.array(force)


def swaying(time, place, seed=1):
    """The heads of bodies at (f,n,2) m."""
    rng = np.random.default_rng(seed)
    shape = (SWAYS, 1, *place.shape[1:])
    turns = rng.uniform(*SWAY_HZ, shape) * time[:, None, None] + rng.uniform(0.0, 1.0, shape)
    return place + SWAY_M * np.sqrt(2 / SWAYS) * np.cos(2 * np.pi * turns).sum(axis=0)


def measured(time, place, corridor):
    """Flow (1/s), density (1/m²), speed (m/s); NaN where not 90 % came through."""
    through = place[..., 1] < LINE_M
    exits = np.sort(time[np.argmax(through, axis=0)][through.any(axis=0)])
    first, last = (int(np.ceil(share * place.shape[1])) for share in (0.1, 0.9))
    if len(exits) < last:
        return np.full(3, np.nan)
    start, end = exits[first - 1], exits[last - 1]
    half, reach = 0.5 * corridor - 0.05, round(0.2 / (time[1] - time[0]))
    x, y = np.moveaxis(place[reach:-reach], -1, 0)
    inside = (np.abs(x) <= half) & (y >= FRONT_M[0]) & (y <= FRONT_M[1])
    inside &= ((time >= start) & (time <= end))[reach:-reach, None]
    frames = ((time >= start) & (time <= end)).sum()
    way = np.hypot(*np.moveaxis(place[2 * reach :] - place[: -2 * reach], -1, 0)) / 0.4
    some = inside.any(axis=1)
    mean = (way * inside).sum(axis=1)[some] / inside.sum(axis=1)[some]
    area = 2 * half * (FRONT_M[1] - FRONT_M[0])
    return np.array([(last - first) / (end - start), inside.sum() / frames / area, mean.mean()])


def main():
    """Print what was seen beside what comes out."""
    parser = argparse.ArgumentParser(description="A real gate, seen and simulated.")
    parser.add_argument("runs", type=Path)
    for name, value in (("push", [0.0]), ("jostling", [0.06])):
        parser.add_argument(f"--{name}", type=float, nargs="+", default=value)
    numbers = {"time-gap": 0.75, "radius": 0.12, "relaxation": 0.3, "friction": 0.0, "seeds": 2}
    for name, value in numbers.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    given = parser.parse_args()
    print("run          p    jostling  flow /s      density /m²  speed m/s      force 90 % N")
    for row in csv.DictReader(given.runs.open(encoding="utf-8")):
        width, people = float(row["corridor_m"]), int(row["n"])
        seen = [float(row[key]) for key in ("flow_per_s", "density_per_m2", "speed_m_s")]
        for push, jostling in itertools.product(given.push, given.jostling):
            law = {"time_gap_s": given.time_gap, "relaxation_time_s": given.relaxation}
            law |= {"push_share": push, "jostling_m_per_s": jostling}
            found = []
            for seed in range(1, given.seeds + 1):
                start = crowd(width, people, given.radius, seed)
                time, place, force = run(gate(width), start, law, seed, given.friction)
                heads = swaying(time, place, seed)
                found.append([*measured(time, heads, width), np.quantile(force, 0.9)])
            *ours, force = np.mean(found, axis=0)
            beside = "  ".join(f"{a:.2f} / {b:.2f}" for a, b in zip(seen, ours, strict=True))
            print(f"{row['run']:12} {push:4.2f} {jostling:4.2f}      {beside}    {force:.0f}")


if __name__ == "__main__":
    main()
