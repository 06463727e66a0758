"""What the viewer of a film reads: whole numbers, coded as differences, packed into text."""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from analysis.exposure.counts import limits_of_people
from analysis.film.frame import Frame, Reel
from analysis.film.summary import jumping
from analysis.pages.drawing import BLUE, ORANGE, PINK, SHADES, VERMILION
from analysis.percussions.setting import FORCE
from nscd.arrays import Floats

# Places are whole multiples of this (m), and forces of the largest power of ten that leaves their
# largest so many steps: both are finer than a screen.
PLACE_M, STEPS = 1e-3, 1e4
STOPS = 9


def packed(reels: Sequence[Reel]) -> str:
    """Pack a film for the page: JSON of whole numbers, gzip, base64.

    The same film gives the same text. The names of its keys are those that film.js reads."""
    limits = [one for one in limits_of_people() if one.quantity == "contact_largest"]
    shades = matplotlib.colormaps[SHADES](np.linspace(0, 1, STOPS))
    content = {
        "place": PLACE_M,
        "reels": [_reel(reel) for reel in reels],
        "limits": [{"number": one.number, "what": one.what, "source": one.cited} for one in limits],
        "shades": [to_hex(shade) for shade in shades],
        "colours": {"known": BLUE, "open": ORANGE, "more": VERMILION, "less": BLUE, "head": PINK},
    }
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode("ascii")


def _reel(reel: Reel) -> dict[str, Any]:
    """Everybody who is ever there, the walls, and the frames."""
    shown = [frame for frame in reel.frames if frame.found is not None]
    people = {
        int(one): float(r)
        for frame in shown
        if frame.found is not None
        for one, r in zip(frame.found.snapshot.ids, frame.found.snapshot.radius, strict=True)
    }
    ids = sorted(people)
    step = _step(max((_largest(reel, frame) for frame in shown), default=0.0))
    walls, drive = reel.scene.walls, reel.scene.drive
    before: dict[int, tuple[int, int]] = {}
    return {
        "title": reel.title,
        "engine": reel.title if reel.engine else "",
        "walls": [[*wall.start_m, *wall.end_m] for wall in walls],
        "names": [wall.name for wall in walls],
        "doors": [[*p, *q] for p, q in (e.door for e in drive.doors)] if drive else [],
        "ids": ids,
        "radius": [round(people[one] / PLACE_M) for one in ids],
        "step": step,
        # of an impact the two models have no unit in common, and so no difference
        "units": {model: shown[0].unit(model) if shown else FORCE for model in reel.models},
        "jumps": [] if reel.radius is None else jumping(reel),
        "frames": [_frame(reel, frame, ids, step, before) for frame in reel.frames],
    }


def _frame(
    reel: Reel, frame: Frame, ids: Sequence[int], step: float, before: dict[int, tuple[int, int]]
) -> dict[str, Any]:
    """Places as differences from those of the frame before; contacts by their bodies."""
    head: dict[str, Any] = {"n": frame.number, "t": round(frame.time, 6), "s": frame.status}
    if frame.reason:
        head["why"] = frame.reason
    if frame.found is None or frame.match is None:
        return head
    now, match = frame.found.snapshot, frame.match
    places = np.round(now.position / PLACE_M).astype(np.int64).tolist()
    moved = []
    for one, (x, y) in zip(now.ids.tolist(), places, strict=True):
        x0, y0 = before.get(one, (0, 0))
        before[one] = x, y
        moved += [x - x0, y - y0]
    first = np.searchsorted(ids, match.ids[:, 0])
    second = np.where(match.is_wall, -match.ids[:, 1], np.searchsorted(ids, match.ids[:, 1]))
    people = np.searchsorted(ids, now.ids)
    return head | {
        "p": _steps_of(people),
        "x": moved,
        "a": _steps_of(first),
        "b": second.tolist(),
        "f": [np.where(frame.has(model), np.round(frame.size(model) / step), -1)
              .astype(np.int64).tolist() for model in reel.models],
        "d": frame.determined.tolist(),
        "lo": _ends(frame.lower, step),
        "hi": _ends(frame.upper, step),
    } | ({"h": _heads(frame)} if frame.heads is not None else {})  # fmt: skip


def _heads(frame: Frame) -> list[int]:
    """Where the heads were, seen from the disks."""
    assert frame.found is not None
    assert frame.heads is not None
    away = np.round((frame.heads - frame.found.snapshot.position) / PLACE_M)
    return [int(step) for step in away.ravel()]


def _steps_of(rising: Any) -> list[int]:
    return [int(step) for step in np.diff(rising, prepend=0)]


def _ends(ends: Floats, step: float) -> list[int]:
    """Ends in steps; −1 where there is none."""
    return [-1 if np.isnan(end) else round(end / step) for end in ends.tolist()]


def _largest(reel: Reel, frame: Frame) -> float:
    return max(float(frame.size(model).max(initial=0.0)) for model in reel.models)


def _step(largest: float) -> float:
    """The power of ten of which the largest has at most 10 times STEPS."""
    return 10.0 ** math.floor(math.log10(largest / STEPS)) if largest > 0 else 1.0
