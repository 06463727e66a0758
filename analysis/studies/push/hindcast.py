"""A push trial computed after the event: the row of people by penalty contacts and as rigid bodies, and the
scores of models and baselines. The row is straight, so a contact is one gap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logsumexp, ndtri

from analysis.studies.push.trial import SPEED_OVER_S, Trial, onset, speed_of
from analysis.support.parallel import Progress
from nscd.arrays import Floats, Indices, Mask

# Time steps: of rigid people (s), and of springs as a share of sqrt(m/k) of the lightest person.
RIGID_STEP_S, SOFT_SHARE = 0.008, 0.05
# Ranges of what is not known: share of the room between chests that arms bridge from the start,
# and time (s) in which the floor takes a speed.
ARMS, TAU_S = (0.0, 1.0), (0.1, 1.0)
# Reach (m) of the soft layer of arms, and its force (N): from the push of LEMONS' people to that of a
# man who stands.
REACH_M, ARM_N = (0.0, 0.2), (100.0, 250.0)
# The first may be stopped so far (m) before the end of its measured motion.
STOPPED_M = 0.001
# Cases of one batch.
DRAWS = 500


class Inputs(NamedTuple):
    """Hold what is not known of a row, in s cases.

    arms: (s,) share of the room between chests that is bridged from the start: 0 where chests
        meet, 1 where arms touch already; wall: (s,) the same share before the wall, an input of
        its own (0 without a wall)
    reach, force: (s,) m and N, of the soft layer of arms (`nscd.stepping.Arms`); who stands nearer
        than the reach begins to push when the room becomes smaller than at the start"""

    arms: Floats
    wall: Floats
    tau: Floats  # (s,) s, in which the floor takes a speed
    gap: Floats  # (s, g) m, from the start to contact; the last one at the wall, where there is one
    batch: Indices  # (s,) number of the batch, drawn on its own
    reach: Floats
    force: Floats

    def arms_at(self, room: Floats) -> Floats:
        """Compute the push (g, s) N of arms at rooms (g, s) m between people."""
        begin, slope = np.minimum(self.reach, self.gap.T), self.force / np.maximum(self.reach, 1e-9)
        return np.asarray(np.clip(slope * (begin - room), 0.0, (self.reach > 0) * self.force))


class Moved(NamedTuple):
    """Hold what a model or a baseline makes of s cases.

    largest, impulse: (s,) N and N·s of the contact with the first; NaN of a baseline, and largest for
        rigid people
    """

    along: Floats  # (f, n, s) m, heads along the row
    largest: Floats
    impulse: Floats
    possible: Mask  # (s,) whether the case can be (see `rigid` and `soft`)


def inputs_of(
    trial: Trial, arms: Sequence[float], batch: int, reach: Sequence[float] = REACH_M
) -> Inputs:
    """Draw a batch of cases (Latin hypercube, seeded by the batch's number): posture evenly between
    the least and the most of arms, the share before the wall evenly from 0 to 1, τ evenly in its
    logarithm, each room with the standard deviation of the mean of two chests; reach and force of
    the soft layer evenly."""
    room, low, high = trial.torso_gap, min(arms), max(arms)
    random = np.random.default_rng([batch, 5])
    strata = random.permuted(np.tile(np.arange(DRAWS), (3 + len(room), 1)), axis=1).T
    drawn = (strata + random.random(strata.shape)) / DRAWS
    posture = low + (high - low) * drawn[:, 0]
    before_wall = drawn[:, 1] * (trial.wall is not None)
    fraction = np.repeat(posture[:, None], len(room), axis=1)
    if trial.wall is not None:
        fraction[:, -1] = before_wall
    error = trial.depth_sd * ndtri(drawn[:, 3:])
    # drawn by themselves, so that a reach of 0 leaves all others as they are
    random = np.random.default_rng([batch, 6])
    layers = random.permuted(np.tile(np.arange(DRAWS), (2, 1)), axis=1)
    layers = (layers + random.random(layers.shape)) / DRAWS
    return Inputs(
        arms=posture,
        wall=before_wall,
        tau=TAU_S[0] * (TAU_S[1] / TAU_S[0]) ** drawn[:, 2],
        gap=(1 - fraction) * np.maximum(room + error, 0.0),
        batch=np.full(DRAWS, batch),
        reach=min(reach) + (max(reach) - min(reach)) * layers[0],
        force=ARM_N[0] + (ARM_N[1] - ARM_N[0]) * layers[1],
    )


def rigid(trial: Trial, inputs: Inputs) -> Moved:
    """Step rigid people who do not rebound.

    In a row the velocities after contact, which minimise ½ Σ m (v − v_free)² so that nobody passes
    a neighbour, are a weighted isotonic regression (pool adjacent violators): the largest, over
    those behind, of the smallest, over those in front, of means of neighbours. The first and the
    wall bound it.

    A case cannot be where people are pressed together before the first has gone as far as it was
    measured to go, or where the impulse is above `most_impulse`."""
    mass, gap = trial.mass[1:, None], inputs.gap.T
    position = np.cumsum(gap[: len(mass)], axis=0)
    wall = np.full(gap.shape[1], np.inf) if trial.wall is None else gap.sum(0)
    step, many = steps(trial, RIGID_STEP_S)
    keep = np.exp(-step / inputs.tau)
    at, speed, start = position.copy(), np.zeros_like(position), position.copy()
    along, impulse, first = [at - start], np.zeros(len(inputs.tau)), np.zeros((1, len(gap.T)))
    for before, after in pairwise(trial.pushed):
        for number in range(1, many + 1):
            pushed = before + (after - before) * number / many
            ends = [first, at] if trial.wall is None else [first, at, wall[None]]
            push = inputs.arms_at(np.diff(np.concatenate(ends), axis=0))
            kick = step * _net(push, len(mass)) / mass
            impulse += step * push[0]
            first[:] = pushed
            free = _isotonic(at + step * keep * (speed + kick), mass)
            moved = np.minimum(np.maximum(free, pushed), wall)
            impulse += (mass * np.maximum(pushed - free, 0.0)).sum(0) / step
            at, speed = moved, (moved - at) / step
        along.append(at - start)
    return Moved(
        along=_head_positions(trial, np.array(along)),
        largest=np.full(len(impulse), np.nan),
        impulse=impulse,
        possible=(trial.pushed.max() <= wall + STOPPED_M)
        & (impulse <= most_impulse(trial, inputs.tau)),
    )


def _net(push: Floats, people: int) -> Floats:
    """What pushes (g, s) between neighbours give to the n others, (n, s): from behind, less what is
    given on."""
    onward = push[:people].copy()
    onward[: len(push) - 1] -= push[1 : people + 1]
    return onward


def _isotonic(free: Floats, mass: Floats) -> Floats:
    """Rising values nearest to free (n, s), by weights (n, 1)."""
    if (np.diff(free, axis=0) >= 0).all():
        return free
    sums = np.cumsum(np.concatenate([0 * free[:1], mass * free]), axis=0)
    weights = np.cumsum(np.concatenate([[[0.0]], mass]), axis=0)
    found = np.full_like(free, -np.inf)
    for behind in range(len(free)):
        means = (sums[behind + 1 :] - sums[behind]) / (weights[behind + 1 :] - weights[behind])
        minimum = np.minimum.accumulate(means[::-1], axis=0)[::-1]
        np.maximum(found[behind:], minimum, out=found[behind:])
    return found


def soft(trial: Trial, inputs: Inputs, stiffness: float) -> Moved:
    """Step people with critically damped springs of so many N/m that never pull: a contact's force
    is max(0, k overlap + 2 √(k m) approach), with m the reduced mass of the two.

    A case cannot be where impulse or force are above `most_impulse` and `most_force`."""
    mass, gap = trial.mass[1:, None], inputs.gap.T.copy()
    inverse = np.concatenate([[[0.0]], 1 / mass, np.zeros((len(gap) - len(mass), 1))])
    damping = 2 * np.sqrt(stiffness / (inverse[:-1] + inverse[1:]))
    step, many = steps(trial, SOFT_SHARE * np.sqrt(trial.mass.min() / stiffness))
    keep = np.exp(-step / inputs.tau)
    # all motions: of the first, of the others, of the wall
    at, speed = np.zeros((2, len(inverse), len(inputs.tau)))
    largest, impulse = np.zeros((2, len(inputs.tau)))
    people, reaching = slice(1, len(mass) + 1), bool(inputs.reach.any())
    along = [at[people].copy()]
    for velocity in np.diff(trial.pushed) / float(trial.time[1]):
        speed[0] = velocity
        for _ in range(many):
            overlap = at[:-1] - at[1:] - gap
            force = speed[:-1] - speed[1:]
            force *= damping
            force += stiffness * overlap
            force[(overlap <= 0) | (force < 0)] = 0.0
            if reaching:
                force += inputs.arms_at(-overlap)
            np.maximum(largest, force[0], out=largest)
            impulse += force[0]
            speed[people] += _net(force, len(mass)) * (step / mass)
            speed[people] *= keep
            at += step * speed
        along.append(at[people].copy())
    impulse *= step
    return Moved(
        along=_head_positions(trial, np.array(along)),
        largest=largest,
        impulse=impulse,
        possible=(impulse <= most_impulse(trial, inputs.tau))
        & (largest <= most_force(trial, stiffness)),
    )


def momentum(trial: Trial) -> float:
    """Compute the largest momentum Σ m v of all people together (N·s), as measured."""
    return float((trial.speed @ trial.mass).max())


def most_impulse(trial: Trial, tau: Floats) -> Floats:
    """Bound the impulse (s,) N·s on the second person by what was measured: the largest momentum of
    all, and what the floor takes on the way d of each of the others, Σ m v + Σ m d/τ."""
    way = (trial.along - trial.along[0]).max(0)[1:]
    return np.asarray(momentum(trial) + way @ trial.mass[1:] / tau)


def most_force(trial: Trial, stiffness: float) -> float:
    """Bound a force (N) by the measured momentum P: the impact of all of it through one damped
    spring on the lightest, 2 P √(k/m)."""
    return 2 * momentum(trial) * float(np.sqrt(stiffness / trial.mass.min()))


def steps(trial: Trial, longest: float) -> tuple[float, int]:
    """The time step (s), and how many of them are between two frames."""
    frame = float(trial.time[1])
    many = int(np.ceil(frame / longest))
    return frame / many, many


def _head_positions(trial: Trial, moved: Floats) -> Floats:
    """Heads (f, n, s) m: the first as measured, the others as far from their start as moved."""
    first = np.broadcast_to(trial.along[:, 0, None, None], (len(moved), 1, moved.shape[2]))
    return np.concatenate([first, trial.along[0, 1:, None] + moved], axis=1)


# Who does not move has this onset (s); positions are compared for so long after the push (s).
NEVER_S, POSITION_S = 2.0, 0.8
# A model beats a baseline where its score is smaller by at least so large a share.
MARGIN = 0.1
# So many times less likely than the likeliest, whatever is weighted, a model is out, and its order
# is settled.
APART, SETTLED = 10.0, 1.25
ONSET, POSITION, CLOSEST = SCORES = ("onset_rms_s", "position_rms_m", "closest_rms_m")
# Logarithms of weights of the share that arms bridge and of the share of the longest reach.
TILTS = (0.0, -2.0, 2.0)
# The smallest error that counts is the one that this share of a model's cases keep below.
NEAREST = 0.01


class Cases(NamedTuple):
    """Hold what a model or a baseline scores in s cases, and the contact with the first (see
    `Moved`)."""

    onset: Floats  # (s, n) s after the push reached the first
    scores: Mapping[str, Floats]  # (s,) each of SCORES, root mean squares over all but the first
    largest: Floats
    impulse: Floats
    possible: Mask


@dataclass(frozen=True, slots=True)
class Odds:
    """Hold how likely a model is, over the likeliest: of all cases, and the least and the most of
    all batches and weightings."""

    fraction: float
    low: float
    high: float

    @property
    def settled(self) -> bool:
        """Tell whether every batch and weighting finds the model less likely by a quarter."""
        return self.high * SETTLED <= 1

    @property
    def out(self) -> bool:
        """Tell whether every batch and weighting finds it ten times less likely."""
        return self.high * APART <= 1


def onsets(trial: Trial, along: Floats) -> Floats:
    """Find when each head (f, …) m is faster than 0.15 m/s, in s (…) after the first was; 2 s for
    never."""
    return np.minimum(onset(trial.time, speed_of(trial.time, along)) - trial.start_s, NEVER_S)


def scored(trial: Trial, moved: Moved) -> Cases:
    """Score heads against the measured ones, which are treated alike."""
    along, early = moved.along, trial.time <= trial.start_s + POSITION_S
    found = onsets(trial, along)
    late = found[1:] - onsets(trial, trial.along)[1:, None]
    off = along[early, 1:] - trial.along[early, 1:, None]
    near = closest(along) - closest(trial.along)[:, None]
    scores = {
        ONSET: np.sqrt((late**2).mean(0)),
        POSITION: np.sqrt((off**2).mean((0, 1))),
        CLOSEST: np.sqrt((near**2).mean(0)),
    }
    return Cases(found.T, scores, *moved[1:])


def closest(along: Floats) -> Floats:
    """Find the smallest distance (n − 1, …) m of neighbours' heads (f, n, …) m."""
    return np.asarray(np.diff(along, axis=1).min(0))


def baselines(trial: Trial, inputs: Inputs) -> dict[str, Moved]:
    """Move the heads by what knows no mechanics, by name.

    nobody: only the first moves; copy: everybody moves as the first did, later by the time that the
    first at its fastest takes to go the gaps before; geometry: everybody is carried along once the
    gaps have closed, until those in front stand at the wall, and stays where the push ends."""
    first = trial.pushed
    closed = np.cumsum(inputs.gap[:, : len(trial.mass) - 1], axis=1).T
    late = closed / float(trial.speed[:, 0].max())
    carried = np.maximum(np.maximum.accumulate(first)[:, None, None] - closed, 0.0)
    if trial.wall is not None:
        carried = np.minimum(carried, np.maximum(inputs.gap.sum(1) - closed, 0.0))
    moved = {
        "nobody": np.zeros_like(carried),
        "copy": np.interp(trial.time[:, None, None] - late, trial.time, first),
        "geometry": carried,
    }
    none, able = np.full(closed.shape[1], np.nan), np.ones(closed.shape[1], bool)
    return {name: Moved(_head_positions(trial, each), none, none, able) for name, each in moved.items()}


def error_of(trial: Trial, cases: Mapping[str, Cases]) -> float:
    """Give the error (s) of an onset: the time over which speeds are taken, or what the nearest
    hundredth of the cases of the best model reaches, if that is more."""
    near = [
        float(np.quantile(one.scores[ONSET][one.possible], NEAREST))
        for one in cases.values()
        if one.possible.any()
    ]
    return max(SPEED_OVER_S, float(trial.time[1]), min(near, default=0.0))


def odds(trial: Trial, inputs: Inputs, models: Mapping[str, Cases]) -> dict[str, Odds]:
    """Compare how likely the measured onsets are under models: the mean over possible cases of
    exp(−½ Σ (difference/σ)²), with σ of `error_of`.

    Each batch of cases is asked on its own, with σ and with 2 σ, and with the share that arms
    bridge between people (and before the wall), and the reach, weighted evenly, and up to seven
    times less or more at its upper end. A model without a possible case has no odds."""
    sigma = error_of(trial, models)
    able = {name: one for name, one in models.items() if one.possible.any()}
    near = {name: log_likelihood(trial, one, sigma) for name, one in able.items()}
    none, maximum = (0.0,), float(inputs.reach.max()) or 1.0
    ways = [
        *product(
            (1.0, 2.0),
            TILTS,
            TILTS if trial.wall is not None else none,
            TILTS if np.ptp(inputs.reach) else none,
        )
    ]

    def likelihood(name: str, batch: int | None, way: tuple[float, ...]) -> float:
        chosen = able[name].possible & ((inputs.batch == batch) if batch is not None else True)
        tilted = way[1] * inputs.arms + way[2] * inputs.wall + way[3] * inputs.reach / maximum
        weight = tilted[chosen]
        found = near[name][chosen] / way[0] ** 2
        return float(logsumexp(weight + found) - logsumexp(weight)) if chosen.any() else np.nan

    full = {name: likelihood(name, None, (1.0, 0.0, 0.0, 0.0)) for name in able}
    best = max(full, key=lambda name: full[name], default="")
    found = {}
    for name in able:
        ratio = np.exp(
            [
                likelihood(name, batch, way) - likelihood(best, batch, way)
                for batch in np.unique(inputs.batch)
                for way in ways
            ]
        )
        finite = not np.isnan(ratio).any()
        found[name] = Odds(
            fraction=float(np.exp(full[name] - full[best])),
            low=float(ratio.min()) if finite else 0.0,
            high=float(ratio.max()) if finite else np.inf,
        )
    return found


def log_likelihood(trial: Trial, one: Cases, sigma: float) -> Floats:
    """Compute −½ Σ (difference of onsets/σ)² of each case (s,); −∞ of one that cannot be."""
    square = ((one.onset[:, 1:] - onsets(trial, trial.along)[1:]) ** 2).sum(1)
    return np.asarray(np.where(one.possible, -0.5 * square / sigma**2, -np.inf))


# Contact stiffness of people (N/m): chest against chest, between, Helbing's, the product's own.
STIFFNESSES = (2e3, 5e3, 2e4, 1.2e5, 1e6)
RIGID = "rigid"
BATCHES = 10
# CPU seconds of a time step of a batch, and of each person in it.
STEP_S, PERSON_S = 2e-5, 5e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hindcast:
    """Hold a trial, what was not known of it, and what came out."""

    trial: Trial
    inputs: Inputs
    models: dict[str, Cases]  # what each makes of all cases, by name
    base: dict[str, Cases]  # the same of baselines
    odds: dict[str, Odds]  # over the likeliest, of each model that has a possible case

    def combined(self) -> list[str]:
        """Name the models that are not ten times less likely than the likeliest."""
        return [name for name, one in self.odds.items() if not one.out]

    def likely(self, name: str) -> list[tuple[float, float]]:
        """Give 5 and 95 % of posture, largest force (N), impulse (N·s) and reach (m) of a model's
        possible cases, weighted by the likelihood of the measured onsets."""
        one = self.models[name]
        logs = log_likelihood(self.trial, one, error_of(self.trial, self.models))
        order = {"weights": np.exp(logs - logs.max()), "method": "inverted_cdf"}
        every = (self.inputs.arms, one.largest, one.impulse, self.inputs.reach)
        ends = [np.quantile(each, [0.05, 0.95], **order) for each in every]
        return [(float(low), float(high)) for low, high in ends]

    def better(self, name: str) -> dict[str, float]:
        """Give the share of possible cases in which a model beats every baseline by a tenth, by
        score."""
        one, found = self.models[name], dict.fromkeys(SCORES, np.nan)
        for score in SCORES if one.possible.any() else ():
            best = np.min([other.scores[score] for other in self.base.values()], axis=0)
            found[score] = float((one.scores[score] < (1 - MARGIN) * best)[one.possible].mean())
        return found

    def nearest(self, name: str) -> int:
        """Find the case of a model with the nearest onsets, of those that can be if any can."""
        one = self.models[name]
        far = np.where(one.possible, 0.0, 1e9) + one.scores[ONSET]
        return int(far.argmin())

    def head_positions(self, name: str) -> Floats:
        """Compute the heads (f, n) m of a model's nearest case."""
        case = [self.nearest(name)]
        drawn = Inputs._make(each[case] for each in self.inputs)
        return _moved(self.trial, drawn, name).along[..., 0]


def hindcast(
    trial: Trial,
    arms: Sequence[float] = ARMS,
    stiffnesses: Sequence[float] = STIFFNESSES,
    batches: int = BATCHES,
    reach: Sequence[float] = REACH_M,
    progress: Progress | None = None,
) -> Hindcast:
    """Compute every model (penalty, rigid) and baseline in so many batches of cases.

    arms: the least and the most that arms bridge of the room between chests
    stiffnesses: N/m
    reach: m, the least and the longest of the soft layer of arms; 0 for none"""
    names = [*(f"{stiffness:g}" for stiffness in stiffnesses), RIGID]
    made: dict[str, list[Cases]] = {}
    drawn = [inputs_of(trial, arms, batch, reach) for batch in range(batches)]
    for batch, inputs in enumerate(drawn):
        for index, name in enumerate(names, start=1):
            made.setdefault(name, []).append(scored(trial, _moved(trial, inputs, name)))
            if progress:
                progress("rows", (batch + index / len(names)) / batches)
        for name, moved in baselines(trial, inputs).items():
            made.setdefault(name, []).append(scored(trial, moved))
    inputs, found = _joined(drawn), {name: _joined(parts) for name, parts in made.items()}
    models = {name: found.pop(name) for name in names}
    every = odds(trial, inputs, models)
    return Hindcast(trial=trial, inputs=inputs, models=models, base=found, odds=every)


def expected_seconds(trial: Trial) -> float:
    """Estimate the CPU time (s) of a hindcast from its time steps and people."""
    lightest = float(trial.mass.min())
    longest = [RIGID_STEP_S / 4, *(SOFT_SHARE * np.sqrt(lightest / k) for k in STIFFNESSES)]
    many = sum(len(trial.time) * steps(trial, step)[1] for step in longest)
    return BATCHES * many * (STEP_S + PERSON_S * len(trial.mass))


def _moved(trial: Trial, inputs: Inputs, name: str) -> Moved:
    return rigid(trial, inputs) if name == RIGID else soft(trial, inputs, float(name))


def _joined(parts: Sequence[Any]) -> Any:
    """The arrays of batches, one batch after the other, in records and mappings too."""
    if isinstance(parts[0], tuple):
        return type(parts[0])(*map(_joined, zip(*parts, strict=True)))
    if isinstance(parts[0], dict):
        return {name: _joined([part[name] for part in parts]) for name in parts[0]}
    return np.concatenate(parts)
