"""One answer held against one problem: by its equations, and by what they determine."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.studies.exchange.fclib import (
    CrowdProblem,
    Truth,
    read_answer,
    read_problem,
    read_truth,
)
from analysis.studies.exchange.problem import ExchangeError, GlobalProblem, LocalProblem
from nscd.arrays import Floats
from nscd.friction.planar import natural_map

# Up to where an answer is right: residual of the equations; distance of u⁺ from the one that there
# is, over the largest |u⁻|; distance of a determined reaction from the one that there is, and of any
# from its interval, over the largest reaction. Nearly isostatic crowds carry a residual of 10⁻⁸ into
# forces of 10⁻⁵ of the largest.
THRESHOLDS = {"residual": 1e-8, "velocity": 1e-6, "reaction": 1e-4}


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Say how good an answer is. All errors are dimensionless; nan where nothing is judged."""

    residual: float  # natural map over max |q|, from the matrices and r alone
    velocity: float  # largest |v − v*| of a disk over max |u⁻|
    determined: float  # largest |r_n − r_n*| where balance determines it, over max r_n*
    outside: float  # how far the worst other r_n lies outside its interval, over max r_n*
    seconds: float | None  # CPU seconds that the answer says it took; None where it says nothing
    why: str  # what is wrong with it; empty where nothing is

    @property
    def right(self) -> bool:
        """Whether nothing is wrong with it."""
        return not self.why


# the same problem is asked for by every solver in turn
@lru_cache(maxsize=2)
def _read_known(path: Path, unique: bool) -> tuple[CrowdProblem, GlobalProblem, LocalProblem, Any, Any]:
    """A problem as an answer is held against it: with its matrices and, where u⁺ is unique, the
    reactions that are known and the rest of that. Raises ExchangeError for a problem without
    bodies."""
    problem = read_problem(path)
    if not isinstance(problem, CrowdProblem):
        raise ExchangeError(f"{path}: /crowd: missing; the library has it")
    k = len(problem.contacts)
    full = problem.matrices(problem.setting.law.frictions(problem.contacts.is_wall))
    truth = read_truth(path, k) if unique else None
    reaction = None if truth is None else read_answer(path, k)[0]
    return problem, full, full.local(), reaction, truth


def judge(problem: Path, solution: Path, *, unique: bool) -> Verdict:
    """Hold the reactions in a file against the problem in another.

    unique: whether u⁺ is, as without friction; where it is not, the residual alone is judged

    Of reactions that balance leaves open any choice is right, as long as each lies in its interval.
    Raises ExchangeError naming the file for what cannot be read."""
    crowd, full, local, exact, truth = _read_known(problem, unique)
    reaction, seconds = read_answer(solution, len(local.friction))
    residual = natural_map(local.delassus, local.free, local.friction, reaction)
    errors = {"velocity": math.nan, "determined": math.nan, "outside": math.nan}
    if truth is not None and math.isfinite(residual):
        # what reactions that differ by so much change of velocities
        moved = full.transfer @ (reaction - exact) / full.mass.diagonal()
        difference = float(np.abs(moved.reshape(-1, 3)[:, :2]).max())
        fastest = float(np.abs(crowd.left_velocity).max() or 1.0)
        errors = {"velocity": difference / fastest, **_against(truth, exact, reaction)}
    limits = THRESHOLDS | dict.fromkeys(("determined", "outside"), THRESHOLDS["reaction"])
    every = {"residual": residual, **errors}
    wrong = [f"{name} {error:.1e}" for name, error in every.items() if error > limits[name]]
    return Verdict(**every, seconds=seconds, why=", ".join(wrong))


def _against(truth: Truth, exact: Floats, reaction: Floats) -> dict[str, float]:
    """Errors of what is known of reactions."""
    right, found = exact[::2], reaction[::2]
    scale = float(right.max(initial=0.0)) or 1.0
    fixed = truth.determined == 1
    beyond = np.fmax(truth.lower - found, found - truth.upper)[~fixed]
    beyond = beyond[~np.isnan(beyond)]
    return {
        "determined": float(np.abs(found - right)[fixed].max(initial=0.0)) / scale,
        "outside": float(beyond.max(initial=0.0)) / scale if len(beyond) else math.nan,
    }
