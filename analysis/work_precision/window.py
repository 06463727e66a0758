"""What is compared: one crowd, one short window of time, and quantities that every method gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.percussions.setting import Setting, law_of
from analysis.scene.scene import Scene
from nscd import ContactLaw, Contacts, Snapshot
from nscd.arrays import Floats

# The window of a driven crowd, in relaxation times: so short that the rigid disks keep their
# neighbours.
DRIVEN_SHARE = 0.04
# An ill-conditioned C would make contact values of rounding errors.
LARGEST_CONDITION = 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """What a method makes of the window: displacement (2,n,2) m and velocity (2,n,2) m/s, halfway
    and at its end."""

    displacement: Floats
    velocity: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """What is compared: name, unit, and in words."""

    name: str
    unit: str
    words: str


CONTACT_IMPULSE = Quantity(
    name="contact_impulse", unit="N·s", words="normal impulse of each contact"
)
DISK_IMPULSE = Quantity(
    name="disk_impulse", unit="N·s", words="impulse that each disk receives from its contacts"
)
WALL_IMPULSE = Quantity(name="wall_impulse", unit="N·s", words="impulse on all walls together")
CONTACT_FORCE = Quantity(name="contact_force", unit="N", words="mean normal force of each contact")
DISK_FORCE = Quantity(name="disk_force", unit="N", words="mean contact force on each disk")
WALL_FORCE = Quantity(name="wall_force", unit="N", words="mean force on all walls together")
DISPLACEMENT = Quantity(name="displacement", unit="m", words="displacement of each disk")


Values = dict[Quantity, Floats]


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """A scene whose snapshot is the start of the window: disks that touch and, where there is a
    drive, stand.

    For an impact the window lasts as many times √(m/k) as the scene's run does (soft contacts need
    that long to let go, however stiff they are); for a driven crowd 0.04 τ, whatever the stiffness.
    """

    scene: Scene

    @property
    def driven(self) -> bool:
        """Whether it is the drive that presses the crowd; else it is an impact."""
        return self.scene.drive is not None

    def duration(self, stiffness: float) -> float:
        """Give its length (s) for soft contacts of that stiffness (N/m)."""
        if self.scene.drive is not None:
            return DRIVEN_SHARE * self.scene.drive.relaxation_time_s
        return self.scene.run.duration_s * float(
            np.sqrt(self.scene.contact.stiffness_N_per_m / stiffness)
        )

    def variant(self, law: str, stiffness: float) -> Scene:
        """Make the scene of the window with that contact law and stiffness (N/m), written halfway
        and at the end."""
        scene = self.scene.with_contact(law=law, stiffness_N_per_m=stiffness)
        return scene.with_run(duration_s=self.duration(stiffness), frames=2, time_step_s=None)

    @cached_property
    def setting(self) -> Setting:
        """Walls, drive and contact tolerance: of a driven crowd the left velocity is the desired
        one (p/τ is then a force), else the velocity at the start (an impact)."""
        scene = self.scene
        return Setting(
            walls=scene.wall_segments(),
            drive=scene.drive,
            contact_tolerance=scene.analysis.contact_tolerance_m,
        )

    @cached_property
    def contacts(self) -> Contacts:
        """Who touches whom at the start."""
        return self.setting.contacts(self.scene.snapshot)

    @cached_property
    def law(self) -> ContactLaw:
        """The contact law of the rigid model, restitution included."""
        return law_of(self.scene)

    @cached_property
    def left_velocity(self) -> Floats:
        """u⁻ (n,2) m/s of the rigid model."""
        return self.setting.left(self.scene.snapshot)[0]

    @cached_property
    def closing(self) -> Floats:
        """C u⁻ (k,) m/s: how fast each contact would close; negative where it opens."""
        matrix = self.contacts.normal_matrix(len(self.scene.snapshot))
        speed: Floats = matrix @ self.left_velocity.ravel()
        return speed

    def check(self) -> None:
        """Raise ValueError where nobody touches anybody at the start, or all move apart."""
        missing = "touches" if not len(self.contacts) else "presses"
        if not (self.closing > 0).any():
            raise ValueError(
                f"scene {self.scene.name}: nobody {missing} anybody at the start: "
                "nothing to compare"
            )

    def rigid_motion(self, right_velocity: Floats) -> Motion:
        """Give the motion of rigid disks from u⁺ (n,2) m/s, the contacts kept as they are at the
        start.

        Driven: m du/dt = m (u_d − u)/τ − Cᵀf from rest gives u = u⁺ (1 − e^(−t/τ)) and constant
        forces p/τ."""
        if self.scene.drive is None:
            # an impact takes no time
            both = np.stack([right_velocity, right_velocity])
            return Motion(displacement=np.zeros_like(both), velocity=both)
        tau = self.scene.drive.relaxation_time_s
        time = (
            self.duration(self.scene.contact.stiffness_N_per_m)
            * np.array([0.5, 1.0])[:, None, None]
        )
        velocity = -right_velocity * np.expm1(-time / tau)
        return Motion(displacement=right_velocity * time - tau * velocity, velocity=velocity)

    def rigid_values(self, right_velocity: Floats) -> Values:
        """Give the quantities of rigid disks with u⁺ (n,2) m/s."""
        motion = self.rigid_motion(right_velocity)
        return self.quantities(motion, self.scene.contact.stiffness_N_per_m)

    def quantities(self, motion: Motion, stiffness: float) -> Values:
        """Give what the motion says of the contacts, as flat arrays in the unit of each quantity.

        The impulse that a disk received is m Δu − ∫F_drive dt, with the drive's own time integral
        m/τ (∫u_d dt − Δq) and u_d linear in time: exact balance, no sampling of forces. An impact
        is taken from beginning to end; for a driven crowd the second half of the window counts (the
        first is for soft contacts to be loaded), and divided by T/2 the impulse is a mean force.
        Walls receive the opposite of all disks together, since pair forces cancel. Contacts: the
        normal impulses that give the disks theirs, where C of the start has full row rank; else
        there is no such quantity."""
        scene, snapshot = self.scene, self.scene.snapshot
        mass = snapshot.mass[:, None]
        drive = scene.drive
        if drive is None:
            received = mass * (motion.velocity[1] - snapshot.velocity)
        else:
            half = 0.5 * self.duration(stiffness)
            wish = sum(
                drive.desired_velocity(snapshot.position + moved, snapshot.ids)
                for moved in motion.displacement
            )
            moved = motion.displacement[1] - motion.displacement[0]
            gained = motion.velocity[1] - motion.velocity[0]
            received = mass * (
                gained / half - (0.5 * wish - moved / half) / drive.relaxation_time_s
            )
        found = {}
        if self._inverse is not None:
            found[CONTACT_FORCE if drive else CONTACT_IMPULSE] = -self._inverse @ received.ravel()
        found[DISK_FORCE if drive else DISK_IMPULSE] = received.ravel()
        if self.contacts.is_wall.any():
            found[WALL_FORCE if drive else WALL_IMPULSE] = -received.sum(0)
        if drive:
            found[DISPLACEMENT] = motion.displacement[1].ravel()
        return found

    def bounds(self, error: float) -> dict[Quantity, float]:
        """Bound how far the rms of each quantity of the rigid model can be off for an error |Δu⁺|_M
        (kg^½ m/s) of u⁺."""
        snapshot, drive = self.scene.snapshot, self.scene.drive
        n = len(snapshot)
        # |M Δu| ≤ √m |Δu|_M; the impulses on n disks have 2n components, those on all walls
        # together 2
        received = float(np.sqrt(snapshot.mass.max())) * error
        found = {}
        if drive is not None:
            received /= drive.relaxation_time_s
            moved = error / float(np.sqrt(snapshot.mass.min())) * self.duration(1.0)
            found[DISPLACEMENT] = moved / float(np.sqrt(2 * n))
        found[DISK_FORCE if drive else DISK_IMPULSE] = received / float(np.sqrt(2 * n))
        found[WALL_FORCE if drive else WALL_IMPULSE] = received * float(np.sqrt(n / 2))
        if self._inverse is not None:
            gain = float(np.linalg.norm(self._inverse, 2))
            found[CONTACT_FORCE if drive else CONTACT_IMPULSE] = (
                gain * received / float(np.sqrt(len(self.contacts)))
            )
        return found

    @cached_property
    def _inverse(self) -> Floats | None:
        """The pseudo-inverse of Cᵀ where it gives contact values, (k, 2n)."""
        if not len(self.contacts):
            return None
        matrix = self.contacts.normal_matrix(len(self.scene.snapshot)).toarray().T
        size = np.linalg.svd(matrix, compute_uv=False)
        if matrix.shape[1] > matrix.shape[0] or size[-1] * LARGEST_CONDITION < size[0]:
            return None
        inverse: Floats = np.linalg.pinv(matrix)
        return inverse


def relative_error(value: Floats, reference: Floats, scale: Floats) -> float:
    """Compute rms(value − reference) / rms(scale); infinite where the scale is nothing."""
    size = float(np.sqrt((scale**2).mean()))
    return float(np.sqrt(((value - reference) ** 2).mean())) / size if size else float("inf")


def impact_window(scene: Scene) -> Window:
    """Make the window of an impact: the scene as it stands."""
    return Window(scene=scene)


def driven_window(scene: Scene, position: Floats) -> Window:
    """Make the window of a driven crowd that stands at position (n,2) m, without overlaps; who has
    passed the door is left out."""
    assert scene.drive is not None
    people = scene.snapshot
    inside = ~scene.drive.gone(position, people.ids)
    start = Snapshot(
        position=position[inside],
        velocity=np.zeros((int(inside.sum()), 2)),
        radius=people.radius[inside],
        mass=people.mass[inside],
    )
    return Window(
        scene=scene.model_copy(update={"snapshot": start, "name": f"{scene.name}_window"})
    )
