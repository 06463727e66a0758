"""The rigid answer: percussions of snapshots, trajectories and dumps."""

from analysis.percussions.snapshot import (
    LeftVelocity,
    Setting,
    SnapshotPercussions,
    left_velocity_of,
    percussions_of,
)
from analysis.percussions.trajectory import CSV_HEADER, PercussionAnalysis, contact_rows

__all__ = [
    "CSV_HEADER",
    "LeftVelocity",
    "PercussionAnalysis",
    "Setting",
    "SnapshotPercussions",
    "contact_rows",
    "left_velocity_of",
    "percussions_of",
]
