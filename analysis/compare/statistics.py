"""Statistics of a comparison: agreement, ranges of loads."""

from typing import NamedTuple

import numpy as np

from analysis.compare.comparison import Comparison
from nscd.arrays import Floats
from nscd.indeterminacy.admissible import Admissible, ProgramError
from nscd.indeterminacy.intervals import Intervals, IntervalStatus, weights_of_wall

# An interval narrower than this share of its upper end is one number.
ONE = 1e-6


class Range(NamedTuple):
    """Smallest and largest load (N, or N·s for an impact) over all admissible percussions, and the
    status in words: determined, proven, unbounded, unproven, or why there is none."""

    lower: float
    upper: float
    status: str


def wall_ranges(comparison: Comparison) -> list[Range]:
    """Find the ranges of the loads of all walls of the scene."""
    contacts, window = comparison.percussions.contacts, comparison.percussions.window or 1.0
    nothing, walls = float("nan"), range(len(comparison.scene.walls))
    try:
        intervals = Intervals(Admissible.of(contacts, comparison.answer))
    except (ValueError, ProgramError) as error:
        return [Range(nothing, nothing, str(error))] * len(walls)
    ranges = []
    for wall in walls:
        try:
            found = intervals.of(weights_of_wall(contacts, wall))
        except ProgramError as error:
            ranges.append(Range(nothing, nothing, str(error)))
            continue
        one = found.status == IntervalStatus.PROVEN and found.width <= ONE * abs(found.upper)
        status = "determined" if one else str(found.status)
        ranges.append(Range(found.lower / window, found.upper / window, status))
    return ranges


def statistics(comparison: Comparison) -> dict[str, float | int]:
    """Summarise a comparison: counts, correlation and relative difference per contact, per
    determined contact and per disk; N or N·s is the comparison's unit.

    Relative difference: rms(rigid − penalty) / rms(penalty), of normal components; correlation:
    Pearson's, NaN where it has no meaning."""
    match, known = comparison.match, comparison.by_balance
    penalty, rigid = match.normal_parts()
    both = match.in_penalty & match.in_rigid
    fixed = both & match.determined
    out: dict[str, float | int] = {
        "contacts_both": int(both.sum()),
        "contacts_only_penalty": int((match.in_penalty & ~match.in_rigid).sum()),
        "contacts_only_rigid": int((~match.in_penalty & match.in_rigid).sum()),
        "rigid_contacts": int(match.in_rigid.sum()),
        "rank": known.rank,
        "redundant": known.redundant,
        "determined_contacts": int(match.determined.sum()),
        "determined_by_balance_alone": int(known.determined.sum()),
        "penalty_mean": _mean(penalty[match.in_penalty]),
        "rigid_mean": _mean(rigid[match.in_rigid]),
        "penalty_max": float(penalty.max()),
        "rigid_max": float(rigid.max()),
    }
    vectors = comparison.disk_vectors()
    parts = {
        "contact": (penalty, rigid),
        "determined": (penalty[fixed], rigid[fixed]),
        "disk_sum": comparison.disk_sums(),
        "disk_vector": (vectors[0].ravel(), vectors[1].ravel()),
    }
    for name, (a, b) in parts.items():
        out[f"{name}_correlation"] = correlation(a, b)
        out[f"{name}_relative_difference"] = relative_difference(a, b)
    out["closure_error"] = comparison.balance.closure_error
    out["unbalanced_share"] = comparison.balance.unbalanced
    out["residual"] = comparison.answer.residual
    return out


def penalty_difference(a: Comparison, b: Comparison) -> float:
    """Compare the penalty forces of two runs over their united contacts: rms of the difference,
    relative to the rms of the first."""
    keys = np.union1d(a.match.keys, b.match.keys)
    forces = np.zeros((2, len(keys), 2))
    for force, one in zip(forces, (a.match, b.match), strict=True):
        force[np.searchsorted(keys, one.keys)] = one.penalty
    return relative_difference(forces[0].ravel(), forces[1].ravel())


def correlation(a: Floats, b: Floats) -> float:
    """Compute Pearson's correlation; NaN for fewer than three pairs or no spread."""
    if len(a) < 3 or any(x.std() < 1e-9 * np.abs(x).max(initial=1e-300) for x in (a, b)):
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def relative_difference(a: Floats, b: Floats) -> float:
    """Compute rms(b − a) / rms(a); NaN where a vanishes."""
    size = float(np.sqrt((a**2).mean())) if len(a) else 0.0
    return float(np.sqrt(((b - a) ** 2).mean())) / size if size else float("nan")


def exponent(x: Floats, y: Floats) -> float:
    """Fit a of y ∝ xᵃ by least squares of the logarithms; NaN for fewer than two points."""
    known = np.isfinite(y) & (y > 0)
    if known.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(x[known]), np.log(y[known]), 1)[0])


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else 0.0
