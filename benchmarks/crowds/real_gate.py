"""Does a crowd that keeps its distance go through a real gate as a filmed one did?

    nice python benchmarks/crowds/real_gate.py RUNS.csv OURS.csv --push 0 0.1 0.2 --jostling 0.06 0.1

Runs of the experiment CrowdQueue (Wuppertal 2018, doi 10.34735/ped.2018.1): a straight corridor,
in the middle of its end a gate that is 0.5 m wide and 0.95 m long, with bevels of 0.15 m. RUNS.csv
has the columns run, corridor_m, n, motivation, flow_per_s, density_per_m2, speed_m_s: seen there, as
in PedestrianDynamics/jupedsim-dakota-calibration. People start at 3 per m², 0.5 m before the gate.

Flow is over the line in the middle of the gate, from 10 to 90 % of the people; density and speed
(over 0.4 s) in the corridor, 0.65 to 2.65 m before the gate, in that time. Heads sway besides.

What comes out of each push, jostling and seed is kept in OURS.csv. Then it is told what fits best of
pushes, of jostlings, and of both, linearly between those that were run, and the push that is read
off the flow, with the interval of the flow: its errors are 0.6 of a headway, over the root of their
number."""

import argparse
import itertools
from pathlib import Path

import numpy as np
import pandas as pd

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


SEEN = ["flow_per_s", "density_per_m2", "speed_m_s"]
WITHIN = np.log([1.1, 1.25, 1.15])  # of SEEN
KEYS, FINE = ["run", "push", "jostling", "seed"], 5
HEADWAY_SD, Z90 = 0.6, 1.645


def simulated(row, given, path):
    """Run what is asked for of a run and not in the file, and put it there."""
    known = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=KEYS)
    done = set(known[KEYS].itertuples(index=False, name=None))
    ways = itertools.product(range(1, given.seeds + 1), given.push, given.jostling)
    for seed, push, jostling in ways:
        if (row.run, push, jostling, seed) in done:
            continue
        law = {"time_gap_s": given.time_gap, "relaxation_time_s": given.relaxation}
        law |= {"push_share": push, "jostling_m_per_s": jostling}
        start = crowd(row.corridor_m, row.n, given.radius, seed)
        time, place, force = run(gate(row.corridor_m), start, law, seed, given.friction)
        found = measured(time, swaying(time, place, seed), row.corridor_m)
        values = [row.run, push, jostling, seed, *found, np.quantile(force, 0.9)]
        one = pd.DataFrame([values], columns=[*KEYS, *SEEN, "force_N"])
        one.to_csv(path, mode="a", header=not path.exists(), index=False)


def between(ours, push=None, jostling=None):
    """Means over seeds at pushes × jostlings, and linearly between them: pushes, jostlings, and log of
    SEEN and force (p,j,4)."""
    means = ours.groupby(["push", "jostling"])[[*SEEN, "force_N"]].mean().clip(lower=1.0e-3)
    p, j = (np.unique(means.index.get_level_values(k)) for k in (0, 1))
    value = np.log(means.reindex(pd.MultiIndex.from_product([p, j])).to_numpy())
    value = value.reshape(len(p), len(j), -1)
    for axis, name, known, only in ((0, "p", p, push), (1, "j", j, jostling)):
        more = np.interp(
            np.arange(FINE * (len(known) - 1) + 1) / FINE, np.arange(len(known)), known
        )
        wanted = more if only is None else np.array([only])
        at = lambda line, x=wanted, of=known: np.interp(x, of, line)  # noqa: E731
        value = np.apply_along_axis(at, axis, value)
        p, j = (wanted, j) if name == "p" else (p, wanted)
    return p, j, value


def fitted(row, ours, **only):
    """What fits a run best: push, jostling, SEEN, force, and the residuals over what is asked."""
    p, j, value = between(ours, **only)
    off = (value[..., :3] - np.log([getattr(row, key) for key in SEEN])) / WITHIN
    k, m = np.unravel_index(np.nanargmin((off**2).sum(-1)), off.shape[:2])
    return p[k], j[m], *np.exp(value[k, m]), *off[k, m]


def read_off(row, ours, key, sd, **only):
    """What gives a value of SEEN as it was seen, the least that does; and the ends of 90 %."""
    p, j, value = between(ours, **only)
    x = p if len(p) > 1 else j
    rising = np.maximum.accumulate(value.reshape(len(x), -1)[:, SEEN.index(key)])
    rising = rising + 1e-9 * np.arange(len(x))
    seen = np.log(getattr(row, key))
    return [float(np.interp(seen + by * sd, rising, x)) for by in (0.0, -Z90, Z90)]


def main():
    """Print what was seen beside what comes out."""
    parser = argparse.ArgumentParser(description="A real gate, seen and simulated.")
    parser.add_argument("runs", type=Path)
    parser.add_argument("ours", type=Path)
    for name, value in (("push", [0.0, 0.1, 0.2, 0.4]), ("jostling", [0.02, 0.06, 0.1, 0.2, 0.3])):
        parser.add_argument(f"--{name}", type=float, nargs="+", default=value)
    numbers = {"time-gap": 0.75, "radius": 0.12, "relaxation": 0.3, "friction": 0.0, "seeds": 2}
    for name, value in numbers.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    given = parser.parse_args()
    seen = pd.read_csv(given.runs)
    for row in seen.itertuples():
        simulated(row, given, given.ours)
    ours = dict(list(pd.read_csv(given.ours).groupby("run")))
    variants = {"push": {"jostling": 0.06}, "jostling": {"push": 0.0}, "both": {}}
    names = [f"{who}_{key}" for key in SEEN for who in ("seen", "ours")]
    for name, only in variants.items():
        fits = [fitted(row, ours[row.run], **only) for row in seen.itertuples()]
        push, jostling, *found, force = np.transpose(fits)[:6]
        off = np.transpose(fits)[6:]
        pairs = [each for key, mine in zip(SEEN, found, strict=True) for each in (seen[key], mine)]
        columns = dict(zip(names, pairs, strict=True)) | {
            "push": push,
            "jostling_m_per_s": jostling,
        }
        table = seen[["run", "corridor_m", "n"]].assign(**columns, force_90_N=force.round())
        good = np.abs(off) <= 1.0
        flow, density, speed = good.sum(1)
        print(f"{name}: within: flow {flow}, density {density}, speed {speed}, all {good.all(0).sum()}"
              f" of {len(seen)}; root mean square {np.sqrt(np.mean(np.square(off))):.2f} of what is"
              " asked")  # fmt: skip
    errors = HEADWAY_SD / np.sqrt(0.8 * seen.n)
    for column, key, only in (
        ("push_of_flow", "flow_per_s", {"jostling": 0.06}),
        ("jostling_of_speed", "speed_m_s", {"push": 0.0}),
    ):
        rows = zip(seen.itertuples(), errors, strict=True)
        ends = np.transpose([read_off(row, ours[row.run], key, sd, **only) for row, sd in rows])
        for end, values in zip(("", "_low", "_high"), ends, strict=True):
            table[column + end] = values
    print(table.round(2).to_string())
    table.round(2).to_csv(given.ours.with_stem(f"{given.ours.stem}_fit"), index=False)


if __name__ == "__main__":
    main()
