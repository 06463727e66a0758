"""The push inferred: many crowds drawn from the prior and run, and those that look as what was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit

from analysis.infer.crowd import PRIOR, Ran, Site, crowd_of, simulate, uniform
from analysis.infer.posterior import FITS, INTERVAL, Posterior, Reference
from analysis.support.machine import cores
from analysis.support.parallel import Progress, Task, do_all, workers
from nscd.arrays import Floats

# What follows from a crowd, after the parameters of PRIOR; N, added before logarithms are taken.
FORCES, SOFT_N = ("contact_N", "wall_N"), 20.0
NAMES = (*PRIOR, *FORCES)
# Least quotient of the ends of an interval of a wall load: a wrong rule for walls is not seen.
WALL_FACTOR = 1.5
SMALLEST, EDGE = 1e-3, 1e-6
FEWEST_RUNS = 60
# CPU seconds of a person's second.
COST_S = 2.5e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inferred:
    """Hold what runs say of a crowd that was seen.

    site, seen: where, and its statistics by name
    drawn: (n,k) numbers from 0 to 1 of PRIOR
    statistics: (n,s) of the runs, in the order of `seen`
    forces: (n,2) N, of FORCES
    unsolved: how many runs had no answer, or nobody to be measured
    left_out: (n,3,k+2) quantiles of each run, inferred from the others, of coordinates"""

    site: Site
    seen: Mapping[str, float]
    drawn: Floats
    statistics: Floats
    forces: Floats
    unsolved: int
    left_out: Floats

    @property
    def coordinates(self) -> Floats:
        """Parameters and forces (n,k+2) without bounds: logit, and log(F + 20 N)."""
        return _coordinates(self.drawn, self.forces)

    def reference(self, names: Sequence[str] = ()) -> Reference:
        """Give the runs as the inference takes them, with some of the statistics, or all."""
        chosen = [list(self.seen).index(name) for name in names or self.seen]
        every = _comparable(list(self.seen), self.statistics)[:, chosen]
        return Reference(coordinates=self.coordinates, statistics=every)

    def posterior(self, names: Sequence[str] = ()) -> Posterior:
        """Infer parameters (as they are) and forces (N) from some of the statistics, or all."""
        chosen = {name: self.seen[name] for name in names or self.seen}
        seen = _comparable(list(chosen), np.array([list(chosen.values())]))[0]
        found = self.reference(names).posterior(seen)
        return found._replace(sample=_values(found.sample))

    @property
    def beyond(self) -> float:
        """The share of runs that are nearer to others than what was seen is to any."""
        seen = _comparable(list(self.seen), np.array([list(self.seen.values())]))[0]
        return self.reference().misfit(seen)

    @property
    def fits(self) -> bool:
        """Whether what was seen lies within the runs; where not, nothing follows."""
        return self.beyond < FITS

    def intervals(self, names: Sequence[str] = ()) -> dict[str, Floats]:
        """Give 5, 50 and 95 % (3,) of each of NAMES; of the wall load no finer than 1.5."""
        columns = self.posterior(names).quantiles().T
        found = dict(zip(NAMES, columns, strict=True))
        low, middle, high = found["wall_N"]
        wider = np.sqrt(max(1.0, WALL_FACTOR * (low + SOFT_N) / (high + SOFT_N)))
        ends = (low + SOFT_N) / wider - SOFT_N, middle, (high + SOFT_N) * wider - SOFT_N
        found["wall_N"] = np.maximum(ends, 0.0)
        return found

    def prior(self) -> dict[str, Floats]:
        """Give 5, 50 and 95 % (3,) of each of NAMES in all runs."""
        columns = np.quantile(_values(self.coordinates), INTERVAL, axis=0).T
        return dict(zip(NAMES, columns, strict=True))

    def coverage(self) -> dict[str, float]:
        """Give the share of runs whose own value is within the 90 % interval from the others."""
        low, _, high = np.moveaxis(self.left_out, 1, 0)
        inside = (low <= self.coordinates) & (self.coordinates <= high)
        return dict(zip(NAMES, inside.mean(0).tolist(), strict=True))

    def width(self, quantiles: Floats) -> dict[str, float]:
        """Compare intervals (3,k+2) of coordinates with those of the prior: parameters as uniform numbers,
        forces in their logarithm."""
        every, k = self.coordinates, len(PRIOR)
        span = np.quantile(every[:, k:], INTERVAL, axis=0)
        shares = [*((expit(quantiles[2, :k]) - expit(quantiles[0, :k])) / (INTERVAL[2] - INTERVAL[0]))]
        shares += [*((quantiles[2, k:] - quantiles[0, k:]) / (span[2] - span[0]))]
        return {name: float(share) for name, share in zip(NAMES, shares, strict=True)}

    def widths(self) -> dict[str, float]:
        """Give the width of the intervals as a share of the prior's."""
        seen = _comparable(list(self.seen), np.array([list(self.seen.values())]))[0]
        return self.width(self.reference().posterior(seen).quantiles())

    def owed(self) -> dict[str, float]:
        """Give what share of the scatter of the contact force goes with each parameter."""
        shares = self.posterior().owed(NAMES.index("contact_N"))
        return dict(zip(PRIOR, shares.tolist(), strict=False))


def _coordinates(drawn: Floats, forces: Floats) -> Floats:
    bounded = logit(np.clip(drawn, EDGE, 1 - EDGE))
    return np.concatenate([bounded, np.log(forces + SOFT_N)], axis=1)


def _values(coordinates: Floats) -> Floats:
    """Parameters and forces of coordinates (n,k+2)."""
    k = len(PRIOR)
    crowds = [list(crowd_of(row).values()) for row in expit(coordinates[:, :k])]
    return np.concatenate([crowds, np.maximum(np.exp(coordinates[:, k:]) - SOFT_N, 0.0)], axis=1)


def _comparable(names: Sequence[str], statistics: Floats) -> Floats:
    """Statistics (n,s) as they are compared: logarithms, but of what may be below 0."""
    signed = [name == "correlation" for name in names]
    return np.where(signed, statistics, np.log(np.maximum(statistics, SMALLEST)))


def one_run(site: Site, seed: int, number: int) -> Ran | None:
    """Run the crowd of this number; its own random numbers follow from both."""
    return simulate(site, crowd_of(uniform(seed, number)), 1 + (seed * 100_003 + number) % 3_999_999_999)


def run_prior(
    site: Site, runs: int, seed: int, progress: Progress | None = None, processes: int | None = None
) -> list[Ran | None]:
    """Run so many crowds of the prior, in parallel."""
    tasks = [Task(call=one_run, arguments=(site, seed, k), work=1.0) for k in range(runs)]
    alone = (processes or cores()) == 1
    with nullcontext() if alone else workers(processes) as executor:
        return do_all(tasks, executor, "simulations", progress)


def infer_from(
    site: Site,
    seen: Mapping[str, float],
    ran: Sequence[Ran | None],
    seed: int,
    progress: Progress | None = None,
) -> Inferred:
    """Infer the push of a crowd that was seen from runs of `run_prior` with the same seed.

    Raises ValueError where fewer than 60 runs can be compared."""
    good = [
        (uniform(seed, number), [one.statistics[name] for name in seen], one[1:])
        for number, one in enumerate(ran)
        if one is not None and all(np.isfinite(one.statistics[name]) for name in seen)
    ]
    if len(good) < FEWEST_RUNS:
        raise ValueError(f"runs: {len(good)} can be compared. At least {FEWEST_RUNS} are needed")
    drawn, statistics, forces = (np.array(part, dtype=float) for part in zip(*good, strict=True))
    if progress:
        progress("each run inferred from the others", 0.0)
    coordinates = _coordinates(drawn, forces)
    every = Reference(coordinates=coordinates, statistics=_comparable(list(seen), statistics))
    left_out = every.left_out()
    if progress:
        progress("each run inferred from the others", 1.0)
    return Inferred(
        site=site, seen=dict(seen), drawn=drawn, statistics=statistics, forces=forces,
        unsolved=len(ran) - len(good), left_out=left_out,
    )  # fmt: skip


def infer(
    site: Site,
    seen: Mapping[str, float],
    *,
    runs: int = 200,
    seed: int = 1,
    progress: Progress | None = None,
    processes: int | None = None,
) -> Inferred:
    """Infer the push of a crowd from its statistics, and the contact forces and wall loads that follow.

    site, seen: see `analysis.infer.seen.see`
    runs: simulations of the same place, drawn from PRIOR by the seed

    Raises ValueError where too few runs can be compared."""
    ran = run_prior(site, runs, seed, progress, processes)
    return infer_from(site, seen, ran, seed, progress)


def expected_seconds(site: Site, runs: int) -> float:
    """CPU seconds that so many runs take."""
    return COST_S * runs * site.people * site.duration_s
