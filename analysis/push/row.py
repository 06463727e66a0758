"""A row of people pushed by its first, whose motion is given: penalty contacts and rigid people.

The row is straight, so a contact is one gap. Many cases, each with its own gaps and floor, are
computed side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from analysis.push.trial import Trial
from nscd.arrays import Flags, Floats, Indices

# Time steps: of rigid people (s), and of springs as a share of sqrt(m/k) of the lightest person.
RIGID_STEP_S, SOFT_SHARE = 0.008, 0.05
# Ranges of what is not known: share of the room between chests that arms bridge from the start,
# and time (s) in which the floor takes a speed.
ARMS, TAU_S = (0.0, 1.0), (0.1, 1.0)
# The first may be stopped so far (m) before the end of its measured motion.
STOPPED_M = 0.001
# Cases of one batch.
DRAWS = 500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """Hold what is not known of a row, in s cases.

    arms: (s,) share of the room between chests that is bridged from the start: 0 where chests
        meet, 1 where arms touch already; wall: (s,) the same share before the wall, an input of
        its own (0 without a wall)"""

    arms: Floats
    wall: Floats
    tau: Floats  # (s,) s, in which the floor takes a speed
    gap: Floats  # (s, g) m, from the start to contact; the last one at the wall, where there is one
    batch: Indices  # (s,) number of the batch, drawn on its own


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moved:
    """Hold what a model makes of the cases.

    largest, impulse: (s,) N and N·s of the contact with the first; largest is NaN for rigid people
    """

    along: Floats  # (f, n, s) m, heads along the row
    largest: Floats
    impulse: Floats
    possible: Flags  # (s,) whether the case can be (see `rigid` and `soft`)


def inputs_of(trial: Trial, arms: Sequence[float], batch: int) -> Inputs:
    """Draw a batch of cases (Latin hypercube, seeded by the batch's number): posture evenly between
    the least and the most of arms, the share before the wall evenly from 0 to 1, τ evenly in its
    logarithm, each room with the standard deviation of the mean of two chests."""
    room, low, high = trial.torso_gap, min(arms), max(arms)
    random = np.random.default_rng([batch, 5])
    strata = random.permuted(np.tile(np.arange(DRAWS), (3 + len(room), 1)), axis=1).T
    drawn = (strata + random.random(strata.shape)) / DRAWS
    posture = low + (high - low) * drawn[:, 0]
    before_wall = drawn[:, 1] * (trial.wall is not None)
    share = np.repeat(posture[:, None], len(room), axis=1)
    if trial.wall is not None:
        share[:, -1] = before_wall
    error = trial.depth_sd * ndtri(drawn[:, 3:])
    return Inputs(
        arms=posture,
        wall=before_wall,
        tau=TAU_S[0] * (TAU_S[1] / TAU_S[0]) ** drawn[:, 2],
        gap=(1 - share) * np.maximum(room + error, 0.0),
        batch=np.full(DRAWS, batch),
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
    place = np.cumsum(gap[: len(mass)], axis=0)
    wall = np.inf if trial.wall is None else gap.sum(0)
    step, many = steps(trial, RIGID_STEP_S)
    keep = np.exp(-step / inputs.tau)
    at, speed, start = place.copy(), np.zeros_like(place), place.copy()
    along, impulse = [at - start], np.zeros(len(inputs.tau))
    for before, after in pairwise(trial.pushed):
        for number in range(1, many + 1):
            pushed = before + (after - before) * number / many
            free = _isotonic(at + step * keep * speed, mass)
            moved = np.minimum(np.maximum(free, pushed), wall)
            impulse += (mass * np.maximum(pushed - free, 0.0)).sum(0) / step
            at, speed = moved, (moved - at) / step
        along.append(at - start)
    return Moved(
        along=_heads(trial, np.array(along)),
        largest=np.full(len(impulse), np.nan),
        impulse=impulse,
        possible=(trial.pushed.max() <= wall + STOPPED_M)
        & (impulse <= most_impulse(trial, inputs.tau)),
    )


def _isotonic(free: Floats, mass: Floats) -> Floats:
    """Rising values nearest to free (n, s), by weights (n, 1)."""
    if (np.diff(free, axis=0) >= 0).all():
        return free
    sums = np.cumsum(np.concatenate([0 * free[:1], mass * free]), axis=0)
    weights = np.cumsum(np.concatenate([[[0.0]], mass]), axis=0)
    found = np.full_like(free, -np.inf)
    for behind in range(len(free)):
        means = (sums[behind + 1 :] - sums[behind]) / (weights[behind + 1 :] - weights[behind])
        least = np.minimum.accumulate(means[::-1], axis=0)[::-1]
        np.maximum(found[behind:], least, out=found[behind:])
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
    people = slice(1, len(mass) + 1)
    along = [at[people].copy()]
    for velocity in np.diff(trial.pushed) / float(trial.time[1]):
        speed[0] = velocity
        for _ in range(many):
            overlap = at[:-1] - at[1:] - gap
            force = speed[:-1] - speed[1:]
            force *= damping
            force += stiffness * overlap
            force[(overlap <= 0) | (force < 0)] = 0.0
            np.maximum(largest, force[0], out=largest)
            impulse += force[0]
            onward = force[: len(mass)].copy()
            onward[: len(force) - 1] -= force[1 : len(mass) + 1]
            onward *= step / mass
            speed[people] += onward
            speed[people] *= keep
            at += step * speed
        along.append(at[people].copy())
    impulse *= step
    return Moved(
        along=_heads(trial, np.array(along)),
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


def _heads(trial: Trial, moved: Floats) -> Floats:
    """Heads (f, n, s) m: the first as measured, the others as far from their start as moved."""
    first = np.broadcast_to(trial.along[:, 0, None, None], (len(moved), 1, moved.shape[2]))
    return np.concatenate([first, trial.along[0, 1:, None] + moved], axis=1)
