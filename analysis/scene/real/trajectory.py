"""Heads of a real crowd: positions and velocities of one frame of a trajectory file, by PedPy."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pedpy
from scipy.spatial import cKDTree

from analysis.scene.real.loading import TrajectoryError, Unit, first_line, load
from nscd.arrays import Floats, Indices

__all__ = ["Heads", "Recording", "TrajectoryError", "Unit", "read_heads"]
# Coordinates of cities have seven digits.
FARTHEST_M = 1e9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heads:
    """Hold the heads in one frame of a file, ordered by id.

    file, frame: where they come from
    window_s: s, over which velocities were measured
    ids: (n,)
    position: (n,2) m
    velocity: (n,2) m/s, NaN for those who were not seen long enough to have one
    """

    file: Path
    frame: int
    window_s: float
    ids: Indices
    position: Floats
    velocity: Floats

    @property
    def origin(self) -> str:
        """File and frame in words, for messages."""
        return f"{self.file}: frame {self.frame}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Hold the heads of a whole file.

    data: id, frame, x (m), y (m)
    frame_rate: 1/s
    """

    file: Path
    data: pd.DataFrame
    frame_rate: float

    @classmethod
    def read(
        cls, file: Path, *, unit: Unit | None = None, frame_rate: float | None = None
    ) -> "Recording":
        """Read a file.

        unit, frame_rate (1/s): needed only where the file does not state them

        Raises TrajectoryError naming the file, for one that PedPy cannot read or that has nobody
        in it, a missing unit or frame rate."""
        found = load(file, unit, frame_rate)
        if not 0 < found.frame_rate < np.inf:
            raise TrajectoryError(
                f"{file}: {found.frame_rate:g} frames per second; its times must grow with frames"
            )
        if not len(found.data):
            raise TrajectoryError(f"{file}: no frame with anybody in it")
        return cls(file=file, data=found.data, frame_rate=found.frame_rate)

    @property
    def ends(self) -> tuple[int, int]:
        """The first and the last frame."""
        return int(self.data.frame.min()), int(self.data.frame.max())

    def still(self, frame: int) -> Heads:
        """Take the heads of a frame as `heads`, with no velocities but zeros."""
        now = _near(self.file, self.data, frame, 0)
        ids, position = now.id.to_numpy(dtype=np.int64), now[["x", "y"]].to_numpy(dtype=np.float64)
        _check_places(f"{self.file}: frame {frame}", ids, position)
        return Heads(
            file=self.file,
            frame=frame,
            window_s=1.0 / self.frame_rate,
            ids=ids,
            position=position,
            velocity=np.zeros_like(position),
        )

    def heads(self, frame: int, window_s: float = 0.4) -> Heads:
        """Take the heads of frame number `frame`.

        window_s: s; velocities are displacements over it, round the frame (over half of it for
            people who appear or vanish there)

        Raises TrajectoryError naming the file and the frame, for a missing frame, a position that
        is not a number, a person who occurs twice and two people at the same place."""
        file, half = self.file, 0.5 * window_s * self.frame_rate
        if not 0.5 < half < len(self.data):
            raise TrajectoryError(
                f"{file}: a window of {window_s:g} s is {2 * half:.3g} frames at "
                f"{self.frame_rate:g} frames per second; at least 2, and no more than there are, "
                "are needed"
            )
        step = round(half)
        near = _near(file, self.data, frame, step)
        now = near[near.frame == frame]
        ids, position = now.id.to_numpy(dtype=np.int64), now[["x", "y"]].to_numpy(dtype=np.float64)
        _check_places(f"{file}: frame {frame}", ids, position)
        try:
            moving = pedpy.compute_individual_speed(
                traj_data=pedpy.TrajectoryData(
                    data=near[["id", "frame", "x", "y"]], frame_rate=self.frame_rate
                ),
                frame_step=step,
                compute_velocity=True,
                speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED,
            )
        except (pedpy.errors.PedPyError, ValueError, KeyError) as error:
            raise TrajectoryError(
                f"{file}: frame {frame}: no velocities over {window_s:g} s: {first_line(error)}"
            ) from None
        found = moving[moving.frame == frame].set_index("id")[["v_x", "v_y"]]
        return Heads(
            file=file,
            frame=frame,
            window_s=window_s,
            ids=ids,
            position=position,
            velocity=found.reindex(ids).to_numpy(dtype=np.float64),
        )


def read_heads(
    file: Path,
    frame: int,
    *,
    unit: Unit | None = None,
    frame_rate: float | None = None,
    window_s: float = 0.4,
) -> Heads:
    """Read the heads of one frame of a file: see `Recording.read` and `Recording.heads`."""
    return Recording.read(file, unit=unit, frame_rate=frame_rate).heads(frame, window_s)


def _near(file: Path, every: pd.DataFrame, frame: int, step: int) -> pd.DataFrame:
    """The rows up to `step` frames from the frame, by person and frame, each position a number and
    each person once."""
    near = every[(every.frame >= frame - step) & (every.frame <= frame + step)].sort_values(
        ["id", "frame"]
    )
    if not (near.frame == frame).any():
        first, last = every.frame.min(), every.frame.max()
        raise TrajectoryError(
            f"{file}: there is no frame {frame}; the frames go from {first} to {last}"
        )
    bad = near[~(near[["x", "y"]].abs() <= FARTHEST_M).all(axis=1)]
    if len(bad):
        person = bad.id.iloc[0]
        raise TrajectoryError(
            f"{file}: frame {bad.frame.iloc[0]}: the position of person {person} is no "
            f"number of metres up to {FARTHEST_M:g}"
        )
    twice = near[near.duplicated(["id", "frame"])]
    if len(twice):
        raise TrajectoryError(
            f"{file}: frame {twice.frame.iloc[0]}: person {twice.id.iloc[0]} occurs twice"
        )
    return near


def _check_places(origin: str, ids: Indices, position: Floats) -> None:
    if len(ids) < 2:
        return
    distance, other = cKDTree(position).query(position, k=2)
    nearest = distance[:, 1]
    if nearest.min() == 0:
        row = int(np.argmin(nearest))
        twin = next(one for one in other[row] if one != row)
        raise TrajectoryError(f"{origin}: persons {ids[row]} and {ids[twin]} are at the same place")
    # Heads of different people are never so near, and a crowd is never so far apart: it is the
    # unit.
    typical = float(np.median(nearest))
    if not 0.05 < typical < 10:
        raise TrajectoryError(
            f"{origin}: neighbours are {typical:.3g} m apart in the median; is the unit right "
            "(m, cm)?"
        )
