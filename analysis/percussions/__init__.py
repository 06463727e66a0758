"""The rigid answer: percussions of snapshots, trajectories and dumps. Each name is imported when first
used: a run of an engine needs none of them."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.percussions.setting import LeftVelocity, Setting, law_of
    from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
    from analysis.percussions.trajectory import PercussionAnalysis

__all__ = [
    "LeftVelocity", "PercussionAnalysis", "Setting", "SnapshotPercussions", "law_of",
    "percussions_of",
]  # fmt: skip
_HOMES = {"PercussionAnalysis": "trajectory"} | dict.fromkeys(
    ("SnapshotPercussions", "percussions_of"), "snapshot"
)


def __getattr__(name: str) -> Any:
    """Import what is asked for."""
    if name not in __all__:
        raise AttributeError(f"{__name__} has no {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES.get(name, 'setting')}"), name)
