"""The push inferred: many crowds drawn from the prior and run, and those that look as what was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from analysis.studies.infer.crowd import PRIOR, Ran, Site, crowd_of, simulate
from analysis.studies.infer.posterior import INTERVAL, Posterior, Reference
from analysis.studies.infer.tracks import SIGNED
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from nscd.arrays import Floats

# What follows from a crowd, after the parameters of PRIOR; N that is added before logarithms are taken.
FORCES, SOFT_N = ("contact_N", "wall_N"), 20.0
NAMES = (*PRIOR, *FORCES)
# A crowd that is odder than such a share of the runs fits nothing.
FITS = 0.95
# How many runs are usual; a number is compared that such a share of them has; and of how many of the first
# numbers is shown what they say alone.
RUNS, SHOWN_BY, ALONE = 600, 0.95, (1, 2, 3, 7)
# Least quotient of the bounds of a wall load: a wrong rule for walls is not seen.
WALL_FACTOR = 1.5
DIGITS = 3  # after the point, of quantiles: a push share below is none
SMALLEST, FEWEST_RUNS = 1e-3, 60
COST_S = 1.2e-4  # CPU seconds of a person's second


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inferred:
    """Hold what runs say of a crowd that was seen. Quantiles (3,) are 5, 50 and 95 %, by NAMES.

    seen: statistics by name; statistics: (n,s) of the runs
    values: (n,k+2) parameters of the runs and forces (N), as NAMES
    unsolved: runs that had no solution, or nobody to be measured
    beyond: share of runs that are less odd than this crowd (`Reference.misfit`)
    odd: by how many standard deviations a statistic differs from what runs that are alike show
    prior, found: quantiles; of wall loads no finer than a factor 1.5; alone: from some statistics
    width, usual: of the intervals, as a share of the prior's (of forces in their logarithm): here, and the
        mean of the runs
    coverage: share of runs that lie in the 90 % interval inferred from the others
    owed: share of the scatter of the contact force that goes with a parameter"""

    seen: Mapping[str, float]
    statistics: Floats
    values: Floats
    unsolved: int
    beyond: float
    odd: Mapping[str, float]
    prior: Mapping[str, Floats]
    found: Mapping[str, Floats]
    alone: Mapping[tuple[str, ...], Mapping[str, Floats]]
    width: Mapping[str, float]
    usual: Mapping[str, float]
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
    signed = [name in SIGNED for name in names]
    return np.where(signed, statistics, np.log(np.maximum(statistics, SMALLEST)))


def _values(coordinates: Floats) -> Floats:
    """Parameters and forces of coordinates (n,k+2): none beyond the prior, no force below 0."""
    low, high, _ = np.array([*PRIOR.values()]).T
    forces = np.maximum(np.exp(coordinates[:, len(PRIOR) :]) - SOFT_N, 0.0)
    return np.concatenate([np.clip(coordinates[:, : len(PRIOR)], low, high), forces], axis=1)


def _by_name(values: Floats) -> dict[str, Floats]:
    """Quantiles (3,) by NAMES; of wall loads no finer than WALL_FACTOR."""
    named = dict(zip(NAMES, values.T, strict=True))
    low, middle, high = named["wall_N"] + SOFT_N
    wider = np.sqrt(max(1.0, WALL_FACTOR * low / high))
    named["wall_N"] = np.maximum(np.array([low / wider, middle, high * wider]) - SOFT_N, 0.0)
    return {name: found.round(DIGITS) for name, found in named.items()}


def _quantiles(found: Posterior) -> dict[str, Floats]:
    return _by_name(found._replace(sample=_values(found.sample)).quantiles())


def _widths(quantiles: Mapping[str, Floats]) -> Floats:
    """From 5 to 95 % by NAMES, of forces in their logarithm."""
    ends = (np.log(q + SOFT_N) if name in FORCES else q for name, q in quantiles.items())
    return np.array([q[2] - q[0] for q in ends])


def one_run(site: Site, seed: int, number: int) -> Ran | None:
    """Run the crowd of this number; its own random numbers follow from both."""
    crowd = crowd_of(uniform(seed, number), site.largest_m)
    return simulate(site, crowd, 1 + (seed * 100_003 + number) % 3_999_999_999)


def run_prior(
    site: Site, runs: int = RUNS, seed: int = 1, progress: Progress | None = None, processes: int | None = None
) -> list[Ran | None]:
    """Run so many crowds of the prior, in parallel; None where a step is not solved."""
    tasks = [Task(call=one_run, arguments=(site, seed, number), work=1.0) for number in range(runs)]
    with nullcontext() if (processes or cores()) == 1 else workers(processes) as executor:
        return do_all(tasks, executor, "simulations", progress)


def gathered(
    site: Site, observed: Mapping[str, float], ran: Sequence[Ran | None], seed: int = 1
) -> tuple[list[str], Floats, Floats]:
    """Give what can be compared of a crowd with these statistics and runs of `run_prior`: names of statistics,
    those of runs (n,s), and their coordinates (n,k+2): parameters, and logarithms of forces.

    Raises ValueError where fewer than 60 runs can be compared."""
    names = [name for name, value in observed.items() if np.isfinite(value)]
    solved = [
        ([*crowd_of(uniform(seed, k), site.largest_m).values()], one.statistics, one[1:3])
        for k, one in enumerate(ran)
        if one is not None
    ]
    have = {name: sum(np.isfinite(one[name]) for _, one, _ in solved) for name in names}
    names = [name for name in names if have[name] >= SHOWN_BY * len(solved)]
    good = [one for one in solved if all(np.isfinite(one[1][name]) for name in names)]
    if not names or len(good) < FEWEST_RUNS:
        raise ValueError(f"runs: {len(good) * bool(names)} of {len(ran)} can be compared. At least {FEWEST_RUNS} are needed")
    statistics = np.array([[one[name] for name in names] for _, one, _ in good], dtype=float)
    drawn, forces = np.array([one[0] for one in good]), np.array([one[2] for one in good], dtype=float)
    return names, statistics, np.concatenate([drawn, np.log(forces + SOFT_N)], axis=1)


def infer(
    site: Site, observed: Mapping[str, float], ran: Sequence[Ran | None], seed: int = 1, progress: Progress | None = None
) -> Inferred:
    """Infer the push of a crowd from its statistics, and the contact forces and wall loads that follow.

    site, observed: of `observed.see`; ran: of `run_prior` with the same seed

    Raises ValueError as `gathered` does."""
    names, statistics, coordinates = gathered(site, observed, ran, seed)
    every, report = Reference(coordinates, comparable(names, statistics)), progress or (lambda label, fraction: None)
    crowd = comparable(names, np.array([observed[name] for name in names]))
    report("each run from the others", 0.0)
    left_out, posterior = every.left_out(), every.posterior(crowd)
    report("each run from the others", 1.0)
    inside = ((left_out[:, 0] <= coordinates) & (coordinates <= left_out[:, 2])).mean(0)
    alone = {
        tuple(names[:n]): _quantiles(Reference(coordinates, every.statistics[:, :n]).posterior(crowd[:n]))
        for n in ALONE
        if n < len(names)
    }
    values = _values(coordinates)
    prior, found = np.quantile(values, INTERVAL, axis=0), _quantiles(posterior)
    before = dict(zip(NAMES, prior.round(DIGITS).T, strict=True))
    usual = np.mean([_widths(_by_name(_values(each))) for each in left_out], axis=0)
    by_name = _widths(found) / _widths(before), usual / _widths(before), inside, posterior.owed(len(PRIOR))
    width, usual, coverage, owed = (dict(zip(NAMES, each.tolist(), strict=True)) for each in by_name)
    return Inferred(
        seen={name: observed[name] for name in names}, statistics=statistics, values=values, unsolved=len(ran) - len(statistics),
        beyond=every.misfit(crowd), odd=dict(zip(names, every.unusual(crowd).tolist(), strict=True)), prior=before,
        found=found, alone=alone, width=width, usual=usual, coverage=coverage,
        owed={name: owed[name] for name in PRIOR},
    )  # fmt: skip


def infer_parts(
    site: Site, observed: Sequence[Mapping[str, float]], ran: Sequence[Ran | None], seed: int = 1
) -> list[Inferred | None]:
    """Infer the push in each of the site's parts from its statistics; None where too few runs can be compared."""
    found: list[Inferred | None] = []
    for k, statistics in enumerate(observed):
        try:
            found.append(infer(site, statistics, [one and one.parts[k] for one in ran], seed))
        except ValueError:
            found.append(None)
    return found


def expected_seconds(site: Site, runs: int) -> float:
    """CPU seconds that so many runs take."""
    return COST_S * runs * site.people * site.duration_s
