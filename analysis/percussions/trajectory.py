"""Percussions of a whole trajectory, in MDAnalysis' idiom."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from MDAnalysis.analysis.base import AnalysisBase
from MDAnalysis.analysis.results import Results, ResultsGroup

from analysis.dumps import DumpError, snapshot_of
from analysis.percussions.contact_rows import Indeterminacy
from analysis.percussions.setting import Setting, setting_beside
from analysis.percussions.snapshot import SnapshotPercussions, percussions_of
from analysis.scene.scene import Scene
from analysis.support.extras import load
from nscd import ContactLaw
from nscd.show import as_html

if TYPE_CHECKING:
    import pandas as pd

LISTS = ("frames", "contacts", "percussions", "ids", "times", "steps")


class FrameResults(Results):  # type: ignore[misc]
    """Lists with one entry per frame, shown as their names."""

    def __repr__(self) -> str:
        return f"<results of {len(self.frames)} frames: {', '.join(self)}>"


class PercussionAnalysis(AnalysisBase):  # type: ignore[misc]
    """Compute the percussions at every contact of every frame.

    universe: from `open_bodies`, or its trajectory, without transformations
    setting: a scene, or a `Setting`; where left out, scene.toml beside the dump, if there is one.
        Fields of `Setting` (walls, drive, left_velocity, window, contact_tolerance, …) may also be
        given by name instead
    law, tolerance, solver: of `nscd.solve`

    Without a left velocity it is the desired one where there is a drive or a body force (forces), else
    that of the dump (an impact): the rule of `percussions solve`.

    After `run()` (any backend of MDAnalysis) `results` has lists with one entry per frame:

    frames: SnapshotPercussions
    contacts, percussions: theirs
    ids: (n,) of the disks
    times: s, NaN where they are not known
    steps: of the simulation

    Raises DumpError naming file and step for a frame that cannot be solved, and for a universe that
    `open_bodies` did not open; ValueError naming the field.

    >>> from analysis.dumps import open_bodies
    >>> from analysis.scene import read_scene
    >>> universe = open_bodies("out/gate/lammps_hooke_k1e+06/bodies.dump")
    >>> results = PercussionAnalysis(universe, read_scene("gate")).run(start=-1).results
    >>> results.percussions[0].status.value, len(results.contacts[0])
    ('solved', 71)
    """

    _analysis_algorithm_is_parallelizable = True

    @classmethod
    def get_supported_backends(cls) -> tuple[str, ...]:
        """List MDAnalysis' own backends, in order."""
        return ("serial", "multiprocessing", "dask")

    def __init__(
        self,
        universe: Any,
        setting: Scene | Setting | None = None,
        *,
        law: ContactLaw | None = None,
        tolerance: float = 1e-8,
        solver: str = "auto",
        verbose: bool = False,
        **parts: Any,
    ) -> None:
        if setting is not None and parts:
            raise ValueError(f"setting: it is given, so {', '.join(parts)} cannot be")
        trajectory = getattr(universe, "trajectory", universe)
        if not hasattr(trajectory, "n_frames"):
            raise ValueError(
                f"universe: {type(universe).__name__}. A Universe of all disks is needed"
            )
        if getattr(trajectory, "transformations", ()):
            raise ValueError(
                "universe: it has transformations, and disks are read from the columns of the dump. Open "
                "it without"
            )
        super().__init__(trajectory, verbose=verbose)
        self.results: Results
        if isinstance(setting, Scene):
            setting = Setting.of(setting)
        if setting is None:  # a trajectory in memory has nothing beside it
            file = self._filename
            setting = setting_beside(Path(file), **parts) if file else Setting(**parts)
        if hasattr(trajectory, "fixed_disks"):  # opened by `open_bodies`
            setting = setting.of_dump(trajectory)
        self.setting = setting
        self._law, self._tolerance, self._solver = law, tolerance, solver
        first = self._snapshot(trajectory.ts)
        self.setting.left(first)  # fail early
        self.ids = first.ids

    @property
    def _filename(self) -> str:
        return str(getattr(self._trajectory, "filename", None) or "")

    def _snapshot(self, ts: Any) -> Any:
        return snapshot_of(ts, self._filename, needs_velocity=self.setting.moves)

    def _prepare(self) -> None:
        for name in LISTS:
            self.results[name] = []
        self._before: SnapshotPercussions | None = None

    def _single_frame(self) -> None:
        snapshot, step = self._snapshot(self._ts), self._ts.data["step"]
        try:
            found = percussions_of(
                self.setting,
                snapshot,
                self._law,
                tolerance=self._tolerance,
                solver=self._solver,
                before=self._before,
            )
        except ValueError as error:
            raise DumpError(f"{self._filename}, step {step}: {error}") from None
        self._before = found
        entries = (found, found.contacts, found.solution, snapshot.ids, float(self._ts.time), step)
        for name, entry in zip(LISTS, entries, strict=True):
            self.results[name].append(entry)

    def _get_aggregator(self) -> ResultsGroup:
        return ResultsGroup(lookup=dict.fromkeys(LISTS, ResultsGroup.flatten_sequence))

    def _conclude(self) -> None:
        self.results = FrameResults(self.results)

    @property
    def all_solved(self) -> bool:
        """Whether every frame reached the tolerance."""
        return all(solution.status == "solved" for solution in self.results.percussions)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row per frame and contact, with the columns of contacts.csv."""
        return self._table("determined")

    def _table(self, indeterminacy: Indeterminacy) -> pd.DataFrame:
        pandas = load("pandas")
        frames = zip(self.results.frames, self.results.times, self.results.steps, strict=True)
        tables = [one.to_dataframe(time, indeterminacy).assign(step=step) for one, time, step in frames]
        table: pd.DataFrame = pandas.concat(tables, ignore_index=True)
        return table

    def plot(self, frame: int = -1, axes: Any = None) -> Any:
        """Draw one of the frames into matplotlib axes; return them."""
        return self.results.frames[frame].plot(axes)

    def __repr__(self) -> str:
        found = self.results.get("frames", [])
        if not found:
            return f"<PercussionAnalysis of {self._trajectory.n_frames} frames, not run>"
        solved = sum(frame.solution.status == "solved" for frame in found)
        largest = max(frame.largest for frame in found)
        return (
            f"<PercussionAnalysis: {len(found)} frames, {solved} solved, "
            f"{sum(len(frame.contacts) for frame in found)} contacts, "
            f"largest {largest:.3g} {found[0].unit}>"
        )

    def _repr_html_(self) -> str:
        words, found = repr(self)[1:-1], self.results.get("frames", [])
        return as_html(words, self._table("none")) if found else f"<p>{words}</p>"
