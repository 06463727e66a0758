"""Percussions of a whole trajectory, in MDAnalysis' idiom."""

from __future__ import annotations

from typing import Any

import numpy as np
from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.analysis.results import ResultsGroup

from analysis.dumps import DumpError, snapshot_of
from analysis.percussions.snapshot import (
    LeftVelocity,
    Setting,
    SnapshotPercussions,
    percussions_of,
)
from analysis.scene.scene import Drive
from nscd import ContactLaw, Contacts, Percussions, Walls
from nscd.arrays import Indices


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
        self._moving = left_velocity != "desired"
        first = snapshot_of(
            universe.trajectory.ts, universe.trajectory.filename, needs_velocity=self._moving
        )
        self._setting = Setting(
            walls=walls,
            drive=drive,
            contact_tolerance=contact_tolerance,
            left_velocity=left_velocity,
            window=window,
        )
        self._setting.left(first)  # fail early
        self.ids: Indices = first.ids
        self._law, self._tolerance, self._solver = law, tolerance, solver

    def _prepare(self) -> None:
        self.results.contacts = []
        self.results.percussions = []
        self._before: SnapshotPercussions | None = None

    def _single_frame(self) -> None:
        snapshot = snapshot_of(self._ts, self._trajectory.filename, needs_velocity=self._moving)
        if not np.array_equal(snapshot.ids, self.ids):
            raise DumpError(
                f"{self._trajectory.filename}, step {self._ts.data['step']}: other ids than in the first frame"
            )
        self._before = percussions_of(
            self._setting,
            snapshot,
            self._law,
            tolerance=self._tolerance,
            solver=self._solver,
            before=self._before,
        )
        self.results.contacts.append(self._before.contacts)
        self.results.percussions.append(self._before.answer)

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
