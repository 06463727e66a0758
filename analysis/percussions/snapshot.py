"""The central act: the percussions of one snapshot in one scene, and what they leave open."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np

from analysis.dumps import DumpError, snapshot_of
from analysis.percussions.contact_rows import OWN, Column, Indeterminacy, table_columns, with_nulls
from analysis.percussions.setting import FORCE, IMPULSE, Setting
from analysis.scene.scene import Scene
from nscd import ContactLaw, Contacts, Percussions, Snapshot, solve
from nscd.arrays import Floats, Indices, Mask
from nscd.indeterminacy.determinacy import determinacy_of
from nscd.indeterminacy.ensemble import NO_SPREAD, Ensemble, ensemble
from nscd.indeterminacy.equilibrium import Equilibrium
from nscd.indeterminacy.intervals import Intervals, weights_of_contacts
from nscd.indeterminacy.linear import ProgramError
from nscd.indeterminacy.nearest import ForceState, least_energy_within
from nscd.percussions import Status
from nscd.show import arrays, as_frame, as_html, draw
from nscd.solve import SolveOptions

if TYPE_CHECKING:
    import pandas as pd

# Left velocities that differ by less (relative to the largest) leave the closed contacts nearly as
# they were.
ALIKE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SnapshotPercussions:
    """Hold the rigid answer for one snapshot in its setting.

    setting, snapshot: what was solved, n disks
    contacts: the k that it has
    left_velocity: (n,2) m/s, u⁻
    window: s, the time that turns percussions into forces; None for an impact
    solution: percussions with their certificate"""

    setting: Setting
    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats
    window: float | None
    solution: Percussions

    @property
    def unit(self) -> str:
        """What the contacts carry is measured in: N where a window is known, else N·s."""
        return IMPULSE if self.window is None else FORCE

    @property
    def pressing(self) -> Floats:
        """(k,2) in `unit`: forces p/window where a window is known, else impulses p."""
        pressing: Floats = self.solution.impulse / (self.window or 1.0)
        return pressing

    @property
    def force(self) -> Floats:
        """(k,2) N: contact forces p/window that the first body gives to the second.

        Raises ValueError for an impact, which has impulses and no forces."""
        if self.window is None:
            raise ValueError("force: an impact has impulses (N·s), no forces. Read answer.impulse")
        return self.pressing

    @property
    def largest(self) -> float:
        """The largest magnitude that a contact carries, in `unit`; 0 without contacts."""
        return float(np.hypot(*self.pressing.T).max(initial=0.0))

    @property
    def on_standing(self) -> float:
        """The sum of the magnitudes that disks carry which do not move, in `unit`."""
        on = self.contacts.is_wall & (self.contacts.second >= len(self.setting.walls or ()))
        return float(np.hypot(*self.pressing[on].T).sum())

    def columns(
        self, indeterminacy: Indeterminacy = "none", *, time: float | None = None, step: int | None = None,
        own: Floats | None = None,
    ) -> dict[str, Column]:  # fmt: skip
        """Name the columns of k rows, those of contacts.csv that have something to say: arrays, or
        lists of words or of what may be None. own: (k,2) N, forces that came with the dump."""
        contacts, solution = self.contacts, self.solution
        cells: dict[str, Column] = {**arrays(self.snapshot.ids, contacts, solution.reaction, solution.impulse, self.window)}
        if solution.friction is not None:
            cells |= solution.friction.columns()
        if own is not None:
            cells |= {name: with_nulls(force) for name, force in zip(OWN, own.T, strict=True)}
        if indeterminacy != "none":
            found = bounds_of(self, indeterminacy == "ranges")
            cells["determined"] = with_nulls(found.determined, found.determined >= 0)
        if indeterminacy == "ranges":
            names = OPEN_COLUMNS[: 2 if solution.friction is None else 4]
            cells |= {name: with_nulls(ends) for name, ends in zip(names, found[1:], strict=False)}
        if indeterminacy == "ensemble":
            cells |= ensemble_cells(self)
        certificate = str(solution.status), solution.residual, solution.velocity_error
        return table_columns(cells, self.setting, contacts, (time, step), certificate)

    def to_dataframe(self, time: float | None = None, indeterminacy: Indeterminacy = "determined") -> pd.DataFrame:
        """Return one row per contact, with the columns of contacts.csv."""
        frame = as_frame(self.columns(indeterminacy, time=time))
        return frame if indeterminacy == "none" else frame.astype({"determined": "Int64"})

    def plot(self, axes: Any = None) -> Any:
        """Draw disks, walls and what the contacts carry into matplotlib axes; return them."""
        what = "contact force" if self.unit == FORCE else "percussion"
        return draw(
            self.snapshot,
            self.contacts,
            np.hypot(*self.pressing.T),
            label=f"{what} ({self.unit})",
            title=f"{self.solution.status}, residual {self.solution.residual:.0e}",
            walls=self.setting.walls,
            axes=axes,
        )

    def __repr__(self) -> str:
        return (
            f"<SnapshotPercussions: {len(self.snapshot)} disks, {len(self.contacts)} contacts, "
            f"largest {self.largest:.3g} {self.unit}, {self.solution.status}, "
            f"residual {self.solution.residual:.1e}>"
        )

    def _repr_html_(self) -> str:
        return as_html(repr(self)[1:-1], self.to_dataframe(indeterminacy="none"))


def percussions_of(
    scene: Scene | Setting,
    snapshot: Snapshot,
    law: ContactLaw | None = None,
    *,
    tolerance: float = 1e-8,
    solver: str = "auto",
    before: SnapshotPercussions | None = None,
    **search: Unpack[SolveOptions],
) -> SnapshotPercussions:
    """Compute the percussions of a snapshot in a scene: contacts, left velocity, solution, window.

    law: where left out that of the scene or setting
    tolerance, solver, search: of `nscd.solve`
    before: the answer of the frame before; where the same disks touch and are pressed alike, it
        makes the solution cheaper and does not change it

    Raises ValueError where the left velocity lacks a drive or a window, and what
    `Setting.contacts` and `solve` raise."""
    setting = Setting.of(scene) if isinstance(scene, Scene) else scene
    contacts = setting.contacts(snapshot)
    left, window = setting.left(snapshot)
    law = setting.law if law is None else law
    # who wants to go somewhere does not want to turn: a blocked crowd is at rest in its spins too
    still = law.frictional and setting.kind == "desired"
    solution = solve(
        replace(snapshot, spin=np.zeros(len(snapshot))) if still else snapshot,
        contacts,
        left_velocity=left,
        law=law,
        tolerance=tolerance,
        solver=solver,
        guess=before.solution if before and _alike(before, contacts, left) else None,
        **search,
    )
    return SnapshotPercussions(
        setting=setting, snapshot=snapshot, contacts=contacts, left_velocity=left, window=window, solution=solution
    )


def percussions_of_frames(
    trajectory: Any, numbers: Iterable[int], setting: Setting, law: ContactLaw | None = None, **how: Any
) -> Iterator[tuple[int, SnapshotPercussions]]:
    """Yield number and percussions of frames of a dump, as `open_bodies` gives it, one after the other;
    the trajectory is then at this frame. how: as of `percussions_of`.

    Raises DumpError naming file and step."""
    path, found = trajectory.filename, None
    for number in numbers:
        ts = trajectory[number]
        snapshot = snapshot_of(ts, path, needs_velocity=setting.moves)
        try:
            found = percussions_of(setting, snapshot, law, before=found, **how)
        except ValueError as error:
            raise DumpError(f"{path}, step {ts.data['step']}: {error}") from None
        yield number, found


def _alike(before: SnapshotPercussions, contacts: Contacts, left: Floats) -> bool:
    """Whether the same disks touch as before, and are pressed alike."""
    earlier, pressed = before.contacts, before.left_velocity
    if len(left) != len(pressed) or not len(left):
        return False
    ends = ((earlier.first, contacts.first), (earlier.second, contacts.second))
    same = all(np.array_equal(*both) for both in ends)
    return same and bool(np.abs(left - pressed).max() <= ALIKE * np.abs(left).max())


class ReactionBounds(NamedTuple):
    """Say what the mechanics leaves open of k reactions.

    determined: (k,) 1 where every admissible percussion has the same reaction (and friction), 0
        where not, −1 where that is not known
    lower, upper: (k,) N·s, least and largest reaction of all admissible percussions; NaN where
        there is no end, or none was proven
    friction_lower, friction_upper: (k,) N·s, the same of τ; NaN without friction"""

    determined: Indices
    lower: Floats
    upper: Floats
    friction_lower: Floats
    friction_upper: Floats


ENSEMBLE_COLUMNS = ("mean_Ns", "sd_Ns", "q05_Ns", "q95_Ns")
ROUGH_COLUMNS = (
    "friction_mean_Ns", "friction_sd_Ns", "least_energy_Ns", "friction_least_energy_Ns"
)  # fmt: skip
OPEN_COLUMNS = ("lower_Ns", "upper_Ns", "friction_lower_Ns", "friction_upper_Ns")


@lru_cache(maxsize=1)  # a frame of a film is asked for both, and for sums
def intervals_of(found: SnapshotPercussions) -> tuple[Mask, Intervals]:
    """Tell (k,) what is determined, and make the intervals of any sums. Raises as those do."""
    of = Equilibrium.of if found.solution.friction is None else Equilibrium.with_friction
    constrained = of(found.contacts, found.solution)
    return determinacy_of(constrained).determined, Intervals(constrained)


def bounds_of(found: SnapshotPercussions, ranges: bool) -> ReactionBounds:
    """Find what the balance and reactions that only push leave open; `ranges`: and how far.

    Nothing is known where the answer is not solved, or no linear program proves it."""
    k, contacts, solution = len(found.contacts), found.contacts, found.solution
    nothing = ReactionBounds(np.full(k, -1), *np.full((4, k), np.nan))
    if solution.status != Status.SOLVED or not k:
        return nothing
    ends, frictional = np.full((4, k), np.nan), solution.friction is not None
    try:
        determined, intervals = intervals_of(found)
        ends[:2] = solution.reaction
        if ranges and (frictional or not determined.all()):
            for row in range(k) if frictional else np.flatnonzero(~determined).tolist():
                weights = weights_of_contacts(contacts, row)
                ends[:2, row] = intervals.ends(weights)
                if frictional:
                    ends[2:, row] = intervals.ends(weights, tangential=True)
    except (ProgramError, ValueError):
        return nothing
    return ReactionBounds(determined.astype(int), *np.where(np.isfinite(ends), ends, np.nan))


# Flights of a chain: a jam of 594 people with friction needs about 100, each of 0.03 s.
MOST_FLIGHTS = 1600
CONVERGED, NOT_CONVERGED = "converged", "not converged"


def states_of(found: SnapshotPercussions) -> tuple[Ensemble, ForceState] | None:
    """Sample all admissible percussions (N·s), and find those of least energy; None where the answer is
    not solved, or has no contacts.

    The scale of their law is the mean reaction of least energy of contacts that can carry something:
    the loads of a crowd between walls do not give one."""
    k, solution = len(found.contacts), found.solution
    if solution.status != Status.SOLVED or not k:
        return None
    try:
        equilibrium = Equilibrium.of_answer(found.contacts, solution)
        least_energy = least_energy_within(equilibrium)
        carries = np.bincount(equilibrium.contact, minlength=k) > 0
        scale = float(least_energy.normal[carries].mean()) if carries.any() else 1.0
        return ensemble(equilibrium, scale, draws=100, most_sweeps=MOST_FLIGHTS), least_energy
    except (ProgramError, ValueError):
        return None


def ensemble_cells(found: SnapshotPercussions) -> dict[str, Column]:
    """Name the columns of k rows that say the mean and the spread of `states_of`, and with friction
    the ones of least energy; None where there are none."""
    k, frictional = len(found.contacts), found.solution.friction is not None
    names = [*ENSEMBLE_COLUMNS, *(ROUGH_COLUMNS if frictional else ())]
    cells: dict[str, Column] = dict.fromkeys([*names, "r_hat", "sampling"], [None] * k)
    if (both := states_of(found)) is None:
        return cells
    drawn, least_energy = both
    values = [drawn.mean(), drawn.sd(), drawn.quantile(0.05), drawn.quantile(0.95)]
    values += [drawn.mean(tangential=True), drawn.sd(tangential=True)]
    values += [least_energy.normal, least_energy.tangential]
    cells |= dict(zip(names, values, strict=False))
    cells["r_hat"] = drawn.r_hat.reshape(2, k).max(0)
    fixed = drawn.sd() + drawn.sd(tangential=True) <= NO_SPREAD * drawn.scale
    words = np.where(drawn.converged, CONVERGED, NOT_CONVERGED)
    cells["sampling"] = np.where(fixed, "determined", words).tolist()
    return cells
