"""Speeds of heads, and when a head begins to move."""

from __future__ import annotations

import numpy as np

from nscd.arrays import Floats

# Who moves faster than this along the row has been reached (m/s).
ONSET_M_PER_S = 0.15
# Speeds are over this time (s) at least: over less a head that is measured to a millimetre seems to
# move. Two frames of the trials at hand.
SPEED_OVER_S = 0.08


def speed_of(time: Floats, along: Floats) -> Floats:
    """Compute speeds (f,) or (f, n) m/s at evenly spaced times (f,) by central differences over
    0.08 s or more, and at the ends over the first and the last 0.08 s."""
    last = len(time) - 1
    reach = max(1, round(0.5 * SPEED_OVER_S * last / (time[-1] - time[0])))
    frames = np.arange(last + 1)
    before = np.clip(frames - reach, 0, max(last - 2 * reach, 0))
    after = np.minimum(before + 2 * reach, last)
    span = (time[after] - time[before]).reshape(-1, *[1] * (along.ndim - 1))
    return np.asarray((along[after] - along[before]) / span)


def onset(time: Floats, speed: Floats) -> Floats:
    """Find when speeds (f, …) first exceed 0.15 m/s, between frames by interpolation: s (…),
    infinite for never."""
    above = speed > ONSET_M_PER_S
    frame = above.argmax(0)
    earlier = np.maximum(frame - 1, 0)
    before, after = (np.take_along_axis(speed, one[None], 0)[0] for one in (earlier, frame))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(frame > 0, (ONSET_M_PER_S - before) / (after - before), 0.0)
    found = time[earlier] + share * (time[frame] - time[earlier])
    return np.asarray(np.where(above.any(0), found, np.inf))


def way_of(time: Floats, speed: Floats) -> Floats:
    """The way (f,) m of a speed (f,) m/s."""
    ways = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(ways)])
