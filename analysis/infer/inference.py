"""The push inferred: many crowds drawn from the prior and run, and those that look as what was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit

from analysis.infer.crowd import PRIOR, Ran, Site, crowd_of, simulate
from analysis.infer.posterior import INTERVAL, Posterior, Reference
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from nscd.arrays import Floats

# What follows from a crowd, after the parameters of PRIOR; N that is added before logarithms are taken.
FORCES, SOFT_N = ("contact_N", "wall_N"), 20.0
NAMES = (*PRIOR, *FORCES)
# A crowd farther from the runs than such a share of them is from others fits nothing.
FITS = 0.95
# Least quotient of the bounds of a wall load: a wrong rule for walls is not seen.
WALL_FACTOR = 1.5
DIGITS = 3  # after the point, of quantiles: a push share below is none
SMALLEST, EDGE, FEWEST_RUNS = 1e-3, 1e-6, 60
COST_S = 3e-4  # CPU seconds of a person's second


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inferred:
    """Hold what runs say of a crowd that was seen. Quantiles (3,) are 5, 50 and 95 %, by NAMES.

    seen: statistics by name; statistics: (n,s) of the runs
    values: (n,k+2) parameters of the runs and forces (N), as NAMES
    unsolved: runs that had no solution, or nobody to be measured
    beyond: share of runs that others describe better than this crowd (`Reference.misfit`)
    prior, found: quantiles; of wall loads no finer than a factor 1.5; alone: from some statistics
    width: of the intervals, as a share of the prior's (of forces in their logarithm)
    coverage: share of runs that lie in the 90 % interval inferred from the others
    owed: share of the scatter of the contact force that goes with a parameter"""

    seen: Mapping[str, float]
    statistics: Floats
    values: Floats
    unsolved: int
    beyond: float
    prior: Mapping[str, Floats]
    found: Mapping[str, Floats]
    alone: Mapping[tuple[str, ...], Mapping[str, Floats]]
    width: Mapping[str, float]
    coverage: Mapping[str, float]
    owed: Mapping[str, float]

    @property
    def fits(self) -> bool:
        """Whether what was seen lies within the runs; where not, nothing follows."""
        return self.beyond < FITS


def uniform(seed: int, number: int) -> Floats:
    """Draw the numbers (k,) from 0 to 1 of a run's PRIOR: the same on every processor."""
    return np.random.default_rng([seed, number]).random(len(PRIOR))


def comparable(names: Sequence[str], statistics: Floats) -> Floats:
    """Give statistics (…,s) as they are compared: logarithms, but of what may be below 0."""
    signed = [name == "correlation" for name in names]
    return np.where(signed, statistics, np.log(np.maximum(statistics, SMALLEST)))


def _values(coordinates: Floats, largest_m: float) -> Floats:
    """Parameters and forces of coordinates (n,k+2)."""
    crowds = [[*crowd_of(row, largest_m).values()] for row in expit(coordinates[:, : len(PRIOR)])]
    return np.concatenate([crowds, np.maximum(np.exp(coordinates[:, len(PRIOR) :]) - SOFT_N, 0.0)], axis=1)


def _quantiles(found: Posterior, largest_m: float) -> dict[str, Floats]:
    named = dict(zip(NAMES, found._replace(sample=_values(found.sample, largest_m)).quantiles().T, strict=True))
    low, middle, high = named["wall_N"] + SOFT_N
    wider = np.sqrt(max(1.0, WALL_FACTOR * low / high))
    named["wall_N"] = np.maximum(np.array([low / wider, middle, high * wider]) - SOFT_N, 0.0)
    return {name: found.round(DIGITS) for name, found in named.items()}


def one_run(site: Site, seed: int, number: int) -> Ran | None:
    """Run the crowd of this number; its own random numbers follow from both."""
    crowd = crowd_of(uniform(seed, number), site.largest_m)
    return simulate(site, crowd, 1 + (seed * 100_003 + number) % 3_999_999_999)


def run_prior(
    site: Site, runs: int = 200, seed: int = 1, progress: Progress | None = None, processes: int | None = None
) -> list[Ran | None]:
    """Run so many crowds of the prior, in parallel; None where a step is not solved."""
    tasks = [Task(call=one_run, arguments=(site, seed, number), work=1.0) for number in range(runs)]
    with nullcontext() if (processes or cores()) == 1 else workers(processes) as executor:
        return do_all(tasks, executor, "simulations", progress)


def infer(
    site: Site, seen: Mapping[str, float], ran: Sequence[Ran | None], seed: int = 1, progress: Progress | None = None
) -> Inferred:
    """Infer the push of a crowd from its statistics, and the contact forces and wall loads that follow.

    site, seen: of `seen.see`; ran: of `run_prior` with the same seed

    Raises ValueError where fewer than 60 runs can be compared."""
    names = [name for name, value in seen.items() if np.isfinite(value)]
    good = [
        (uniform(seed, k), [one.statistics[name] for name in names], one[1:])
        for k, one in enumerate(ran)
        if one is not None and all(np.isfinite(one.statistics[name]) for name in names)
    ]
    if len(good) < FEWEST_RUNS:
        raise ValueError(f"runs: {len(good)} of {len(ran)} can be compared. At least {FEWEST_RUNS} are needed")
    drawn, statistics, forces = (np.array(part, dtype=float) for part in zip(*good, strict=True))
    coordinates = np.concatenate([logit(np.clip(drawn, EDGE, 1 - EDGE)), np.log(forces + SOFT_N)], axis=1)
    every, k = Reference(coordinates, comparable(names, statistics)), len(PRIOR)
    crowd = comparable(names, np.array([seen[name] for name in names]))
    report = progress or (lambda label, share: None)
    report("each run from the others", 0.0)
    (left_out, stretch), posterior = every.left_out(), every.posterior(crowd)
    report("each run from the others", 1.0)
    inside = (left_out[:, 0] <= coordinates) & (coordinates <= left_out[:, 2])
    # widths: of parameters as uniform numbers
    flat = (np.concatenate([expit(q[:, :k]), q[:, k:]], axis=1) for q in (posterior.quantiles(), coordinates))
    after, before = next(flat), np.quantile(next(flat), INTERVAL, axis=0)
    by_name = [(after[2] - after[0]) / (before[2] - before[0]), inside.mean(0), posterior.owed(k)]
    width, coverage, owed = (dict(zip(NAMES, each.tolist(), strict=True)) for each in by_name)
    some = (Reference(coordinates, every.statistics[:, :n]).posterior(crowd[:n]) for n in range(1, len(names)))
    alone = {tuple(names[: n + 1]): _quantiles(each, site.largest_m) for n, each in enumerate(some)}
    values = _values(coordinates, site.largest_m)
    prior = np.quantile(values, INTERVAL, axis=0)
    return Inferred(
        seen={name: seen[name] for name in names}, statistics=statistics, values=values, unsolved=len(ran) - len(good),
        beyond=every.misfit(crowd, stretch), prior=dict(zip(NAMES, prior.round(DIGITS).T, strict=True)),
        found=_quantiles(posterior, site.largest_m), alone=alone, width=width, coverage=coverage,
        owed={name: owed[name] for name in PRIOR},
    )  # fmt: skip


def expected_seconds(site: Site, runs: int) -> float:
    """CPU seconds that so many runs take."""
    return COST_S * runs * site.people * site.duration_s
