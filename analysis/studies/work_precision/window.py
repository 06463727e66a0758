"""A window of a scene, its rigid reference, and the points that runs and solves make of it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from analysis.percussions.setting import Setting, law_of
from analysis.scene.scene import Scene
from analysis.studies.work_precision.point import Method, Point, PointStatus
from analysis.support.machine import machine
from nscd import ContactLaw, Contacts, Snapshot
from nscd.arrays import Floats

# The window of a driven crowd, in relaxation times: so short that the rigid disks keep their
# neighbours.
DRIVEN_SHARE = 0.04
# An ill-conditioned C would make contact values of rounding errors.
LARGEST_CONDITION = 1e6


class SpringMotion(NamedTuple):
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
        softer = self.scene.contact.stiffness_N_per_m / stiffness
        return self.scene.run.duration_s * float(np.sqrt(softer))

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
        return np.asarray(matrix @ self.left_velocity.ravel())

    def check(self) -> None:
        """Raise ValueError where nobody touches anybody at the start, or all move apart."""
        missing = "touches" if not len(self.contacts) else "presses"
        if not (self.closing > 0).any():
            raise ValueError(
                f"scene {self.scene.name}: nobody {missing} anybody at the start: "
                "nothing to compare"
            )

    def rigid_motion(self, right_velocity: Floats) -> SpringMotion:
        """Give the motion of rigid disks from u⁺ (n,2) m/s, the contacts kept as they are at the
        start.

        Driven: m du/dt = m (u_d − u)/τ − Cᵀf from rest gives u = u⁺ (1 − e^(−t/τ)) and constant
        forces p/τ."""
        if self.scene.drive is None:
            # an impact takes no time
            both = np.stack([right_velocity, right_velocity])
            return SpringMotion(np.zeros_like(both), both)
        tau = self.scene.drive.relaxation_time_s
        lasts = self.duration(self.scene.contact.stiffness_N_per_m)
        time = lasts * np.array([0.5, 1.0])[:, None, None]
        velocity = -right_velocity * np.expm1(-time / tau)
        return SpringMotion(right_velocity * time - tau * velocity, velocity)

    def rigid_values(self, right_velocity: Floats) -> Values:
        """Give the quantities of rigid disks with u⁺ (n,2) m/s."""
        motion = self.rigid_motion(right_velocity)
        return self.quantities(motion, self.scene.contact.stiffness_N_per_m)

    def quantities(self, motion: SpringMotion, stiffness: float) -> Values:
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
            driven = (0.5 * wish - moved / half) / drive.relaxation_time_s
            received = mass * (gained / half - driven)
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
        return np.asarray(np.linalg.pinv(matrix))


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
    radius, mass = people.radius[inside], people.mass[inside]
    start = Snapshot(position=position[inside], radius=radius, mass=mass)
    changes = {"snapshot": start, "name": f"{scene.name}_window"}
    return Window(scene=scene.model_copy(update=changes))


# Rounding, as a share of the kinetic norm.
ROUNDING = 1e-15
# Singular values below this share of the largest are none.
RANK = 1e-10
# Normals this near to one line count as aligned.
ALIGNED = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigidReference:
    """The rigid model, solved."""

    right_velocity: Floats  # (n,2) m/s, u⁺
    origin: str  # how it was found
    bound: float  # kg^½ m/s, of its error |u⁺ − exact|_M


def rigid_reference(
    snapshot: Snapshot, contacts: Contacts, left_velocity: Floats, law: ContactLaw | None = None
) -> RigidReference:
    """Solve M(u⁺ − u⁻) + Cᵀ(κ + λ) = 0, 0 ≤ λ ⟂ −C u⁺ ≥ 0, κ = k max(C(u⁺ + u⁻), 0) (see
    `ContactLaw`).

    Without dissipation (k = 0) in closed form for a line of touching disks that is pressed together
    everywhere (paper eqs. (5), (6)). Else by Lawson and Hanson's active set on dense matrices
    (scipy): with s = κ/k − C u⁻ the pair (u⁺, s) is the nearest to (u⁻, −C u⁻), in the norm of N =
    diag(M, K), of all with C u ≤ 0 and C u ≤ s; λ and κ minimise the distance of N^(−½)Eᵀ(λ, κ) to
    it, E the rows of these constraints. The bound: what was found is the exact answer for E y ≤ c,
    with c = E y where a percussion is > 0 and max(E y, 0) elsewhere, tiny. A shift by w with E w =
    c turns one problem into the other, so |u⁺ − exact|_M ≤ 2 |w|_N ≤ 2 |c| / σ_min(E N^(−½)). Where
    E lacks full row rank: |u⁺ − exact|²_M ≤ |p·v| + Σp* max(v, 0), from monotonicity, where Σp
    stands for Σp*."""
    n, mass = len(snapshot), np.repeat(snapshot.mass, 2)
    root, left = np.sqrt(mass), left_velocity.ravel()
    norm = float(np.linalg.norm(root * left))
    inverse = contacts.inverse_mass(snapshot.mass)
    weight = (law or ContactLaw()).active_dissipation(contacts, inverse, left_velocity)[0]
    if not weight.any():
        closed = _pressed_line(snapshot, contacts, left_velocity)
        if closed is not None:
            return RigidReference(
                right_velocity=closed, origin="closed form of a pressed line", bound=ROUNDING * norm
            )
    matrix = contacts.normal_matrix(n).toarray()
    soft = np.flatnonzero(weight)
    stiff = np.sqrt(weight[soft])
    below = np.zeros((len(soft), len(contacts)))
    columns = np.block(
        [[matrix.T / root[:, None], matrix[soft].T / root[:, None]], [below, -np.diag(1 / stiff)]]
    )
    wanted = np.concatenate([root * left, -stiff * (matrix[soft] @ left)])
    from scipy.optimize import nnls

    percussion, _ = nnls(columns, wanted, maxiter=30 * (columns.shape[1] + 1))
    found = wanted - columns @ percussion
    right, closing = found[: 2 * n] / root, columns.T @ found
    size = np.linalg.svd(columns, compute_uv=False)
    if columns.shape[1] <= columns.shape[0] and size[-1] > RANK * size[0]:
        offset = np.where(percussion > 0, closing, np.maximum(closing, 0.0))
        bound = 2.0 * float(np.linalg.norm(offset)) / float(size[-1])
    else:
        maximum = max(float(closing.max(initial=0.0)), 0.0)
        bound = float(np.sqrt(abs(float(percussion @ closing)) + float(percussion.sum()) * maximum))
    return RigidReference(
        right_velocity=right.reshape(n, 2),
        origin="dense non-negative least squares (Lawson–Hanson)",
        bound=bound + ROUNDING * norm,
    )


def _pressed_line(snapshot: Snapshot, contacts: Contacts, left_velocity: Floats) -> Floats | None:
    """The common velocity (n,2) m/s where all disks are one straight line, free or with one end at
    a wall, that moves along itself and in which every contact presses; else None."""
    n, k, walls = len(snapshot), len(contacts), int(contacts.is_wall.sum())
    if walls > 1 or k != n - 1 + walls or n < 2:
        return None
    axis = contacts.normal[0]
    across = np.array([-axis[1], axis[0]])
    if np.abs(contacts.normal @ across).max() > ALIGNED or np.abs(left_velocity @ across).max() > 0:
        return None
    mass = snapshot.mass[:, None]
    common = (1 - walls) * (mass * left_velocity).sum(0) / mass.sum()
    momentum = (mass * (left_velocity - common)).ravel()
    from scipy.sparse.linalg import spsolve  # a run needs none

    matrix = contacts.normal_matrix(n)
    # what each contact passes on, as many unknowns as the contacts are
    passed = spsolve((matrix @ matrix.T).tocsc(), matrix @ momentum)
    size = 1e-12 * np.abs(momentum).sum()
    if (passed < -size).any() or np.abs(matrix.T @ passed - momentum).max() > 1e3 * size:
        return None
    return np.tile(common, (n, 1))


# A sum over the walls below this share of what the disks carry is rounding.
NOTHING = 1e-9
# An answer that is wrong by more than all of it is none.
WRONG = 1.0


def today() -> str:
    """Give the date, as ISO has it."""
    return datetime.now(UTC).date().isoformat()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Converged:
    """A method's own model, solved to convergence.

    own, looser: its values, and those of a coarser solution, whose difference is the error bar;
    None where there are none."""

    own: Values | None = None
    looser: Values | None = None
    why: str = ""  # why there are none
    wrong: str  # said of an answer that misses the model by more than all of it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MethodResult(Method):
    """What a method gave on a window, and at what cost.

    cpu_seconds, status, reason, machine, date: as in `Point`"""

    cpu_seconds: float | None
    values: Values | None = None  # what it says of each quantity; None without an answer
    lacks: tuple[Quantity, ...] = ()  # quantities that the method does not have
    model: Converged | None = None  # the method's own, where it is not the rigid model or a rival
    status: PointStatus = PointStatus.OK
    reason: str = ""
    machine: str = field(default_factory=machine)
    date: str = field(default_factory=today)


# What a point has of its answer.
SHARED_FIELDS = set(MethodResult.__dataclass_fields__) & set(Point.__dataclass_fields__) - {"status", "reason"}
ERRORS = ("numerical_error", "numerical_bar", "model_error", "model_bar")
Errors = tuple[float | None, float | None, float | None, float | None]


class Judge:
    """Measures answers against the rigid reference of a window in all quantities.

    exact: the reference's values.
    bar: how far each may be off, relative to its rms."""

    def __init__(self, *, window: Window, name: str, rigid: RigidReference) -> None:
        self.window, self.name = window, name
        exact = window.rigid_values(rigid.right_velocity)
        largest = max(float(np.abs(v).max(initial=0.0)) for q, v in exact.items() if q.unit != "m")
        self.exact = {
            q: v
            for q, v in exact.items()
            if q.unit == "m" or np.abs(v).max(initial=0.0) > NOTHING * largest
        }
        bounds = window.bounds(rigid.bound)
        self.bar = {q: bounds[q] / float(np.sqrt((v**2).mean())) for q, v in self.exact.items()}

    def points(self, solution: MethodResult) -> Iterator[Point]:
        """Yield a point per quantity. Without a converged model of its own, the error of an answer
        is numerical where the method is the rigid model, and the model's where it is another."""
        for quantity, exact in self.exact.items():
            values = None if solution.values is None else solution.values.get(quantity)
            if quantity in solution.lacks or (solution.values is not None and values is None):
                continue
            total = None if values is None else relative_error(values, exact, exact)
            errors = self._errors(quantity, solution, total)
            status, reason = _judged(solution, errors[0])
            shared: dict[str, Any] = {name: getattr(solution, name) for name in SHARED_FIELDS}
            yield Point(
                **shared | dict(zip(ERRORS, errors, strict=True)),
                scene=self.name,
                disks=len(self.window.scene.snapshot),
                quantity=quantity.name,
                unit=quantity.unit,
                total_error=total,
                status=status,
                reason=reason,
            )

    def _errors(self, quantity: Quantity, solution: MethodResult, total: float | None) -> Errors:
        exact, bar_of_reference, model = self.exact[quantity], self.bar[quantity], solution.model
        if model is None:
            return (
                (total, bar_of_reference, 0.0, 0.0) if solution.method == "rigid" else (None, None, total, bar_of_reference)
            )
        if model.own is None or model.looser is None:
            return None, None, None, None
        own, values = model.own[quantity], (solution.values or {}).get(quantity)
        bar = relative_error(model.looser[quantity], own, exact)
        numerical = None if values is None else relative_error(values, own, exact)
        return numerical, bar, relative_error(own, exact, exact), bar + bar_of_reference


def _judged(solution: MethodResult, numerical: float | None) -> tuple[PointStatus, str]:
    """Status and reason of a point: those of an answer that the method itself calls well depend on
    its model."""
    model = solution.model
    if solution.status != PointStatus.OK or model is None:
        return solution.status, solution.reason
    if numerical is not None and not numerical <= WRONG:
        return PointStatus.INACCURATE, f"{model.wrong} by {numerical:.2g} times the whole"
    return PointStatus.OK, solution.reason if model.own else f"no numerical error: {model.why}"
