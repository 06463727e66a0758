"""The rigid answer: percussions of snapshots, trajectories and dumps."""

from analysis.percussions.snapshot import (
    LeftVelocity,
    Setting,
    SnapshotPercussions,
    law_of,
    left_velocity_of,
    percussions_of,
)
from analysis.percussions.trajectory import PercussionAnalysis

__all__ = [
    "LeftVelocity",
    "PercussionAnalysis",
    "Setting",
    "SnapshotPercussions",
    "law_of",
    "left_velocity_of",
    "percussions_of",
]
