"""The rigid answer: percussions of snapshots, trajectories and dumps."""

from analysis.percussions.trajectory import (
    CSV_HEADER,
    LeftVelocity,
    PercussionAnalysis,
    contact_rows,
    left_velocity_of,
)

__all__ = ["CSV_HEADER", "LeftVelocity", "PercussionAnalysis", "contact_rows", "left_velocity_of"]
