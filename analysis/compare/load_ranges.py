"""How far the mechanics leaves loads open: intervals of what disks and walls carry, in the unit of
a comparison."""

from collections.abc import Sequence
from typing import NamedTuple

from analysis.compare.comparison import Comparison
from nscd.indeterminacy.admissible import Admissible, ProgramError
from nscd.indeterminacy.intervals import Intervals, IntervalStatus, weights_of_disk, weights_of_wall

# An interval narrower than this share of its upper end is one number.
ONE = 1e-6


class Range(NamedTuple):
    """Smallest and largest load (N, or N·s for an impact) over all admissible percussions, and the
    status in words: determined, proven, unbounded, unproven, or why there is none."""

    lower: float
    upper: float
    status: str


def carried_ranges(comparison: Comparison, disks: Sequence[int]) -> list[Range]:
    """The ranges of the sums of normal magnitudes at some disks (places in the snapshot)."""
    contacts = comparison.percussions.contacts
    return _ranges(comparison, [weights_of_disk(contacts, disk) for disk in disks])


def wall_ranges(comparison: Comparison, walls: Sequence[int]) -> list[Range]:
    """The ranges of the loads of some walls (places in the scene)."""
    contacts = comparison.percussions.contacts
    return _ranges(comparison, [weights_of_wall(contacts, wall) for wall in walls])


def _ranges(comparison: Comparison, quantities: Sequence[object]) -> list[Range]:
    nothing = float("nan")
    try:
        intervals = Intervals(Admissible.of(comparison.percussions.contacts, comparison.answer))
    except (ValueError, ProgramError) as error:
        return [Range(nothing, nothing, str(error))] * len(quantities)
    ranges = []
    for weights in quantities:
        try:
            found = intervals.of(weights)  # type: ignore[arg-type]
        except ProgramError as error:
            ranges.append(Range(nothing, nothing, str(error)))
            continue
        window = comparison.percussions.window or 1.0
        one = found.status == IntervalStatus.PROVEN and found.width <= ONE * abs(found.upper)
        ranges.append(
            Range(
                found.lower / window,
                found.upper / window,
                "determined" if one else str(found.status),
            )
        )
    return ranges
