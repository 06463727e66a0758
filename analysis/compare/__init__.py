"""Like with like: penalty forces and percussions of the same snapshot."""

from analysis.compare.comparison import Comparison, compare_run, statistics

__all__ = ["Comparison", "compare_run", "statistics"]
