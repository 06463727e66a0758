"""Many snapshots of a film in one compiled call."""

from nscd.frames.solving import Asked, Disks, Found, solve_frames

__all__ = ["Asked", "Disks", "Found", "solve_frames"]
