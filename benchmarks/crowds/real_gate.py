"""Does a crowd that keeps its distance go through a real gate as a filmed one did?

    nice python benchmarks/crowds/real_gate.py RUNS.csv OURS.csv --push 0 0.1 0.2 --jostling 0.06 0.1

Runs of the experiment CrowdQueue (Wuppertal 2018, doi 10.34735/ped.2018.1): a straight corridor,
in the middle of its end a gate that is 0.5 m wide and 0.95 m long, with bevels of 0.15 m. RUNS.csv
has the columns run, corridor_m, n, motivation, priming, flow_per_s, density_per_m2, speed_m_s: seen
there, as in PedestrianDynamics/jupedsim-dakota-calibration. People start 0.5 m before the gate.

Flow is over the line in the middle of the gate, from 10 to 90 % of the people; density and speed
(over 0.4 s) in the corridor, 0.65 to 2.65 m before the gate, in that time. Heads sway besides.

What comes out of each law (time gap, radius, people per m² at the start), push, jostling and seed is
kept in OURS.csv. OURS_laws.csv tells how well each law fits, with the best pushes, jostlings, and both,
linearly between those that were run. OURS_fit.csv has the runs, and what is read off the flow, with
its interval (errors: 0.6 of a headway, over the root of their number), for the least misfit."""

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


def crowd(corridor, people, radius, seed, density=3.0):
    """People at random places, so many per m², not yet apart."""
    half = 0.5 * corridor - radius
    low, high = (-half, GATE_M + 0.5), (half, GATE_M + 0.5 + people / density / corridor)
    position = np.random.default_rng(seed).uniform(low, high, (people, 2))
    return Snapshot(position=position, radius=np.full(people, radius), mass=np.full(people, 75.0))


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
    time, position, force = [], [], []
    while motion.time < 3.0 * n and (motion.position[:, 1] > LINE_M - 0.5).any():
        force.append(motion.advance().reaction.max(initial=0.0) / STEP_S)
        if len(force) % EVERY == 0:
            time.append(motion.time)
            position.append(motion.position.copy())
    return np.array(time), np.array(position), np.array(force)


def swaying(time, position, seed=1):
    """The heads of bodies at (f,n,2) m."""
    rng = np.random.default_rng(seed)
    shape = (SWAYS, 1, *position.shape[1:])
    turns = rng.uniform(*SWAY_HZ, shape) * time[:, None, None] + rng.uniform(0.0, 1.0, shape)
    return position + SWAY_M * np.sqrt(2 / SWAYS) * np.cos(2 * np.pi * turns).sum(axis=0)


def measured(time, position, corridor):
    """Flow (1/s), density (1/m²), speed (m/s); NaN where not 90 % came through."""
    through = position[..., 1] < LINE_M
    exits = np.sort(time[np.argmax(through, axis=0)][through.any(axis=0)])
    first, last = (int(np.ceil(fraction * position.shape[1])) for fraction in (0.1, 0.9))
    if len(exits) < last:
        return np.full(3, np.nan)
    start, end = exits[first - 1], exits[last - 1]
    half, reach = 0.5 * corridor - 0.05, round(0.2 / (time[1] - time[0]))
    x, y = np.moveaxis(position[reach:-reach], -1, 0)
    inside = (np.abs(x) <= half) & (y >= FRONT_M[0]) & (y <= FRONT_M[1])
    inside &= ((time >= start) & (time <= end))[reach:-reach, None]
    frames = ((time >= start) & (time <= end)).sum()
    way = np.hypot(*np.moveaxis(position[2 * reach :] - position[: -2 * reach], -1, 0)) / 0.4
    some = inside.any(axis=1)
    mean = (way * inside).sum(axis=1)[some] / inside.sum(axis=1)[some]
    area = 2 * half * (FRONT_M[1] - FRONT_M[0])
    return np.array([(last - first) / (end - start), inside.sum() / frames / area, mean.mean()])


SEEN = ["flow_per_s", "density_per_m2", "speed_m_s"]
WITHIN = np.log([1.1, 1.25, 1.15])  # of SEEN
ROOM, LAW = ["corridor_m", "n"], ["time_gap_s", "radius_m", "start_per_m2"]
KEYS, FINE = [*ROOM, *LAW, "push", "jostling", "seed"], 5
HEADWAY_SD, Z90 = 0.6, 1.645
VARIANTS = {"push": {"jostling": 0.06}, "jostling": {"push": 0.0}, "both": {}}


def simulated(rooms, inputs, path):
    """Run what is asked for of rooms and not in the file, and put it there."""
    known = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=KEYS)
    done = set(known[KEYS].itertuples(index=False, name=None))
    requested = [getattr(inputs, key) for key in ("time_gap", "radius", "start", "push", "jostling")]
    seeds = range(1, inputs.seeds + 1)
    for (corridor, people), *values in itertools.product(rooms, *requested, seeds):
        if (corridor, people, *values) in done:
            continue
        gap, radius, density, push, jostling, seed = values
        law = {"time_gap_s": gap, "relaxation_time_s": inputs.relaxation}
        law |= {"push_share": push, "jostling_m_per_s": jostling}
        start = crowd(corridor, people, radius, seed, density)
        time, position, force = run(gate(corridor), start, law, seed, inputs.friction)
        found = measured(time, swaying(time, position, seed), corridor)
        one = [corridor, people, *values, *found, np.quantile(force, 0.9)]
        one = pd.DataFrame([one], columns=[*KEYS, *SEEN, "force_N"])
        one.to_csv(path, mode="a", header=not path.exists(), index=False)


def between(ours, push=None, jostling=None):
    """Means over seeds at pushes × jostlings, and linearly between them: pushes, jostlings, and log of
    SEEN and force (p,j,4)."""
    means = ours.groupby(["push", "jostling"])[[*SEEN, "force_N"]].mean().clip(lower=1.0e-3)
    axes = [np.unique(means.index.get_level_values(k)) for k in (0, 1)]
    value = np.log(means.reindex(pd.MultiIndex.from_product(axes)).to_numpy())
    value = value.reshape(*map(len, axes), -1)
    for k, only in enumerate((push, jostling)):
        known, count = axes[k], len(axes[k])
        finer = np.interp(np.arange(FINE * (count - 1) + 1) / FINE, np.arange(count), known)
        axes[k] = finer if only is None else np.array([only])
        at = lambda line, x=axes[k], of=known: np.interp(x, of, line)  # noqa: E731
        value = np.apply_along_axis(at, k, value)
    return *axes, value


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
    observed = np.log(getattr(row, key))
    return [float(np.interp(observed + by * sd, rising, x)) for by in (0.0, -Z90, Z90)]


def seen_again(ours, fit, flow_sd, draws=400):
    """The share of draws within what is asked, were a fitted crowd what is seen: its flow with
    errors, density and speed as seeds differ."""
    sd = np.log(ours[SEEN].clip(lower=1.0e-3)).groupby([ours.push, ours.jostling]).std().mean()
    drawn = np.random.default_rng(1).normal(np.log(fit[2:5]), [flow_sd, *sd[1:]], (draws, 3))
    off = (between(ours)[2][..., :3].reshape(-1, 1, 3) - drawn) / WITHIN
    best = np.nanargmin((off**2).sum(-1), axis=0)
    return (np.abs(off[best, np.arange(draws)]) <= 1.0).mean(axis=0)


def judged(observed, ours):
    """A line of misfits and counts of one law, and the table of its runs."""
    rooms = ours.groupby(ROOM)
    rows = [(row, rooms.get_group((row.corridor_m, row.n))) for row in observed.itertuples()]
    line, table = {"seeds": ours.seed.max()}, observed[["run", *ROOM]].copy()
    for name, only in VARIANTS.items():
        fits = np.array([fitted(*row, **only) for row in rows])
        good = np.abs(fits[:, 6:]) <= 1.0
        line[f"{name}_misfit"] = np.sqrt(np.mean(fits[:, 6:] ** 2))
        counts = [*good.sum(0), good.all(1).sum()]
        line |= zip([f"{name}_{key}" for key in [*SEEN, "all"]], counts, strict=True)
    errors = HEADWAY_SD / np.sqrt(0.8 * observed.n)
    again = [seen_again(of, *fit) for (_, of), *fit in zip(rows, fits, errors, strict=True)]
    line |= zip([f"seen_again_{key}" for key in SEEN], np.sum(again, axis=0), strict=True)
    for k, key in enumerate(SEEN):
        table[f"seen_{key}"], table[f"ours_{key}"] = observed[key], fits[:, 2 + k]
    table[["push", "jostling_m_per_s", "force_90_N"]] = fits[:, [0, 1, 5]]
    for name, key, of in (("push", "flow_per_s", "flow"), ("jostling", "speed_m_s", "speed")):
        each = zip(rows, errors, strict=True)
        ends = [read_off(*row, key, sd, **VARIANTS[name]) for row, sd in each]
        table[[f"{name}_of_{of}{end}" for end in ("", "_low", "_high")]] = ends
        values = observed.assign(x=[first for first, *_ in ends])
        pair = values.pivot(index=[*ROOM, "priming"], columns="motivation", values="x")
        line[f"pairs_{name}"] = (pair["h0"] > pair["h-"]).sum()
    return line, table


def main():
    """Print what was seen beside what comes out."""
    parser = argparse.ArgumentParser(description="A real gate, seen and simulated.")
    parser.add_argument("runs", type=Path)
    parser.add_argument("ours", type=Path)
    lists = {"push": [0.0, 0.05, 0.1, 0.2, 0.4], "jostling": [0.06, 0.1, 0.2, 0.3, 0.6]}
    for name, value in (lists | {"time-gap": [0.65], "radius": [0.13], "start": [6.0]}).items():
        parser.add_argument(f"--{name}", type=float, nargs="+", default=value)
    for name, value in {"relaxation": 0.3, "friction": 0.0, "seeds": 2}.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    args = parser.parse_args()
    observed = pd.read_csv(args.runs)
    simulated(dict.fromkeys(observed[ROOM].itertuples(index=False, name=None)), args, args.ours)
    groups = pd.read_csv(args.ours).groupby(LAW)
    lines, tables = zip(*[judged(observed, ours) for _, ours in groups], strict=True)
    laws = pd.DataFrame(list(groups.groups), columns=LAW).join(pd.DataFrame(lines))
    for what, found in (("laws", laws), ("fit", tables[laws.both_misfit.argmin()])):
        print(found.round(2).to_string())
        found.round(3).to_csv(args.ours.with_stem(f"{args.ours.stem}_{what}"), index=False)


if __name__ == "__main__":
    main()
