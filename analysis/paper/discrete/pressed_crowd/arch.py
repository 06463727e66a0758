"""A pressed crowd at an exit and its percussions: what each person carries, and where."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from analysis.percussions.snapshot import percussions_of
from analysis.scene.scene import Drive, Scene
from nscd import ContactLaw, Contacts, Percussions, Snapshot, solve
from nscd.arrays import Flags, Floats, Indices
from nscd.indeterminacy.admissible import ProgramError
from nscd.indeterminacy.intervals import IntervalStatus, interval, weights_of_disk

log = logging.getLogger(__name__)
RING_M = 1.0
# Half the exit (0.5 m) and a metre beyond: what is called the neighbourhood of the exit here.
NEIGHBOURHOOD_M = 1.5
# Contacts that part faster open.
OPENS_M_PER_S = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arch:
    """A snapshot of a driven crowd and its percussions for the desired velocity as u⁻ (paper (1),
    (7) corrected): n people, k contacts.

    left_velocity: (n,2) m/s
    window: s, the relaxation time τ that turns percussions p into forces p/τ
    """

    drive: Drive
    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats
    window: float
    answer: Percussions

    @classmethod
    def of(cls, scene: Scene, snapshot: Snapshot) -> Arch:
        """Solve the percussions (k = 0) of a snapshot in the room of a scene. Raises ValueError for
        a scene without drive."""
        if scene.drive is None:
            raise ValueError(f"drive: scene {scene.name} has none, so nobody presses")
        found = percussions_of(scene, snapshot, tolerance=1e-10)
        return cls(
            drive=scene.drive,
            snapshot=snapshot,
            contacts=found.contacts,
            left_velocity=found.left_velocity,
            window=scene.drive.relaxation_time_s,
            answer=found.answer,
        )

    def under(self, law: ContactLaw) -> Percussions:
        """Solve the percussions of the same snapshot and left velocity under another contact
        law."""
        return solve(
            self.snapshot, self.contacts, left_velocity=self.left_velocity, law=law, tolerance=1e-8
        )

    def normal_forces(self) -> Floats:
        """Give n·p/τ at each contact, (k,) N."""
        forces: Floats = (self.answer.impulse * self.contacts.normal).sum(1) / self.window
        return forces

    def carried(self) -> Floats:
        """Sum |n·p|/τ over the contacts of each person, (n,) N: how hard one is pressed, from
        whatever side."""
        return self.contacts.sum_at_disks(np.abs(self.normal_forces()), len(self.snapshot))

    def resultants(self) -> Floats:
        """Give |Σ p|/τ of each person, (n,) N: forces from opposite sides cancel; m |u⁺ − u⁻|/τ,
        whatever the pressing."""
        change = self.contacts.momentum_change(self.answer.impulse, len(self.snapshot))
        return np.asarray(np.hypot(*change.T) / self.window, dtype=np.float64)

    def inside(self) -> Flags:
        """Tell who has not passed the line of the exit, (n,)."""
        beyond = (self.snapshot.position - np.array(self.drive.door_start_m)) @ np.array(
            self.drive.outward
        )
        return np.asarray(beyond < 0)

    def distance(self) -> Floats:
        """Measure from the middle of the exit to each person's centre, (n,) m."""
        return np.asarray(np.hypot(*self._from_exit().T), dtype=np.float64)

    def angle_degrees(self) -> Floats:
        """Give the direction of each person seen from the middle of the exit, (n,): 0 straight into
        the room, ±90 along the wall."""
        x, y = self._from_exit().T
        out_x, out_y = self.drive.outward
        return np.asarray(np.degrees(np.arctan2(y * out_x - x * out_y, -(x * out_x + y * out_y))))

    def approach(self, velocity: Floats) -> float:
        """Give the speed (m/s) at which velocities (n,2) m/s bring two in contact together, at
        most."""
        return float(self.contacts.approach_velocity(velocity).max())

    def opening(self) -> int:
        """Count the contacts that open."""
        approach = self.contacts.approach_velocity(self.answer.right_velocity)
        return int((approach < -OPENS_M_PER_S).sum())

    def largest(self, values: Floats) -> int:
        """Find the person inside who has the largest value (n,)."""
        return int(np.argmax(np.where(self.inside(), values, -np.inf)))

    def overlap_share(self) -> float:
        """Give the largest overlap over the mean diameter."""
        return float(
            max(-self.contacts.gap.min(initial=0.0), 0.0) / (2 * self.snapshot.radius.mean())
        )

    def rings(self) -> Indices:
        """Give the ring of each person, (n,): 0 within a metre of the middle of the exit, then 1,
        …; −1 for those outside."""
        return np.where(self.inside(), (self.distance() / RING_M).astype(np.int64), -1)

    def _from_exit(self) -> Floats:
        middle = 0.5 * (np.array(self.drive.door_start_m) + np.array(self.drive.door_end_m))
        return np.asarray(self.snapshot.position - middle)


def carried_interval(arch: Arch, person: int) -> tuple[float, float]:
    """Prove the interval (N) of the sum of normal magnitudes of a person, (nan, nan) where none
    could be proven."""
    try:
        found = interval(arch.contacts, arch.answer, weights_of_disk(arch.contacts, person))
    except (ProgramError, ValueError) as error:
        log.warning("no interval for person %d: %s", person, error)
        return float("nan"), float("nan")
    if found.status == IntervalStatus.UNPROVEN:
        return float("nan"), float("nan")
    return found.lower / arch.window, found.upper / arch.window
