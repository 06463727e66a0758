"""The central act: the percussions of one snapshot in one scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.scene.scene import Drive, Scene
from nscd import ContactLaw, Contacts, Percussions, Snapshot, Walls, find_contacts, solve
from nscd.arrays import Floats

LeftVelocity = Literal["desired", "dump", "free"]
FORCE, IMPULSE = "N", "N·s"
# Left velocities that differ by less (relative to the largest) leave the closed contacts nearly as
# they were.
ALIKE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What surrounds a snapshot and presses it: the parts of a scene that its percussions need.

    walls
    drive: who wants to go where
    contact_tolerance: m, gap up to which disks are in contact
    left_velocity: see `left_velocity_of`; None: desired where there is a drive, else dump
    window: s, Δt of the left velocity `free`
    """

    walls: Walls | None = None
    drive: Drive | None = None
    contact_tolerance: float = 1e-6
    left_velocity: LeftVelocity | None = None
    window: float | None = None

    @classmethod
    def of(cls, scene: Scene) -> Setting:
        """Take the setting from a scene: an impact keeps the velocities of the snapshot."""
        return cls(
            walls=scene.wall_segments(),
            drive=scene.drive,
            contact_tolerance=scene.analysis.contact_tolerance_m,
            left_velocity="dump" if scene.analysis.kind == "impact" else "desired",
        )

    def contacts(self, snapshot: Snapshot) -> Contacts:
        """Find who touches whom in a snapshot."""
        return find_contacts(snapshot, self.walls, tolerance=self.contact_tolerance)

    def left(self, snapshot: Snapshot) -> tuple[Floats, float | None]:
        """Give u⁻ (n,2) m/s of a snapshot and the time that turns percussions into forces (s)."""
        kind = self.left_velocity or ("desired" if self.drive else "dump")
        return left_velocity_of(snapshot, kind, self.drive, self.window)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SnapshotPercussions:
    """The rigid answer for one snapshot in its setting.

    snapshot: n disks
    contacts: the k that it has
    left_velocity: (n,2) m/s, u⁻
    window: s, the time that turns percussions into forces; None for an impact
    answer: percussions with their certificate
    """

    snapshot: Snapshot
    contacts: Contacts
    left_velocity: Floats
    window: float | None
    answer: Percussions

    @property
    def force(self) -> Floats:
        """(k,2) N: contact forces p/window that the first body gives to the second.

        Raises ValueError for an impact, which has impulses and no forces."""
        if self.window is None:
            raise ValueError("force: an impact has impulses (N·s), no forces; read answer.impulse")
        return self.pressing

    @property
    def unit(self) -> str:
        """What the contacts carry is measured in: N where a window is known, else N·s."""
        return IMPULSE if self.window is None else FORCE

    @property
    def pressing(self) -> Floats:
        """(k,2) in `unit`: forces p/window where a window is known, else impulses p."""
        pressing: Floats = self.answer.impulse / (self.window or 1.0)
        return pressing


def percussions_of(
    scene: Scene | Setting,
    snapshot: Snapshot,
    law: ContactLaw | None = None,
    *,
    tolerance: float = 1e-8,
    solver: str = "auto",
    canonical: bool = True,
    before: SnapshotPercussions | None = None,
) -> SnapshotPercussions:
    """Compute the percussions of a snapshot in a scene: contacts, left velocity, solution, window.

    law: inelastic and frictionless where left out
    tolerance, solver, canonical: of `nscd.solve`
    before: the answer of the frame before; where the same disks touch and are pressed alike, it
        makes the solution cheaper and does not change it

    Raises ValueError where the left velocity lacks a drive or a window, and what `find_contacts`
    and `solve` raise."""
    setting = Setting.of(scene) if isinstance(scene, Scene) else scene
    contacts = setting.contacts(snapshot)
    left, window = setting.left(snapshot)
    answer = solve(
        snapshot,
        contacts,
        left_velocity=left,
        law=law,
        tolerance=tolerance,
        solver=solver,
        guess=before.answer if before and _alike(before, contacts, left) else None,
        canonical=canonical,
    )
    return SnapshotPercussions(
        snapshot=snapshot, contacts=contacts, left_velocity=left, window=window, answer=answer
    )


def law_of(scene: Scene) -> ContactLaw:
    """Give the rigid law of a scene's own contacts: an impact has the scene's restitution, which is
    part of the model. A crowd that a drive presses rests, and its forces do not depend on it.

    Raises ValueError for an impact of restitution 1, which no finite dissipation gives."""
    restitution = scene.contact.restitution
    if scene.drive is not None or not restitution:
        return ContactLaw()
    if restitution == 1:
        raise ValueError(
            f"scene {scene.name}: contact.restitution: 1; the rigid model needs a restitution below 1"
        )
    return ContactLaw(restitution=restitution)


def left_velocity_of(
    snapshot: Snapshot, kind: LeftVelocity, drive: Drive | None = None, window: float | None = None
) -> tuple[Floats, float | None]:
    """Choose the left velocity u⁻ (n,2) m/s, and the time (s) that turns its percussions into
    forces (None for an impact).

    desired: the velocity u_d that people want, forces p/τ
    dump: the velocity in the snapshot, an impact
    free: u + Δt F_drive/m, what the drive makes of it in `window` Δt without contacts, forces p/Δt

    Raises ValueError where the drive or the window is missing."""
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


def _alike(before: SnapshotPercussions, contacts: Contacts, left: Floats) -> bool:
    """Whether the same disks touch as before, and are pressed alike."""
    earlier, pressed = before.contacts, before.left_velocity
    same = np.array_equal(earlier.first, contacts.first) and np.array_equal(
        earlier.second, contacts.second
    )
    return same and bool(np.abs(left - pressed).max() <= ALIKE * np.abs(left).max())
