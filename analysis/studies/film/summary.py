"""A film in numbers: its headlines as intervals, and a row per frame and model."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from analysis.pages.numbers import NONE, interval, two
from analysis.percussions.setting import FORCE, IMPULSE
from analysis.studies.film.frame import ENGINE, HEADLINES, MOVED_FAR, RIGID, SHOCK, Animation, Frame
from analysis.studies.motion.inference import LEVEL, correlation_windows
from analysis.support.columns import Columns
from analysis.support.files import whole_file, write_rows
from nscd.arrays import Floats

# Columns before those of the headline numbers.
HEAD = Columns("film")
NUMBERS = Columns("numbers")
# A number jumps that changes by more than this share of its mean from one frame to the next.
JUMP = 0.5
# Bounds nearer than this share of a mean are one number.
NO_WIDTH = 1e-6
# A band: reels that are summed up together, and their model.
Band = tuple[Sequence[Animation], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """Hold a number of a film as an interval.

    low, high: of nine tenths of the frames, over all radii and all that the mechanics allows
    unbounded: frames whose ends were not computed, or have no high end; the answer stands there"""

    median: float  # of the frames, of the middle radius
    low: float
    high: float
    independent: float  # how many of the frames count as independent, by their correlation time
    unbounded: int


def headline(animations: Sequence[Animation], model: str, key: str) -> Headline | None:
    """Sum up a number of reels that make one band; None where no frame of the middle one has it."""
    every = np.stack([animation.track(model, key) for animation in animations])  # (reels, frames, 3)
    finite = ~np.isnan(every[..., 0])
    values = every[len(animations) // 2][finite[len(animations) // 2], 0]
    if not len(values):
        return None
    (low, high), there = band(every), finite.any(0)
    tail = 0.5 - LEVEL / 2
    return Headline(
        median=float(np.median(values)),
        low=float(np.quantile(np.nanmin(low[:, there], axis=0), tail)),
        high=float(np.quantile(np.nanmax(high[:, there], axis=0), 1 - tail)),
        independent=len(values) / correlation_windows([values]),
        unbounded=int((finite & np.isnan(every).any(2)).any(0).sum()),
    )


def band(track: Floats) -> tuple[Floats, Floats]:
    """Give the bounds of numbers (…,3); the number itself where one is not known."""
    value = track[..., :1]
    bounds = np.where(np.isnan(track), value, track)
    return bounds.min(-1), bounds.max(-1)


def bands(animations: Sequence[Animation]) -> dict[str, Band]:
    """Name what has an interval: the radii of a filmed crowd together, and each model of each run."""
    if not animations[0].engine:
        return {RIGID: (animations, RIGID)}
    found: dict[str, Band] = {}
    for animation in animations:
        found[animation.title] = ([animation], ENGINE)
        if RIGID in animation.models:
            found[f"{RIGID}, places of {animation.title}"] = ([animation], RIGID)
    return found


def interval_text(found: Headline | None, written: Callable[[float], str] = two) -> str:
    """Write a headline, with two digits: 350 (110 – 1 400); – where there is none."""
    if found is None:
        return NONE
    return f"{written(found.median)} ({written(found.low)} – {written(found.high)})"


def headline_rows(animations: Sequence[Animation]) -> tuple[list[str], list[list[str]]]:
    """Give the names of the models, and a row per headline number: title with unit, and its
    interval in each model; of an impact the unit stands beside the interval."""
    columns, rows = bands(animations), []
    for key in HEADLINES:
        found = {name: headline(*one, key) for name, one in columns.items()}
        if not any(found.values()):
            continue
        units = {name: unit_of(one[0][0], one[1], key) for name, one in columns.items()}
        same = len(set(units.values())) == 1
        titles = " or ".join(dict.fromkeys(title_of(key, unit) for unit in units.values()))
        cells = [
            interval_text(one) + ("" if same or one is None else f" {units[name]}")
            for name, one in found.items()
        ]
        rows.append([f"{titles} ({next(iter(units.values()))})" if same else titles, *cells])
    far = [headline(*one, MOVED_FAR) for one in columns.values()]
    if any(far):
        rows.append(["people moved by more than half a radius (%)", *map(interval_text, far)])
    return list(columns), rows


def push_of(animation: Animation) -> tuple[float, float]:
    """Give the least and the largest push (N) of those who are filmed; animation: of a driven scene."""
    assert animation.scene.drive is not None
    push = animation.scene.drive.push(np.concatenate([frame.people.mass for frame in animation.shown]))
    return (float(push.min()), float(push.max())) if len(push) else (0.0, 0.0)


def about(animations: Sequence[Animation]) -> list[str]:
    """Say of which frames, radii and push the numbers of a film are, and how many frames are empty."""
    middle, driven = animations[len(animations) // 2], animations[0].scene.drive
    first, last = middle.frames[0], middle.frames[-1]
    span = f"{first.number} to {last.number} ({first.time:.4g} to {last.time:.4g} s)"
    sentences = [f"{len(middle.frames)} frames, {span}"]
    if radii := [animation.radius for animation in animations if animation.radius is not None]:
        sentences.append(f"radius {interval((radii[0], radii[-1]))} m")
    sentences.append(f"push {interval(push_of(middle), 2)} N each (assumed)" if driven else "no push")
    empty = [frame for frame in middle.shown if not len(frame.now)]
    if empty:
        sentences.append(f"nobody in {len(empty)} frames (first: {empty[0].number}), their forces are 0")
    return sentences


def jumps(animation: Animation) -> dict[str, Floats]:
    """Give the change of each headline number of the percussions since the frame of the film
    before, as a share of its mean over the frames, (f,); NaN but of solved frames that follow each
    other."""
    tracks = {key: animation.track(RIGID, key)[:, 0] for key in HEADLINES}
    return {key: np.diff(values, prepend=np.nan) / _mean(values) for key, values in tracks.items()}


def _mean(values: Floats) -> float:
    """The mean of the known ones; 1 where it is zero or none is known."""
    finite = values[~np.isnan(values)]
    return (float(finite.mean()) if len(finite) else 0.0) or 1.0


def jumping(animation: Animation) -> list[int]:
    """List the frames in which one of the headline numbers jumps."""
    large = np.any([np.abs(every) > JUMP for every in jumps(animation).values()], axis=0)
    return sorted(frame.number for frame, one in zip(animation.frames, large, strict=True) if one)


def left_open(animations: Sequence[Animation]) -> tuple[int, float, int]:
    """Tell what equilibrium leaves open in the headline numbers of the percussions: in how many
    frames of all reels, by what largest share of the mean of a number, and in how many frames the
    bounds are not known."""
    opened, unknown, maximum = 0, 0, 0.0
    for animation in (film for film in animations if RIGID in film.models):
        every = np.stack([animation.track(RIGID, key) for key in HEADLINES])  # (numbers, frames, 3)
        finite = ~np.isnan(every[..., 0])
        mean = np.array([[_mean(values)] for values in every[..., 0]])
        width = np.nan_to_num((every[..., 2] - every[..., 1]) / mean)
        width[width <= NO_WIDTH] = 0.0
        opened += int(width.any(0).sum())
        maximum = max(maximum, float(width.max()))
        unknown += int((finite & np.isnan(every).any(2)).any(0).sum())
    return opened, maximum, unknown


def unsolved_kinds(animations: Sequence[Animation]) -> list[tuple[int, str, Frame, str]]:
    """List the kinds of reasons why frames are not solved: how many frames of all reels have one, the
    reel and the frame of the first, and its reason. Reasons are of one kind but for their numbers."""
    kinds: dict[str, list[tuple[str, Frame, str]]] = {}
    for animation in animations:
        for frame in animation.unsolved:
            reason = frame.reason or str(frame.status)
            kinds.setdefault(re.sub(r"[\d.e+-]+", "", reason), []).append(
                (animation.title, frame, reason)
            )
    return [(len(every), *every[0]) for every in kinds.values()]


def title_of(key: str, unit: str) -> str:
    """Name a headline number, which in N·s is one of percussions."""
    return SHOCK[key] if unit == IMPULSE else HEADLINES[key].title


def unit_of(animation: Animation, model: str, key: str) -> str:
    """Name the unit of a headline number, which of an impact is that of the percussions."""
    own = next((one.unit(model) for one in animation.frames if one.found is not None), FORCE)
    return HEADLINES[key].unit if own == FORCE else own


def column(key: str, unit: str, end: str = "") -> str:
    """Name a column of a headline number: walls_N, walls_low_N, pressure_door_N_per_m."""
    own = HEADLINES[key].unit
    of = own.replace("/", "_per_") if unit == FORCE else "Ns"
    return "_".join(part for part in (key, end, of) if part)


def table(animations: Sequence[Animation]) -> tuple[list[str], list[list[object]]]:
    """Give the names of the columns, and a row per reel, frame and model."""
    rows = [row for animation in animations for row in _rows(animation)]
    names = [*HEAD, *dict.fromkeys(name for row in rows for name in row if name not in HEAD)]
    return names, [[row.get(name) for name in names] for row in rows]


def _rows(animation: Animation) -> Iterator[Mapping[str, object]]:
    changes = {} if animation.radius is None else jumps(animation)
    jumped = [] if animation.radius is None else jumping(animation)
    for (index, frame), model in product(enumerate(animation.frames), animation.models):
        done, values = frame.account, frame.values.get(model, {})
        row: dict[str, object] = {
            "reel": animation.title,
            "model": animation.engine if model != RIGID else RIGID,
            "radius_m": animation.radius,
            "frame": frame.number,
            "time_s": frame.time,
            "people": 0 if frame.found is None else len(frame.people),
            "status": frame.status if model == RIGID else None,
            "moved_mean_m": done.moved_mean_m if done else None,
            "moved_largest_m": done.moved_largest_m if done else None,
            MOVED_FAR: float(values[MOVED_FAR][0]) if MOVED_FAR in values else None,
            "jump": None if animation.radius is None else int(frame.number in jumped),
        }
        numbers = {}
        for key in HEADLINES:
            if key in changes:
                numbers[f"{key}_jump"] = changes[key][index]
            for end, value in zip(("", "low", "high"), values.get(key, ()), strict=False):
                if model == RIGID or not end:
                    numbers[column(key, frame.unit(model), end)] = value
        yield row | {name: None if np.isnan(one) else float(one) for name, one in numbers.items()}


def write_table(animations: Sequence[Animation], folder: Path, *, parquet: bool = False) -> list[Path]:
    """Write film.csv and, where asked for, film.parquet; return them.

    Columns: docs/columns.md. Raises ValueError where pyarrow is missing."""
    names, rows = table(animations)
    write_rows(folder / "film.csv", names, rows)
    if not parquet:
        return [folder / "film.csv"]
    import pandas as pd

    with whole_file(folder / "film.parquet", "wb") as file:
        pd.DataFrame(rows, columns=names).to_parquet(file, index=False)
    return [folder / "film.csv", folder / "film.parquet"]
