"""Whether a trajectory can be one of people: their speeds, distances and steps of time, in a line."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from nscd.arrays import Floats

# Why a file that looks wrong is read all the same.
TAKE_AS_IS = "--take-as-is to read it all the same"
STOREYS = "people walk above each other"
COLUMNS, RATE, UNIT = (
    "Are columns swapped?",
    "Is the frame rate right?",
    "Is the unit right (m, cm)?",
)
# No more than this share of people is seen in one frame only.
MOST_ONCE = 0.75
# Few people are faster than the first (m/s) in more than a tenth of their steps, and nobody than the
# second; all are seen more often than every so many s.
FAST_M_PER_S, FASTEST_M_PER_S, LONGEST_STEP_S = 4.0, 8.0, 5.0
# m that a row may be wrong: farther than this and what the fastest run nobody gets from one row to the next.
WRONG_M = 0.2
# Who goes straight on, so far (m) at least, is not slower than this (m/s).
SLOWEST_M_PER_S, WAY_M = 0.02, 0.02
# Speeds are over this time (s) at least, so that noise of single frames is none.
OVER_S = 0.2
# Nearest heads (m), in the median, and people per m² of those who have six others round them.
NEAREST_M, DENSEST, ROUND = (0.05, 20.0), 15.0, 6
# As many frames are looked at.
LOOKED_AT = 50
# Heights of heads (m), and what is no slope on so short a way: two storeys, where a share of rows is
# on either.
HEADS_M, STOREY_M, CELL_M, BOTH = (1.0, 2.2), 1.0, 0.5, 0.01


class Plausibility(NamedTuple):
    """Hold how a trajectory looks: medians, and who moves how."""

    people: int
    frames: int
    once: float  # share of people who are seen in one frame only
    step: float  # s, between frames
    longest: float  # s, the largest of these
    observed_s: float  # s, of a person
    speed: float  # m/s
    speed_95: float
    fast: float  # m/s, of the fastest tenth of steps
    crawls: bool  # whether people go straight on as slowly as nobody does
    nearest: float  # m, NaN where nobody has a neighbour
    density: float  # 1/m², 0 of less than seven people

    def line(self, *more: str) -> str:
        """Say it in a line, with more, and ask why people are so fast."""
        message = f"{self.people} people, {self.frames} frames"
        if self.step == self.step:
            message += f", {1 / self.step:.3g} per s"
            if self.longest > 1.5 * self.step:
                message += f" (up to {self.longest:.3g} s apart)"
            message += f", seen {self.observed_s:.3g} s each"
        if self.speed == self.speed:
            message += f", speeds {self.speed:.2g} m/s (95 %: {self.speed_95:.2g})"
        if self.nearest == self.nearest:
            message += f", nearest {self.nearest:.2g} m"
        message = ", ".join([message, *more])
        if self.fast > FAST_M_PER_S * (1 + 1e-9):
            message += f". A tenth of the steps are faster than {self.fast:.3g} m/s. {UNIT} {RATE}"
        return message

    @property
    def doubt(self) -> tuple[str, str]:
        """Say what people are not like, and ask why; nothing where all is."""
        low, high = NEAREST_M
        if self.once > MOST_ONCE and self.frames > 1 and self.people > 2:
            return f"{self.once:.0%} of the people are in one frame only", COLUMNS
        if self.step > LONGEST_STEP_S:
            return f"times are {self.step:.3g} s apart", RATE
        if self.fast > FASTEST_M_PER_S:
            return f"a tenth of the steps are faster than {self.fast:.3g} m/s", f"{UNIT} {RATE}"
        if self.crawls:
            return f"people walk at {1e3 * self.speed_95:.2g} mm/s", f"{UNIT} {RATE}"
        if not (self.nearest != self.nearest or low < self.nearest < high):
            return f"neighbours are {self.nearest:.3g} m apart in the median", UNIT
        if self.density > DENSEST:
            return f"{self.density:.3g} people stand on a m²", UNIT
        return "", ""


def plausibility_of(data: pd.DataFrame) -> Plausibility:
    """Look at rows of id, frame, time (s), x and y (m)."""
    data = _placed(data).drop_duplicates(["id", "frame"]).sort_values(["id", "time"])
    people = data.groupby("id").time.agg(["min", "max", "count"])
    times = np.unique(data.time)
    intervals = np.diff(times) if len(times) > 1 else np.array([np.nan])
    step = float(np.median(intervals))
    speed, straight = _speeds(data, step)
    nearest, round_ = _distances(data)
    middle, fast, high = np.quantile(speed, (0.5, 0.9, 0.95)) if len(speed) else 3 * (np.nan,)
    return Plausibility(
        people=len(people),
        frames=len(times),
        once=float((people["count"] == 1).mean()) if len(people) else 0.0,
        step=step,
        longest=float(intervals.max()),
        observed_s=float((people["max"] - people["min"]).median()),
        speed=float(middle),
        speed_95=float(high),
        fast=float(fast),
        crawls=bool(0 < high < SLOWEST_M_PER_S and straight > 0.5),
        nearest=nearest,
        density=ROUND / (np.pi * round_**2) if round_ > 0 else 0.0,
    )


def _placed(data: pd.DataFrame) -> pd.DataFrame:
    """Rows that have a place; what is none is refused by its frame."""
    return data[(data[["x", "y"]].abs() < 1e9).all(axis=1)]


def _speeds(data: pd.DataFrame, step: float) -> tuple[Floats, float]:
    """Speeds (m/s) over OVER_S or a step, and the share of people whose way is a straight one."""
    who, time = data.id.to_numpy(), data.time.to_numpy()
    position = data[["x", "y"]].to_numpy()
    for rows in (max(1, round(OVER_S / step)) if step > 0 else 1, 1):
        same = (who[rows:] == who[:-rows]) & (time[rows:] > time[:-rows])
        if same.any():
            break
    else:
        return np.zeros(0), 0.0
    way = np.hypot(*(position[rows:] - position[:-rows])[same].T)
    table = data.groupby("id")[["x", "y"]]
    net = np.hypot(*(table.last() - table.first()).to_numpy().T)
    path = pd.Series(way).groupby(who[rows:][same]).sum().reindex(table.first().index) / rows
    straight = (net > WAY_M) & (net > 0.5 * path.to_numpy())
    return way / (time[rows:] - time[:-rows])[same], float(straight.mean())


def _distances(data: pd.DataFrame) -> tuple[float, float]:
    """The median distance (m) to the nearest neighbour, and that to the sixth which a quarter is
    within, in some frames."""
    counts = data.frame.value_counts().sort_index()
    numbers = counts.index[counts > 1].to_numpy()
    chosen = numbers[:: max(1, len(numbers) // LOOKED_AT)]
    found, near = [], data[data.frame.isin(chosen)]
    for _, one in near.groupby("frame"):
        position = one[["x", "y"]].to_numpy()
        found.append(cKDTree(position).query(position, k=ROUND + 1)[0])
    if not found:
        return np.nan, 0.0
    every = np.concatenate(found)
    finite = every[np.isfinite(every[:, ROUND]), ROUND]
    return float(np.median(every[:, 1])), float(np.quantile(finite, 0.25)) if len(finite) else 0.0


def doubt(data: pd.DataFrame, *, timed: bool) -> str:
    """Say why rows look like no people, what would make them sound, and the way on; nothing where they
    do. timed: whether the file has times of its own"""
    why, requested = plausibility_of(data).doubt
    if not why:
        return _leap(data)
    ways = {
        "times in ms (--time-unit ms)": data.assign(time=1e-3 * data.time),
        "lengths in cm": data.assign(x=0.01 * data.x, y=0.01 * data.y),
    }
    if not timed:
        del ways["times in ms (--time-unit ms)"]
        swapped = data.rename(columns={"id": "frame", "frame": "id"})
        step = data.time.abs().max() / max(data.frame.abs().max(), 1)
        ways["columns id and frame swapped"] = swapped.assign(time=swapped.frame * step)
    valid = [way for way, rows in ways.items() if not plausibility_of(rows).doubt[0]]
    requested = f"It is sound with {' or '.join(valid)}." if valid else requested
    return f"{why}. {requested} Give {TAKE_AS_IS}"


def _leap(data: pd.DataFrame) -> str:
    """Say who is farther from one row to the next than anybody gets, in which frame; nothing for nobody."""
    rows = _placed(data).sort_values(["id", "time"], kind="stable")
    step = rows.groupby("id")[["time", "x", "y"]].diff()
    way = np.hypot(step.x, step.y).to_numpy()
    over = way - FASTEST_M_PER_S * step.time.to_numpy() - WRONG_M
    if not (over > 0).any():
        return ""
    row = rows.iloc[k := int(np.argmax(over > 0))]
    return (
        f"frame {row.frame:.0f}: person {row.id:.0f} is {way[k]:.3g} m from where it was {step.time.iloc[k]:.3g} s before. "
        f"Nobody is so fast. Give {TAKE_AS_IS}"
    )


def heights(data: pd.DataFrame) -> str:
    """Say what z (m) is: storeys where people are above each other, or heights of heads."""
    cell = data.assign(i=np.floor(data.x / CELL_M), j=np.floor(data.y / CELL_M))
    cell = cell[np.isfinite(cell.z)]
    if not len(cell):
        return ""
    cells = cell.groupby(["i", "j"]).z
    above = cell.z > cells.transform("min") + STOREY_M
    both = above.groupby([cell.i, cell.j]).agg(["sum", "count"])
    fraction = np.minimum(both["sum"], both["count"] - both["sum"]).sum() / len(cell)
    low, high = np.quantile(cell.z, (0.05, 0.95))
    span = f"{low:.3g} to {high:.3g} m"
    if fraction >= BOTH:
        return f"{STOREYS}: z from {span} at one place"
    if HEADS_M[0] <= low and high <= HEADS_M[1]:
        return f"heights of heads, {span}"
    return f"it is {span}"
