"""Like with like: penalty forces and percussions of the same snapshot."""

from analysis.compare.comparison import Balance, Comparison, Match, compare_run, statistics

__all__ = ["Balance", "Comparison", "Match", "compare_run", "statistics"]
