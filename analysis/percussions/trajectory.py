"""Percussions of a whole trajectory, in MDAnalysis' idiom."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.analysis.results import ResultsGroup

from analysis.dumps.reader import DumpError, snapshot_of
from analysis.scene.scene import Drive
from nscd import ContactLaw, Contacts, Percussions, Snapshot, Walls, find_contacts, solve
from nscd.arrays import Floats, Indices

LeftVelocity = Literal["desired", "dump", "free"]
# Left velocities that differ by less (relative to the largest) leave the closed contacts nearly as
# they were.
ALIKE = 1e-3


def left_velocity_of(
    snapshot: Snapshot, kind: LeftVelocity, drive: Drive | None = None, window: float | None = None
) -> tuple[Floats, float | None]:
    """The left velocity u⁻ (n,2) m/s, and the time (s) that turns its percussions into forces, None
    for an impact.

    desired: the velocity u_d that people want, forces p/τ; dump: the velocity in the snapshot, an
    impact; free: u + Δt F_drive/m, what the drive makes of it in `window` Δt without contacts,
    forces p/Δt. Raises ValueError where the drive or the window is missing."""
    if kind == "dump":
        return snapshot.velocity, None
    if kind == "desired":
        if drive is None:
            raise ValueError(
                "left velocity `desired` needs a scene with a [drive] (--walls SCENE.toml)"
            )
        return drive.desired_velocity(snapshot.position), drive.relaxation_time_s
    force = snapshot.drive
    if force is None and drive is not None:
        u_d = drive.desired_velocity(snapshot.position)
        force = snapshot.mass[:, None] * (u_d - snapshot.velocity) / drive.relaxation_time_s
    if force is None:
        raise ValueError(
            "left velocity `free` needs drive_x and drive_y in the dump, or a scene with a [drive]"
        )
    if window is None or not window > 0:
        raise ValueError("left velocity `free` needs a window > 0 s (--window)")
    return snapshot.velocity + window * force / snapshot.mass[:, None], window


class PercussionAnalysis(AnalysisBase):  # type: ignore[misc]
    """Percussions at every contact of every frame.

    universe: from `open_bodies`; walls, drive: of the scene; left_velocity, window: see
    `left_velocity_of`; law, tolerance, solver: of `nscd.solve`; contact_tolerance (m): gap up to
    which disks are in contact. After `run()` (any backend of MDAnalysis): `results.contacts`,
    `results.percussions`, `results.times`: lists, one entry a frame; `ids` (n,) the disks' ids.
    `all_solved` says whether each frame reached the tolerance."""

    _analysis_algorithm_is_parallelizable = True

    @classmethod
    def get_supported_backends(cls) -> tuple[str, ...]:
        """MDAnalysis' own backends, in order."""
        return ("serial", "multiprocessing", "dask")

    def __init__(
        self,
        universe: Any,
        *,
        walls: Walls | None = None,
        drive: Drive | None = None,
        left_velocity: LeftVelocity = "dump",
        window: float | None = None,
        law: ContactLaw | None = None,
        tolerance: float = 1e-8,
        contact_tolerance: float = 1e-6,
        solver: str = "auto",
        **kwargs: Any,
    ) -> None:
        super().__init__(universe.trajectory, **kwargs)
        first = snapshot_of(universe.trajectory.ts, universe.trajectory.filename)
        left_velocity_of(first, left_velocity, drive, window)  # fail early
        self.ids: Indices = first.ids
        self._walls, self._drive, self._kind, self._window = walls, drive, left_velocity, window
        self._law, self._tolerance, self._contact_tolerance, self._solver = (
            law,
            tolerance,
            contact_tolerance,
            solver,
        )

    def _prepare(self) -> None:
        self.results.contacts = []
        self.results.percussions = []
        self._before: tuple[Contacts, Floats, Percussions] | None = None

    def _single_frame(self) -> None:
        snapshot = snapshot_of(self._ts, self._trajectory.filename)
        if not np.array_equal(snapshot.ids, self.ids):
            raise DumpError(
                f"{self._trajectory.filename}, step {self._ts.data['step']}: other ids than in the first frame"
            )
        contacts = find_contacts(snapshot, self._walls, tolerance=self._contact_tolerance)
        left, _ = left_velocity_of(snapshot, self._kind, self._drive, self._window)
        answer = solve(
            snapshot,
            contacts,
            left_velocity=left,
            law=self._law,
            tolerance=self._tolerance,
            solver=self._solver,
            guess=self._guess(contacts, left),
        )
        self._before = contacts, left, answer
        self.results.contacts.append(contacts)
        self.results.percussions.append(answer)

    def _guess(self, contacts: Contacts, left: Floats) -> Percussions | None:
        """The answer of the frame before where the same disks touch and are pressed alike; it does
        not change the result."""
        if self._before is None:
            return None
        earlier, pressed, answer = self._before
        alike = np.array_equal(earlier.first, contacts.first) and np.array_equal(
            earlier.second, contacts.second
        )
        return (
            answer if alike and np.abs(left - pressed).max() <= ALIKE * np.abs(left).max() else None
        )

    def _get_aggregator(self) -> ResultsGroup:
        join = ResultsGroup.flatten_sequence
        return ResultsGroup(lookup={"contacts": join, "percussions": join})

    def _conclude(self) -> None:
        pass

    @property
    def all_solved(self) -> bool:
        """Whether every frame reached the tolerance."""
        return all(answer.status == "solved" for answer in self.results.percussions)


def contact_rows(
    time: float, ids: np.ndarray[Any, Any], contacts: Contacts, answer: Percussions
) -> list[str]:
    """Lines of contacts.csv for one frame (columns: CSV_HEADER); walls are numbered from 1 as in
    the scene."""
    second = np.where(
        contacts.is_wall, contacts.second + 1, ids[np.where(contacts.is_wall, 0, contacts.second)]
    )
    columns = zip(
        ids[contacts.first].tolist(),
        second.tolist(),
        contacts.is_wall.astype(int).tolist(),
        contacts.normal.tolist(),
        contacts.gap.tolist(),
        answer.reaction.tolist(),
        answer.impulse.tolist(),
        strict=True,
    )
    return [
        f"{time!r},{i},{j},{w},{nx!r},{ny!r},{gap!r},{reaction!r},{px!r},{py!r}"
        for i, j, w, (nx, ny), gap, reaction, (px, py) in columns
    ]


CSV_HEADER = "time_s,first,second,is_wall,nx,ny,gap_m,reaction_Ns,impulse_x_Ns,impulse_y_Ns"
